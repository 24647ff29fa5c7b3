// The last step: every output pixel read from the nearer source at its displacement; tiles that stand still are left alone.
//
// Input: displacement per cell, pixels; between cell centres it is interpolated where neighbours agree, and taken from the
// nearer cell where they do not, so that two surfaces keep an edge between them.
#pragma once

#include "render/extrapolation/changing_light.hpp"
#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

class Gather {
public:
    void resize(int width_px, int height_px, Format format, int threads);

    // Where the pixels of a part of the picture come from.
    struct Layer {
        const Field* displacement = nullptr;
        Box touched;             // of it: the rest is 0
        int cell_px = 0;
    };
    struct Job {
        const ConstImage* near;
        const Gatherable* source;
        const Image* output;     // still tiles are there already
        Layer all;
        const TileMap* tiles;
        bool cubic;
        const Gaze* gaze;        // cubic only inside its full radius; null: everywhere
        Layer fovea;             // instead of `all`
        Box fovea_tiles;         // ... in these tiles
        // The farther source, where known motion tells what it shows; null: nothing does.
        const Gatherable* far_source = nullptr;
        const Field* far_displacement = nullptr;
        const std::vector<std::uint8_t>* sources = nullptr;   // Projection::sources
        ChangingLight* light = nullptr;                       // told how both differ, if 8-bit
    };
    void run(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept;

    // Of the last run: tiles that stand still and that nothing moves into, columns x rows.
    [[nodiscard]] const std::vector<std::uint8_t>& stays() const noexcept { return stays_; }
    // Of pixels x0 to x1 - 1 of row y, as WarpRow wants them; `row_u`, `row_v`: scratch, as of ExpandRow.
    static void displacement_row(const Field& f, int cell_px, int y, int x0, int x1, const Kernels& kernels, std::int32_t* dx, std::int32_t* dy, float* row_u, float* row_v) noexcept;

private:
    struct Scratch {
        std::vector<std::int32_t> dx, dy;
        std::vector<float> row_u, row_v;
        std::vector<std::uint8_t> packed, second;
        std::vector<std::int32_t> how;
    };
    [[nodiscard]] static bool nothing_moves_into(const Layer& layer, int column, int row, int height_px) noexcept;
    static bool how_row(const Job& job, int y, int x0, int x1, Scratch& s) noexcept;

    std::vector<Scratch> scratch_;
    std::vector<std::uint8_t> stays_;
};

// What the steps after the gather look at and write over.
struct Gathered {
    const ConstImage *near, *far;
    const Gatherable *near_source, *far_source;
    const Image* output;
    const TileMap* tiles;
    const std::uint8_t* stays;   // Gather::stays()
    Gather::Layer all, fovea;    // as the gather had them
    Box fovea_tiles;
    float step;                  // of the displacement, in frame times; not 0
    [[nodiscard]] const Gather::Layer& layer_of(int column, int row) const noexcept {
        const Box& f = fovea_tiles;
        return row >= f.y0 && row < f.y1 && column >= f.x0 && column < f.x1 ? fovea : all;
    }
};

}  // namespace fovea::render::extrapolation
