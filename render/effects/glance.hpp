// A small picture of what a scene shows, drawn by the processor: for each pixel the surface, not its colour.
//
// Source: edge functions over the pixel centres, perspective-correct (Blinn's 1/w), clipped at the near plane.
// Cost: about 40 ns a triangle and 10 ns a pixel; on load only. Threads: any.
#pragma once

#include <cstdint>
#include <vector>

#include "render/scene/scene.hpp"

namespace fovea::effects {

// What everything drawn with one material at one node has in common.
struct Surface {
    float roughness = 1;
    int image = -1;           // of the model
    int node = -1;            // of the model; -1: of the fixed part of the scene
    int material = -1, variant = 0;   // of scene::Material, where it is procedural
    bool moving = false, blended = false, cut_out = false;
};

struct Glimpse {
    float w = 0;                          // distance along the view, metres; 0: nothing there
    std::uint32_t triangle = 0;           // its index in triangle_px
    std::uint32_t surface = 0;            // its index in surfaces
    std::array<float, 3> world{}, normal{};
    std::array<float, 2> uv{};
};

struct Glance {
    int width = 0, height = 0;
    std::vector<Glimpse> pixels;          // bottom row first
    std::vector<bool> blended;            // something that is seen through lies there, nearer than what is in `pixels`
    std::vector<float> triangle_px;       // area of each triangle drawn, in these pixels
    std::vector<Surface> surfaces;
    [[nodiscard]] const Glimpse& at(int x, int y) const noexcept { return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
};

[[nodiscard]] scene::Mat4 clip_from_world(const scene::Source& source, const scene::SceneView& view, double time_s) noexcept;
[[nodiscard]] Glance glance(const scene::Source& source, const scene::SceneView& view, double time_s, int width_px, int height_px);

}  // namespace fovea::effects
