// What a scene contains, measured from what it shows: the shares in Needs, on load, without GL.
//
// Source: each measure is defined beside its code in contents.cpp; measured at kGlance_px and scaled to the real size.
// Cost: a glance per moment looked at: 10 ms, 0.2 s for two million triangles. Threads: any.
#pragma once

#include <span>

#include "render/effects/effects.hpp"
#include "render/effects/glance.hpp"

namespace fovea::effects {

inline constexpr int kGlance_px = 512;

struct Look {
    int width_px = 1024, height_px = 1024;    // of the views to be drawn
    int views = 2;
    double frame_s = 1.0 / 90;                // between frames: motion is per frame
    std::array<double, 2> times_s{0.6, 6.9};  // moments looked at; the shares are their means
};

// All of Needs but the times and the lens.
[[nodiscard]] Needs look_at(const scene::Source& source, const Look& look);

// Print: a picture of two tones, with the finer one in between 1 and 45 % of it. The mean run of that tone along a row,
// texels; 0: no print.
[[nodiscard]] double stroke_texels(const scene::Image& image);

}  // namespace fovea::effects
