// Averages a still eye, passes a moving one: an exponential average whose share of the new sample rises with the speed
// relative to the saccade threshold, and that starts afresh at each landing.
//
// Lag: fixation_ms while the eye is still, none in a saccade. Cost: about 60 ns. Threads: one at a time; noexcept.
#pragma once

#include <cstdint>

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/settings.hpp"

namespace fovea::pipeline {

class SaccadeAware {
public:
    explicit SaccadeAware(const SaccadeAwareSettings& settings) noexcept : tau_s_{settings.fixation_ms * 1e-3} {}

    Direction<HeadFrame> update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, const Classified& now) noexcept;
    void reset() noexcept { any_ = false; }

private:
    double tau_s_;
    bool any_ = false;
    std::int64_t last_ns_ = 0;
    double age_s_ = 0;  // of the average
    Direction<HeadFrame> out_;
};

}  // namespace fovea::pipeline
