// A window that stands still while its content scrolls, in a frame that stands still: repeating is hard to beat there, and
// content that goes over the window's rim loses to it. A thing of the same size that moves is the counter-case.
#include <gtest/gtest.h>

#include "tests/render/extrapolation_engine.hpp"

using namespace fovea::render::extrapolation;
using fovea::test::engine;
using fovea::test::noise;
using fovea::test::Picture;
using fovea::test::psnr;
using fovea::test::run;

namespace {

constexpr int kSize = 192;

struct Scene {
    int x0, y0, x1, y1;       // the window, or the thing at time 0
    bool plain, moves;        // surroundings of one colour; the frame moves with its content
    float u, v;               // pixels per frame
};

Picture at_time(const Scene& s, float t, Format format = Format::rgba8) {
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

struct Measured {
    double repeated, made;
};
Measured measure(const Scene& s, float factor = 0.5f) {
    const Picture a = at_time(s, 0), b = at_time(s, 1), truth = at_time(s, 1 + factor);
    Picture out(kSize, kSize, Format::rgba8);
    auto e = engine();
    EXPECT_EQ(run(e, a, b, out, factor), Outcome::ok);
    return {psnr(factor < -0.5f ? a : b, truth), psnr(out, truth)};
}

constexpr float kWays[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {0.8f, 0.6f}};

TEST(ExtrapolationWindow, ContentThatScrollsStaysInsideItsWindow) {
    for (const bool plain : {false, true})
        for (const bool corner : {false, true})
            for (const float speed : {2.0f, 5.3f, 16.0f})
                for (const auto& way : kWays) {
                    Scene s{61, 55, 125, 119, plain, false, speed * way[0], speed * way[1]};
                    if (corner) s = {0, 0, 71, 61, plain, false, speed * way[0], speed * way[1]};
                    const Measured m = measure(s);
                    EXPECT_GE(m.made, m.repeated - 0.1) << (plain ? "plain" : "textured") << (corner ? ", corner, " : ", middle, ") << s.u << " " << s.v;
                }
}

TEST(ExtrapolationWindow, AThingOfTheSameSizeStillMoves) {
    for (const bool plain : {false, true})
        for (const float speed : {5.3f, 9.0f})
            for (const auto& way : kWays) {
                const Scene s{61, 55, 125, 119, plain, true, speed * way[0], speed * way[1]};
                const Measured m = measure(s);
                EXPECT_GE(m.made, m.repeated + 3) << (plain ? "plain, " : "textured, ") << s.u << " " << s.v;
            }
}

// What stands still outside of the window, to the last bit.
bool frame_stands(const Picture& out, const Picture& source, const Scene& s) {
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            if ((x < s.x0 || x >= s.x1 || y < s.y0 || y >= s.y1) && std::memcmp(out.at(x, y), source.at(x, y), static_cast<std::size_t>(bytes_per_pixel(out.format))) != 0) return false;
    return true;
}

TEST(ExtrapolationWindow, TheFrameStandsInEveryPresetFormatAndDirectionOfTime) {
    const Scene s{61, 55, 125, 119, false, false, 5, 3};
    for (const Format f : {Format::rgba8, Format::rgb8, Format::rgba16f, Format::rgb32f}) {
        const Picture a = at_time(s, 0, f), b = at_time(s, 1, f);
        for (const Preset p : kPresets)
            for (const float factor : {0.5f, 1.0f, -0.4f, -1.5f}) {
                Picture out(kSize, kSize, f);
                auto e = engine(p);
                ASSERT_EQ(run(e, a, b, out, factor), Outcome::ok);
                EXPECT_FALSE(e.report().repeated);
                EXPECT_TRUE(frame_stands(out, b, s)) << format_name(f) << " " << preset_name(p) << " " << factor;
            }
    }
}

TEST(ExtrapolationWindow, TheFrameStandsAroundAGazeToo) {
    const Scene s{61, 55, 125, 119, false, false, 5, 3};
    const Picture a = at_time(s, 0), b = at_time(s, 1), truth = at_time(s, 1.5f);
    for (const auto& at : {std::array{125.0f, 119.0f}, std::array{93.0f, 87.0f}, std::array{20.0f, 20.0f}}) {
        const Gaze gaze{at[0], at[1], 24, 48};
        Hints hints;
        hints.gaze = &gaze;
        Picture out(kSize, kSize, Format::rgba8);
        auto e = engine();
        ASSERT_EQ(run(e, a, b, out, 0.5f, hints), Outcome::ok);
        EXPECT_GE(psnr(out, truth), psnr(b, truth) - 0.1) << at[0];
    }
}

}  // namespace
