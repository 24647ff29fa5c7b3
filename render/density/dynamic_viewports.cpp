#include "render/density/dynamic_viewports.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/error.hpp"

namespace fovea::density {

void layout_viewports(std::span<const ViewportSize> sizes, std::span<Viewport> out) noexcept {
    FOVEA_REQUIRE(out.size() >= sizes.size());
    int x = 0, y = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        out[i] = {x, y, sizes[i].width, sizes[i].height};
        x += sizes[i].width;
        if (i % 2 == 1) {
            x = 0;
            y += sizes[i].height;
        }
    }
}

FieldOfView focus_tangents(const FieldOfView& full, NdcPoint gaze, double extent) noexcept {
    const double e = std::isnan(extent) ? 1.0 : std::clamp(extent, 1e-3, 1.0);
    const auto middle = [&](double ndc) { return std::isnan(ndc) ? 0.0 : std::clamp(ndc, e - 1, 1 - e); };
    const double x = middle(gaze.x), y = middle(gaze.y);
    const auto tangent = [](double low, double high, double ndc) { return low + (high - low) * (ndc + 1) / 2; };
    return {tangent(full.tan_left, full.tan_right, x - e), tangent(full.tan_left, full.tan_right, x + e),
            tangent(full.tan_down, full.tan_up, y + e), tangent(full.tan_down, full.tan_up, y - e)};
}

std::array<float, 4> crop_between(const FieldOfView& full, const FieldOfView& part) noexcept {
    const double sx = (full.tan_right - full.tan_left) / (part.tan_right - part.tan_left);
    const double sy = (full.tan_up - full.tan_down) / (part.tan_up - part.tan_down);
    const double ox = (full.tan_right + full.tan_left - part.tan_right - part.tan_left) / (part.tan_right - part.tan_left);
    const double oy = (full.tan_up + full.tan_down - part.tan_up - part.tan_down) / (part.tan_up - part.tan_down);
    return {static_cast<float>(sx), static_cast<float>(sy), static_cast<float>(ox), static_cast<float>(oy)};
}

}  // namespace fovea::density
