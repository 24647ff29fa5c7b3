// Steps of the engine by themselves, where the whole frame would not show which of them failed: the luma that is searched, the
// check by the way back, smoothing along edges, what a call leaves for the next, and who lies in front.
#include <gtest/gtest.h>

#include <algorithm>

#include "render/extrapolation/luma.hpp"
#include "render/extrapolation/motion.hpp"
#include "render/extrapolation/projection.hpp"
#include "tests/render/extrapolation_engine.hpp"

using namespace fovea::render::extrapolation;
using fovea::test::engine;
using fovea::test::moved_noise;
using fovea::test::noise;
using fovea::test::Picture;
using fovea::test::psnr;
using fovea::test::run;

namespace {

// What Extrapolator does up to the motion field, from `near` to `far`.
struct Steps {
    Steps(int w, int h, Format f) : out(w, h, f) {
        tiles.resize(w, h);
        scratch.resize(w, h, 1);
        motion.resize(w, h, kCell_px, 1);
    }
    const Field& search(const Picture& near, const Picture& far, const Tuning& tuning) {
        const ConstImage n = near.view(), f = far.view();
        const LumaPair luma{&n, &f, kCell_px, luma_key(n), &motion.near_luma(), &motion.far_luma(), &scratch};
        compare_tiles(n, f, out.target(), tiles, kernels, pool);
        fill_luma(luma, tiles, motion.begin(tiles, false), false, kernels, pool);
        motion.run(tuning, tiles, kernels, pool);
        return motion.field();
    }
    static constexpr int kCell_px = 2;
    const Kernels& kernels = choose_kernels(true);
    ThreadPool pool{1};
    Picture out;
    TileMap tiles;
    LumaScratch scratch;
    MotionSearch motion;
};

// A board of 80x80 at (x, y) before a wall that moves by itself.
Picture board(float x, float y, float wall) {
    Picture p = moved_noise(240, 200, Format::rgba8, wall, 0, 5);
    for (int j = 0; j < 200; ++j)
        for (int i = 0; i < 240; ++i) {
            const float u = static_cast<float>(i) - x, v = static_cast<float>(j) - y;
            if (u < 0 || u >= 80 || v < 0 || v >= 80) continue;
            p.set(i, j, {0.6f + 0.4f * noise(2 * u, 2 * v, 77), 0.2f * noise(2 * u, 2 * v, 78), 0.9f - 0.5f * noise(2 * u, 2 * v, 79), 1});
        }
    return p;
}

// How many of the cells in a part of the picture (pixels) the way back confirms.
double trusted(const MotionSearch& m, int x0, int x1) {
    int sure = 0, all = 0;
    for (int y = 70; y < 130; ++y)
        for (int x = x0; x < x1; ++x, ++all) sure += m.trust()[static_cast<std::size_t>(y / 2) * static_cast<std::size_t>(m.field().width) + static_cast<std::size_t>(x / 2)] == 1;
    return static_cast<double>(sure) / all;
}

TEST(ExtrapolationSteps, TheWayBackDoubtsWhatTheOtherSourceHid) {
    const Picture far = board(60, 60, 0), near = board(76, 60, -3);
    for (const Preset preset : {Preset::balanced, Preset::best}) {
        Steps steps(240, 200, Format::rgba8);
        steps.search(near, far, tuning_of(preset));
        EXPECT_LT(trusted(steps.motion, 60, 72), 0.5) << preset_name(preset) << ": the board stood there, what it hid has no partner";
        EXPECT_GT(trusted(steps.motion, 86, 146), 0.7) << preset_name(preset) << ": the board";
        EXPECT_GT(trusted(steps.motion, 170, 230), 0.9) << preset_name(preset) << ": the wall";
    }
}

TEST(ExtrapolationSteps, EveryPresetButDraftSmoothsItsField) {
    const Picture far = board(60, 60, 0), near = board(65, 62, -3);
    for (const Preset preset : kPresets) {
        Tuning rough = tuning_of(preset);
        rough.smoothing_passes = 0;
        Steps with(240, 200, Format::rgba8), without(240, 200, Format::rgba8);
        const bool same = with.search(near, far, tuning_of(preset)).u == without.search(near, far, rough).u;
        EXPECT_EQ(same, preset == Preset::draft) << preset_name(preset);
    }
}

TEST(ExtrapolationSteps, SmoothingStopsAtEdgesOfLuma) {
    constexpr int kWidth = 48, kHeight = 24, kEdge = 21;
    Plane guide;
    guide.resize(kWidth, kHeight);
    std::vector<float> u(kWidth * kHeight), v(u), trust(u.size(), 1.0f), u_out(u), v_out(u);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            guide.row(y)[x] = x < kEdge ? 60.0f : 180.0f;
            const auto at = static_cast<std::size_t>(y * kWidth + x);
            u[at] = x < kEdge ? 5.0f : -5.0f;
            v[at] = x < kEdge ? -1.0f : 2.0f;
            if (x < kEdge - 1 || x >= kEdge + 1) continue;
            trust[at] = 0.02f;   // doubted on both sides of the edge, and wrong; sure neighbours lie on both sides as well
            u[at] = 30;
        }
        guide.pad_row(y);
    }
    guide.pad_above();
    guide.pad_below();
    for (const bool wide : {false, true}) {
        choose_kernels(wide).smooth({u.data(), v.data(), trust.data(), guide.row(0), guide.stride(), kWidth, kHeight, 2, 0, kWidth, u_out.data(), v_out.data()}, 0, kHeight);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const auto at = static_cast<std::size_t>(y * kWidth + x);
                ASSERT_NEAR(u_out[at], x < kEdge ? 5 : -5, 2.5) << x << " " << y;
                ASSERT_NEAR(v_out[at], x < kEdge ? -1 : 2, 0.1) << x << " " << y;
            }
    }
}

