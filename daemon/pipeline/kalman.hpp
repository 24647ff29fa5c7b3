// Constant-velocity Kalman filter on the sphere, and a bank of three of them (interacting multiple models).
//
// The state is a direction and a velocity in its tangent plane; both axes share one 2x2 covariance because noise and
// motion are taken as the same in every direction. The covariance update is in Joseph form, which stays symmetric and
// positive whatever the gain's rounding. The measurement noise is the caller's, estimated online (NoiseEstimate).
//
// Source: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001: 5.2 (Joseph
// form), 6.2.2 (white-noise acceleration), 11.6.6 (IMM). Numerics: docs/numerics.md.
// Units: radians, seconds. Cost: one filter about 100 ns, the bank 350 ns. Threads: one at a time; noexcept, no
// allocation.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/sphere.hpp"

namespace fovea::pipeline {

// Symmetric by construction: three numbers.
struct Covariance {
    double pp = 0, pv = 0, vv = 0;  // rad^2, rad^2/s, rad^2/s^2
    // No eigenvalue below zero but by rounding.
    [[nodiscard]] bool positive_semidefinite() const noexcept { return pp >= 0 && vv >= 0 && pv * pv <= pp * vv * (1 + 1e-9) + 1e-300; }
};

// Time update over dt seconds with acceleration PSD q (rad^2/s^3), then a measurement of the position with variance r.
// Both keep every value finite and within fixed bounds, whatever dt, q and r are.
[[nodiscard]] Covariance predict_covariance(Covariance c, double dt, double q) noexcept;
struct Gain {
    double p = 0, v = 0;         // of the innovation
    double innovation_variance = 0;
};
[[nodiscard]] Gain kalman_gain(const Covariance& c, double r) noexcept;
[[nodiscard]] Covariance update_covariance(const Covariance& c, const Gain& gain, double r) noexcept;

// The tracker's white noise, per axis, from how far each sample lies off the line through its neighbours.
class NoiseEstimate {
public:
    // The newest three samples, newest first, and the times between them.
    void update(Direction<HeadFrame> a, Direction<HeadFrame> b, Direction<HeadFrame> c, double dt_ab_s, double dt_bc_s) noexcept;
    [[nodiscard]] double variance_rad2() const noexcept { return sigma_rad_ * sigma_rad_; }
    void reset() noexcept { sigma_rad_ = kStart_rad; }

private:
    static constexpr double kStart_rad = 0.002;  // 0.11 degrees: the middle of the trackers measured
    double sigma_rad_ = kStart_rad;
};

class KalmanCv {
public:
    explicit KalmanCv(double acceleration_psd_deg2_s3) noexcept;

    Direction<HeadFrame> update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, double noise_rad2) noexcept;
    void reset() noexcept { any_ = false; }
    [[nodiscard]] Direction<HeadFrame> direction() const noexcept { return at_; }
    [[nodiscard]] Tangent velocity_rad_s() const noexcept { return velocity_; }  // in the tangent plane of direction()
    [[nodiscard]] const Covariance& covariance() const noexcept { return c_; }

private:
    double q_;
    bool any_ = false;
    std::int64_t last_ns_ = 0;
    Direction<HeadFrame> at_;
    Tangent velocity_;
    Covariance c_;
};

class Imm {
public:
    static constexpr std::size_t kModels = 3;  // fixation, pursuit, saccade

    Imm() noexcept { reset(); }
    void update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, double noise_rad2) noexcept;
    void reset() noexcept;
    [[nodiscard]] Direction<HeadFrame> direction() const noexcept { return at_; }
    // Displacement from direction() after h seconds: each model's, weighted by its probability.
    [[nodiscard]] Tangent displacement(double h_s) const noexcept;
    [[nodiscard]] const std::array<double, kModels>& probabilities() const noexcept { return mu_; }  // sum to 1
    [[nodiscard]] const Covariance& covariance(std::size_t model) const noexcept { return c_[model]; }

private:
    bool any_ = false;
    std::int64_t last_ns_ = 0;
    Direction<HeadFrame> at_;                      // origin of the plane that all models share
    std::array<Tangent, kModels> position_{}, velocity_{};
    std::array<Covariance, kModels> c_{};
    std::array<double, kModels> mu_{};
};

}  // namespace fovea::pipeline
