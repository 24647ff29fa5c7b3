#include "render/foveation/upsample.hpp"

#include <algorithm>
#include <cstring>

#include "protocol/error.hpp"

namespace fovea::foveation {
namespace {

// GCC vectors: two pixels of four 16-bit channels, and the four pixels of bytes they are packed into.
using Two = std::uint16_t __attribute__((vector_size(16)));
using Four = std::uint16_t __attribute__((vector_size(32)));
using Bytes8 = std::uint8_t __attribute__((vector_size(8)));
using Bytes16 = std::uint8_t __attribute__((vector_size(16)));
using Pixel = std::uint16_t __attribute__((vector_size(8)));

Pixel load(const std::uint16_t* p) noexcept {
    Pixel v;
    std::memcpy(&v, p, sizeof v);
    return v;
}
Two twice(Pixel p) noexcept { return __builtin_shufflevector(p, p, 0, 1, 2, 3, 0, 1, 2, 3); }
constexpr Two weights(unsigned a, unsigned b) noexcept {
    const auto x = static_cast<std::uint16_t>(a), y = static_cast<std::uint16_t>(b);
    return Two{x, x, x, x, y, y, y, y};
}

// Blends two rows, weights w0 + w1 = 2 << y_shift.
void blend_rows(const std::uint8_t* a, const std::uint8_t* b, unsigned w0, unsigned w1, std::size_t n, std::uint16_t* out) noexcept {
    for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint16_t>(a[i] * w0 + b[i] * w1);
}

// One enlarged row. `row` has one texel before and one after the `texels` that are enlarged.
template <int Shift>
void enlarge_row(const std::uint16_t* row, std::size_t texels, int total, std::uint8_t* out) noexcept {
    constexpr unsigned kFactor = 1u << Shift, kSum = 2 * kFactor;
    const auto half = static_cast<std::uint16_t>(1u << (total - 1));
    const auto total_shift = static_cast<std::uint16_t>(total);
    const Four round = Four{} + half;
    Two before = twice(load(row)), here = twice(load(row + 4));
    for (std::size_t i = 0; i < texels; ++i) {
        const Two after = twice(load(row + 8 + 4 * i));
        if constexpr (Shift == 1) {
            // Outputs: 1/4 before + 3/4 here, 3/4 here + 1/4 after.
            const Two ends = __builtin_shufflevector(before, after, 0, 1, 2, 3, 8, 9, 10, 11);
            const Two sum = ends + here * weights(3, 3);
            const Two shifted = (sum + half) >> total_shift;
            const Bytes8 bytes = __builtin_convertvector(shifted, Bytes8);
            std::memcpy(out, &bytes, 8);
        } else {
            for (unsigned k = 0; k < kFactor; k += 4) {
                // Output k lies at (k + 1/2) / factor - 1/2 texels from this one's middle.
                const auto pair = [&](unsigned j) {
                    if (j < kFactor / 2) {
                        const unsigned p = kFactor - 1 - 2 * j, q = kFactor - 3 - 2 * j;
                        return before * weights(p, q) + here * weights(kSum - p, kSum - q);
                    }
                    const unsigned p = 2 * j + 1 - kFactor, q = 2 * j + 3 - kFactor;
                    return after * weights(p, q) + here * weights(kSum - p, kSum - q);
                };
                const Four sum = __builtin_shufflevector(pair(k), pair(k + 2), 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
                const Bytes16 bytes = __builtin_convertvector((sum + round) >> total_shift, Bytes16);
                std::memcpy(out + 4 * k, &bytes, 16);
            }
        }
        out += 4 * kFactor;
        before = here;
        here = after;
    }
}

void shrink_row(const std::uint16_t* row, std::size_t texels, int total_shift, std::uint8_t* out) noexcept {
    const unsigned half = 1u << (total_shift - 1);
    for (std::size_t i = 0; i < texels * 4; ++i) out[i] = static_cast<std::uint8_t>((row[4 + i] * 2u + half) >> total_shift);
}

}  // namespace

void enlarge(const SmallImage& s, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
             std::size_t out_stride, RowScratch scratch) noexcept {
    const int first = x0 >> x_shift, last = x1 >> x_shift, factor = 1 << y_shift;
    const auto texels = static_cast<std::size_t>(last - first);
    FOVEA_REQUIRE(scratch.size() >= (texels + 2) * 4 && first >= s.x0 && last <= s.x1);
    const auto row_of = [&](int y) { return s.rgba + static_cast<std::size_t>(std::clamp(y, s.y0, s.y1 - 1) - s.y0) * s.stride_bytes; };
    // Clamped copies stand in for the texels beyond the part that is there.
    const bool has_before = first > s.x0, has_after = last < s.x1;
    for (int y = y0; y < y1; ++y, out += out_stride) {
        const int texel = y >> y_shift, k = y & (factor - 1);
        const bool lower = 2 * k + 1 < factor;   // nearer to the row below than to the one above
        const unsigned w = static_cast<unsigned>(lower ? factor - 1 - 2 * k : 2 * k + 1 - factor);
        const auto skip = static_cast<std::size_t>(first - s.x0 - (has_before ? 1 : 0)) * 4;
        const std::size_t n = (texels + (has_before ? 1 : 0) + (has_after ? 1 : 0)) * 4;
        std::uint16_t* row = scratch.data();
        blend_rows(row_of(lower ? texel - 1 : texel + 1) + skip, row_of(texel) + skip, w, static_cast<unsigned>(2 * factor) - w, n,
                   row + (has_before ? 0 : 4));
        if (!has_before) std::memcpy(row, row + 4, 8);
        if (!has_after) std::memcpy(row + (texels + 1) * 4, row + texels * 4, 8);
        const int total = x_shift + y_shift + 2;
        switch (x_shift) {
            case 0: shrink_row(row, texels, total, out); break;
            case 1: enlarge_row<1>(row, texels, total, out); break;
            case 2: enlarge_row<2>(row, texels, total, out); break;
            default: enlarge_row<3>(row, texels, total, out); break;
        }
    }
}

}  // namespace fovea::foveation
