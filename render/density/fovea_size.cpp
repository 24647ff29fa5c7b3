#include "render/density/fovea_size.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::density {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;

}  // namespace

double fovea_radius_rad(const FoveaSizeSettings& s, double radius95_rad) noexcept {
    if (!(radius95_rad >= 0)) return s.max_radius_rad;  // unknown: as large as allowed
    return std::clamp(s.reach_rad * std::pow(radius95_rad * kDegreesPerRadian, s.power), s.min_radius_rad, std::max(s.min_radius_rad, s.max_radius_rad));
}

FocalPoint sized_focal_point(const FoveaSizeSettings& s, double x, double y, double radius95_rad, double scale_x,
                             double scale_y) noexcept {
    const bool known = std::isfinite(x) && std::isfinite(y) && std::isfinite(scale_x) && std::isfinite(scale_y) &&
                       scale_x > 0 && scale_y > 0 && s.gain > 0 && std::isfinite(s.gain);
    if (!known) return {};
    const double radius = fovea_radius_rad(s, radius95_rad);
    // A circle of visual angle: the same number of radians reaches scale_y / scale_x as far in NDC along y.
    const double gain_y = s.gain * scale_x / scale_y;
    const double reach = s.gain * radius * scale_x;
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(s.gain), static_cast<float>(gain_y),
            static_cast<float>(reach * reach - 1)};
}

}  // namespace fovea::density
