// Luma of the two sources, in cells, for the search: made tile by tile, while the comparison has a row of tiles at hand where it
// can be, and only where something may look at it.
//
// Luma is 3/4 of Rec. 601 luma and 1/4 alpha, 0 to 255. Float pictures are first mapped to x / (x + key), where key is the
// geometric mean of src2's positive luma: light of any range then has gradients of about the size that 8 bits have.
// What is not finite counts as black there.
// Threads: each worker fills rows of tiles of its own.
#pragma once

#include <vector>

#include "render/extrapolation/image.hpp"
#include "render/extrapolation/plane.hpp"
#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

// Room for the rows of a few cells, one per chunk that may run at a time, and what the comparison has filled; sized once.
struct LumaScratch {
    struct Span {
        std::int16_t begin = 0, end = 0;   // columns of tiles
    };
    std::vector<std::byte> strips;
    std::size_t strip_bytes = 0;
    std::vector<Span> filled;   // per row of tiles
    void resize(int width_px, int height_px, int threads);
    [[nodiscard]] std::byte* strip(std::size_t index) noexcept { return strips.data() + strip_bytes * (index % (strips.size() / strip_bytes)); }
};

// The key of a float picture; 1 if nothing in it is positive.
[[nodiscard]] float luma_key(const ConstImage& image) noexcept;

// Both sources' luma in cells of `cell_px`, 2 to 8 pixels; the planes are sized ceil(picture / cell_px).
struct LumaPair {
    const ConstImage *near, *far;
    int cell_px;
    float key;
    Plane *near_luma, *far_luma;
    LumaScratch* scratch;
};

// Of a row of tiles, the columns begin to end - 1. Where the sources are equal the farther one's is copied.
void fill_tiles(const LumaPair& luma, const TileMap& tiles, int row, int begin, int end, std::byte* strip, const Kernels& kernels) noexcept;
// A part of the picture, in tiles, with the padding where it reaches the picture's edge. `begun`: what scratch->filled tells is there.
void fill_luma(const LumaPair& luma, const TileMap& tiles, const Box& part, bool begun, const Kernels& kernels, ThreadPool& pool) noexcept;

}  // namespace fovea::render::extrapolation
