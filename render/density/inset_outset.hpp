// The arithmetic of Arm's inset and outset views: fields of view, and how many pixels the circular masks leave.
//
// Source: "Foveated Rendering: Current and Future Technologies for Virtual Reality", Arm, November 2017, sections 3.2
// and 3.5 (tables 2 to 4).
// Threads: pure functions.
#pragma once

#include <cstdint>

namespace fovea::density {

// Field of view of an inset whose image has `ratio` of the full image's pixels per axis, at the same pixels per tangent:
// 2 atan(tan(full / 2) ratio). Radians; 90 degrees and 0.35 give 38.580 degrees. full in (0, pi), ratio in (0, 1].
[[nodiscard]] double inset_fov_rad(double full_fov_rad, double ratio) noexcept;

// Pixels of both eyes' views, each of view_px squared, by the paper's formulas. The paper counts with pi = 3.14.
struct MaskedPixels {
    double inset = 0, outset = 0;
    [[nodiscard]] double total() const noexcept { return inset + outset; }
};
// inset_px: diameter of the circle that is left of each inset; hole_px: of the hole in each outset.
[[nodiscard]] MaskedPixels masked_pixels(double view_px, double inset_px, double hole_px, double pi) noexcept;

// Pixels of a width x height image whose centres lie inside a circle (pixels; the centre may lie outside the image).
[[nodiscard]] std::uint64_t pixels_in_circle(int width_px, int height_px, double x, double y, double radius_px) noexcept;

}  // namespace fovea::density
