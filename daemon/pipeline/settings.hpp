// What the pipeline can be told: one struct per stage, every member with unit, legal range and default.
// The same ranges stand in configs/fovead.toml; daemon/service/config checks them and names file and line.
#pragma once

#include <string>

#include "protocol/loss_policy.hpp"

namespace fovea::pipeline {

// Source: Casiez et al., "1 Euro Filter", CHI 2012. Defaults measured on recordings in degrees (docs/pipeline.md).
struct OneEuroSettings {
    double min_cutoff_hz = 5.0;     // (0, 1000]
    double beta_per_deg = 3.0;      // [0, 1000]: cutoff rises by this many Hz per deg/s
    double derivative_cutoff_hz = 5.0;  // (0, 1000]
};

// Blink gate: samples in the guards around a blink are not used. Source: gaze_science, 1.2.
struct BlinkSettings {
    double openness_closed = 0.3;   // [0, 1]: below it the eye counts as closed
    double guard_before_ms = 40;    // [0, 500]: motion this recent before a blink is not extrapolated
    double guard_after_ms = 60;     // [0, 500]: valid samples this soon after a blink are not used
    double min_confidence = 0.6;    // [0, 1]: a sample below it counts as invalid
};

struct PredictorSettings {
    std::string name = "damped_velocity";   // one of predictor_names()
    double damping = 0.25;                  // [0, 1]: share of the velocity that is extrapolated
    double time_constant_ms = 60;           // (0, 1000]: after which the extrapolated velocity has died away
};

struct PipelineSettings {
    std::string filter = "one_euro";        // one of filter_names()
    OneEuroSettings one_euro;
    BlinkSettings blink;
    PredictorSettings predictor;
    LossPolicy loss;                        // hold, ease, recover; evaluated by clients, published with the region
    bool per_eye = false;                   // also model left and right, where the tracker gives them
};

}  // namespace fovea::pipeline
