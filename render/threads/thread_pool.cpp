#include "render/threads/thread_pool.hpp"

#include <algorithm>

namespace fovea::threads {

ThreadPool::ThreadPool(int threads) {
    threads_.reserve(static_cast<std::size_t>(std::max(threads - 1, 0)));
    for (int i = 1; i < threads; ++i) threads_.emplace_back([this] { worker(); });
}

ThreadPool::~ThreadPool() {
    stop_.store(true, std::memory_order_relaxed);
    generation_.fetch_add(1, std::memory_order_release);
    generation_.notify_all();
    for (auto& t : threads_) t.join();
}

void ThreadPool::share() noexcept {
    for (;;) {
        const int begin = next_.fetch_add(chunk_, std::memory_order_relaxed);
        if (begin >= count_) return;
        call_(work_, begin, std::min(begin + chunk_, count_));
    }
}

void ThreadPool::worker() noexcept {
    std::uint32_t seen = 0;
    for (;;) {
        generation_.wait(seen, std::memory_order_acquire);
        const std::uint32_t now = generation_.load(std::memory_order_acquire);
        if (now == seen) continue;
        seen = now;
        if (stop_.load(std::memory_order_relaxed)) return;
        share();
        // Release: the caller reads what this thread wrote. The last one wakes it.
        if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
    }
}

void ThreadPool::run_raw(int count, int chunk, Call call, const void* work) noexcept {
    if (count <= 0) return;
    call_ = call;
    work_ = work;
    count_ = count;
    chunk_ = std::max(chunk, 1);
    next_.store(0, std::memory_order_relaxed);
    if (threads_.empty() || count <= chunk_) {
        share();
        return;
    }
    busy_.store(static_cast<int>(threads_.size()), std::memory_order_relaxed);
    generation_.fetch_add(1, std::memory_order_release);
    generation_.notify_all();
    share();
    for (int left = busy_.load(std::memory_order_acquire); left != 0; left = busy_.load(std::memory_order_acquire))
        busy_.wait(left, std::memory_order_acquire);
}

}  // namespace fovea::threads
