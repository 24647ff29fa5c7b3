// Small pictures of what procedural shaders paint: a square of a material's own uv each, without light.
//
// Output: albedo as a picture encodes it (its root), 8 bits, RGBA, v up: the first row is the least v.
// Cost: a program per family of materials asked for, and a square per tile; on load only. Nothing of it stays on the GPU.
// Threads: the context's; changes its bindings. Errors: what the driver refuses.
#pragma once

#include <span>
#include <vector>

#include "protocol/error.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/model.hpp"

namespace fovea::scene {

struct MaterialTile {
    std::uint8_t material = 0, variant = 0;   // not the sky's, nor a ball's: they have no uv
    std::array<float, 3> normal{0, 1, 0};     // some materials are printed on top only
    std::array<float, 2> middle{};            // uv
    float edge = 1;                           // of the square, in uv; > 0
};

[[nodiscard]] constexpr bool has_tiles(std::uint8_t material) noexcept { return material != kSky && material != kBall; }
// edge_px: 1 to 512, of each picture.
[[nodiscard]] Result<std::vector<Image>> draw_tiles(std::span<const MaterialTile> tiles, int edge_px);

}  // namespace fovea::scene
