// The frames region: a client's frame reports on their way to the daemon. One region per client, written by the client:
// for the daemon it is untrusted bytes, copied once and then validated.
//
//   word  0  magic kFramesMagic | 1 abi | 2 total size | 3 capacity    written by the daemon, read by an honest client
//         8  head: reports ever written                                client, release, after the record
//        16  tail: reports ever drained                                daemon, release; for the client's "full" check
//        24  record r = n % capacity: 66 words of FrameTiming          client, before head
//
// The daemon trusts none of these words: it keeps its own tail and capacity, and a head that is not within `capacity`
// of its tail is counted and skipped to. Nothing that a client writes can make it loop, wait or read elsewhere.
//
// Threads: FrameReporter: one thread at a time; FrameCollector: one thread. noexcept, no allocation, no lock.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/abi.hpp"
#include "protocol/frame_timing.hpp"
#include "protocol/seqlock.hpp"
#include "protocol/shared_memory.hpp"

namespace fovea {

inline constexpr std::size_t kFrameSlots = 256;   // 2.5 s at 100 frames/s
inline constexpr std::size_t kFrameSlotWords = 72;   // kFrameTimingWords, rounded up to whole cache lines

struct FramesRegion {
    Word magic, abi, total_bytes, capacity;
    alignas(kCacheLine) Word head;
    alignas(kCacheLine) Word tail;
    alignas(kCacheLine) Word slots[kFrameSlots][kFrameSlotWords];
};
static_assert(offsetof(FramesRegion, head) == 8 * 8 && offsetof(FramesRegion, tail) == 16 * 8 &&
              offsetof(FramesRegion, slots) == 24 * 8);

// Why reports were refused.
struct FrameCounters {
    std::uint64_t accepted = 0;
    std::uint64_t bad_values = 0;    // not finite, or out of range
    std::uint64_t bad_instants = 0;  // out of order, or not near the present
    std::uint64_t bad_index = 0;     // head was not within the ring
    std::uint64_t overrun = 0;       // reports skipped because of a bad index, saturated at the ring's capacity each
};

// Everything a frame report must satisfy, for a daemon that drains it at `now`. Pure.
//   frame >= 1; view_count 1 to kMaxViews; pixels_full > 0 and pixels_shaded within 64 times it; fields of view valid;
//   rotations of unit length within 1e-3; |center_ndc| <= 4 (a region may be put beyond the edge); half sizes in (0, 1e4];
//   submitted, gpu_done and photon within an hour before and ten seconds after `now`;
//   latched <= submitted <= gpu_done; submitted <= photon; and where model_sequence > 0
//   exposed <= received <= filtered <= published (an hour each at most) <= latched (a year at most: after a loss).
enum class FrameFault : std::uint8_t { none, values, instants };
[[nodiscard]] FrameFault check(const FrameTiming& timing, Instant now) noexcept;

// The daemon's side of one client's region.
class FrameCollector {
public:
    [[nodiscard]] static Result<FrameCollector> create();
    // The next valid report, skipping (and counting) invalid ones. Looks at no more than kFrameSlots records.
    [[nodiscard]] std::optional<FrameTiming> next(Instant now) noexcept;
    [[nodiscard]] const FrameCounters& counters() const noexcept { return counters_; }
    [[nodiscard]] int fd() const noexcept { return memory_.fd(); }

private:
    [[nodiscard]] FramesRegion& region() const noexcept { return *reinterpret_cast<FramesRegion*>(memory_.data()); }
    SharedMemory memory_;
    std::uint64_t tail_ = 0;
    FrameCounters counters_;
};

// The client's side.
class FrameReporter {
public:
    // Errors: not a frames region, another ABI version, too small, or not sealed.
    [[nodiscard]] static Result<FrameReporter> map(int fd);
    // False: the daemon is behind and the ring is full; the report is dropped.
    [[nodiscard]] bool submit(const FrameTiming& timing) noexcept;

private:
    [[nodiscard]] FramesRegion& region() const noexcept { return *reinterpret_cast<FramesRegion*>(memory_.data()); }
    SharedMemory memory_;
    std::uint64_t head_ = 0;
};

}  // namespace fovea
