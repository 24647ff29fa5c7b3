// Pixel by pixel along the edges of motion, where cells are too coarse to say what belongs to which side.
//
//   near   . . B B|A A . .     Of an output pixel two motions may tell: that of the cell around which moves least like the
//   output . . B B B|A A .     background (A, in front), and that of the one which moves most like it (B). Where A says the
//                              pixel came from, does src1 agree with A better than with B? Then it is A's, else, by the same
//                              question, B's; where neither holds, something was uncovered, and the gather's answer stays.
//
// Source: measured by `fovea tradeoff extrapolation`; the judgement needs both sources and no depth.
// Input/Output: displacement and front of Projection; the output is already gathered, and rewritten where a side is chosen.
// Cost: a pass over the cells for differences, then some 50 ns per pixel within two cells of an edge.
// Threads: run() uses the pool; no bit depends on it.
#pragma once

#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

class MotionEdges {
public:
    void resize(int width_cells, int height_cells, int width_px, Format format, int threads);

    // Finds edges inside of `touched`, and with a gaze (of cells of `cell_px`) inside its full radius. False: there are none,
    // or so many that the field is noise.
    [[nodiscard]] bool find(const Field& displacement, const Box& touched, const Gaze* gaze, int cell_px) noexcept;

    struct Job {
        const ConstImage* near;
        const Gatherable *source, *far_source;
        const Image* output;
        const Field* displacement;   // that of find()
        const float* front;          // per cell: how little it moves like the background; negative: nothing lies there
        int cell_px;
        float step;                  // of the displacement, in frame times; not 0
        const Gaze* gaze;            // only inside its full radius; null: everywhere
        bool cubic;
    };
    void run(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept;

private:
    struct Sides {
        float front_u, front_v, back_u, back_v;
    };
    struct Scratch {
        std::vector<Sides> sides;            // per cell of a row
        std::vector<std::int32_t> dx, dy;    // per pixel of a row
        std::vector<std::uint8_t> packed;
    };
    // `decide`: in: the row's cells around an edge; out: those of them where two sides meet.
    void row_of_cells(const Job& job, int row, std::uint8_t* decide, const Kernels& kernels, Scratch& s) const noexcept;

    int width_ = 0, height_ = 0;
    Box box_;
    std::vector<std::uint8_t> edge_, around_;   // per cell
    std::vector<std::uint8_t> row_has_edge_;
    std::vector<Scratch> scratch_;
};

}  // namespace fovea::render::extrapolation
