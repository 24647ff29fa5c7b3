// Light that changes on a surface while the surface moves as known: a highlight slides over it, a soft shadow crosses it.
//
// Both sources, brought to the output's time, differ there by what one frame has changed. Where that is smooth, it goes on
// changing; the mean of both sources, good against noise, would be a frame behind.
//
// Source: measured by `fovea tradeoff extrapolation` (specular). Two frames do not tell a flicker from a fade: where light changes
// over a large part of the picture it is met half-way, as before, and what has sharp edges is left alone.
// Input: sums of differences per cell of kCellPx, 8-bit pictures. Output: changes the picture in place.
// Cost: one pass over every fourth row while it is at hand; then only cells whose light changes.
// Threads: a row of cells is written by one at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "render/extrapolation/image.hpp"
#include "render/threads/thread_pool.hpp"

namespace fovea::render::extrapolation {

class ChangingLight {
public:
    static constexpr int kCellPx = 8, kEveryRow = 4;

    void resize(int width_px, int height_px);
    void clear() noexcept;
    // BlendRow::differences of output row y from pixel x (a multiple of kCellPx) on; null: the row does not count.
    [[nodiscard]] std::int16_t* differences(int x, int y) noexcept;
    // `step`: frame times ahead of the nearer source. False: there is nothing to change.
    [[nodiscard]] bool find(float step) noexcept;
    void apply(const Image& output, threads::ThreadPool& pool) const noexcept;

private:
    int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
    std::vector<std::int16_t> sums_;     // per cell, kDifferenceLanes numbers
    std::vector<float> mean_;            // per cell: three channels of how much the farther source is above the nearer one
    std::vector<float> certain_;         // per cell, 0 to 1
    std::vector<std::uint8_t> asked_;    // per cell: it or a neighbour changes
    std::vector<float> change_;          // per cell, three channels: levels to add
};

}  // namespace fovea::render::extrapolation
