// Fixation, smooth pursuit or saccade: by speed, against a threshold that follows the tracker's own noise. Causal.
//
// The speed is the slope of the last few raw samples, less the slow drift of the gaze, so that pursuit does not look
// like a saccade. Its typical size while nothing happens is the noise; a saccade must stand out from it.
//
// Lag: the onset is seen one sample to about 5 ms late (docs/pipeline.md). Cost: about 150 ns.
// Threads: one at a time; noexcept, no allocation.
#pragma once

#include <cstdint>

#include "daemon/pipeline/history.hpp"
#include "daemon/pipeline/settings.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::pipeline {

// What the eye does, as of the newest sample. Velocities in the tangent plane of the newest raw gaze.
struct Classified {
    GazeEvent event = GazeEvent::fixation;  // fixation, pursuit or saccade
    Tangent fast_rad_s;                     // over about 6 ms
    Tangent slow_rad_s;                     // of the pursuit or drift, over pursuit_window; 0 when there is none
    double speed_deg_s = 0;                 // |fast - slow|, what the thresholds see
    double noise_deg_s = 0;                 // typical speed while nothing happens
    double threshold_deg_s = 0;             // above which a saccade begins now
    // The saccade in flight, or the last one:
    std::int64_t onset_ns = 0;
    Direction<HeadFrame> start_dir_head;
    double peak_deg_s = 0;
    bool lid = false;                       // the "saccade" is the lid closing: up or down, faster than any eye
    bool any_saccade = false;               // false: onset and peak mean nothing yet
    std::int64_t end_ns = 0;                // of the last one that is over
};

class Classifier {
public:
    explicit Classifier(const ClassifierSettings& settings) noexcept;

    // `raw` already holds the newest sample.
    const Classified& update(const History& raw) noexcept;
    [[nodiscard]] const Classified& now() const noexcept { return now_; }
    // After a gap: the motion is forgotten, the tracker's noise is not.
    [[gnu::noinline]] void forget_motion() noexcept;
    // For a new source.
    void reset() noexcept { *this = Classifier{ClassifierSettings{settings_}}; }

private:
    void track_noise(double speed_deg_s, double dt_s) noexcept;
    void update_slow(std::int64_t t_ns, const Plane& gaze) noexcept;
    [[gnu::noinline]] void begin_saccade(const History& raw, double speed_deg_s, double span_s) noexcept;

    ClassifierSettings settings_;
    std::int64_t pursuit_window_ns_;
    Classified now_;
    Trail trail_;                   // of the gaze outside saccades
    double noise_median_deg_s_ = 0; // running median of |fast - slow| outside saccades
    double noise_age_s_ = 0;
    std::int64_t last_ns_ = 0;
    std::int64_t above_since_ns_ = 0;
    int above_ = 0;                 // consecutive samples above the onset threshold
    bool armed_ = true;             // the speed has come down since the last saccade
    bool any_ = false;
};

}  // namespace fovea::pipeline
