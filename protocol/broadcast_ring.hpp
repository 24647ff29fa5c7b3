// A broadcast ring in shared memory: one writer that never waits, any number of readers that count what they lost.
//
//   control line   [written]: records ever written; release, after the record is whole
//   record n       [sequence][kWords words], in slot (n - 1) % capacity, under its own seqlock (seqlock.hpp)
//
//        writer                               reader
//        fill record n+1                      next <= written? copy record `next`
//        written = n+1 (release)              overwritten meanwhile? jump to the oldest that is safe, count the loss
//
// Threads: one writer; each reader object belongs to one thread. Nothing here allocates, locks or blocks.
#pragma once

#include <algorithm>

#include "protocol/abi.hpp"
#include "protocol/seqlock.hpp"

namespace fovea {

// Where one ring lies. The capacity is a power of two.
template <std::size_t kWords>
class BroadcastRing {
public:
    static constexpr std::size_t kStride = 1 + kWords;
    [[nodiscard]] static constexpr std::size_t bytes(std::size_t capacity) noexcept {
        return kCacheLine + capacity * kStride * sizeof(Word);
    }

    BroadcastRing() noexcept = default;
    // `base` is cache-line aligned and holds bytes(capacity).
    BroadcastRing(Word* base, std::size_t capacity) noexcept : base_{base}, capacity_{capacity} {}

    [[nodiscard]] Word& written() const noexcept { return *base_; }
    [[nodiscard]] Word* record(std::uint64_t n) const noexcept {
        return base_ + kCacheLine / sizeof(Word) + ((n - 1) & (capacity_ - 1)) * kStride;
    }
    [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

private:
    Word* base_ = nullptr;
    std::size_t capacity_ = 0;
};

template <std::size_t kWords>
class BroadcastWriter {
public:
    BroadcastWriter() noexcept = default;
    explicit BroadcastWriter(BroadcastRing<kWords> ring) noexcept : ring_{ring} {}

    // encode(SeqlockWriter&) puts kWords words.
    template <class Encode>
    void write(Encode&& encode) noexcept {
        ++written_;
        Word* r = ring_.record(written_);
        {
            SeqlockWriter w(*r, r + 1, written_);
            encode(w);
        }
        ring_.written().store(written_, std::memory_order_release);  // release: the record is whole before it counts
    }
    [[nodiscard]] std::uint64_t written() const noexcept { return written_; }

private:
    BroadcastRing<kWords> ring_;
    std::uint64_t written_ = 0;
};

template <std::size_t kWords>
class BroadcastReader {
public:
    BroadcastReader() noexcept = default;
    explicit BroadcastReader(BroadcastRing<kWords> ring) noexcept : ring_{ring} {}

    // Starts with the record after the newest one.
    void skip_to_newest() noexcept { next_ = ring_.written().load(std::memory_order_acquire) + 1; }

    // decode(SeqlockReader&) takes kWords words into the caller's record. False: nothing new.
    template <class Decode>
    [[nodiscard]] bool read(Decode&& decode) noexcept {
        for (;;) {
            const std::uint64_t written = ring_.written().load(std::memory_order_acquire);  // acquire: pairs with write()
            if (next_ > written) return false;
            // A slot that the writer may be filling now is not safe: keep a margin behind it, so that one that lags
            // does not lose the race again at once.
            const std::uint64_t margin = ring_.capacity() / 8 + 1;
            if (written - next_ >= ring_.capacity()) jump(written - ring_.capacity() + 1 + margin);
            const Word* r = ring_.record(next_);
            SeqlockReader reader(*r, r + 1, next_);
            if (reader.whole()) {
                decode(reader);
                if (reader.still_whole()) {
                    ++next_;
                    return true;
                }
            }
            jump(next_ + margin);  // the writer got here first
        }
    }
    // Records that were overwritten before this reader came to them.
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

private:
    void jump(std::uint64_t to) noexcept {
        lost_ += to - next_;
        next_ = to;
    }
    BroadcastRing<kWords> ring_;
    std::uint64_t next_ = 1, lost_ = 0;
};

}  // namespace fovea
