// A window that stands still while its content scrolls, in a frame that stands still, and a thing of the same size that moves: for the
// tests of both sides of frame extrapolation.
#pragma once

#include <cstring>

#include "tests/render/extrapolation_pictures.hpp"

namespace fovea::test::window {

using namespace fovea::render::extrapolation;

inline constexpr int kSize = 192;

struct Scene {
    int x0, y0, x1, y1;       // the window, or the thing at time 0
    bool plain, moves;        // surroundings of one colour; the frame moves with its content
    float u, v;               // pixels per frame
};

inline Picture at_time(const Scene& s, float t, Format format = Format::rgba8) {
    Picture p(kSize, kSize, format);
    const float dx = s.u * t, dy = s.v * t;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
            const float wx = s.moves ? fx - dx : fx, wy = s.moves ? fy - dy : fy;
            if (wx >= static_cast<float>(s.x0) && wx < static_cast<float>(s.x1) && wy >= static_cast<float>(s.y0) && wy < static_cast<float>(s.y1)) {
                const float n = noise(1.5f * (fx - dx), 1.5f * (fy - dy), 77), m = noise(1.5f * (fx - dx), 1.5f * (fy - dy), 78);
                p.set(x, y, {0.3f + 0.7f * n, m, 0.9f - 0.6f * n, 1});
            } else if (s.plain) {
                p.set(x, y, {0.2f, 0.25f, 0.3f, 1});
            } else {
                p.set(x, y, {noise(fx, fy, 5), noise(fx, fy, 6), noise(fx, fy, 7), 1});
            }
        }
    return p;
}

inline constexpr float kWays[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {0.8f, 0.6f}};

// Outside of the window, pixels that are not those of the source, to the last bit.
inline int pixels_of_frame_off(const Picture& out, const Picture& source, const Scene& s) {
    int off = 0;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const bool outside = x < s.x0 || x >= s.x1 || y < s.y0 || y >= s.y1;
            off += outside && std::memcmp(out.at(x, y), source.at(x, y), static_cast<std::size_t>(bytes_per_pixel(out.format))) != 0;
        }
    return off;
}
inline bool frame_stands(const Picture& out, const Picture& source, const Scene& s) { return pixels_of_frame_off(out, source, s) == 0; }

}  // namespace fovea::test::window
