// Four floats at a time, for what is done alike for each horizon: the compiler's own vectors, which every x86-64 and aarch64
// has. Each lane is computed as a scalar would be, in the order written, so results are the same bits everywhere.
//
// Threads: pure functions; noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace fovea::pipeline {

using Four [[gnu::vector_size(16)]] = float;
using FourInts [[gnu::vector_size(16)]] = std::int32_t;
using FourWords [[gnu::vector_size(16)]] = std::uint32_t;

[[nodiscard]] inline Four load_four(const float* from) noexcept {
    Four v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
inline void store_four(float* to, Four v) noexcept { std::memcpy(to, &v, sizeof v); }
[[nodiscard]] inline Four all_four(float x) noexcept { return Four{x, x, x, x}; }
[[nodiscard]] inline Four magnitude(Four v) noexcept {
    return reinterpret_cast<Four>(reinterpret_cast<FourInts>(v) & FourInts{0x7fffffff, 0x7fffffff, 0x7fffffff, 0x7fffffff});
}
// A NaN in `v` becomes the bound.
[[nodiscard]] inline Four at_most(Four v, float bound) noexcept { return v < bound ? v : all_four(bound); }
[[nodiscard]] inline Four at_least(Four v, float bound) noexcept { return v > bound ? v : all_four(bound); }
[[nodiscard]] inline Four larger(Four a, Four b) noexcept { return a > b ? a : b; }

// 2^v for |v| <= 100; relative error below 2e-7. Source of the polynomial: Cephes, exp2f.
[[nodiscard]] inline Four exp2_four(Four v) noexcept {
    constexpr float kRound = 12582912;   // 1.5 * 2^23: adding it rounds to whole numbers, which then stand in the low bits
    const Four rounded = v + kRound, f = v - (rounded - kRound);
    const Four p = (((((f * 1.535336188319500e-4f + 1.339887440266574e-3f) * f + 9.618437357674640e-3f) * f + 5.550332471162809e-2f) * f +
                     2.402264791363012e-1f) * f + 6.931472028550421e-1f) * f + 1.0f;
    return reinterpret_cast<Four>(reinterpret_cast<FourWords>(p) + (reinterpret_cast<FourWords>(rounded) << 23));
}

// A value for each horizon after the present, and one lane that means nothing, so that they are whole fours.
inline constexpr std::size_t kHorizonLanes = 12;
using PerHorizon [[gnu::aligned(16)]] = std::array<float, kHorizonLanes>;

}  // namespace fovea::pipeline
