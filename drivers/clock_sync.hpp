// Turns a device's clock into ours: an online fit of offset and skew to the lower envelope of the transport delay.
//
// A sample that the device stamps with D arrives at A = D + offset + skew * D + delay, and the delay is never
// negative. So the line that lies below all points (D, A - D), as high as it can, is the map with the least delay; what
// stays unknown is the delay's own minimum, which a driver may pass as `min_delay`.
//
//   A - D |     x          x            points: one per bucket of 0.25 s, the least delay in it
//         |  x      x   x     x  x      line: the lower convex hull's edge under the middle of the window
//         |__x______________x________   buckets: 128, so 32 s are remembered
//         +---------------------------> D
//
// Jitter only ever lifts points; drift (up to 500 ppm) tilts the line; a counter that wraps is unwrapped before; a jump
// of the device's or of our clock by more than kJump starts the fit anew, when a second sample confirms it. The result
// never runs backwards: exposures rise strictly as device times do.
//
// Source: the lower-hull form of the filter by Moon, Skelly, Towsley, "Estimation and removal of clock skew from
// network delay measurements", INFOCOM 1999.
// Input/Output: nanoseconds, int64; differences only, so epochs beyond 2^53 and a year of uptime are exact.
// Cost: about 30 ns per sample, 1 us when a bucket is full. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/clock.hpp"

namespace fovea::drivers {

// Counts on where a device's counter of `bits` bits wraps; ticks of `tick_ns` nanoseconds. Steps back by less than half
// the range are late samples, not wraps.
class CounterUnwrap {
public:
    // bits in [1, 63]; tick_ns > 0.
    CounterUnwrap(int bits, std::int64_t tick_ns) noexcept;
    [[nodiscard]] DeviceTime update(std::uint64_t counter) noexcept;
    void reset() noexcept { any_ = false; }

private:
    std::uint64_t mask_;
    std::int64_t tick_ns_;
    bool any_ = false;
    std::uint64_t last_ = 0;
    std::int64_t ticks_ = 0;
};

class ClockSync {
public:
    static constexpr std::int64_t kJump_ns = 500'000'000;  // above any transport delay worth having
    static constexpr double kMaxSkew = 500e-6;             // crystals are within 200 ppm

    explicit ClockSync(Duration min_delay = {}) noexcept : min_delay_{min_delay} {}

    struct Mapped {
        Instant exposed;        // never later than `received`, never earlier than the one before
        bool settled = false;   // false: too little data yet; the delay is not known, so mark the time as estimated
    };
    // In the order of arrival.
    [[nodiscard]] Mapped update(DeviceTime device, Instant received) noexcept;
    void reset() noexcept { *this = ClockSync{min_delay_}; }

    [[nodiscard]] double skew() const noexcept { return slope_; }  // device runs slow by this: seconds per second
    [[nodiscard]] std::uint64_t jumps() const noexcept { return jumps_; }

private:
    static constexpr std::int64_t kBucket_ns = 250'000'000;
    static constexpr std::size_t kBuckets = 128;
    static constexpr std::int64_t kSettle_ns = 1'000'000'000;

    struct Point {
        std::int64_t device_ns, lag_ns;  // from the origin; lag = arrival - device
    };
    [[gnu::noinline]] void start(std::int64_t device_ns, std::int64_t received_ns) noexcept;
    void add(Point p) noexcept;
    [[gnu::noinline]] void fit() noexcept;
    [[nodiscard]] double line(std::int64_t device_ns) const noexcept;

    Duration min_delay_;
    bool any_ = false;
    std::int64_t origin_device_ = 0, origin_received_ = 0;
    std::array<Point, kBuckets> ring_{};
    std::size_t next_ = 0, count_ = 0;
    Point open_{};                    // the least of the bucket that is filling
    bool open_any_ = false;
    double slope_ = 0;
    std::int64_t anchor_device_ = 0;  // the line goes through (anchor_device, anchor_lag)
    double anchor_lag_ = 0;
    int strangers_ = 0;               // samples in a row that a jump would explain
    std::int64_t last_device_ns_ = 0, last_exposed_ns_ = 0;
    std::uint64_t jumps_ = 0;
};

}  // namespace fovea::drivers
