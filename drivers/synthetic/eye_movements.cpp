#include "drivers/synthetic/eye_movements.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace fovea::drivers::synthetic {
namespace {

constexpr double kMs = 1e6, kSecond = 1e9;  // in nanoseconds
constexpr double kShortestDwell_ms = 150;   // longer than the longest saccade
constexpr double kLargestSaccade_deg = 45;
constexpr double kLinePitch_deg = 1.5;      // reading: from line to line
constexpr double kLongestMicrosaccade_deg = 1;
constexpr double kRefractory_s = 0.1;       // between microsaccades
constexpr double kDriftForgets = 1e-3;      // per step (Engbert et al. 2011)
constexpr double kDegrees = 180 / std::numbers::pi;

std::int64_t ns(double value) noexcept { return static_cast<std::int64_t>(std::llround(value)); }

double log_normal(double median, double spread, double normal) noexcept { return median * std::exp(spread * normal); }

// x mirrored at +-half until it is inside.
double folded(double x, double half) noexcept {
    if (!(half > 0)) return 0;
    const double period = 4 * half;
    double y = std::fmod(x + half, period);
    if (y < 0) y += period;
    return y <= 2 * half ? y - half : 3 * half - y;
}

double minimum_jerk(double u) noexcept { return u <= 0 ? 0 : u >= 1 ? 1 : u * u * u * (10 + u * (6 * u - 15)); }

}  // namespace

FixationTrain::FixationTrain(const Fixations& settings, RandomStream random) noexcept : s_{settings}, random_{random} {
    now_.to = now_.from = choose(0, {});
    next_ns_ = dwell_ns(0);
    next_ = choose(1, now_.to);
}

std::int64_t FixationTrain::dwell_ns(std::uint64_t index) const noexcept {
    return ns(kMs * std::max(kShortestDwell_ms, log_normal(s_.median_ms, s_.spread, random_.normal(index, 0).first)));
}

Offset FixationTrain::choose(std::uint64_t index, Offset from) const noexcept {
    const double half_width = s_.width_deg / 2, half_height = s_.height_deg / 2;
    if (s_.pattern == "hold") return {};
    if (s_.pattern == "targets") {
        const auto count = static_cast<std::uint64_t>(s_.rows * s_.columns);
        auto stride = static_cast<std::uint64_t>(0.618 * static_cast<double>(count)) | 1u;
        while (std::gcd(stride, count) != 1) ++stride;  // every target comes once in a round
        const std::uint64_t n = (index * stride) % count;
        const auto place = [](std::uint64_t at, int of, double half) {
            return of == 1 ? 0 : half * (2 * static_cast<double>(at) / (of - 1) - 1);
        };
        const auto columns = static_cast<std::uint64_t>(s_.columns);
        return {place(n % columns, s_.columns, half_width), -place(n / columns, s_.rows, half_height)};
    }
    const NormalPair size = random_.normal(index, 1);
    const double amplitude = std::min(kLargestSaccade_deg, log_normal(s_.amplitude_deg, s_.amplitude_spread, size.first));
    if (s_.pattern == "reading") {
        if (index == 0) return {-half_width, half_height};
        const bool back = random_.uniform(index, 2) < s_.regressions;
        Offset to{back ? std::max(-half_width, from.x_deg - amplitude) : from.x_deg + amplitude, from.y_deg};
        if (to.x_deg <= half_width) return to;
        to = {-half_width + std::min(0.3 * std::fabs(size.second), s_.width_deg), from.y_deg - kLinePitch_deg};
        return to.y_deg < -half_height ? Offset{to.x_deg, half_height} : to;
    }
    if (index == 0) return {};
    const double way = 2 * std::numbers::pi * random_.uniform(index, 2);
    return {folded(from.x_deg + amplitude * std::cos(way), half_width), folded(from.y_deg + amplitude * std::sin(way), half_height)};
}

const GazeShift& FixationTrain::at(std::int64_t t_ns) noexcept {
    while (t_ns >= next_ns_) {
        now_ = {now_.index + 1, next_ns_, now_.to, next_};
        next_ns_ += dwell_ns(now_.index);
        next_ = choose(now_.index + 1, now_.to);
    }
    return now_;
}

Offset SaccadeTrain::at(const GazeShift& shift, std::int64_t t_ns) noexcept {
    if (shift.index == 0) return {};
    const Offset whole = shift.to - shift.from;
    if (shift.index != index_) {
        index_ = shift.index;
        const double speed = std::clamp(1 + s_.scatter * random_.normal(index_).first, 0.5, 2.0);
        const double usual_ms = s_.duration_intercept_ms + s_.duration_slope_ms_per_deg * length(whole);
        const double duration_ms = std::min(usual_ms / speed, kShortestDwell_ms - 1);
        duration_ns_ = kMs * duration_ms;
        end_ns_ = shift.start_ns + ns(duration_ns_);
        profile_ = SaccadeProfile(s_.peak_ratio, 0.5 - s_.skew_per_ms * std::max(0.0, duration_ms - 30));
    }
    return (profile_.at(static_cast<double>(t_ns - shift.start_ns) / duration_ns_) - 1) * whole;
}

