#include "render/viewer/layout.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::viewer {
namespace { constexpr int kLeast = 16; }

std::array<Place, kEyes> layout(int width_px, int height_px, double aspect) noexcept {
    const double half = width_px / 2.0;
    const double height = std::min(static_cast<double>(height_px), half / aspect);
    const int w = std::max(static_cast<int>(std::lround(height * aspect)), kLeast), h = std::max(static_cast<int>(std::lround(height)), kLeast);
    const int x = (width_px - 2 * w) / 2, y = (height_px - h) / 2;
    return {Place{x, y, w, h}, Place{x + w, y, w, h}};
}

PointedAt pointed_at(const std::array<Place, kEyes>& places, int height_px, double x_px, double y_px) noexcept {
    const std::size_t eye = x_px < places[1].x_px ? 0 : 1;
    const Place& p = places[eye];
    return {eye, std::clamp((x_px - p.x_px) / p.width_px * 2 - 1, -1.0, 1.0), std::clamp((height_px - y_px - p.y_px) / p.height_px * 2 - 1, -1.0, 1.0)};
}

}  // namespace fovea::viewer
