#include "render/foveation/upsample.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "protocol/error.hpp"

namespace fovea::foveation {
namespace {

// GCC vectors: two pixels of four 16-bit channels, and the bytes they come from or are packed into.
using Two = std::uint16_t __attribute__((vector_size(16)));
using Pixels2 = std::uint64_t __attribute__((vector_size(16)));
using Bytes8 = std::uint8_t __attribute__((vector_size(8)));
using Bytes16 = std::uint8_t __attribute__((vector_size(16)));

Two twice(const std::uint16_t* p) noexcept {
    std::uint64_t pixel;
    std::memcpy(&pixel, p, sizeof pixel);
    return reinterpret_cast<Two>(Pixels2{pixel, pixel});
}
// A weight for each of the two pixels.
template <std::uint16_t A, std::uint16_t B>
constexpr Two kWeights = {A, A, A, A, B, B, B, B};

// Blends two rows, weights w0 + w1 = 2 << y_shift.
void blend_rows(const std::uint8_t* a, const std::uint8_t* b, std::uint16_t w0, std::uint16_t w1, std::size_t n, std::uint16_t* out) noexcept {
    std::size_t i = 0;
    for (; i + 16 <= n; i += 16) {
        Bytes16 x, y;
        std::memcpy(&x, a + i, 16);
        std::memcpy(&y, b + i, 16);
        const auto low = [](Bytes16 v) noexcept {
            return reinterpret_cast<Two>(__builtin_shufflevector(v, Bytes16{}, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
        };
        const auto high = [](Bytes16 v) noexcept {
            return reinterpret_cast<Two>(__builtin_shufflevector(v, Bytes16{}, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31));
        };
        const Two first = low(x) * w0 + low(y) * w1, second = high(x) * w0 + high(y) * w1;
        std::memcpy(out + i, &first, 16);
        std::memcpy(out + i + 8, &second, 16);
    }
    for (; i < n; ++i) out[i] = static_cast<std::uint16_t>(a[i] * w0 + b[i] * w1);
}

// One enlarged row. `row` has one texel before and one after the `texels` that are enlarged. Output k of a texel lies at
// (k + 1/2) / factor - 1/2 texels from its middle: the first half between it and the one before, the others and the one after.
template <int Shift>
void enlarge_row(const std::uint16_t* row, std::size_t texels, int total, std::uint8_t* out) noexcept {
    const auto half = static_cast<std::uint16_t>(1u << (total - 1)), shift = static_cast<std::uint16_t>(total);
    const Two round = Two{} + half;   // of a variable: with the expression in its place a sanitizer's build takes it for an int
    Two before = twice(row), here = twice(row + 4);
    for (std::size_t i = 0; i < texels; ++i) {
        const Two after = twice(row + 8 + 4 * i);
        const auto put = [&](std::size_t pixel, Two sum) noexcept {   // two pixels
            const Bytes8 bytes = __builtin_convertvector((sum + round) >> shift, Bytes8);
            std::memcpy(out + 4 * pixel, &bytes, sizeof bytes);
        };
        if constexpr (Shift == 1) {
            put(0, __builtin_shufflevector(before, after, 0, 1, 2, 3, 8, 9, 10, 11) + here * kWeights<3, 3>);
        } else if constexpr (Shift == 2) {
            put(0, before * kWeights<3, 1> + here * kWeights<5, 7>);
            put(2, after * kWeights<1, 3> + here * kWeights<7, 5>);
        } else {
            put(0, before * kWeights<7, 5> + here * kWeights<9, 11>);
            put(2, before * kWeights<3, 1> + here * kWeights<13, 15>);
            put(4, after * kWeights<1, 3> + here * kWeights<15, 13>);
            put(6, after * kWeights<5, 7> + here * kWeights<11, 9>);
        }
        out += 4 << Shift;
        before = here;
        here = after;
    }
}

using Pixel4f = float __attribute__((vector_size(16)));
using Pixel4i = std::int32_t __attribute__((vector_size(16)));
using Bytes4 = std::uint8_t __attribute__((vector_size(4)));

// Weights of the texels -1, 0, 1, 2 at the distance t from texel 0.
std::array<float, 4> spline(float t) noexcept {
    return {((-0.5f * t + 1) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1, ((-1.5f * t + 2) * t + 0.5f) * t, (0.5f * t - 0.5f) * t * t};
}

// Where output k of a texel lies: between the texels `before` and `before + 1`, relative to the texel, and how far in.
struct Phase {
    int before;
    std::array<float, 4> weights;
};
Phase phase(int k, int shift) noexcept {
    const float at = (static_cast<float>(k) + 0.5f) / static_cast<float>(1 << shift) - 0.5f;
    const int before = at < 0 ? -1 : 0;
    return {before, spline(at - static_cast<float>(before))};
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
        const int w = lower ? factor - 1 - 2 * k : 2 * k + 1 - factor;
        const auto skip = static_cast<std::size_t>(first - s.x0 - (has_before ? 1 : 0)) * 4;
        const std::size_t n = (texels + (has_before ? 1 : 0) + (has_after ? 1 : 0)) * 4;
        std::uint16_t* row = scratch.data();
        blend_rows(row_of(lower ? texel - 1 : texel + 1) + skip, row_of(texel) + skip, static_cast<std::uint16_t>(w),
                   static_cast<std::uint16_t>(2 * factor - w), n, row + (has_before ? 0 : 4));
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

void enlarge_nearest(const SmallImage& s, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
                     std::size_t out_stride) noexcept {
    const int first = x0 >> x_shift, last = x1 >> x_shift;
    FOVEA_REQUIRE(first >= s.x0 && last <= s.x1 && (y0 >> y_shift) >= s.y0 && ((y1 - 1) >> y_shift) < s.y1);
    const std::uint8_t* done = nullptr;   // the row above, when it shows the same texels
    int done_texel = -1;
    for (int y = y0; y < y1; ++y, out += out_stride) {
        const int texel = y >> y_shift;
        if (texel == done_texel) {
            std::memcpy(out, done, static_cast<std::size_t>(x1 - x0) * 4);
            continue;
        }
        const std::uint8_t* row = s.rgba + static_cast<std::size_t>(texel - s.y0) * s.stride_bytes;
        std::uint8_t* to = out;
        for (int x = first; x < last; ++x)
            for (int k = 0; k < 1 << x_shift; ++k, to += 4) std::memcpy(to, row + static_cast<std::size_t>(x - s.x0) * 4, 4);
        done = out;
        done_texel = texel;
    }
}

void enlarge_cubic(const SmallImage& s, int x_shift, int y_shift, int x0, int y0, int x1, int y1, std::uint8_t* out,
                   std::size_t out_stride, std::span<float> scratch) noexcept {
    const int first = x0 >> x_shift, last = x1 >> x_shift, factor_x = 1 << x_shift;
    FOVEA_REQUIRE(scratch.size() >= static_cast<std::size_t>(last - first + 4) * 4 && first >= s.x0 && last <= s.x1);
    std::array<Phase, 8> across{};
    for (int k = 0; k < factor_x; ++k) across[static_cast<std::size_t>(k)] = phase(k, x_shift);
    const auto row_of = [&](int y) { return s.rgba + static_cast<std::size_t>(std::clamp(y, s.y0, s.y1 - 1) - s.y0) * s.stride_bytes; };
    // Blended texels first - 2 .. last + 1; clamped copies stand in for those beyond the part that is there.
    const int from = std::max(first - 2, s.x0), to = std::min(last + 2, s.x1);
    for (int y = y0; y < y1; ++y, out += out_stride) {
        const Phase down = phase(y & ((1 << y_shift) - 1), y_shift);
        const int row = (y >> y_shift) + down.before;
        const std::array<const std::uint8_t*, 4> rows{row_of(row - 1), row_of(row), row_of(row + 1), row_of(row + 2)};
        float* blended = scratch.data() + static_cast<std::size_t>(from - first + 2) * 4;
        const auto skip = static_cast<std::size_t>(from - s.x0) * 4, n = static_cast<std::size_t>(to - from) * 4;
        for (std::size_t i = 0; i < n; ++i)
            blended[i] = down.weights[0] * rows[0][skip + i] + down.weights[1] * rows[1][skip + i] + down.weights[2] * rows[2][skip + i] +
                         down.weights[3] * rows[3][skip + i];
        for (int x = first - 2; x < from; ++x) std::memcpy(scratch.data() + static_cast<std::size_t>(x - first + 2) * 4, blended, 16);
        for (int x = to; x < last + 2; ++x) std::memcpy(scratch.data() + static_cast<std::size_t>(x - first + 2) * 4, blended + n - 4, 16);
        std::uint8_t* put = out;
        for (int x = first; x < last; ++x) {
            const float* here = scratch.data() + static_cast<std::size_t>(x - first + 2) * 4;
            for (int k = 0; k < factor_x; ++k, put += 4) {
                const Phase& p = across[static_cast<std::size_t>(k)];
                const float* at = here + (p.before - 1) * 4;
                Pixel4f sum{};
                for (std::size_t j = 0; j < 4; ++j) {
                    Pixel4f texel;
                    std::memcpy(&texel, at + 4 * j, sizeof texel);
                    sum += texel * p.weights[j];
                }
                Pixel4i whole = __builtin_convertvector(sum + 0.5f, Pixel4i);   // negative ones are clamped: truncation is right
                whole = whole < 0 ? Pixel4i{} : whole;
                whole = whole > 255 ? Pixel4i{} + 255 : whole;
                const Bytes4 bytes = __builtin_convertvector(whole, Bytes4);
                std::memcpy(put, &bytes, 4);
            }
        }
    }
}

}  // namespace fovea::foveation
