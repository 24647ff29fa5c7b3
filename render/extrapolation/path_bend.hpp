// How the paths of points bend, told by one frame's motion alone: a turning camera has a flow that stays as it is while points drift
// through it, so that the motion further along a path is the motion that other points have there now.
//
// Source: for a steady flow x'' = (m . grad) m; with m = x(t) - x(t-1), x(t+h) = x + h m + h (1+h) / 2 x'', exact at h = 0 and -1.
// grad m comes from one quadratic in x and y fitted to the whole picture, robustly: a turn is one, whatever lies at which depth;
// what moves by itself, or by its depth, adds little to it, and a still picture bends nothing.
// Input: motion per cell, pixels. Output: grad m, per cell of distance.
// Cost: 32 x 32 samples. Threads: pure.
#pragma once

namespace fovea::render::extrapolation {

// d(u)/dx = u[0][0] + u[0][1] x + u[0][2] y, d(u)/dy = u[1][...]; v likewise; x and y in cells.
struct PathBend {
    float u[2][3] = {}, v[2][3] = {};
};
// `motion_px`: pairs. Motion longer than `reach_px`, or that is no number, does not count.
[[nodiscard]] PathBend fit_path_bend(const float* motion_px, int width, int height, float reach_px) noexcept;

}  // namespace fovea::render::extrapolation