TEST(ExtrapolationSteps, WhereNothingMovesAnyMoreNoMotionIsLeft) {
    const Picture before = moved_noise(240, 200, Format::rgba8, 0, 0), after = moved_noise(240, 200, Format::rgba8, 5, 3), a = board(60, 60, 0), b = board(64, 60, 0);
    const Tuning tuning = tuning_of(Preset::balanced);
    Steps steps(240, 200, Format::rgba8), fresh(240, 200, Format::rgba8);
    EXPECT_NE(steps.search(after, before, tuning).u[0], 0);
    const Field &used = steps.search(b, a, tuning), &first = fresh.search(b, a, tuning);
    EXPECT_EQ(used.u, first.u);
    EXPECT_EQ(used.v, first.v);
    const Box& active = steps.motion.active();
    ASSERT_LT(active.x1, used.width);
    for (int y = 0; y < used.height; ++y)
        for (int x = 0; x < used.width; ++x) {
            if (x >= active.x0 && x < active.x1 && y >= active.y0 && y < active.y1) continue;
            const auto at = static_cast<std::size_t>(y * used.width + x);
            ASSERT_TRUE(used.u[at] == 0 && used.v[at] == 0) << x << " " << y << ": outside of what may move";
        }
}

TEST(ExtrapolationSteps, AlphaCountsAQuarterOfTheLumaOfFloatsToo) {
    ThreadPool pool(1);
    LumaScratch scratch;
    scratch.resize(16, 2, 1);
    TileMap tiles;
    tiles.resize(16, 2);
    for (const Format f : {Format::rgba8, Format::rgba32f, Format::rgba16f}) {
        Picture p(16, 2, f);
        for (int y = 0; y < 2; ++y)
            for (int x = 0; x < 16; ++x) p.set(x, y, {0.5f, 0.5f, 0.5f, x < 8 ? 1.0f : 0.0f});
        const ConstImage view = p.view();
        Plane near, far;
        near.resize(8, 1);
        far.resize(8, 1);
        fill_luma({&view, &view, 2, 0.5f, &near, &far, &scratch}, tiles, {0, 0, 1, 1}, false, choose_kernels(true), pool);
        for (const Plane* luma : {&near, &far}) EXPECT_NEAR(luma->row(0)[0] - luma->row(0)[7], 255.0f / 4, 0.1f) << format_name(f);
    }
}

TEST(ExtrapolationSteps, LightOfAnyRangeHasGradientsOfOneSize) {
    for (const float light : {1e-20f, 1e-4f, 1.0f, 1e6f, 1e30f}) {
        Picture p(64, 64, Format::rgba32f);
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) p.set(x, y, {light * (x < 32 ? 1.0f : 4.0f), light, light, 1});
        const float key = luma_key(p.view());
        EXPECT_GT(key, 0.5f * light) << light;
        EXPECT_LT(key, 4 * light) << light;
    }
    EXPECT_EQ(luma_key(Picture(8, 8, Format::rgba8).view()), 1);
}

// Eight cells that land side by side are written at once; each by itself must still ask who is in front.
TEST(ExtrapolationSteps, WhoMovesLikeTheBackgroundIsBehindHoweverManyLand) {
    constexpr int kWidth = 96, kHeight = 32;
    for (const float way : {-24.0f, 24.0f}) {
        std::vector<float> u(kWidth * kHeight), v(u.size());
        for (int y = 8; y < 24; ++y)
            for (int x = 40; x < 56; ++x) u[static_cast<std::size_t>(y * kWidth + x)] = way;
        Projection projection;
        projection.resize(kWidth, kHeight);
        projection.run({u.data(), v.data(), 1, 1.0f}, 1, 100);
        for (int y = 8; y < 24; ++y)
            for (int x = 40; x < 56; ++x)
                ASSERT_EQ(projection.displacement().u[static_cast<std::size_t>(y * kWidth + x) + static_cast<std::size_t>(static_cast<int>(way) + kWidth) - kWidth], -way) << x << " " << y;
    }
}

