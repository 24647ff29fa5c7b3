// A window that stands still while its content scrolls, in a frame that stands still: repeating is hard to beat there, and
// content that goes over the window's rim loses to it. A thing of the same size that moves is the counter-case.
#include <gtest/gtest.h>

#include "tests/render/extrapolation_engine.hpp"
#include "tests/render/extrapolation_window.hpp"

using namespace fovea::test::window;
using fovea::test::engine;
using fovea::test::Picture;
using fovea::test::psnr;
using fovea::test::run;

namespace {

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

// There the cells are larger, and half as many pixels along each edge are asked.
TEST(ExtrapolationWindow, TheFrameNearlyStandsAwayFromAGaze) {
    constexpr int kMostOff = 250;   // pixels; 2000 where no edge is asked
    const Gaze gaze{8, 8, 8, 24};
    for (const float speed : {3.0f, 5.3f, 9.0f})
        for (const auto& way : kWays) {
            const Scene s{61, 55, 125, 119, false, false, speed * way[0], speed * way[1]};
            const Picture a = at_time(s, 0), b = at_time(s, 1), truth = at_time(s, 1.5f);
            Picture out(kSize, kSize, Format::rgba8);
            auto e = engine();
            ASSERT_EQ(run(e, a, b, out, 0.5f, {.gaze = &gaze}), Outcome::ok);
            EXPECT_LE(pixels_of_frame_off(out, b, s), kMostOff) << s.u << " " << s.v;
            EXPECT_GE(psnr(out, truth), psnr(b, truth)) << s.u << " " << s.v;
        }
}

}  // namespace
