// From a gaze direction in the head to the focal point of one view.
//
// Input/Output: directions are unit vectors; the result is finite and within [-1, 1] for any direction and every view
// that view_of() accepted.
// Cost: about 10 ns per view; noexcept, no allocation.
// Threads: pure functions.
#pragma once

#include <optional>

#include "fovea/fovea.h"
#include "protocol/gaze_sample.hpp"
#include "protocol/sphere.hpp"

namespace fovea::client {

struct View {
    Eye eye = Eye::combined;
    FieldOfView fov;
    Rotation<HeadFrame, ViewFrame> head_from_view;   // unit length to rounding
    double ndc_per_tan_x = 1, ndc_per_tan_y = 1;     // 2 / width, 2 / height of the field of view
};

// Nothing for an unknown eye, a field of view that is empty, mirrored or not finite, or a quaternion that is not finite
// or whose length is not within [0.5, 2]; others are normalised. Never looks at struct_size.
[[nodiscard]] std::optional<View> view_of(const fovea_view& view) noexcept;

struct Focal {
    NdcPoint point;                   // in [-1, 1]
    float ndc_per_rad_x = 1, ndc_per_rad_y = 1;   // > 0, at `point`
    Direction<ViewFrame> gaze_dir_view;
    bool outside = false;             // `point` is the point of the view's edge that is nearest in angle (behind the
                                      // view: nearest to the gaze turned back to 90 degrees)
};
[[nodiscard]] Focal focal_of(const View& view, Direction<HeadFrame> gaze) noexcept;

}  // namespace fovea::client
