// From motion at the nearer source to displacement at the output: where does each output cell come from?
//
//   near     . . A A A B B . .       each cell lands where its motion carries it; where two land, the one in front wins
//   output   . . B B o o A A . .     (smaller depth, else the one that moves least like the background); a hole `o` that
//                                    nothing lands on is filled from the side that lies behind (with depth: with its rim)
//
// Input: motion per cell, pixels of the picture; times `scale` it is output position - near position.
// Output: dx, dy in pixels: near position - output position. Known motion with depth tells as well where each output cell
// was in the farther source: there it may have been seen a second time, or at all.
#pragma once

#include "render/extrapolation/border_lines.hpp"
#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/plane.hpp"
#include "render/extrapolation/sources.hpp"

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
    // `active`: everything outside of it stands still; null: nothing is known of that.
    void run(const Motion& motion, int cell_px, float reach_px, const Box* active = nullptr) noexcept;
    // Only what lands in `into`, from the cells of `from`, with the background of `whole`: a projection of the same picture in
    // cells twice as large, which has run.
    void run_part(const Motion& motion, int cell_px, float reach_px, const Box& from, const Box& into, const Projection& whole) noexcept;
    // Everything outside of it is where it was.
    [[nodiscard]] const Box& touched() const noexcept { return touched_; }

    // Known motion with depth: sized apart, since it needs more room.
    void resize_known(int width, int height, int width_px, int height_px);
    // `source`: the nearer one, which tells what holds some of the thing in front of it.
    void run_known(const KnownMotion& known, float step, int cell_px, float reach_px, const Gatherable& source, bool floats, const Kernels& kernels) noexcept;

    [[nodiscard]] const Field& displacement() const noexcept { return out_; }
    // Of run_known with motion_px: where each output cell was in the farther source; null: nothing is known of it.
    [[nodiscard]] const Field* far_displacement() const noexcept { return has_far_ ? &far_ : nullptr; }
    // Per cell, with far_displacement: kBoth, kFirstOnly or kSecondOnly (of BlendRow).
    [[nodiscard]] const std::vector<std::uint8_t>& sources() const noexcept { return sources_; }
    // Per cell, of run(): larger is nearer; negative: a hole.
    [[nodiscard]] const float* front() const noexcept { return front_.data(); }
    [[nodiscard]] float filled_fraction() const noexcept { return filled_; }
    // False: nothing moves, every displacement is 0.
    [[nodiscard]] bool moves() const noexcept { return moves_; }

private:
    // The motion of the background as u = a0 + a1 x + a2 y, v likewise: a robust fit over a grid of cells.
    struct Background {
        float u[3] = {}, v[3] = {};
    };
    template <int kLanes>
    void stay(int x0, int y, const Background& b) noexcept;
    void scatter(const Motion& motion, int cell_px, float reach_px, const Box& from, const Background& b) noexcept;
    [[nodiscard]] Background fit_background(const Motion& motion, float reach_px) const noexcept;
    struct Carry {
        const KnownMotion* known;
        float step;
        int cell_px;
        const PathBend* bend;   // null: none
    };
    void fill_holes(int cell_px, const Carry* carry) noexcept;   // null: no known motion with depth
    struct Hole;
    int look_around(Hole& hole, bool beside, bool below, int& left, int& right) noexcept;
    [[nodiscard]] bool continues(const Carry& carry, int x, int y, std::size_t found) const noexcept;
    void fill_from_far(const Hole& hole, const float* depth, int cell_px) noexcept;

    Field out_, far_;
    Background background_;   // of the last run()
    Box touched_;
    std::vector<std::uint8_t> up_, down_;   // per column: what the hole above it has found
    std::vector<std::uint8_t> sources_;
    BorderLines border_;         // of the nearer source, for run_known
    std::vector<float> carry_;   // scratch of run_known
    bool has_far_ = false;
    std::vector<float> front_;   // what lies at each output cell; larger is nearer; kNothing: a hole
    float filled_ = 0;
    bool moves_ = false;
};

}  // namespace fovea::render::extrapolation
