// Effort that follows the gaze, on pictures most of which stand still.
#include "tests/render/extrapolation_engine.hpp"

namespace {

using namespace fovea::render::extrapolation;
using namespace fovea::test;

// A board of 96x96 pixels at (x, y) before what stands still.
Picture board(float x, float y, int width = 512, int height = 512, Format format = Format::rgba8) {
    Picture p = moved_noise(width, height, format, 0, 0);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            const float dx = static_cast<float>(i) - x, dy = static_cast<float>(j) - y;
            if (dx >= 0 && dy >= 0 && dx < 96 && dy < 96) p.set(i, j, {noise(dx, dy, 5), noise(dx, dy, 6), noise(dx, dy, 7), 1.0f});
        }
    return p;
}

// Of a window of two pictures.
double psnr_within(const Picture& a, const Picture& b, int x0, int y0, int x1, int y1) {
    double sum = 0;
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            for (int c = 0; c < 4; ++c) {
                const double d = std::to_integer<int>(a.at(x, y)[c]) - std::to_integer<int>(b.at(x, y)[c]);
                sum += d * d;
            }
    return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * 4 * (x1 - x0) * (y1 - y0) / sum);
}

TEST(ExtrapolationGaze, WhatComesIntoTheFoveaHasFineCellsThere) {
    // In neither source does anything of the fovea's tiles (192 to 319) move; the board's edge comes 24 pixels into them.
    const Picture a = board(60, 210), b = board(90, 210), truth = board(120, 210);
    const Gaze centre{256, 256, 64, 192}, none{256, 256, 0, 192};
    Picture full(512, 512, Format::rgba8), foveated(full), coarse(full);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, full, 1.0f), Outcome::ok);
    ASSERT_EQ(run(e, a, b, foveated, 1.0f, {.gaze = &centre}), Outcome::ok);
    ASSERT_EQ(run(e, a, b, coarse, 1.0f, {.gaze = &none}), Outcome::ok);
    const auto within = [&](const Picture& p) { return psnr_within(p, truth, 200, 232, 224, 280); };
    ASSERT_GT(within(full), within(b) + 7);
    EXPECT_GT(within(foveated), within(coarse) + 1.5);
}

// Luma is made around what differs only: what lies beyond is left from calls before.
TEST(ExtrapolationGaze, APartThatMovesGivesTheSameFrameWhateverCameBefore) {
    constexpr int kWidth = 448, kHeight = 160;
    const Gaze beside{200, 80, 40, 120};
    for (const Format f : {Format::rgba8, Format::rgb8, Format::rgba16f}) {
        const Picture a = board(120, 30, kWidth, kHeight, f), b = board(131, 24, kWidth, kHeight, f);
        const Picture other = moved_noise(kWidth, kHeight, f, 3, 40, 9), moved = moved_noise(kWidth, kHeight, f, 9, 44, 9);
        Picture first(kWidth, kHeight, f), again(first);
        for (const Gaze* gaze : {static_cast<const Gaze*>(nullptr), &beside}) {
            auto fresh = engine(), used = engine(Preset::balanced, 3);
            ASSERT_EQ(run(fresh, a, b, first, 0.5f, {.gaze = gaze}), Outcome::ok);
            ASSERT_EQ(run(used, other, moved, again, 0.5f, {.gaze = gaze}), Outcome::ok);
            ASSERT_EQ(run(used, a, b, again, 0.5f, {.gaze = gaze}), Outcome::ok);
            EXPECT_EQ(first, again) << format_name(f) << (gaze != nullptr ? ", with a gaze" : "");
        }
    }
}

}  // namespace
