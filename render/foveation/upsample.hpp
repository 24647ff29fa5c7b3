// Enlargement by 1, 2, 4 or 8 along each axis: bilinear with the same samples and weights as GL_LINEAR with clamped edges,
// nearest, and cubic (Catmull-Rom, as the shader of bin_resolve.cpp).
//
// Input: RGBA8 rows, any row first. Precision: exact weights, rounded to nearest once (GL rounds the same or one off).
// Cost: about 0.4 ns per output pixel, cubic about 3 ns. Threads: pure functions. noexcept, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace fovea::foveation {

// A part of a small image: its pixels (x0..x1, y0..y1) of a whole of width x height texels.
struct SmallImage {
    const std::uint8_t* rgba = nullptr;   // of texel (x0, y0)
    std::size_t stride_bytes = 0;
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;   // half-open; sampling never leaves it
};

// Scratch for one row: at least (small width + 2) * 4 values.
using RowScratch = std::span<std::uint16_t>;

// Fills out(x0..x1, y0..y1) of the enlarged image (size << shift); x0 and x1 are multiples of 1 << x_shift. `out` is the
// pixel (x0, y0).
void enlarge(const SmallImage& small, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
             std::size_t out_stride_bytes, RowScratch scratch) noexcept;
// The same with other filters. Scratch of cubic: at least (small width + 4) * 4 values.
void enlarge_nearest(const SmallImage& small, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
                     std::size_t out_stride_bytes) noexcept;
void enlarge_cubic(const SmallImage& small, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
                   std::size_t out_stride_bytes, std::span<float> scratch) noexcept;

}  // namespace fovea::foveation
