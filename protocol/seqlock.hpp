// A seqlocked array of atomic words: one writer, any number of readers, nobody waits for anybody.
//
//   sequence   2n + 1 while the writer fills in version n, 2n + 2 once it is whole (n counts from 1; 0: never written)
//   words      the content
//
// Who may: the one writer calls begin/store/end in this order; readers only read. Instead of fences each word is stored
// with release and loaded with acquire, which is free on x86, cheap elsewhere, and which ThreadSanitizer understands:
//   - a reader that sees any word of version n+1 has acquired that word's release store, so the odd sequence that was
//     stored before it is visible, and the second look at the sequence differs from the first: a torn copy is refused;
//   - a reader whose first look sees 2n + 2 has acquired the release store of end(), so it sees all words of version n.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace fovea {

using Word = std::atomic<std::uint64_t>;
static_assert(Word::is_always_lock_free && sizeof(Word) == 8, "words are shared between processes");

// Views of words that live elsewhere: `sequence` and the words after it.
class SeqlockWriter {
public:
    SeqlockWriter(Word& sequence, Word* words, std::uint64_t version) noexcept
        : sequence_{sequence}, next_{words}, version_{version} {
        // relaxed: made visible by the release store of every word that follows it
        sequence_.store(2 * version_ + 1, std::memory_order_relaxed);
    }
    SeqlockWriter(const SeqlockWriter&) = delete;
    SeqlockWriter& operator=(const SeqlockWriter&) = delete;
    // release: whoever sees the even sequence sees all words
    ~SeqlockWriter() { sequence_.store(2 * version_ + 2, std::memory_order_release); }

    void put(std::uint64_t v) noexcept {
        next_->store(v, std::memory_order_release);  // release: whoever sees this word sees the odd sequence
        ++next_;
    }
    void skip(std::size_t words) noexcept { next_ += words; }

private:
    Word& sequence_;
    Word* next_;
    std::uint64_t version_;
};

class SeqlockReader {
public:
    SeqlockReader(const Word& sequence, const Word* words, std::uint64_t version) noexcept
        : sequence_{sequence}, next_{words}, expected_{2 * version + 2},
          // acquire: the words are at least as new as this sequence
          whole_{sequence.load(std::memory_order_acquire) == expected_} {}

    // Version `version` stood whole when this reader was made.
    [[nodiscard]] bool whole() const noexcept { return whole_; }
    [[nodiscard]] std::uint64_t get() noexcept {
        const std::uint64_t v = next_->load(std::memory_order_acquire);  // acquire: pairs with the writer's put()
        ++next_;
        return v;
    }
    void skip(std::size_t words) noexcept { next_ += words; }
    // All that was read since construction belongs to one version.
    [[nodiscard]] bool still_whole() const noexcept {
        // relaxed: cannot move before the acquire loads above it
        return whole_ && sequence_.load(std::memory_order_relaxed) == expected_;
    }

private:
    const Word& sequence_;
    const Word* next_;
    std::uint64_t expected_;
    bool whole_;
};

}  // namespace fovea
