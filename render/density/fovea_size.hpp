// From "the eye is this close to the point with that probability" to the parameters of a focal point.
//
// The region of full density has half-width sqrt(1 + area) / gain (NDC). Given the radius that it must have and the
// gain that shapes the fall-off outside it, area = (gain * radius)^2 - 1.
// The radius grows with the 95 % radius of the prediction to the power of 0.4, not in proportion: area grows with the
// square of the radius, and the uncertain moments are those in which even a large region often misses.
// Source: the density equation (density.hpp); `fovea tradeoff fovea` (docs/render.md): with the same floor and at equal
// misses the region has 4 to 29 % less area than one of floor plus 95 % radius. The floor: the fovea's rod-free zone plus
// the parafovea spans about 5 degrees around the gaze.
// Threads: pure functions. noexcept.
#pragma once

#include "render/density/density.hpp"

namespace fovea::density {

struct FoveaSizeSettings {
    double min_radius_rad = 0.070;    // full resolution around a perfectly known gaze, 4 degrees
    double reach_rad = 0.087;         // radius for a prediction whose 95 % radius is one degree: 5 degrees, 2 % misses at 50 ms
    double power = 0.4;               // of the 95 % radius in degrees; 0 ignores it, 1 is in proportion
    double max_radius_rad = 0.44;     // 25 degrees: a gaze that is less certain than this is not known
    double gain = 4.0;                // fall-off outside, 1/NDC along x at the middle of the view
};

// x_ndc, y_ndc: the focal point; ndc_per_rad_*: local scale there, > 0; radius95_rad >= 0. Values that cannot be (NaN,
// scale <= 0) give full density everywhere, so that an unknown gaze is never shown as a small sharp spot.
[[nodiscard]] FocalPoint sized_focal_point(const FoveaSizeSettings& settings, double x_ndc, double y_ndc,
                                           double radius95_rad, double ndc_per_rad_x, double ndc_per_rad_y) noexcept;

// The radius, radians, that sized_focal_point gives the region of full density.
[[nodiscard]] double fovea_radius_rad(const FoveaSizeSettings& settings, double radius95_rad) noexcept;

}  // namespace fovea::density
