// From motion at the nearer source to displacement at the output: where does each output cell come from?
//
//   near     . . A A A B B . .       each cell lands where its motion carries it; where two land, the one in front wins
//   output   . . B B o o A A . .     (smaller depth, else the one that moves least like the background); a hole `o` that
//                                    nothing lands on is filled from the side that lies behind (with depth: mirrored at its rim)
//
// Input: motion per cell, pixels of the picture; times `scale` it is output position - near position.
// Output: dx, dy in pixels: near position - output position.
#pragma once

#include "render/extrapolation/plane.hpp"

namespace fovea::render::extrapolation {

class Projection {
public:
    void resize(int width, int height);

    // `u`, `v`: `pitch` floats from one cell to the next (1: planes, 2: pairs). `depth`: one per cell or null. Scaled motions
    // longer than `reach_px`, or that are no numbers, stand still.
    struct Motion {
        const float *u, *v;
        std::size_t pitch;
        float scale;
    };
    void run(const Motion& motion, const float* depth, int cell_px, float reach_px) noexcept;

    [[nodiscard]] const Field& displacement() const noexcept { return out_; }
    [[nodiscard]] float filled_fraction() const noexcept { return filled_; }
    // False: nothing moves, every displacement is 0.
    [[nodiscard]] bool moves() const noexcept { return moves_; }

private:
    // The motion of the background as u = a0 + a1 x + a2 y, v likewise: a robust fit over a grid of cells.
    struct Background {
        float u[3] = {}, v[3] = {};
    };
    [[nodiscard]] Background fit_background(const Motion& motion, float reach_px) const noexcept;
    void fill_holes(int cell_px, bool mirrored) noexcept;

    Field out_;
    std::vector<float> front_;   // what lies at each output cell; larger is nearer; kNothing: a hole
    float filled_ = 0;
    bool moves_ = false;
};

}  // namespace fovea::render::extrapolation
