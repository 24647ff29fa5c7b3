// What the pipeline can be told: one struct per stage, every member with unit, legal range and default.
//
// settings_table.hpp lists the same members as dotted keys with their ranges; the config reader, `fovea` and
// Pipeline::create() all check against that one table. Where a default was measured stands in docs/pipeline.md.
//
// Threads: plain data.
#pragma once

#include <string>

#include "protocol/loss_policy.hpp"

namespace fovea::pipeline {

// Source: Casiez et al., "1 Euro Filter", CHI 2012.
struct OneEuroSettings {
    double min_cutoff_hz = 5.0;         // (0, 1000]: cutoff of a still eye
    double beta_per_deg = 3.0;          // [0, 1000]: cutoff rises by this many Hz per deg/s
    double derivative_cutoff_hz = 5.0;  // (0, 1000]: cutoff of the speed that drives the rise
};

// Constant velocity with white acceleration; the measurement noise is estimated online.
struct KalmanSettings {
    double acceleration_psd = 1000;  // (0, 1e9], deg^2/s^3
};

// Averages while the eye is still, passes the sample itself while it is in a saccade.
struct SaccadeAwareSettings {
    double fixation_ms = 12;  // (0, 1000]: time constant while fixating or pursuing
};

// Blinks and drop-outs. Source: gaze recordings, docs/pipeline.md.
struct BlinkSettings {
    double openness_closed = 0.3;  // [0, 1]: below it the eye counts as closed
    double min_confidence = 0.6;   // [0, 1]: a sample below it counts as invalid
    double min_duration_ms = 20;   // [0, 500]: shorter invalid runs are drop-outs, without guards
    double max_duration_ms = 500;  // [0, 10000]: a longer one is a loss, not a blink
    double guard_before_ms = 40;   // [0, 500]: through a blink, show the gaze of this long before it
    double guard_after_ms = 60;    // [0, 500]: valid samples this soon after a blink are not used
};

struct ClassifierSettings {
    double min_onset_deg_s = 22;     // [1, 1000]: a saccade begins above this speed (or the noise's), low-noise eye
    double noise_factor = 5;         // [1, 50]: ... or above this many times the speed that the noise alone shows
    double end_ratio = 0.95;         // [0.1, 1]: a saccade ends below this share of its onset threshold
    double pursuit_min_deg_s = 4;    // [0.5, 100]: slower than this is a fixation
    double pursuit_window_ms = 120;  // [20, 1000]: over which pursuit must keep its direction
};

struct PredictorSettings {
    std::string name = "auto";             // one of predictor_names()
    double damping = 0.25;                 // [0, 1]: share of the velocity that is extrapolated
    bool head_pose = true;                 // auto: while the head turns, the eyes turn against it
    double time_constant_ms = 60;          // (0, 1000]: after which the extrapolated velocity has died away
};

struct PipelineSettings {
    std::string filter = "saccade_aware";  // one of filter_names()
    OneEuroSettings one_euro;
    KalmanSettings kalman;
    SaccadeAwareSettings saccade_aware;
    BlinkSettings blink;
    ClassifierSettings classifier;
    PredictorSettings predictor;
    LossPolicy loss;       // hold, ease, recover; evaluated by clients, published with the region
    bool per_eye = false;  // also model left and right, where the tracker gives them
};

}  // namespace fovea::pipeline
