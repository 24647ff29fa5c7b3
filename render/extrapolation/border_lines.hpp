// Which way the lines of a picture run at its border, so that what comes into view continues them instead of being smeared outwards.
//
// Source: the displacement along the border that explains best, in squares, how the outermost pixels change inwards; over the
// scenes of `fovea tradeoff extrapolation` it takes a fifth to nine tenths off the squared error two to eight pixels beyond the border.
// Input: a gatherable picture. Output: shifts along the border per pixel beyond it, at most kSteepest.
// Cost: a frame of kDepth_px pixels is read. Threads: find() by one; follow() is pure.
#pragma once

#include <vector>

#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

class BorderLines {
public:
    void resize(int width_px, int height_px);
    void find(const Gatherable& source, bool floats) noexcept;
    // What is seen at (x, y), pixels of the picture, if that lies beyond it: (u, v) is changed so that x + u, y + v follows the lines
    // there. Inside, and beyond a corner, nothing is changed.
    void follow(float x, float y, float& u, float& v) const noexcept;

private:
    enum Side { kLeft, kRight, kTop, kBottom };
    void find_side(Side side, const Gatherable& source, bool floats) noexcept;

    int width_ = 0, height_ = 0;
    std::vector<float> shift_[4];         // along the border, for each pixel outwards
    std::vector<float> luma_;             // kDepth_px + 1 rows along a side
    std::vector<float> across_, along_;   // sums of products of gradients, per place along a side
};

}  // namespace fovea::render::extrapolation