Offset post_saccadic_swing(const PostSaccadicOscillation& s, const GazeShift& shift, std::int64_t end_ns, std::int64_t t_ns) noexcept {
    if (shift.index == 0 || t_ns <= end_ns) return {};
    const double since_s = static_cast<double>(t_ns - end_ns) / kSecond;
    const double decay = std::exp(-since_s * 1e3 / s.decay_ms);
    if (decay < 1e-3) return {};
    const Offset whole = shift.to - shift.from;
    const double amplitude = length(whole);
    if (!(amplitude > 0)) return {};
    const double swing = std::min(s.share * amplitude, s.largest_deg) * decay * std::sin(2 * std::numbers::pi * s.frequency_hz * since_s);
    return (swing / amplitude) * whole;
}

MicrosaccadeTrain::MicrosaccadeTrain(const Microsaccades& settings, RandomStream random) noexcept : s_{settings}, random_{random} {
    next_ns_ = pause_ns(0);
}

std::int64_t MicrosaccadeTrain::pause_ns(std::uint64_t index) const noexcept {
    return ns(kSecond * (kRefractory_s + random_.exponential(index) * (1 / s_.rate_hz - kRefractory_s)));
}

Offset MicrosaccadeTrain::at(std::int64_t t_ns) noexcept {
    while (t_ns >= next_ns_) {
        ++index_;
        start_ns_ = next_ns_;
        next_ns_ += pause_ns(index_);
        from_ = to_;
        const NormalPair n = random_.normal(index_, 1);
        const double amplitude = std::min(kLongestMicrosaccade_deg, log_normal(s_.amplitude_deg, s_.amplitude_spread, n.first));
        // Mostly along the horizontal, and back rather than on (Engbert 2006).
        const bool right = from_.x_deg == 0 ? random_.uniform(index_, 2) < 0.5 : from_.x_deg < 0;
        const double way = 0.35 * n.second;
        const double up = from_.y_deg > s_.amplitude_deg ? -1 : from_.y_deg < -s_.amplitude_deg ? 1 : 0;
        to_ = from_ + Offset{(right ? 1 : -1) * amplitude * std::cos(way), up == 0 ? amplitude * std::sin(way) : up * amplitude * std::fabs(std::sin(way))};
    }
    if (index_ == 0) return {};
    const double u = static_cast<double>(t_ns - start_ns_) / (kMs * s_.duration_ms);
    return from_ + profile_.at(u) * (to_ - from_);
}

DriftWalk::DriftWalk(const Drift& s, RandomStream random) noexcept
    : step_deg_{s.speed_deg_s / s.steps_per_s}, step_ns_{kSecond / s.steps_per_s}, random_{random} {}

// The potential that draws to the middle: slope 1 per lattice unit at the rim, as in the source.
double DriftWalk::cost(int i, int j) const noexcept {
    const double x = static_cast<double>(i - kMiddle) / kMiddle, y = static_cast<double>(j - kMiddle) / kMiddle;
    return visited_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] / scale_ + kSide * (x * x + y * y);
}

void DriftWalk::step() noexcept {
    visited_[static_cast<std::size_t>(i_)][static_cast<std::size_t>(j_)] += scale_;
    // All counts fall by one share per step; instead the weight of a visit rises, and is taken back before it overflows.
    scale_ /= 1 - kDriftForgets;
    if (scale_ > 1e100) {
        for (auto& row : visited_)
            for (double& v : row) v /= scale_;
        scale_ = 1;
    }
    i_before_ = i_, j_before_ = j_;
    constexpr std::array<std::array<int, 2>, 4> kWays = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    const auto first = static_cast<std::size_t>(4 * random_.uniform(steps_));  // who wins among equals
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < 4; ++k) {
        const auto [di, dj] = kWays[(first + k) % 4];
        const int i = i_before_ + di, j = j_before_ + dj;
        if (i < 0 || j < 0 || i >= kSide || j >= kSide) continue;
        if (const double c = cost(i, j); c < least) {
            least = c;
            i_ = i, j_ = j;
        }
    }
    ++steps_;
}

Offset DriftWalk::at(std::int64_t t_ns) noexcept {
    const double steps = static_cast<double>(t_ns) / step_ns_;
    const auto whole = static_cast<std::uint64_t>(std::max(0.0, steps));
    while (steps_ <= whole) step();
    const double f = std::clamp(steps - static_cast<double>(whole), 0.0, 1.0);
    return step_deg_ * Offset{i_before_ - kMiddle + f * (i_ - i_before_), j_before_ - kMiddle + f * (j_ - j_before_)};
}

TremorWave::TremorWave(const Tremor& s, RandomStream random) noexcept
    : amplitude_deg_{s.amplitude_deg * std::sqrt(2.0 / static_cast<double>(kWaves))} {
    for (std::size_t axis = 0; axis < 2; ++axis)
        for (std::size_t w = 0; w < kWaves; ++w) {
            const std::uint64_t n = axis * kWaves + w;
            waves_[axis][w] = {s.lowest_hz + (s.highest_hz - s.lowest_hz) * random.uniform(n, 0), 2 * std::numbers::pi * random.uniform(n, 1)};
        }
}

