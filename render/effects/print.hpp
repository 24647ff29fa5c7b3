// The print that procedural shaders make, which no texture tells of: measured in the materials' own uv, without light.
//
// Source: at each spot a square of the material is drawn at half a pixel of the picture a texel (scene::draw_tiles), and
// measured as a texture is (stroke_texels), along rows and columns both: a joint between tiles is long, a letter is not. And
// its edges must be hard: 93 % of the steps are, in circuit's print, and 0 to 6 % of those of marble's veins (medians).
// Cost: some hundred tiles of 64 x 64; on load only, and nothing of it stays on the GPU. Threads: the context's.
// Errors: what the driver refuses.
#pragma once

#include "protocol/error.hpp"
#include "render/effects/contents.hpp"

namespace fovea::effects {

// Width of the strokes of what this shows, texels, if that is print; 0: no print.
[[nodiscard]] double print_texels(const scene::Image& tile);

// spots: of look_at(), which this completes: adds their print to needs.text_share. No GL call without spots.
[[nodiscard]] Result<void> add_print(std::span<const Spot> spots, Needs& needs);

}  // namespace fovea::effects
