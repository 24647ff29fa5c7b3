#include "render/density/shading_rate.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/error.hpp"

namespace fovea::density {
namespace {

constexpr double kFar_px = 16'000;   // squares of sums of two stay below 2^31

std::int32_t whole(double px) noexcept { return static_cast<std::int32_t>(std::lround(std::clamp(px, -kFar_px, kFar_px))); }

}  // namespace

RateInput rate_input(const RateSettings& s, int width, int height, NdcPoint gaze) noexcept {
    RateInput in;
    in.flags = s.flags;
    if (std::isnan(gaze.x) || std::isnan(gaze.y)) in.flags &= ~static_cast<std::uint32_t>(kRateGaze);
    in.width = width;
    in.height = height;
    in.tile = std::clamp(s.tile_px, 4, 64);
    const double w = width, h = height;
    if ((in.flags & kRateGaze) != 0) {
        in.gaze_x = whole((gaze.x + 1) / 2 * w);
        in.gaze_y = whole((gaze.y + 1) / 2 * h);
    }
    in.inner = std::max(0, whole(s.inner_radius * w));
    in.outer = std::max(in.inner, whole(s.outer_radius * w));
    in.focus_x0 = whole(w * (1 - s.focus_extent) / 2);
    in.focus_x1 = whole(w * (1 + s.focus_extent) / 2);
    in.focus_y0 = whole(h * (1 - s.focus_extent) / 2);
    in.focus_y1 = whole(h * (1 + s.focus_extent) / 2);
    in.lens_x = std::max(1, whole(s.lens_radius * w / 2));
    in.lens_y = std::max(1, whole(s.lens_radius * h / 2));
    return in;
}

// The shader in foveation/rate_map.cpp says the same, line by line.
Rate tile_rate(const RateInput& in, int column, int row) noexcept {
    const std::int32_t x0 = column * in.tile, y0 = row * in.tile;
    const std::int32_t x1 = std::min(x0 + in.tile, in.width), y1 = std::min(y0 + in.tile, in.height);
    if ((in.flags & kRateOcclusion) != 0) {
        // Nearest point of the tile to the lens' middle, in 1/256 of the lens' semi-axes, rounded toward the middle.
        const std::int32_t cx = in.width / 2, cy = in.height / 2;
        const std::int32_t dx = std::max({x0 - cx, cx - x1, 0}), dy = std::max({y0 - cy, cy - y1, 0});
        const std::int32_t u = std::min(dx * 256 / in.lens_x, 20000), v = std::min(dy * 256 / in.lens_y, 20000);
        if (u * u + v * v > 256 * 256) return Rate::r4x4;
    }
    int coarse = 0;   // 0: 1x1, 1: 2x2, 2: 4x4
    if ((in.flags & kRateStereo) != 0 && (x1 <= in.focus_x0 || x0 >= in.focus_x1 || y1 <= in.focus_y0 || y0 >= in.focus_y1)) coarse = 1;
    if ((in.flags & kRateGaze) != 0) {
        const std::int32_t dx = std::max({x0 - in.gaze_x, in.gaze_x - x1, 0}), dy = std::max({y0 - in.gaze_y, in.gaze_y - y1, 0});
        const std::uint32_t d2 = static_cast<std::uint32_t>(dx) * static_cast<std::uint32_t>(dx) + static_cast<std::uint32_t>(dy) * static_cast<std::uint32_t>(dy);
        const auto inner = static_cast<std::uint32_t>(in.inner), outer = static_cast<std::uint32_t>(in.outer);
        coarse = std::max(coarse, d2 <= inner * inner ? 0 : d2 <= outer * outer ? 1 : 2);
    }
    return coarse == 0 ? Rate::r1x1 : coarse == 1 ? Rate::r2x2 : Rate::r4x4;
}

void fill_rate_map(const RateInput& in, std::span<std::uint8_t> rates) noexcept {
    const int columns = in.columns(), rows = in.rows();
    FOVEA_REQUIRE(rates.size() >= static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    std::size_t i = 0;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) rates[i++] = static_cast<std::uint8_t>(tile_rate(in, c, r));
}

TileViewport to_tiles(int x, int y, int width, int height, int tile) noexcept { return {x / tile, y / tile, width / tile, height / tile}; }

}  // namespace fovea::density
