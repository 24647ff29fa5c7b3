#include "render/density/density.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fovea::density {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kInf = std::numeric_limits<double>::infinity();

// (distance * gain)^2, where a distance or gain of exactly zero wins over an infinite partner.
double square_term(double distance, double gain) noexcept {
    if (distance == 0 || gain == 0) return std::isnan(distance) || std::isnan(gain) ? distance + gain : 0.0;
    const double t = distance * gain;
    return t * t;
}

double density_of(double denominator) noexcept {
    if (!(denominator > 1)) return 1;  // NaN as well: full density
    return std::max(1 / denominator, kSmallestDensity);
}

}  // namespace

double clamp_min_density(double d) noexcept {
    if (std::isnan(d)) return 1;
    return std::clamp(d, 0.0, 1.0);
}

double pixel_density(std::span<const FocalPoint> points, double x, double y, double min_density) noexcept {
    double density = std::max(clamp_min_density(min_density), kSmallestDensity);
    for (const FocalPoint& p : points) {
        const double denominator = square_term(static_cast<double>(p.x_ndc) - x, p.gain_x) +
                                   square_term(static_cast<double>(p.y_ndc) - y, p.gain_y) -
                                   static_cast<double>(p.fovea_area);
        density = std::max(density, density_of(denominator));
    }
    return density;
}

double nearest_term(double lo, double hi, double focal, double gain) noexcept {
    if (std::isnan(focal) || std::isnan(gain)) return std::numeric_limits<double>::quiet_NaN();
    double distance = focal < lo ? lo - focal : focal > hi ? focal - hi : 0.0;
    // The edges and the difference are each rounded once; take that off the distance.
    if (!std::isinf(distance)) distance = std::max(0.0, distance - 4 * kEps * (2 + std::abs(focal)));
    return square_term(distance, gain);
}

double denominator_bound(double tx, double ty, double area) noexcept {
    const double sum = tx + ty - area;
    if (std::isnan(sum)) return -kInf;
    if (std::isinf(sum)) return sum;
    return sum - 8 * kEps * (tx + ty + std::abs(area));  // four roundings, each of at most eps of a summand
}

double tile_density_bound(std::span<const FocalPoint> points, const NdcRect& tile, double min_density) noexcept {
    double density = std::max(clamp_min_density(min_density), kSmallestDensity);
    for (const FocalPoint& p : points) {
        const double tx = nearest_term(tile.x0, tile.x1, p.x_ndc, p.gain_x);
        const double ty = nearest_term(tile.y0, tile.y1, p.y_ndc, p.gain_y);
        density = std::max(density, density_of(denominator_bound(tx, ty, p.fovea_area)) * (1 + 2 * kEps));
    }
    return std::min(density, 1.0);
}

double full_radius_ndc(const FocalPoint& p, int axis) noexcept {
    const double gain = std::abs(static_cast<double>(axis == 0 ? p.gain_x : p.gain_y));
    const double square = 1 + static_cast<double>(p.fovea_area);
    if (std::isnan(gain) || std::isnan(square) || gain == 0) return square < 0 ? 0 : kInf;
    if (square <= 0) return 0;
    if (std::isinf(square)) return kInf;
    return std::sqrt(square) / gain;
}

}  // namespace fovea::density
