#include "daemon/pipeline/kalman.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fovea::pipeline {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// Bounds of what a covariance may hold: beyond them the filter knows nothing, and more than nothing would overflow.
constexpr double kMaxPp = 10;      // rad^2: all directions
constexpr double kMaxVv = 1e4;     // (100 rad/s)^2: no eye is faster than 17
constexpr double kMinPp = 1e-14;   // (0.02 seconds of arc)^2: below any tracker, keeps the gain defined
constexpr double kMinVv = 1e-12;
constexpr double kMinNoise = 1e-12, kMaxNoise = 1e3;
constexpr double kMaxDt = 0.1;     // after longer gaps a caller resets; the state is as good as unknown

// Brings a covariance back into its bounds without making it indefinite.
Covariance bounded(Covariance c) noexcept {
    if (!std::isfinite(c.pp) || !std::isfinite(c.vv) || !std::isfinite(c.pv)) return {kMaxPp, 0, kMaxVv};
    c.pp = std::clamp(c.pp, kMinPp, kMaxPp);
    c.vv = std::clamp(c.vv, kMinVv, kMaxVv);
    const double most = std::sqrt(c.pp * c.vv);
    c.pv = std::clamp(c.pv, -most, most);
    return c;
}

}  // namespace

Covariance predict_covariance(Covariance c, double dt, double q) noexcept {
    dt = std::clamp(dt, 0.0, kMaxDt);
    return bounded({c.pp + 2 * dt * c.pv + dt * dt * c.vv + q * dt * dt * dt / 3, c.pv + dt * c.vv + q * dt * dt / 2,
                    c.vv + q * dt});
}

Gain kalman_gain(const Covariance& c, double r) noexcept {
    const double s = c.pp + std::clamp(r, kMinNoise, kMaxNoise);
    return {c.pp / s, c.pv / s, s};
}

Covariance update_covariance(const Covariance& c, const Gain& k, double r) noexcept {
    r = std::clamp(r, kMinNoise, kMaxNoise);
    // (I - K H) P (I - K H)^T + K r K^T with H = (1 0).
    const double a = 1 - k.p;
    return bounded({a * a * c.pp + k.p * k.p * r, a * (c.pv - k.v * c.pp) + k.p * k.v * r,
                    c.vv - 2 * k.v * c.pv + k.v * k.v * c.pp + k.v * k.v * r});
}

void NoiseEstimate::update(Direction<HeadFrame> a, Direction<HeadFrame> b, Direction<HeadFrame> c, double dt_ab_s,
                           double dt_bc_s) noexcept {
    if (!(dt_ab_s > 0) || !(dt_bc_s > 0) || dt_ab_s > 0.05 || dt_bc_s > 0.05) return;
    // b against the chord from a to c. Its deviation has variance sigma^2 (1 + w^2 + (1-w)^2) per axis.
    const double w = dt_ab_s / (dt_ab_s + dt_bc_s);
    const Vec3<HeadFrame> off = b.vec() - (w * c.vec() + (1 - w) * a.vec());
    const double spread = 1 + w * w + (1 - w) * (1 - w);
    const double size = std::sqrt(dot(off, off) / spread);
    // Median of a Rayleigh variable: 1.177 sigma. Up or down by 1 % per sample: 100 samples to settle.
    sigma_rad_ *= size > 1.177 * sigma_rad_ ? 1.01 : 1 / 1.01;
    sigma_rad_ = std::clamp(sigma_rad_, 1e-6, 0.2);
}

KalmanCv::KalmanCv(double psd) noexcept : q_{psd * kRadiansPerDegree * kRadiansPerDegree} {}

Direction<HeadFrame> KalmanCv::update(std::int64_t t_ns, Direction<HeadFrame> gaze, double noise_rad2) noexcept {
    if (!any_) {
        any_ = true;
        last_ns_ = t_ns;
        velocity_ = {};
        c_ = {std::clamp(noise_rad2, kMinNoise, kMaxPp), 0, 1};
        return at_ = gaze;
    }
    const double dt = std::clamp(static_cast<double>(t_ns - last_ns_) * 1e-9, 0.0, kMaxDt);
    last_ns_ = t_ns;
    const Direction<HeadFrame> ahead = exp_map(at_, dt * velocity_);
    velocity_ = transport(at_, ahead, velocity_);
    c_ = predict_covariance(c_, dt, q_);
    const Gain k = kalman_gain(c_, noise_rad2);
    const Tangent innovation = log_map(ahead, gaze);
    at_ = exp_map(ahead, k.p * innovation);
    velocity_ = transport(ahead, at_, velocity_ + k.v * innovation);
    const double speed = length(velocity_), fastest = 30;  // rad/s
    if (speed > fastest) velocity_ = (fastest / speed) * velocity_;
    c_ = update_covariance(c_, k, noise_rad2);
    return at_;
}

