#include "protocol/frames_region.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "protocol/model_words.hpp"

namespace fovea {
namespace {

static_assert(kFrameTimingWords <= kFrameSlotWords);

constexpr Duration kOldest = std::chrono::hours(1);
constexpr Duration kLongestLoss = std::chrono::hours(24 * 366);   // a frame may use a sample from before a long loss
constexpr Duration kFarthestAhead = std::chrono::seconds(10);
constexpr std::uint64_t kMostOverdraw = 64;         // a method that shades more than this often each pixel is a bug
constexpr std::uint64_t kMostPixels = 1ull << 40;   // 4 views of 500,000 x 500,000

// Untrusted instants: any int64. True where a <= b and b - a <= most.
bool ordered(Instant a, Instant b, Duration most) noexcept {
    std::int64_t ns = 0;
    return !__builtin_sub_overflow(to_ns(b), to_ns(a), &ns) && ns >= 0 && ns <= most.count();
}
bool near(Instant t, Instant now) noexcept {
    std::int64_t ns = 0;
    return !__builtin_sub_overflow(to_ns(t), to_ns(now), &ns) && ns >= -kOldest.count() && ns <= kFarthestAhead.count();
}

bool sane(const ViewFovea& v) noexcept {
    const auto& q = v.head_from_view;
    const double q2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    // Written so that a NaN fails each of them.
    return static_cast<std::uint8_t>(v.eye) < kEyeCount && v.fov.valid() && std::abs(q2 - 1) <= 2e-3 &&
           std::abs(v.center_ndc.x) <= 4 && std::abs(v.center_ndc.y) <= 4 && v.half_width_ndc > 0 &&
           v.half_width_ndc <= 1e4 && v.half_height_ndc > 0 && v.half_height_ndc <= 1e4;
}

}  // namespace

FrameFault check(const FrameTiming& t, Instant now) noexcept {
    if (t.frame == 0 || t.view_count == 0 || t.view_count > kMaxViews || t.pixels_full == 0 ||
        t.pixels_full > kMostPixels || t.pixels_shaded > t.pixels_full * kMostOverdraw ||
        !std::all_of(t.views.begin(), t.views.begin() + t.view_count, sane))
        return FrameFault::values;
    if (!near(t.latched, now) || !near(t.submitted, now) || !near(t.gpu_done, now) || !near(t.photon, now) ||
        !near(t.predicted_photon, now) || !ordered(t.latched, t.submitted, kOldest) ||
        !ordered(t.submitted, t.gpu_done, kOldest) || !ordered(t.submitted, t.photon, kOldest))
        return FrameFault::instants;
    if (t.model_sequence > 0 &&
        (!ordered(t.exposed, t.received, kOldest) || !ordered(t.received, t.filtered, kOldest) ||
         !ordered(t.filtered, t.published, kOldest) || !ordered(t.published, t.latched, kLongestLoss)))
        return FrameFault::instants;
    return FrameFault::none;
}

Result<FrameCollector> FrameCollector::create() {
    auto memory = SharedMemory::create("fovea-frames", sizeof(FramesRegion), Access::client_writes);
    if (!memory) return std::unexpected(memory.error());
    FrameCollector collector;
    collector.memory_ = std::move(*memory);
    FramesRegion& region = *new (collector.memory_.data()) FramesRegion{};
    // relaxed: the release store of `abi` publishes them
    region.magic.store(kFramesMagic, std::memory_order_relaxed);
    region.total_bytes.store(sizeof(FramesRegion), std::memory_order_relaxed);
    region.capacity.store(kFrameSlots, std::memory_order_relaxed);
    region.abi.store(kAbiVersion, std::memory_order_release);
    return collector;
}

std::optional<FrameTiming> FrameCollector::next(Instant now) noexcept {
    for (std::size_t looked = 0; looked < kFrameSlots; ++looked) {
        const std::uint64_t head = region().head.load(std::memory_order_acquire);   // acquire: the record is whole
        const std::uint64_t waiting = head - tail_;   // modulo 2^64: any value of head gives some count
        if (waiting == 0) return std::nullopt;
        if (waiting > kFrameSlots) {   // no honest client: it never passes the tail that it was told
            ++counters_.bad_index;
            counters_.overrun += kFrameSlots;
            tail_ = head;
            region().tail.store(tail_, std::memory_order_release);
            return std::nullopt;
        }
        // Copied once: what is checked is what is used, whatever the client writes meanwhile.
        FrameWords words;
        const Word* slot = region().slots[tail_ % kFrameSlots];
        for (std::size_t i = 0; i < words.size(); ++i)
            words[i] = slot[i].load(std::memory_order_relaxed);   // relaxed: ordered by `head`
        ++tail_;
        region().tail.store(tail_, std::memory_order_release);    // release: the copy is done before the slot is free

        const FrameTiming timing = frame_from_words(words);
        switch (check(timing, now)) {
            case FrameFault::none: ++counters_.accepted; return timing;
            case FrameFault::values: ++counters_.bad_values; break;
            case FrameFault::instants: ++counters_.bad_instants; break;
        }
    }
    return std::nullopt;
}

Result<FrameReporter> FrameReporter::map(int fd) {
    auto memory = SharedMemory::map(fd, Access::client_writes, sizeof(FramesRegion), sizeof(FramesRegion));
    if (!memory) return std::unexpected(memory.error());
    FrameReporter reporter;
    reporter.memory_ = std::move(*memory);
    const FramesRegion& region = reporter.region();
    const std::uint64_t abi = region.abi.load(std::memory_order_acquire);   // acquire: the header is whole
    if (abi != kAbiVersion)
        return fail("the frames region has ABI version " + std::to_string(abi) + ", this library has " +
                        std::to_string(kAbiVersion),
                    {}, "install fovead and libfovea of the same release");
    if (region.magic.load(std::memory_order_relaxed) != kFramesMagic ||
        region.capacity.load(std::memory_order_relaxed) != kFrameSlots)
        return fail("the memory handed over is no frames region", {}, "the daemon is no fovead of this version");
    reporter.head_ = region.head.load(std::memory_order_relaxed);
    return reporter;
}

bool FrameReporter::submit(const FrameTiming& timing) noexcept {
    const std::uint64_t tail = region().tail.load(std::memory_order_acquire);   // acquire: the daemon has copied the slot
    if (head_ - tail >= kFrameSlots) return false;
    Word* slot = region().slots[head_ % kFrameSlots];
    const FrameWords words = to_words(timing);
    for (std::size_t i = 0; i < words.size(); ++i)
        slot[i].store(words[i], std::memory_order_relaxed);   // relaxed: published by `head`
    ++head_;
    region().head.store(head_, std::memory_order_release);
    return true;
}

}  // namespace fovea
