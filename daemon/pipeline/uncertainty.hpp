// How sure a prediction is: the radii that hold 68 % and 95 % of the outcomes, per event and horizon.
//
// Source: errors of the hold predictor on the recordings of docs/pipeline.md; during a fixation they include the
// saccade that may start after the last sample.
// Threads: pure function; noexcept.
#pragma once

#include <cstddef>

#include "protocol/gaze_sample.hpp"
#include "protocol/motion_model.hpp"

namespace fovea::pipeline {

struct Radii {
    double radius68_rad = 0, radius95_rad = 0;
};

// `horizon` indexes kHorizons_ns.
[[nodiscard]] Radii uncertainty(GazeEvent event, std::size_t horizon) noexcept;

}  // namespace fovea::pipeline
