// A saccade as a ballistic movement: which amplitudes and onsets fit what has been seen so far, and where they lead.
//
// The posterior over 16 amplitudes and 5 onsets, given the way come at six lags, with the main sequence for the
// durations, a measured displacement profile, and a log-normal prior over amplitudes. One or two samples are enough
// to answer: the prior then decides. The answer is bounded by the largest amplitude.
//
// Source: profile and prior measured on 227 hand-labelled saccades, EyeLink 1000 Hz (docs/pipeline.md).
// Cost: about 2 us, only while a saccade runs. Threads: pure functions; noexcept, no allocation.
#pragma once

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/motion_features.hpp"
#include "daemon/pipeline/self_judge.hpp"

namespace fovea::pipeline {

struct Landing {
    std::array<double, kAhead> advance_deg;  // along MotionFeatures::along, from the present
    double amplitude_deg = 0;                // mean of the posterior; from start to landing
};
[[nodiscard]] Landing ballistic(const MotionFeatures& features, const Classified& now, std::int64_t t_ns) noexcept;

// The share of the way that is done at share u of the duration; 0 before, 1 after.
[[nodiscard]] double saccade_profile(double u) noexcept;

}  // namespace fovea::pipeline