Offset TremorWave::at(std::int64_t t_ns) const noexcept {
    const double t_s = static_cast<double>(t_ns) / kSecond;
    std::array<double, 2> sum{};
    for (std::size_t axis = 0; axis < 2; ++axis)
        for (const Wave& w : waves_[axis]) sum[axis] += std::sin(2 * std::numbers::pi * w.hz * t_s + w.phase);
    return amplitude_deg_ * Offset{sum[0], sum[1]};
}

PursuitTrain::PursuitTrain(const Pursuit& settings, RandomStream random) noexcept
    : s_{settings}, random_{random}, segment_ns_{ns(kSecond * settings.segment_s)} {
    const double way = 2 * std::numbers::pi * random_.uniform(0);
    speed_ = s_.gain * s_.speed_deg_s * Offset{std::cos(way), std::sin(way)};
}

void PursuitTrain::next_segment() noexcept {
    const double tau_s = s_.time_constant_ms * 1e-3, d = s_.segment_s, left = std::exp(-d / tau_s);
    // The eye's speed goes from speed_at_start_ to speed_ with a time constant; this is its integral.
    place_ = place_ + d * speed_ + tau_s * (1 - left) * (speed_at_start_ - speed_);
    speed_at_start_ = speed_ + left * (speed_at_start_ - speed_);
    ++index_;
    start_ns_ += segment_ns_;
    const double speed = s_.gain * s_.speed_deg_s * (0.5 + random_.uniform(index_, 1));
    const double way = length(place_) > s_.extent_deg ? std::atan2(-place_.y_deg, -place_.x_deg) + 0.5 * (random_.uniform(index_) - 0.5)
                                                      : 2 * std::numbers::pi * random_.uniform(index_);
    speed_ = speed * Offset{std::cos(way), std::sin(way)};
}

Offset PursuitTrain::at(std::int64_t t_ns) noexcept {
    while (t_ns >= start_ns_ + segment_ns_) next_segment();
    const double tau_s = s_.time_constant_ms * 1e-3, d = static_cast<double>(t_ns - start_ns_) / kSecond;
    return place_ + d * speed_ + tau_s * -std::expm1(-d / tau_s) * (speed_at_start_ - speed_);
}

VergenceTrain::VergenceTrain(const Vergence& settings, RandomStream random) noexcept : s_{settings}, random_{random} {
    from_deg_ = to_deg_ = draw_deg(0);
    next_ns_ = ns(kSecond * s_.hold_s * (0.5 + random_.uniform(0, 1)));
}

// Depths are even in dioptres, as what one looks at is rather than in metres.
double VergenceTrain::draw_deg(std::uint64_t index) const noexcept {
    const double u = random_.uniform(index), dioptres = 1 / s_.far_m + u * (1 / s_.near_m - 1 / s_.far_m);
    return std::atan(0.5e-3 * s_.eyes_apart_mm * dioptres) * kDegrees;
}

double VergenceTrain::half_angle_deg(std::int64_t t_ns) noexcept {
    const auto eased = [this](std::int64_t t) { return to_deg_ + (from_deg_ - to_deg_) * std::exp(-static_cast<double>(t - start_ns_) / (kMs * s_.time_constant_ms)); };
    while (t_ns >= next_ns_) {
        from_deg_ = eased(next_ns_);
        start_ns_ = next_ns_;
        ++index_;
        to_deg_ = draw_deg(index_);
        next_ns_ += ns(kSecond * s_.hold_s * (0.5 + random_.uniform(index_, 1)));
    }
    return eased(t_ns);
}

HeadTurns::HeadTurns(const Head& settings, RandomStream random) noexcept : s_{settings}, random_{random} {}

Offset HeadTurns::at(std::int64_t t_ns) noexcept {
    while (count_ == 0 || turns_[(count_ - 1) % kKept].start_ns <= t_ns) {
        const Turn before = count_ == 0 ? Turn{-ns(kMs * s_.turn_ms), {}, {}} : turns_[(count_ - 1) % kKept];
        const NormalPair n = random_.normal(count_);
        const double rest_s = s_.interval_s * random_.exponential(count_, 1);
        turns_[count_ % kKept] = {before.start_ns + ns(kMs * s_.turn_ms + kSecond * rest_s), before.to,
                                  {std::clamp(n.first, -2.0, 2.0) * s_.yaw_deg, std::clamp(n.second, -2.0, 2.0) * s_.pitch_deg}};
        ++count_;
    }
    const std::uint64_t oldest = count_ > kKept ? count_ - kKept : 0;
    for (std::uint64_t k = count_; k-- > oldest;) {
        const Turn& turn = turns_[k % kKept];
        if (turn.start_ns > t_ns) continue;
        return turn.from + minimum_jerk(static_cast<double>(t_ns - turn.start_ns) / (kMs * s_.turn_ms)) * (turn.to - turn.from);
    }
    return turns_[oldest % kKept].from;
}

}  // namespace fovea::drivers::synthetic
