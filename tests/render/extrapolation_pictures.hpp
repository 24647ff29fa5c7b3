// Pictures whose content at any time is known, for the tests of frame extrapolation.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "render/extrapolation/image.hpp"

namespace fovea::test {

using render::extrapolation::ConstImage;
using render::extrapolation::Format;
using render::extrapolation::Image;

// A picture that owns its pixels, with `slack` bytes after each row that nobody may write.
struct Picture {
    int width, height;
    Format format;
    std::ptrdiff_t row_bytes;
    std::vector<std::byte> bytes;
    static constexpr std::byte kSlack{0xa5};

    Picture(int w, int h, Format f, int slack = 0)
        : width(w), height(h), format(f), row_bytes(static_cast<std::ptrdiff_t>(w) * bytes_per_pixel(f) + slack),
          bytes(static_cast<std::size_t>(row_bytes) * static_cast<std::size_t>(h), kSlack) {}
    [[nodiscard]] ConstImage view() const { return {bytes.data(), width, height, row_bytes, format}; }
    [[nodiscard]] Image target() { return {bytes.data(), width, height, row_bytes, format}; }
    [[nodiscard]] std::byte* at(int x, int y) { return bytes.data() + y * row_bytes + static_cast<std::ptrdiff_t>(x) * bytes_per_pixel(format); }
    [[nodiscard]] const std::byte* at(int x, int y) const { return bytes.data() + y * row_bytes + static_cast<std::ptrdiff_t>(x) * bytes_per_pixel(format); }
    void set(int x, int y, const std::array<float, 4>& value) {   // 0 to 1 (floats: as they are; 16-bit floats: 0 and normal numbers)
        for (int c = 0; c < channel_count(format); ++c) {
            const float v = value[static_cast<std::size_t>(c)];
            if (bytes_per_channel(format) == 1) {
                at(x, y)[c] = static_cast<std::byte>(std::lround(std::fmin(std::fmax(v, 0.0f), 1.0f) * 255));
            } else if (bytes_per_channel(format) == 4) {
                std::memcpy(at(x, y) + 4 * c, &v, 4);
            } else {
                std::uint32_t bits;
                std::memcpy(&bits, &v, 4);
                const auto h = static_cast<std::uint16_t>((bits >> 16 & 0x8000u) | (v == 0 ? 0u : ((bits & 0x7fffffffu) - 0x38000000u) >> 13));
                std::memcpy(at(x, y) + 2 * c, &h, 2);
            }
        }
    }
    bool operator==(const Picture&) const = default;
};

// Smooth noise with detail down to about four pixels, 0 to 1; continuous in x and y.
inline float noise(float x, float y, std::uint32_t seed) {
    const auto lattice = [&](int i, int j) {
        std::uint32_t h = static_cast<std::uint32_t>(i) * 0x9e3779b1u ^ static_cast<std::uint32_t>(j) * 0x85ebca77u ^ seed * 0xc2b2ae3du;
        h = (h ^ h >> 15) * 0x2c1b3c6du;
        h = (h ^ h >> 12) * 0x297a2d39u;
        return static_cast<float>((h ^ h >> 15) >> 8) / 16777216.0f;
    };
    float sum = 0, weight = 0.5f;
    for (float scale = 1.0f / 32; scale < 0.2f; scale *= 2, weight /= 2) {
        const float fx = std::floor(x * scale), fy = std::floor(y * scale);
        float u = x * scale - fx, v = y * scale - fy;
        u = u * u * (3 - 2 * u);
        v = v * v * (3 - 2 * v);
        const int i = static_cast<int>(fx), j = static_cast<int>(fy);
        const float a = lattice(i, j), b = lattice(i + 1, j), c = lattice(i, j + 1), d = lattice(i + 1, j + 1);
        sum += weight * ((a + u * (b - a)) * (1 - v) + (c + u * (d - c)) * v);
    }
    return sum;
}

// Noise that has moved by (dx, dy).
inline Picture moved_noise(int width, int height, Format format, float dx, float dy, std::uint32_t seed = 1, int slack = 0) {
    Picture p(width, height, format, slack);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto fx = static_cast<float>(x) - dx, fy = static_cast<float>(y) - dy;
            p.set(x, y, {noise(fx, fy, seed), noise(fx, fy, seed + 1), noise(fx, fy, seed + 2), 1.0f});
        }
    return p;
}

// Of 8-bit pictures, over all their channels; `margin` pixels at each edge do not count.
inline double psnr(const Picture& a, const Picture& b, int margin = 0) {
    double sum = 0, count = 0;
    for (int y = margin; y < a.height - margin; ++y)
        for (int x = margin; x < a.width - margin; ++x)
            for (int c = 0; c < channel_count(a.format); ++c) {
                const double d = std::to_integer<int>(a.at(x, y)[c]) - std::to_integer<int>(b.at(x, y)[c]);
                sum += d * d;
                count += 1;
            }
    return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * count / sum);
}

}  // namespace fovea::test
