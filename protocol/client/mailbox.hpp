// How the maintenance thread hands a new object to the latching thread, and gets the old one back, without a lock.
//
//   maintenance thread                          latching thread
//   offer(new): incoming = new, by exchange;    waiting(): one load
//     an offer that was never taken comes back  take(): incoming -> mine, by exchange; the old `mine` onto `retired`
//   collect(): the whole list `retired`
//
// Whoever holds a pointer after an exchange owns the object alone. Objects need a member `T* next_retired`.
// Threads: offer() and collect() from one thread, take() from one thread.
#pragma once

#include <atomic>

namespace fovea::client {

template <class T>
class Mailbox {
public:
    // Returns an earlier offer that nobody took, for the caller to delete.
    [[nodiscard]] T* offer(T* object) noexcept {
        return incoming_.exchange(object, std::memory_order_acq_rel);   // release: the object is whole before it shows
    }
    // Something was offered and not yet taken.
    [[nodiscard]] bool waiting() const noexcept {
        return incoming_.load(std::memory_order_relaxed) != nullptr;   // relaxed: the exchange in take() orders
    }
    // Replaces `mine` by the newest offer, if there is one.
    bool take(T*& mine) noexcept {
        T* const object = incoming_.exchange(nullptr, std::memory_order_acquire);
        if (object == nullptr) return false;
        if (mine != nullptr) {
            mine->next_retired = retired_.load(std::memory_order_relaxed);
            // release: all that was done with `mine` is done before it can be deleted
            while (!retired_.compare_exchange_weak(mine->next_retired, mine, std::memory_order_release,
                                                   std::memory_order_relaxed)) {}
        }
        mine = object;
        return true;
    }
    // The list of objects that are no longer in use, linked by next_retired.
    [[nodiscard]] T* collect() noexcept { return retired_.exchange(nullptr, std::memory_order_acquire); }

private:
    std::atomic<T*> incoming_{nullptr};
    std::atomic<T*> retired_{nullptr};
};

}  // namespace fovea::client
