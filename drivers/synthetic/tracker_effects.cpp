#include "drivers/synthetic/tracker_effects.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::drivers::synthetic {
namespace {

constexpr double kMs = 1e6, kSecond = 1e9, kMinute = 60e9;  // in nanoseconds
constexpr double kLeastPause_ms = 100;  // between two blinks or drop-outs
constexpr double kSlipTakes_ns = 200e6;
constexpr double kClosing = 0.3, kClosed = 0.15;  // shares of a blink; the rest is the slower opening

std::int64_t ns(double value) noexcept { return static_cast<std::int64_t>(std::llround(value)); }
double smooth(double u) noexcept { return u <= 0 ? 0 : u >= 1 ? 1 : u * u * (3 - 2 * u); }

}  // namespace

BlinkTrain::BlinkTrain(const Blinks& settings, RandomStream random) noexcept : s_{settings}, random_{random} { plan(); }

void BlinkTrain::plan() noexcept {
    const double duration = kMs * std::clamp(s_.duration_ms * std::exp(s_.spread * random_.normal(index_).first), 50.0, 2000.0);
    const double pause = std::max(kMinute / s_.rate_per_min - kMs * s_.duration_ms - kMs * kLeastPause_ms, 0.0);
    start_ns_ = end_ns_ + ns(kMs * kLeastPause_ms + pause * random_.exponential(index_, 1));
    end_ns_ = start_ns_ + ns(duration);
}

void BlinkTrain::advance(std::int64_t t_ns) noexcept {
    while (t_ns >= end_ns_) {
        ++index_;
        plan();
    }
}

bool BlinkTrain::running(std::int64_t t_ns) noexcept {
    advance(t_ns);
    return t_ns >= start_ns_;
}

double BlinkTrain::openness(std::int64_t t_ns) noexcept {
    if (!running(t_ns)) return 1;
    const double u = static_cast<double>(t_ns - start_ns_) / static_cast<double>(end_ns_ - start_ns_);
    if (u < kClosing) return 1 - smooth(u / kClosing);
    if (u < kClosing + kClosed) return 0;
    return smooth((u - kClosing - kClosed) / (1 - kClosing - kClosed));
}

SlipTrain::SlipTrain(const Slip& settings, RandomStream random) noexcept : s_{settings}, random_{random}, next_ns_{pause_ns(0)} {
    const double way = 6.283185307179586 * random_.uniform(0, 2);
    creep_deg_s_ = s_.creep_deg_per_min / 60 * Offset{std::cos(way), std::sin(way)};
}

std::int64_t SlipTrain::pause_ns(std::uint64_t index) const noexcept {
    return ns(kSlipTakes_ns + kMinute / s_.rate_per_min * random_.exponential(index, 1));
}

Offset SlipTrain::at(std::int64_t t_ns) noexcept {
    while (t_ns >= next_ns_) {
        start_ns_ = next_ns_;
        ++index_;
        next_ns_ += pause_ns(index_);
        from_ = to_;
        const NormalPair n = random_.normal(index_);
        to_ = to_ + s_.step_deg * Offset{n.first, n.second};
    }
    const double done = index_ == 0 ? 0 : smooth(static_cast<double>(t_ns - start_ns_) / kSlipTakes_ns);
    return from_ + done * (to_ - from_) + (static_cast<double>(t_ns) / kSecond) * creep_deg_s_;
}

ColouredNoise::ColouredNoise(const Noise& s, RandomStream random, std::uint32_t lane) noexcept
    : std_deg_{s.std_deg}, random_{random}, lane_{lane}, white_{s.colour == 0} {
    taps_[0] = 1;
    double sum = 1;
    for (std::size_t k = 1; k < kTaps; ++k) {
        taps_[k] = taps_[k - 1] * (s.colour / 2 + static_cast<double>(k) - 1) / static_cast<double>(k);
        sum += taps_[k] * taps_[k];
    }
    for (double& t : taps_) t /= std::sqrt(sum);
}

void ColouredNoise::push(std::uint64_t source) noexcept {
    const NormalPair n = random_.normal(source, lane_);
    drawn_[source % kTaps] = {n.first, n.second};
}

Offset ColouredNoise::at(std::uint64_t index) noexcept {
    if (white_) {
        const NormalPair n = random_.normal(index + kTaps - 1, lane_);
        return std_deg_ * Offset{n.first, n.second};
    }
    const std::uint64_t newest = index + kTaps - 1;
    next_ = std::max(next_, index);  // older than that is not needed any more
    for (; next_ <= newest; ++next_) push(next_);
    Offset sum;
    for (std::size_t k = 0; k < kTaps; ++k) sum = sum + taps_[k] * drawn_[(newest - k) % kTaps];
    return std_deg_ * sum;
}

double ColouredNoise::step_ratio() const noexcept {
    double steps = taps_[0] * taps_[0] + taps_[kTaps - 1] * taps_[kTaps - 1];
    for (std::size_t k = 1; k < kTaps; ++k) steps += (taps_[k] - taps_[k - 1]) * (taps_[k] - taps_[k - 1]);
    return std::sqrt(steps);
}

Offset quantised(const Quantisation& s, Offset o) noexcept {
    return {s.step_deg * std::nearbyint(o.x_deg / s.step_deg), s.step_deg * std::nearbyint(o.y_deg / s.step_deg)};
}

Offset miscalibrated(const Miscalibration& s, Offset o) noexcept {
    return {s.gain_x * o.x_deg + s.shear * o.y_deg + s.offset_x_deg, s.gain_y * o.y_deg + s.offset_y_deg};
}

std::int64_t jitter_ns(const RateJitter& s, const RandomStream& random, std::uint64_t index, double interval_ns) noexcept {
    // Less than half an interval, so that exposures keep their order.
    return ns(std::clamp(kMs * s.std_ms * random.normal(index).first, -0.45 * interval_ns, 0.45 * interval_ns));
}

std::int64_t latency_ns(const Latency& s, const RandomStream& random, std::uint64_t index) noexcept {
    return ns(kMs * (s.least_ms + (s.mean_ms - s.least_ms) * random.exponential(index)));
}

DropOutTrain::DropOutTrain(const DropOuts& settings, RandomStream random) noexcept : s_{settings}, random_{random} { plan(); }

void DropOutTrain::plan() noexcept {
    const double pause = std::max(kMinute / s_.rate_per_min - kMs * s_.duration_ms - kMs * kLeastPause_ms, 0.0);
    start_ns_ = end_ns_ + ns(kMs * kLeastPause_ms + pause * random_.exponential(index_, 1));
    end_ns_ = start_ns_ + std::max<std::int64_t>(1, ns(kMs * s_.duration_ms * random_.exponential(index_)));
    kind_ = random_.uniform(index_, 2) < s_.missing ? State::missing : State::invalid;
}

DropOutTrain::State DropOutTrain::at(std::int64_t t_ns) noexcept {
    while (t_ns >= end_ns_) {
        ++index_;
        plan();
    }
    return t_ns >= start_ns_ ? kind_ : State::none;
}

}  // namespace fovea::drivers::synthetic