// Finer cells beside a gaze have the background of the coarser ones, whose centres lie elsewhere.
TEST(ExtrapolationSteps, APartInFinerCellsKeepsTheBackgroundOfTheWhole) {
    constexpr int kWidth = 64, kHeight = 48;
    const auto motion_at = [](float x_px, float y_px) { return std::pair{0.06f * x_px - 5 + 0.01f * y_px, 0.03f * y_px - 2}; };
    std::vector<float> u(kWidth * kHeight), v(u.size()), fine_u(4 * u.size()), fine_v(fine_u.size());
    const auto fill = [&](std::vector<float>& to_u, std::vector<float>& to_v, int width, int height, int cell_px) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto cell = static_cast<float>(cell_px);
                std::tie(to_u[static_cast<std::size_t>(y * width + x)], to_v[static_cast<std::size_t>(y * width + x)]) = motion_at((static_cast<float>(x) + 0.5f) * cell, (static_cast<float>(y) + 0.5f) * cell);
            }
    };
    fill(u, v, kWidth, kHeight, 4);
    fill(fine_u, fine_v, 2 * kWidth, 2 * kHeight, 2);
    Projection whole, part;
    whole.resize(kWidth, kHeight);
    part.resize(2 * kWidth, 2 * kHeight);
    whole.run({u.data(), v.data(), 1, 1.0f}, 4, 100);
    part.run_part({fine_u.data(), fine_v.data(), 1, 1.0f}, 2, 100, {32, 24, 96, 72}, {40, 32, 88, 64}, whole);
    float most = 0;   // the deviation from the background, squared: all of this is background
    for (int y = 34; y < 62; ++y)
        for (int x = 42; x < 86; ++x) most = std::max(most, part.front()[y * 2 * kWidth + x]);
    EXPECT_GE(most, 0);
    EXPECT_LT(most, 1e-3f);
}

// What stands still beside what moves is no part of it, in either kind of cell.
TEST(ExtrapolationSteps, WhatStandsStillHasNoMotionAtAll) {
    const Picture far = board(64, 64, 0), near = board(68, 66, 0);
    Steps steps(240, 200, Format::rgba8);
    const Field& f = steps.search(near, far, tuning_of(Preset::best));
    int anchors = 0;
    for (int row = 0; row < steps.tiles.rows; ++row)
        for (int column = 0; column < steps.tiles.columns; ++column) {
            if (!steps.tiles.is_anchor(column, row)) continue;
            ++anchors;
            for (int y = 8 * row; y < std::min(8 * row + 8, f.height); ++y)
                for (int x = 8 * column; x < std::min(8 * column + 8, f.width); ++x) {
                    const auto at = static_cast<std::size_t>(y * f.width + x);
                    ASSERT_TRUE(f.u[at] == 0 && f.v[at] == 0) << x << " " << y;
                }
        }
    EXPECT_GT(anchors, 100);
}

// The mean of equal numbers may round to more than they are: an alpha above 1, an infinity from the largest number.
TEST(ExtrapolationSteps, NoMeanIsMoreThanItsNumbers) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    for (const float alpha : {1.0f, kLargest})
        for (const Format f : {Format::rgba32f, Format::rgba16f}) {
            if (f == Format::rgba16f && alpha > 1) continue;
            const auto at = [&](float t) {
                Picture p(96, 80, f);
                for (int y = 0; y < 80; ++y)
                    for (int x = 0; x < 96; ++x) {
                        const float n = noise(static_cast<float>(x) - 4.3f * t, static_cast<float>(y) - 2.6f * t, 3);
                        p.set(x, y, {n, 1 - n, 0.5f, alpha});
                    }
                return p;
            };
            const Picture a = at(0), b = at(1);
            Picture out(96, 80, f);
            for (const Preset preset : kPresets) {
                auto e = engine(preset);
                ASSERT_EQ(run(e, a, b, out, 0.57f), Outcome::ok);
                EXPECT_FALSE(e.report().repeated);
                for (int y = 0; y < 80; ++y)
                    for (int x = 0; x < 96; ++x)
                        ASSERT_EQ(std::memcmp(out.at(x, y) + 3 * bytes_per_channel(f), b.at(x, y) + 3 * bytes_per_channel(f), static_cast<std::size_t>(bytes_per_channel(f))), 0) << preset_name(preset) << " " << x << " " << y;
            }
        }
}

}  // namespace
