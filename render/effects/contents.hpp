// What a scene contains, measured from what it shows: the shares in Needs, on load, without GL.
//
// Source: each measure is defined beside its code in contents.cpp; measured at kGlance_px and scaled to the real size.
// Cost: a glance per moment looked at: 10 ms, 0.2 s for two million triangles. Threads: any.
#pragma once

#include <span>

#include "render/effects/effects.hpp"
#include "render/effects/glance.hpp"
#include "render/scene/material_tiles.hpp"

namespace fovea::effects {

inline constexpr int kGlance_px = 512;
inline constexpr double kStroke_px = 4;   // a stroke that is narrower than a texel of the level 1/4 is lost there

struct Look {
    int width_px = 1024, height_px = 1024;    // of the views to be drawn
    int views = 2;
    double frame_s = 1.0 / 90;                // between frames: motion is per frame
    std::array<double, 2> times_s{0.6, 6.9};  // moments looked at; the shares are their means
};

// A place of the picture that shows a procedural material; print.hpp draws it.
struct Spot {
    scene::MaterialTile tile;                  // where and what; its edge is not set
    double fine_uv = 1, coarse_uv = 1;         // uv that one pixel of the real picture passes, where it is least and most
    double share = 0;                          // of the picture that it stands for
};

// All of Needs but the times and the lens; print only where textures have it. spots: gets the others, on a grid.
[[nodiscard]] Needs look_at(const scene::Source& source, const Look& look, std::vector<Spot>* spots = nullptr);

// Print: a picture of two tones, with the finer one in between 1 and 45 % of it. The mean run of that tone along a row,
// texels; 0: no print. hard_edges: and none where more than half of the steps between the tones are softer than a texel.
[[nodiscard]] double stroke_texels(const scene::Image& image, bool hard_edges = false);

}  // namespace fovea::effects