namespace {

// Acceleration PSD per model, deg^2/s^3, and how likely each is to go on being the one, per second.
constexpr std::array<double, Imm::kModels> kPsd = {3, 300, 3e6};
constexpr std::array<double, Imm::kModels> kLeave_per_s = {4, 4, 25};
constexpr double kLeastProbability = 1e-6;  // a model that underflowed to 0 could never come back

}  // namespace

void Imm::reset() noexcept {
    any_ = false;
    mu_ = {0.8, 0.1, 0.1};
}

void Imm::update(std::int64_t t_ns, Direction<HeadFrame> gaze, double noise_rad2) noexcept {
    if (!any_) {
        any_ = true;
        last_ns_ = t_ns;
        at_ = gaze;
        position_.fill({});
        velocity_.fill({});
        c_.fill({std::clamp(noise_rad2, kMinNoise, kMaxPp), 0, 1});
        c_[0].vv = 1e-4;
        return;
    }
    const double dt = std::clamp(static_cast<double>(t_ns - last_ns_) * 1e-9, 0.0, kMaxDt);
    last_ns_ = t_ns;

    // Mixing: model j starts from what all models hold, weighted by how likely each was to turn into j.
    std::array<double, kModels> prior{};
    std::array<std::array<double, kModels>, kModels> turn{};
    for (std::size_t i = 0; i < kModels; ++i) {
        const double leave = -std::expm1(-kLeave_per_s[i] * dt);
        for (std::size_t j = 0; j < kModels; ++j) {
            turn[i][j] = mu_[i] * (i == j ? 1 - leave : leave / (kModels - 1));
            prior[j] += turn[i][j];
        }
    }
    const auto p0 = position_, v0 = velocity_;
    const auto c0 = c_;
    const Tangent measured = log_map(at_, gaze);
    std::array<double, kModels> log_likelihood{};
    for (std::size_t j = 0; j < kModels; ++j) {
        Tangent p, v;
        for (std::size_t i = 0; i < kModels; ++i) {
            const double w = turn[i][j] / prior[j];
            p = p + w * p0[i];
            v = v + w * v0[i];
        }
        Covariance c;
        for (std::size_t i = 0; i < kModels; ++i) {
            // The spread between the models' means, as the mean of both axes.
            const double w = turn[i][j] / prior[j];
            const Tangent dp = p0[i] - p, dv = v0[i] - v;
            c.pp += w * (c0[i].pp + 0.5 * (dp.u * dp.u + dp.v * dp.v));
            c.pv += w * (c0[i].pv + 0.5 * (dp.u * dv.u + dp.v * dv.v));
            c.vv += w * (c0[i].vv + 0.5 * (dv.u * dv.u + dv.v * dv.v));
        }
        if (j == 0) v = {}, c.pv = 0, c.vv = std::min(c.vv, 1e-4);  // a fixating eye does not keep a saccade's speed
        c = predict_covariance(c, dt, kPsd[j] * kRadiansPerDegree * kRadiansPerDegree);
        p = p + dt * v;
        const Gain k = kalman_gain(c, noise_rad2);
        const Tangent innovation = measured - p;
        log_likelihood[j] = -std::log(k.innovation_variance) -
                            0.5 * (innovation.u * innovation.u + innovation.v * innovation.v) / k.innovation_variance;
        position_[j] = p + k.p * innovation;
        velocity_[j] = v + k.v * innovation;
        const double speed = length(velocity_[j]);
        if (speed > 30) velocity_[j] = (30 / speed) * velocity_[j];
        c_[j] = update_covariance(c, k, noise_rad2);
    }
    // Probabilities relative to the best model, so that none underflows when all are unlikely.
    const double best = *std::max_element(log_likelihood.begin(), log_likelihood.end());
    double sum = 0;
    for (std::size_t j = 0; j < kModels; ++j) {
        mu_[j] = std::max(prior[j] * std::exp(log_likelihood[j] - best), kLeastProbability);
        sum += mu_[j];
    }
    Tangent mean;
    for (std::size_t j = 0; j < kModels; ++j) {
        mu_[j] /= sum;
        mean = mean + mu_[j] * position_[j];
    }
    // The shared plane moves on to the mean.
    const Direction<HeadFrame> next = exp_map(at_, mean);
    for (std::size_t j = 0; j < kModels; ++j) {
        position_[j] = transport(at_, next, position_[j] - mean);
        velocity_[j] = transport(at_, next, velocity_[j]);
    }
    at_ = next;
}

Tangent Imm::displacement(double h_s) const noexcept {
    Tangent d;
    for (std::size_t j = 0; j < kModels; ++j) {
        // A saccade's speed does not last: it has died away within its typical duration.
        const double reach = j == 2 ? 0.02 * -std::expm1(-h_s / 0.02) : h_s;
        d = d + mu_[j] * (position_[j] + reach * velocity_[j]);
    }
    return d;
}

}  // namespace fovea::pipeline
