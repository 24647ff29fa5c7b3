// A few threads that sleep between frames and share the rows of one frame.
//
// Threads: run() from one thread at a time. Work is handed out in chunks by an atomic counter; which thread does a chunk
// must not matter to the result.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace fovea::threads {

class ThreadPool {
public:
    explicit ThreadPool(int threads);  // 1: everything runs in the caller; throws std::system_error as std::thread does
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    // Calls work(begin, end) for chunks that cover [0, count); returns when all are done. No allocation, no lock.
    template <class Work>
    void run(int count, int chunk, const Work& work) noexcept {
        run_raw(count, chunk, [](const void* w, int b, int e) { (*static_cast<const Work*>(w))(b, e); }, &work);
    }

private:
    using Call = void (*)(const void*, int, int);
    void run_raw(int count, int chunk, Call call, const void* work) noexcept;
    void worker() noexcept;
    void share() noexcept;

    std::vector<std::thread> threads_;
    std::atomic<std::uint32_t> generation_{0};  // a new number: there is work, or `stop_`
    std::atomic<int> next_{0}, busy_{0};
    std::atomic<bool> stop_{false};
    Call call_ = nullptr;
    const void* work_ = nullptr;
    int count_ = 0, chunk_ = 1;
};

}  // namespace fovea::threads
