// The calls recorded between two submissions, with copies of the data that they point at.
//
// A recorded call is a trivially copyable function object that gets the Replay it runs in. Calls and data lie in chunks
// that never move, so a call may keep a pointer to data copied into the same log. Chunks are kept for the next frame.
// Cost: about 20 ns per call. Threads: one at a time; a log belongs to one context.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace fovea::layer {

class Replay;

class CommandLog {
public:
    template <class Function>
    void add(Function function) {
        static_assert(std::is_trivially_copyable_v<Function> && std::is_trivially_destructible_v<Function>);
        auto* node = static_cast<Node*>(allocate(kHeader + sizeof(Function)));
        node->run = [](const std::byte* at, Replay& replay) {
            (*std::launder(reinterpret_cast<const Function*>(at)))(replay);
        };
        node->next = nullptr;
        ::new (reinterpret_cast<std::byte*>(node) + kHeader) Function(std::move(function));
        (last_ ? last_->next : first_) = node;
        last_ = node;
    }

    // A copy of `count` values that lives until clear(). nullptr stays nullptr.
    template <class T>
    [[nodiscard]] const T* copy(const T* values, std::size_t count) {
        static_assert(std::is_trivially_copyable_v<T>);
        if (!values) return nullptr;
        void* to = allocate(count * sizeof(T));
        std::memcpy(to, values, count * sizeof(T));
        return static_cast<const T*>(to);
    }

    [[nodiscard]] void* allocate(std::size_t bytes);

    void run(Replay& replay) const {
        for (const Node* n = first_; n; n = n->next) n->run(reinterpret_cast<const std::byte*>(n) + kHeader, replay);
    }
    // Chunks beyond the first kKeptBytes are given back.
    void clear() noexcept;
    [[nodiscard]] bool empty() const noexcept { return first_ == nullptr; }
    [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

    static constexpr std::size_t kKeptBytes = std::size_t{4} << 20;

private:
    struct Node {
        void (*run)(const std::byte*, Replay&);
        Node* next;
    };
    static constexpr std::size_t kAlign = alignof(std::max_align_t);
    static constexpr std::size_t kHeader = (sizeof(Node) + kAlign - 1) / kAlign * kAlign;
    struct Chunk {
        std::unique_ptr<std::byte[]> memory;
        std::size_t size = 0;
    };
    std::vector<Chunk> chunks_;
    std::size_t chunk_ = 0, used_ = 0, bytes_ = 0;
    Node* first_ = nullptr;
    Node* last_ = nullptr;
};

}  // namespace fovea::layer
