#include "render/effects/print.hpp"

#include <algorithm>

namespace fovea::effects {
namespace {

constexpr int kTile_px = 64;
constexpr double kFiner = 2;          // texels a pixel of the picture

scene::Image turned(const scene::Image& image) {
    scene::Image out{image.height, image.width, std::vector<std::uint8_t>(image.rgba.size())};
    const auto w = static_cast<std::size_t>(image.width), h = static_cast<std::size_t>(image.height);
    for (std::size_t y = 0; y < h; ++y)
        for (std::size_t x = 0; x < w; ++x) std::copy_n(&image.rgba[(y * w + x) * 4], 4, &out.rgba[(x * h + y) * 4]);
    return out;
}

}  // namespace

double print_texels(const scene::Image& tile) {
    const double along = stroke_texels(tile, true);
    const double across = along > 0 ? stroke_texels(turned(tile), true) : 0;
    return across > 0 ? std::max(along, across) : 0;
}

Result<void> add_print(std::span<const Spot> spots, Needs& needs) {
    std::vector<scene::MaterialTile> tiles;
    for (const Spot& s : spots) {
        tiles.push_back(s.tile);
        tiles.back().edge = static_cast<float>(s.fine_uv / kFiner) * kTile_px;
    }
    const auto images = scene::draw_tiles(tiles, kTile_px);
    if (!images) return std::unexpected(images.error());
    for (std::size_t i = 0; i < spots.size(); ++i) {
        const double stroke_px = print_texels((*images)[i]) / kFiner * spots[i].fine_uv / spots[i].coarse_uv;
        if (stroke_px > 0 && stroke_px < kStroke_px) needs.text_share += spots[i].share;
    }
    return {};
}

}  // namespace fovea::effects
