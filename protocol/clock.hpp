// The one clock of the project: CLOCK_MONOTONIC in int64 nanoseconds, injected wherever time matters.
//
// Threads: everything here may be called from any thread, except ManualTime::set/advance (one writer).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace fovea {

// A std::chrono clock that is CLOCK_MONOTONIC by contract (std::chrono::steady_clock only happens to be).
struct MonotonicClock {
    using rep = std::int64_t;
    using period = std::nano;
    using duration = std::chrono::duration<rep, period>;
    using time_point = std::chrono::time_point<MonotonicClock, duration>;
    static constexpr bool is_steady = true;
    [[nodiscard]] static time_point now() noexcept;
};

using Duration = MonotonicClock::duration;    // int64 nanoseconds
using Instant = MonotonicClock::time_point;   // CLOCK_MONOTONIC; the epoch is the machine's boot

[[nodiscard]] constexpr Instant instant_from_ns(std::int64_t ns) noexcept { return Instant{Duration{ns}}; }
[[nodiscard]] constexpr std::int64_t to_ns(Instant t) noexcept { return t.time_since_epoch().count(); }
[[nodiscard]] constexpr double to_seconds(Duration d) noexcept { return static_cast<double>(d.count()) * 1e-9; }
// Nearest nanosecond; the caller keeps |s| below 9e9 (292 years).
[[nodiscard]] constexpr Duration seconds(double s) noexcept {
    const double ns = s * 1e9;
    return Duration{static_cast<std::int64_t>(ns + (ns < 0 ? -0.5 : 0.5))};
}

// A reading of a device's own clock, in nanoseconds since that device's own epoch (which may be UTC, boot or anything).
// It is never compared with an Instant; only clock synchronisation turns one into the other. Kept as int64: epoch
// nanoseconds exceed 2^53.
struct DeviceTime {
    std::int64_t ns = 0;
    auto operator<=>(const DeviceTime&) const = default;
};

// Where code asks for the time, so that a test can be the clock.
class TimeSource {
public:
    virtual ~TimeSource() = default;
    [[nodiscard]] virtual Instant now() const noexcept = 0;
};

class SystemTime final : public TimeSource {
public:
    [[nodiscard]] Instant now() const noexcept override { return MonotonicClock::now(); }
};

class ManualTime final : public TimeSource {
public:
    explicit ManualTime(Instant start = {}) noexcept : now_ns_{to_ns(start)} {}
    [[nodiscard]] Instant now() const noexcept override {
        return instant_from_ns(now_ns_.load(std::memory_order_relaxed));
    }
    void set(Instant t) noexcept { now_ns_.store(to_ns(t), std::memory_order_relaxed); }
    void advance(Duration d) noexcept { now_ns_.fetch_add(d.count(), std::memory_order_relaxed); }

private:
    std::atomic<std::int64_t> now_ns_;  // relaxed: the value itself is all a reader needs
};

}  // namespace fovea
