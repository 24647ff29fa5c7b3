// Shading-rate maps: one rate per tile of a viewport, from the gaze, the lens and the kind of rendering.
//
// Source: Varjo foveated rendering API (variable-rate shading): flags stereo, gaze and occlusion map, combined bitwise;
// inner and outer radius; tiles beyond the outer radius, and tiles that cannot be seen, get 4x4. The rates are encoded as in
// Direct3D 12 (log2 of the width << 2 | log2 of the height), format R8UI.
// Everything is integer arithmetic on whole pixels: the compute shader (foveation/rate_map.hpp) gives the same bits.
// Threads: pure functions. noexcept, no allocation.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/frames.hpp"

namespace fovea::density {

enum class Rate : std::uint8_t { r1x1 = 0x0, r2x2 = 0x5, r4x4 = 0xa };

enum RateFlags : std::uint32_t {
    kRateStereo = 1,      // one texture per eye instead of context and focus: outside the focus area 2x2 is enough
    kRateGaze = 2,        // full rate only around the gaze
    kRateOcclusion = 4,   // what the lens hides is 4x4
};

struct RateSettings {
    std::uint32_t flags = kRateGaze | kRateOcclusion;   // of RateFlags
    int tile_px = 16;              // 4 to 64
    double inner_radius = 0.10;    // 1x1 within, of the viewport's width; 0 to 4
    double outer_radius = 0.15;    // 2x2 within; at least inner_radius
    double focus_extent = 0.40;    // stereo: edge of the focus area in the middle, of the viewport's edges; 0 to 1
    double lens_radius = 1.0;      // occlusion: what is seen, of half the viewport's edges; > 0
};

// All in whole pixels: what the map is computed from, on the processor and by the shader alike.
struct RateInput {
    std::uint32_t flags = 0;
    std::int32_t width = 0, height = 0, tile = 16;
    std::int32_t gaze_x = 0, gaze_y = 0, inner = 0, outer = 0;
    std::int32_t focus_x0 = 0, focus_y0 = 0, focus_x1 = 0, focus_y1 = 0;
    std::int32_t lens_x = 1, lens_y = 1;   // semi-axes of what is seen
    bool operator==(const RateInput&) const = default;

    [[nodiscard]] int columns() const noexcept { return (width + tile - 1) / tile; }
    [[nodiscard]] int rows() const noexcept { return (height + tile - 1) / tile; }
};

// gaze in NDC of the viewport. A gaze that is no number takes the flag kRateGaze away (no gaze: no circle). Sizes 1 to 16384.
[[nodiscard]] RateInput rate_input(const RateSettings& settings, int width_px, int height_px, NdcPoint gaze) noexcept;

// The rate of one tile: the finest that any of its pixels needs.
[[nodiscard]] Rate tile_rate(const RateInput& input, int column, int row) noexcept;

// rates: columns() * rows(), row 0 at the bottom.
void fill_rate_map(const RateInput& input, std::span<std::uint8_t> rates) noexcept;

// A viewport of the picture in tiles, as varjo's mapToVrsTexture: every edge divided by the tile, rounded down.
struct TileViewport {
    int x = 0, y = 0, width = 0, height = 0;
};
[[nodiscard]] TileViewport to_tiles(int x, int y, int width, int height, int tile_px) noexcept;

}  // namespace fovea::density
