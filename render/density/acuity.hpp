// Acuity mode: gain and area of a focal point from what the eye can resolve, how fine the display is, and how sure we are
// of the gaze.
//
// Source: minimum angle of resolution MAR(e) = slope * e + mar0 (Guenter et al., "Foveated 3D Graphics", 2012: slope
// 0.022 conservative, 0.0275 aggressive; mar0 = 1/48 degree). A place at eccentricity e needs min(1, p / MAR(e - margin))
// of the display's pixels along each axis, p being a pixel's angle; the density equation is fitted from above.
// Output: a focal point whose density is nowhere in the view below that need, or else below coarsest_density. This is the perceptual limit, not a
// gentle default: vendors ship far smaller gains.
// Cost: measured by `fovea_bench --benchmark_filter=Acuity`. Threads: pure function. noexcept, no allocation.
#pragma once

#include "protocol/frames.hpp"
#include "render/density/plan.hpp"

namespace fovea::density {

struct AcuitySettings {
    double mar_slope = 0.022;                      // radians per radian of eccentricity, 0.001 to 1
    double mar0_rad = 1.0 / 48 * 0.017453292519943295;   // at the gaze, > 0
    double uncertainty_gain = 1.0;                 // margin = this times the 95 % radius of the gaze
    Reading reading = Reading::linear;             // how the plan will read the density
    double coarsest_density = 0.25;                // of the plan's coarsest level, 0 to 1: it delivers no less anyway, so
                                                   // the fit need not hold below it. 1/4 per axis: area 1/16
};

// The share of the pixels along one axis that eccentricity_rad needs, in (0, 1].
[[nodiscard]] double needed_scale(const AcuitySettings& settings, double eccentricity_rad, double margin_rad,
                                  double pixel_rad) noexcept;

// view: valid(); width_px, height_px > 0: of its image; gaze: in NDC of the view. A radius or gaze that is NaN, or a view
// that is not valid, gives full density.
[[nodiscard]] FocalPoint acuity_focal_point(const AcuitySettings& settings, const FieldOfView& view, int width_px,
                                            int height_px, NdcPoint gaze, double radius95_rad) noexcept;

}  // namespace fovea::density
