#include "daemon/pipeline/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/pipeline/ballistic.hpp"
#include "daemon/pipeline/gain_table.hpp"

namespace fovea::pipeline {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr std::size_t kDriftLag = 7;         // of kLags_ns: 54 ms
constexpr double kDriftLeast_deg = 0.12, kDriftNoise_s = 0.02;
constexpr std::int64_t kLanded_ns = 40'000'000;  // post-saccadic oscillation and glides last 10 to 40 ms

double horizon_s(std::size_t ahead) noexcept { return static_cast<double>(kHorizons_ns[ahead + 1]) * 1e-9; }

template <std::size_t N, class T>
void advance(std::array<Tangent, kAhead>& out, const std::array<T, N>& degrees, Tangent along) noexcept {
    for (std::size_t h = 0; h < kAhead; ++h) out[h] = (static_cast<double>(degrees[h]) * kRadiansPerDegree) * along;
}

}  // namespace

Phase phase_of(const Classified& now, const MotionFeatures& features, std::int64_t t_ns) noexcept {
    if (now.event == GazeEvent::saccade) return now.speed_deg_s >= 0.5 * now.peak_deg_s ? Phase::rising : Phase::falling;
    if (now.event == GazeEvent::pursuit) return Phase::pursuit;
    if (now.any_saccade && t_ns - now.end_ns < kLanded_ns) return Phase::landed;
    if (now.speed_deg_s > 0.5 * now.threshold_deg_s) return Phase::stirring;
    // Slower than the classifier's pursuit, but further than noise alone would have come.
    const double came = features.came_deg[kDriftLag], half = features.came_deg[kDriftLag - 2];
    const bool drifts = came > std::max(kDriftLeast_deg, kDriftNoise_s * now.noise_deg_s) && half > 0.3 * came;
    return drifts ? Phase::pursuit : Phase::quiet;
}

Result<Predictor> Predictor::create(const PredictorSettings& s) {
    Predictor p;
    if (s.name == "hold") p.kind_ = Kind::hold;
    else if (s.name == "velocity") p.kind_ = Kind::velocity;
    else if (s.name == "damped_velocity") p.kind_ = Kind::damped_velocity;
    else if (s.name == "kalman") p.kind_ = Kind::kalman;
    else if (s.name == "imm") p.kind_ = Kind::imm;
    else if (s.name == "gain_table") p.kind_ = Kind::gain_table;
    else if (s.name == "ballistic") p.kind_ = Kind::ballistic;
    else if (s.name == "auto") p.kind_ = Kind::automatic;
    else return fail("there is no predictor '" + s.name + "'");
    const double tau = s.time_constant_ms * 1e-3;
    for (std::size_t h = 0; h < kAhead; ++h) p.damped_s_[h] = s.damping * tau * -std::expm1(-horizon_s(h) / tau);
    return p;
}

void Predictor::reset() noexcept {
    kalman_.reset();
    imm_.reset();
}

void Predictor::update(const PredictorInput& in, std::array<Tangent, kAhead>& out) noexcept {
    out.fill({});
    const History& raw = in.raw;
    const Direction<HeadFrame> gaze = raw.direction(0);
    if (kind_ == Kind::hold) return;
    Direction<HeadFrame> plane = gaze;  // whose tangent plane `out` is in until the end
    switch (kind_) {
        case Kind::hold: return;
        case Kind::velocity:
            for (std::size_t h = 0; h < kAhead; ++h) out[h] = horizon_s(h) * in.now.fast_rad_s;
            break;
        case Kind::damped_velocity: {
            if (in.now.event == GazeEvent::fixation) return;
            const Tangent v = in.now.event == GazeEvent::pursuit ? in.now.slow_rad_s : in.now.fast_rad_s;
            for (std::size_t h = 0; h < kAhead; ++h) out[h] = damped_s_[h] * v;
            break;
        }
        case Kind::kalman:
        case Kind::imm: {
            if (raw.size() >= 3)
                noise_.update(raw.direction(0), raw.direction(1), raw.direction(2),
                              static_cast<double>(raw.time_ns(0) - raw.time_ns(1)) * 1e-9,
                              static_cast<double>(raw.time_ns(1) - raw.time_ns(2)) * 1e-9);
            if (kind_ == Kind::kalman) {
                (void)kalman_.update(raw.time_ns(0), gaze, noise_.variance_rad2());
                for (std::size_t h = 0; h < kAhead; ++h) out[h] = horizon_s(h) * kalman_.velocity_rad_s();
                plane = kalman_.direction();
            } else {
                imm_.update(raw.time_ns(0), gaze, noise_.variance_rad2());
                for (std::size_t h = 0; h < kAhead; ++h) out[h] = imm_.displacement(horizon_s(h));
                plane = imm_.direction();
            }
            break;
        }
        case Kind::gain_table: {
            const auto& gains = kGainTable_s[static_cast<std::size_t>(in.phase)];
            for (std::size_t h = 0; h < kAhead; ++h) out[h] = static_cast<double>(gains[h]) * in.now.fast_rad_s;
            break;
        }
        case Kind::ballistic:
            if (in.now.event != GazeEvent::saccade || !in.features.usable) return;
            advance(out, ballistic(in.features, in.now, raw.time_ns(0)).advance_deg, in.features.along);
            break;
        case Kind::automatic:
            if (in.phase == Phase::turning) {
                for (std::size_t h = 0; h < kAhead; ++h) out[h] = horizon_s(h) * in.against_head_rad_s;
                break;
            }
            if (!in.features.usable) return;
            advance(out, net_advance(in.net, in.features.speed_deg_s), in.features.along);
            break;
    }
    const bool same_plane = plane == in.filtered;
    for (Tangent& t : out) {
        if (!same_plane) t = transport(plane, in.filtered, t);
        const double l = std::sqrt(t.u * t.u + t.v * t.v);
        if (!(l <= kLargestPrediction_rad)) t = std::isfinite(l) ? (kLargestPrediction_rad / l) * t : Tangent{};
    }
}

}  // namespace fovea::pipeline
