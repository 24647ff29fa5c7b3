// Gaze for the pipeline's tests: made by formula, with noise that is the same on every run.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "daemon/pipeline/main_sequence.hpp"
#include "protocol/gaze_sample.hpp"
#include "protocol/sphere.hpp"

namespace fovea::pipeline::test {

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr std::int64_t kMs = 1'000'000;

inline Direction<HeadFrame> at_deg(double x, double y) {
    return from_azimuth_elevation<HeadFrame>({x * kDegree, y * kDegree});
}

inline GazeSample sample_at(std::int64_t t_ns, Direction<HeadFrame> d, bool valid = true) {
    GazeSample s;
    s.exposed = s.received = instant_from_ns(t_ns);
    s.eye(Eye::combined).valid = valid;
    s.eye(Eye::combined).gaze_dir_head = d;
    return s;
}

// The share of a saccade's way that is done at share u of its duration: minimum jerk, which peaks at 1.88 of the mean
// speed, near the main sequence's.
inline double way(double u) {
    u = std::fmin(std::fmax(u, 0), 1);
    return u * u * u * (10 + u * (-15 + u * 6));
}

// A fixation at x0, at `onset_s` a horizontal saccade of `amplitude_deg`, then a fixation there.
struct OneSaccade {
    double x0_deg = 0, amplitude_deg = 10, onset_s = 0.5, noise_deg = 0.03;
    std::mt19937_64 random{7};

    double duration_s() const { return MainSequence::duration_s(std::fabs(amplitude_deg)); }
    double clean_x_deg(double t_s) const { return x0_deg + amplitude_deg * way((t_s - onset_s) / duration_s()); }
    Direction<HeadFrame> gaze(double t_s) {
        std::normal_distribution<double> n(0, noise_deg);
        return at_deg(clean_x_deg(t_s) + n(random), n(random));
    }
};

}  // namespace fovea::pipeline::test
