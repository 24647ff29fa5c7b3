// How sharp each place of an image has to be: the density equation of the foveation extensions, and its bound over a tile.
//
// Source: GL_QCOM_framebuffer_foveated (FramebufferFoveationParametersQCOM) and GL_QCOM_texture_foveated (minimum
// density): max_i 1/max((fx_i - x)^2 gx_i^2 + (fy_i - y)^2 gy_i^2 - area_i, 1), raised to the minimum density.
// Input/Output: positions in NDC of one view or layer; densities in (0, 1], 1 is one rendered pixel per pixel.
// Hard values: whatever makes the equation undefined (NaN, inf - inf) asks for full density, as fmax(NaN, 1) does; an
// infinite gain at distance zero counts as distance zero.
// Threads: pure functions. noexcept, no allocation.
#pragma once

#include <span>

namespace fovea::density {

// One focal point of one layer. The defaults are those of the extension: everything at full density.
struct FocalPoint {
    float x_ndc = 0, y_ndc = 0;    // any value; far outside [-1, 1] is legal
    float gain_x = 0, gain_y = 0;  // how fast density falls with distance, 1/NDC; the sign does not matter
    float fovea_area = 0;          // enlarges (> 0) or shrinks (< 0) the region of full density; see full_radius_ndc
    bool operator==(const FocalPoint&) const = default;
};

struct NdcRect {
    double x0 = -1, y0 = -1, x1 = 1, y1 = 1;  // x0 <= x1, y0 <= y1
};

// A density that is never reached from below: what the equation's limit 0 is answered with.
inline constexpr double kSmallestDensity = 1e-300;

// The equation at one point. Without focal points: min_density. min_density outside [0, 1] or NaN is clamped
// (NaN: 1).
[[nodiscard]] double pixel_density(std::span<const FocalPoint> points, double x_ndc, double y_ndc,
                                   double min_density = 0) noexcept;

// A number that no point of the tile exceeds: the equation at the tile's nearest point to each focal point, rounded up
// by the rounding errors of this computation. Never below pixel_density() of any point of the tile.
[[nodiscard]] double tile_density_bound(std::span<const FocalPoint> points, const NdcRect& tile,
                                        double min_density = 0) noexcept;

// Half the width (axis 0: x, 1: y) of the region of full density: sqrt(1 + area) / |gain|, NDC. Infinite for gain 0
// and for values that make the equation undefined; 0 if there is no such region.
[[nodiscard]] double full_radius_ndc(const FocalPoint& point, int axis) noexcept;

// Building blocks of the bound, for the planner, which shares them over rows and columns.
// (distance * gain)^2 from the nearest point of [lo, hi] to `focal`, rounded down; NaN where undefined.
[[nodiscard]] double nearest_term(double lo, double hi, double focal, double gain) noexcept;
// Lower bound of the equation's denominator before the clamp to 1, from two such terms; -infinity where undefined.
[[nodiscard]] double denominator_bound(double term_x, double term_y, double area) noexcept;
[[nodiscard]] double clamp_min_density(double min_density) noexcept;

}  // namespace fovea::density
