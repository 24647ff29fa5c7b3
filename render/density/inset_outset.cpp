#include "render/density/inset_outset.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::density {

double inset_fov_rad(double full, double ratio) noexcept { return 2 * std::atan(std::tan(full / 2) * ratio); }

MaskedPixels masked_pixels(double view, double inset, double hole, double pi) noexcept {
    return {2 * pi * inset / 2 * inset / 2, 2 * (view * view - pi * hole / 2 * hole / 2)};
}

std::uint64_t pixels_in_circle(int width, int height, double x, double y, double radius) noexcept {
    std::uint64_t count = 0;
    if (!(radius > 0) || !std::isfinite(x) || !std::isfinite(y)) return 0;
    for (int row = 0; row < height; ++row) {
        const double dy = row + 0.5 - y, half2 = radius * radius - dy * dy;
        if (half2 <= 0) continue;
        const double half = std::sqrt(half2);
        // Centres i + 1/2 with |i + 1/2 - x| < half.
        const double low = std::clamp(std::ceil(x - half - 0.5), 0.0, static_cast<double>(width));
        const double high = std::clamp(std::ceil(x + half - 0.5), 0.0, static_cast<double>(width));
        if (high > low) count += static_cast<std::uint64_t>(high - low);
    }
    return count;
}

}  // namespace fovea::density
