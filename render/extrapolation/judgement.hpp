// Whether what was moved is believed: where the motion cannot be shown to explain the two sources, the nearer one is repeated.
//
//   farther     nearer      output     The output's pixel x was read in the nearer source at p, and one motion further back lies a
//     f  <------- p <------- x         place f of the farther one. `left` is how differently x and f look: what the motion does not
//                                      explain. `still` is how differently both sources look at x: what standing still does not.
//
// Both are summed over blocks. A block is believed if less than half of `still` is left in it and those around it, as it is or
// with the mean difference taken out, so that a change of light is no evidence; or if the motion explains most of what goes on in a
// wide region; or if it lies between two sides that are explained well: there something came out from behind a front, or into the
// picture, and nothing can match.
// Source: measured on the pictures of tests/render/extrapolation_cases.hpp and the scenes of `fovea tradeoff extrapolation`.
// Input/Output: the output is gathered already; blocks that are not believed are written over.
// Cost: a linear gather of every fourth row, away from a gaze of one row of a tile, and a pass over it.
// Threads: weigh() and keep() use the pool; no bit depends on it.
#pragma once

#include "render/extrapolation/gather.hpp"

namespace fovea::render::extrapolation {

class Judgement {
public:
    void resize(int width_px, int height_px, Format format, int threads);

    using Job = Gathered;
    // Of what the gather has written, before single pixels are judged at edges. True: some blocks are not believed.
    [[nodiscard]] bool weigh(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept;
    // Blocks that are not believed repeat the nearer source.
    void keep(const Job& job, ThreadPool& pool) noexcept;

private:
    static constexpr int kBlockPx = kWeighPx;
    // Of sums over several blocks.
    struct Weight {
        float left = 0, still = 0, left_light = 0, still_light = 0;   // the latter two: with the mean taken out
        bool is_light = false;   // the mean is small enough for a change of light
        [[nodiscard]] bool explains(float part) const noexcept { return left <= part * still || (is_light && left <= still && left_light <= part * still_light); }
    };
    [[nodiscard]] static Weight weight(const BlockSums& s) noexcept;
    struct Scratch {
        std::vector<std::int32_t> dx, dy, far_dx, far_dy;
        std::vector<float> row_u, row_v;
        std::vector<std::uint8_t> out, far;   // a row, whole blocks
        std::vector<std::uint32_t> mask;
        std::vector<BlockLanes> lanes;        // a row of blocks
    };
    void weigh_tiles(const Job& job, int row0, int row1, const Kernels& kernels, Scratch& s) noexcept;
    struct Row;
    void weigh_bytes(const Row& row, const Kernels& kernels, Scratch& s) const noexcept;
    void weigh_floats(const Row& row, Scratch& s) noexcept;
    struct Range {
        int begin = 0, end = 0;   // end 0: none
    };
    [[nodiscard]] Range active(int row) const noexcept;
    [[nodiscard]] bool decide() noexcept;

    int columns_ = 0, rows_ = 0;   // blocks
    std::vector<BlockSums> sums_, down_;
    std::vector<Range> moved_;              // of a row of blocks: those in tiles that something moves in
    std::vector<Weight> weights_;           // of a block and those around it
    typedef double Sums __attribute__((vector_size(32)));   // left, still, left_light, still_light
    std::vector<Sums> region_;              // of weights, summed from the first block on: (columns + 1) x (rows + 1)
    std::vector<std::uint8_t> believed_, strong_, arrives_, stands_;
    std::vector<Scratch> scratch_;
};

}  // namespace fovea::render::extrapolation
