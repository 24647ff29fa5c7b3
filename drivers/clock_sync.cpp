#include "drivers/clock_sync.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fovea::drivers {
namespace {

// a - b, or the nearest that an int64 holds: stamps of a broken device may lie anywhere.
std::int64_t minus(std::int64_t a, std::int64_t b) noexcept {
    std::int64_t r = 0;
    if (!__builtin_sub_overflow(a, b, &r)) return r;
    return a > b ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}

}  // namespace

CounterUnwrap::CounterUnwrap(int bits, std::int64_t tick_ns) noexcept
    : mask_{(std::uint64_t{1} << std::clamp(bits, 1, 63)) - 1}, tick_ns_{std::max<std::int64_t>(tick_ns, 1)} {}

DeviceTime CounterUnwrap::update(std::uint64_t counter) noexcept {
    counter &= mask_;
    if (!any_) {
        any_ = true;
        last_ = counter;
        ticks_ = static_cast<std::int64_t>(counter);
    }
    // The step, taken as the shorter way round.
    const std::uint64_t forward = (counter - last_) & mask_;
    const std::int64_t step = forward <= mask_ / 2 ? static_cast<std::int64_t>(forward)
                                                   : -static_cast<std::int64_t>((last_ - counter) & mask_);
    last_ = counter;
    ticks_ += step;  // 2^63 ticks of 1 ns are 292 years
    std::int64_t ns = 0;
    if (__builtin_mul_overflow(ticks_, tick_ns_, &ns)) ns = std::numeric_limits<std::int64_t>::max();
    return {ns};
}

void ClockSync::start(std::int64_t device_ns, std::int64_t received_ns) noexcept {
    any_ = true;
    origin_device_ = device_ns;
    origin_received_ = received_ns;
    next_ = count_ = 0;
    open_any_ = false;
    slope_ = 0;
    anchor_device_ = 0;
    anchor_lag_ = 0;
    strangers_ = 0;
}

double ClockSync::line(std::int64_t device_ns) const noexcept {
    return anchor_lag_ + slope_ * static_cast<double>(minus(device_ns, anchor_device_));
}

void ClockSync::add(Point p) noexcept {
    if (open_any_ && p.device_ns / kBucket_ns != open_.device_ns / kBucket_ns) {
        ring_[next_] = open_;
        next_ = (next_ + 1) % kBuckets;
        count_ = std::min(count_ + 1, kBuckets);
        open_any_ = false;
        fit();
    }
    if (!open_any_ || p.lag_ns < open_.lag_ns) {
        open_ = p;
        open_any_ = true;
    }
}

void ClockSync::fit() noexcept {
    // The lower convex hull of the bucket minima, oldest to newest (monotone chain; buckets rise in device time).
    std::array<Point, kBuckets> hull;
    std::size_t n = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const Point p = ring_[(next_ + kBuckets - count_ + i) % kBuckets];
        if (n > 0 && p.device_ns <= hull[n - 1].device_ns) continue;  // a late sample closed a bucket twice
        while (n >= 2) {
            const Point &a = hull[n - 2], &b = hull[n - 1];
            // b lies on or above the line from a to p. Window 32 s: the products stay below 1e22, exact enough.
            const double cross = static_cast<double>(b.device_ns - a.device_ns) * static_cast<double>(p.lag_ns - a.lag_ns) -
                                 static_cast<double>(p.device_ns - a.device_ns) * static_cast<double>(b.lag_ns - a.lag_ns);
            if (cross > 0) break;
            --n;
        }
        hull[n++] = p;
    }
    if (n == 0) return;
    // The edge under the middle of the window: with equal weight of all points, the line that lies highest.
    const std::int64_t middle = hull[0].device_ns + (hull[n - 1].device_ns - hull[0].device_ns) / 2;
    std::size_t e = 0;
    while (e + 2 < n && hull[e + 1].device_ns < middle) ++e;
    anchor_device_ = hull[e].device_ns;
    anchor_lag_ = static_cast<double>(hull[e].lag_ns);
    const double span = n > 1 ? static_cast<double>(hull[e + 1].device_ns - hull[e].device_ns) : 0;
    const double window = static_cast<double>(hull[n - 1].device_ns - hull[0].device_ns);
    // Over less than four seconds jitter would pass for skew.
    if (n > 1 && span > 0 && window >= 4e9)
        slope_ = std::clamp(static_cast<double>(hull[e + 1].lag_ns - hull[e].lag_ns) / span, -kMaxSkew, kMaxSkew);
    else
        for (std::size_t i = 0; i < n; ++i)  // no slope yet: through the least delay
            if (static_cast<double>(hull[i].lag_ns) < anchor_lag_) {
                anchor_lag_ = static_cast<double>(hull[i].lag_ns);
                anchor_device_ = hull[i].device_ns;
            }
}

[[gnu::flatten]] ClockSync::Mapped ClockSync::update(DeviceTime device, Instant received) noexcept {
    const std::int64_t received_ns = to_ns(received);
    if (!any_) {
        start(device.ns, received_ns);
        last_exposed_ns_ = std::numeric_limits<std::int64_t>::min();
        last_device_ns_ = std::numeric_limits<std::int64_t>::min();
    }
    Point p{minus(device.ns, origin_device_), 0};
    p.lag_ns = minus(minus(received_ns, origin_received_), p.device_ns);

    // How far the arrival is from what the line says. Far off, twice in a row: one of the clocks has jumped.
    const double off = static_cast<double>(p.lag_ns) - line(p.device_ns);
    if (std::fabs(off) > static_cast<double>(kJump_ns)) {
        if (++strangers_ < 3) {
            // Perhaps one sample that was held up, or a broken stamp: its own arrival is the best that is known.
            const std::int64_t at = std::max(received_ns - std::max<std::int64_t>(min_delay_.count(), 0), last_exposed_ns_);
            last_exposed_ns_ = std::min(at, std::max(received_ns, last_exposed_ns_));
            return {instant_from_ns(last_exposed_ns_), false};
        }
        ++jumps_;
        start(device.ns, received_ns);
        p = {0, 0};
    } else {
        strangers_ = 0;
    }
    add(p);

    // Before the first fit: the least delay so far. A point below the line proves the line too high at once.
    double lag = count_ > 0 ? std::min(line(p.device_ns), static_cast<double>(p.lag_ns)) : static_cast<double>(open_.lag_ns);
    const bool below = count_ > 0 && static_cast<double>(p.lag_ns) < line(p.device_ns);
    if (below) {
        anchor_device_ = p.device_ns;
        anchor_lag_ = static_cast<double>(p.lag_ns);
    }
    std::int64_t at = origin_received_ + p.device_ns + static_cast<std::int64_t>(lag + (lag < 0 ? -0.5 : 0.5)) - min_delay_.count();
    at = std::min(at, received_ns);
    // Later device times give later exposures, even while the line moves.
    const bool later = device.ns > last_device_ns_;
    if (at <= last_exposed_ns_) at = last_exposed_ns_ + (later && last_exposed_ns_ < received_ns ? 1 : 0);
    last_device_ns_ = device.ns;
    last_exposed_ns_ = at;
    return {instant_from_ns(at), p.device_ns >= kSettle_ns};
}

}  // namespace fovea::drivers
