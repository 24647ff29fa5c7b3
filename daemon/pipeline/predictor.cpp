#include "daemon/pipeline/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/pipeline/ballistic.hpp"
#include "daemon/pipeline/gain_table.hpp"
#include "daemon/pipeline/head_motion.hpp"

namespace fovea::pipeline {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr std::size_t kDriftLag = 7;         // of kLags_ns: 54 ms
constexpr double kDriftLeast_deg = 0.12, kDriftNoise_s = 0.02;
constexpr std::int64_t kLanded_ns = 40'000'000;  // post-saccadic oscillation and glides last 10 to 40 ms

constexpr PerHorizon kHorizon_s = [] {
    PerHorizon s{};
    for (std::size_t h = 0; h < kAhead; ++h) s[h] = static_cast<float>(static_cast<double>(kHorizons_ns[h + 1]) * 1e-9);
    return s;
}();
double horizon_s(std::size_t ahead) noexcept { return static_cast<double>(kHorizons_ns[ahead + 1]) * 1e-9; }

// amounts[h] * way, none longer than an eye can go. `longest`: that, by the length of `way`.
void fill(Ahead& out, const PerHorizon& amounts, Tangent way, double longest) noexcept {
    const Four u = all_four(static_cast<float>(way.u)), v = all_four(static_cast<float>(way.v));
    const float most = static_cast<float>(longest);
    for (std::size_t h = 0; h < kHorizonLanes; h += 4) {
        const Four amount = at_least(at_most(load_four(&amounts[h]), most), -most);
        store_four(&out.du_rad[h], amount * u);
        store_four(&out.dv_rad[h], amount * v);
    }
}
double longest(Tangent rad_s) noexcept { return kLargestPrediction_rad / std::max(norm(rad_s), 1e-3); }   // in seconds

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
    for (std::size_t h = 0; h < kAhead; ++h) p.damped_s_[h] = static_cast<float>(s.damping * tau * -std::expm1(-horizon_s(h) / tau));
    return p;
}

void Predictor::reset() noexcept {
    kalman_.reset();
    imm_.reset();
}

void Predictor::update(const PredictorInput& in, Ahead& out) noexcept {
    if (kind_ == Kind::kalman || kind_ == Kind::imm) [[unlikely]] return filtered(in, out);
    // One way for all horizons, in the tangent plane of the raw gaze: a velocity times seconds, or a direction times radians.
    Tangent way{};
    PerHorizon amounts{};
    if (kind_ == Kind::automatic && in.phase != Phase::turning) [[likely]] {
        if (in.features.usable) {
            amounts = net_advance(in.net, in.features.speed_deg_s * kRadiansPerDegree);
            way = in.features.along;
        }
    } else {
        other(in, amounts, way);
    }
    const Tangent shown = in.raw.plane().at == in.filtered.at ? way : carried(in.raw.plane(), in.filtered, way);
    fill(out, amounts, shown, longest(way));
}

void Predictor::other(const PredictorInput& in, PerHorizon& amounts, Tangent& way) const noexcept {
    switch (kind_) {
        case Kind::hold:
        case Kind::kalman:
        case Kind::imm: break;
        case Kind::velocity:
            amounts = kHorizon_s;
            way = in.now.fast_rad_s;
            break;
        case Kind::damped_velocity:
            if (in.now.event == GazeEvent::fixation) break;
            amounts = damped_s_;
            way = in.now.event == GazeEvent::pursuit ? in.now.slow_rad_s : in.now.fast_rad_s;
            break;
        case Kind::gain_table:
            std::ranges::copy(kGainTable_s[static_cast<std::size_t>(in.phase)], amounts.begin());
            way = in.now.fast_rad_s;
            break;
        case Kind::ballistic: {
            if (in.now.event != GazeEvent::saccade || !in.features.usable) break;
            const Landing landing = ballistic(in.features, in.now, in.raw.time_ns(0));
            for (std::size_t h = 0; h < kAhead; ++h) amounts[h] = static_cast<float>(landing.advance_deg[h] * kRadiansPerDegree);
            way = in.features.along;
            break;
        }
        case Kind::automatic:
            amounts = kHorizon_s;
            way = against_head(in.head_rad_s, in.raw.plane());
            break;
    }
}

void Predictor::filtered(const PredictorInput& in, Ahead& out) noexcept {
    const History& raw = in.raw;
    if (raw.size() >= 3)
        noise_.update(raw.direction(0), raw.direction(1), raw.direction(2),
                      static_cast<double>(raw.time_ns(0) - raw.time_ns(1)) * 1e-9,
                      static_cast<double>(raw.time_ns(1) - raw.time_ns(2)) * 1e-9);
    if (kind_ == Kind::kalman) {
        (void)kalman_.update(raw.time_ns(0), raw.direction(0), noise_.variance_rad2());
        const Tangent way = carried(Plane(kalman_.direction()), in.filtered, kalman_.velocity_rad_s());
        return fill(out, kHorizon_s, way, longest(way));
    }
    imm_.update(raw.time_ns(0), raw.direction(0), noise_.variance_rad2());
    const Plane from(imm_.direction());
    for (std::size_t h = 0; h < kAhead; ++h) {
        Tangent t = carried(from, in.filtered, imm_.displacement(horizon_s(h)));
        const double l = norm(t);
        if (!(l <= kLargestPrediction_rad)) t = std::isfinite(l) ? (kLargestPrediction_rad / l) * t : Tangent{};
        out.du_rad[h] = static_cast<float>(t.u);
        out.dv_rad[h] = static_cast<float>(t.v);
    }
}

}  // namespace fovea::pipeline
