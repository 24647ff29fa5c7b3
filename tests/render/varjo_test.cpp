// Dynamic viewports and shading-rate maps.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <rapidcheck/gtest.h>

#include "render/density/dynamic_viewports.hpp"
#include "render/density/shading_rate.hpp"
#include "render/foveation/rate_map.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::density;
using namespace fovea::test;
using foveation::Method;
using foveation::MethodSettings;

namespace {

std::unique_ptr<Method> make(const char* name, const Views& views, const MethodSettings& settings = {}) {
    auto method = foveation::create_method(name, settings);
    EXPECT_TRUE(method.has_value()) << method.error().message();
    const auto ready = (*method)->prepare(views.targets);
    EXPECT_TRUE(ready.has_value()) << ready.error().message();
    return *std::move(method);
}

Pixels full_picture(const gl::CommandList& list, int width, int height) {
    Views v(width, height);
    make("full", v)->submit(list, v.targets, v.focus);
    return read(v.targets[0]);
}

// ---- dynamic viewports ----

TEST(Viewports, LieTwoARowAsInVarjosExample) {
    const ViewportSize sizes[] = {{100, 80}, {100, 80}, {60, 50}, {70, 50}};
    Viewport at[4];
    layout_viewports(sizes, at);
    EXPECT_EQ(at[0], (Viewport{0, 0, 100, 80}));
    EXPECT_EQ(at[1], (Viewport{100, 0, 100, 80}));
    EXPECT_EQ(at[2], (Viewport{0, 80, 60, 50}));
    EXPECT_EQ(at[3], (Viewport{60, 80, 70, 50}));
}

RC_GTEST_PROP(Viewports, FocusTangentsStayInsideTheViewAndCropsUndoThem, ()) {
    const auto real = [](double low, double high) {
        return *rc::gen::map(rc::gen::inRange(0, 100001), [=](int i) { return low + (high - low) * i / 100000.0; });
    };
    const FieldOfView full{real(-2, -0.2), real(0.2, 2), real(0.2, 2), real(-2, -0.2)};
    const double extent = real(0.05, 1);
    const FieldOfView part = focus_tangents(full, {real(-3, 3), real(-3, 3)}, extent);
    RC_ASSERT(part.tan_left >= full.tan_left - 1e-9);
    RC_ASSERT(part.tan_right <= full.tan_right + 1e-9);
    RC_ASSERT(part.tan_down >= full.tan_down - 1e-9);
    RC_ASSERT(part.tan_up <= full.tan_up + 1e-9);
    RC_ASSERT(std::abs((part.tan_right - part.tan_left) - extent * (full.tan_right - full.tan_left)) < 1e-9);
    // A direction's clip coordinates, cropped, are those of the narrow view.
    const auto crop = crop_between(full, part);
    const double tx = real(-1, 1), ty = real(-1, 1);
    const auto ndc = [](double t, double low, double high) { return (2 * t - high - low) / (high - low); };
    RC_ASSERT(std::abs(ndc(tx, full.tan_left, full.tan_right) * crop[0] + crop[2] - ndc(tx, part.tan_left, part.tan_right)) < 2e-4);
    RC_ASSERT(std::abs(ndc(ty, full.tan_down, full.tan_up) * crop[1] + crop[3] - ndc(ty, part.tan_down, part.tan_up)) < 2e-4);
}

using DynamicViewports = GlTest;

TEST_F(DynamicViewports, AreSharpAroundTheGazeAndShadeAThirdOfThePixels) {
    const QuadDraw quad(kPattern);
    constexpr int kWidth = 200, kHeight = 150;
    const Pixels expected = full_picture(quad.list(), kWidth, kHeight);
    for (const bool separate : {false, true}) {
        MethodSettings s;
        s.count_fragments = true;
        s.dynamic_viewports.separate_targets = separate;
        Views v(kWidth, kHeight, 2);
        const auto method = make("dynamic_viewports", v, s);
        for (const auto& [x, y] : {std::pair{0.0f, 0.0f}, {0.5f, -0.4f}, {-1.0f, 1.0f}, {9.0f, 0.0f}}) {
            v.look(0, {x, y, 4, 4, 0});
            v.look(1, {-x, y, 4, 4, 0});
            const auto cost = method->submit(quad.list(), v.targets, v.focus);
            EXPECT_EQ(method->counted_fragments(), cost.pixels_shaded);
            EXPECT_LT(cost.pixels_shaded, cost.pixels_full * 34 / 100);
            const Pixels got = read(v.targets[0]);
            const auto r = method->full_region(0);
            EXPECT_LE(std::abs(std::clamp(static_cast<double>(x), -1.0, 1.0) - r.x_ndc), r.half_width_ndc + 0.02) << "the gaze is in the sharp view";
            int worst_inside = 0;
            std::size_t differ = 0, outside = 0;
            for (int j = 0; j < kHeight; ++j)
                for (int i = 0; i < kWidth; ++i) {
                    const double dx = std::abs((2.0 * i + 1) / kWidth - 1 - r.x_ndc), dy = std::abs((2.0 * j + 1) / kHeight - 1 - r.y_ndc);
                    const std::size_t k = static_cast<std::size_t>(j * kWidth + i) * 4;
                    const int d = std::abs(int{got[k]} - int{expected[k]});
                    if (dx < r.half_width_ndc && dy < r.half_height_ndc) worst_inside = std::max(worst_inside, d);
                    else {
                        ++outside;
                        differ += d > 3;
                    }
                }
            EXPECT_LE(worst_inside, 3);
            EXPECT_GT(differ, outside / 4);
        }
    }
}

TEST_F(DynamicViewports, ALostGazeGivesTheNormalViewsFromThatFrameOn) {
    const QuadDraw quad(kPattern);
    const Pixels expected = full_picture(quad.list(), 96, 96);
    Views v(96, 96, 2);
    const auto method = make("dynamic_viewports", v);
    ASSERT_TRUE(method->wants_gaze_status());
    v.look(0, {0, 0, 4, 4, 0});
    v.look(1, {0, 0, 4, 4, 0});
    method->submit(quad.list(), v.targets, v.focus);
    EXPECT_LT(psnr(read(v.targets[1]), expected), 30);
    v.focus[0].count = 0;   // one eye's gaze is lost: the status is the tracker's
    const auto cost = method->submit(quad.list(), v.targets, v.focus);
    EXPECT_EQ(cost.pixels_shaded, cost.pixels_full);
    EXPECT_EQ(read(v.targets[0]), expected);
    EXPECT_GT(psnr(read(v.targets[1]), expected), 35) << "its viewport has an offset, which rounds interpolation differently";
    v.look(0, {std::numeric_limits<float>::quiet_NaN(), 0, 4, 4, 0});
    method->submit(quad.list(), v.targets, v.focus);
    EXPECT_EQ(read(v.targets[0]), expected);
    v.look(0, {0, 0, 4, 4, 0});
    EXPECT_LT(method->submit(quad.list(), v.targets, v.focus).pixels_shaded, cost.pixels_full / 2) << "it is back";
}

TEST_F(DynamicViewports, NothingBleedsInFromTheNeighbourInTheAtlas) {
    const QuadDraw left("color = vec4(1.0, 0.0, 0.0, 1.0);");
    Views v(100, 100, 2);
    const auto method = make("dynamic_viewports", v);
    v.look(0, {0.3f, 0.3f, 4, 4, 0});
    v.look(1, {-0.3f, 0.3f, 4, 4, 0});
    method->submit(left.list(), v.targets, v.focus);
    const Pixels got = read(v.targets[0]);
    for (std::size_t i = 0; i < got.size(); i += 4) {
        ASSERT_EQ(got[i], 255);
        ASSERT_EQ(got[i + 1], 0);
    }
}

TEST_F(DynamicViewports, WhatDoesNotFitTheAtlasIsAnError) {
    MethodSettings s;
    s.dynamic_viewports = {.context_scale = 0.7, .focus_extent = 0.5};
    EXPECT_FALSE(foveation::create_method("dynamic_viewports", s).has_value());
    s.dynamic_viewports.separate_targets = true;
    EXPECT_TRUE(foveation::create_method("dynamic_viewports", s).has_value());
}

// ---- shading rate ----

TEST(ShadingRate, WithoutAGazeOnlyTheHiddenCornersAreCoarse) {
    const RateInput in = rate_input({.flags = kRateGaze | kRateOcclusion}, 1024, 1024, {std::nan(""), 0});
    EXPECT_EQ(tile_rate(in, 0, 0), Rate::r4x4);
    EXPECT_EQ(tile_rate(in, 63, 63), Rate::r4x4);
    EXPECT_EQ(tile_rate(in, 32, 32), Rate::r1x1);
    EXPECT_EQ(tile_rate(in, 0, 32), Rate::r1x1);
}

TEST(ShadingRate, TheGazeDrawsACircleWithARing) {
    const RateInput in = rate_input({.flags = kRateGaze}, 1600, 1600, {0, 0});   // 1x1 within 160 px, 2x2 within 240 px
    EXPECT_EQ(tile_rate(in, 50, 50), Rate::r1x1);
    EXPECT_EQ(tile_rate(in, 50 + 9, 50), Rate::r1x1);
    EXPECT_EQ(tile_rate(in, 50 + 12, 50), Rate::r2x2);
    EXPECT_EQ(tile_rate(in, 50 + 16, 50), Rate::r4x4);
    EXPECT_EQ(tile_rate(in, 0, 0), Rate::r4x4);
}

TEST(ShadingRate, StereoKeepsFullRateInTheFocusAreaOnly) {
    const RateInput plain = rate_input({.flags = kRateStereo}, 1000, 1000, {0, 0});
    EXPECT_EQ(tile_rate(plain, 31, 31), Rate::r1x1);
    EXPECT_EQ(tile_rate(plain, 2, 31), Rate::r2x2);
    // With a gaze off the focus area, nothing is at full rate.
    const RateInput both = rate_input({.flags = kRateStereo | kRateGaze}, 1000, 1000, {0.8, 0});
    for (int r = 0; r < both.rows(); ++r)
        for (int c = 0; c < both.columns(); ++c) EXPECT_NE(tile_rate(both, c, r), Rate::r1x1);
}

TEST(ShadingRate, ViewportsMapToTilesAsInVarjosExample) {
    const TileViewport v = to_tiles(100, 50, 1000, 800, 16);
    EXPECT_EQ(v.x, 6);
    EXPECT_EQ(v.y, 3);
    EXPECT_EQ(v.width, 62);
    EXPECT_EQ(v.height, 50);
}

using RateMaps = GlTest;

TEST_F(RateMaps, ComputeShaderAndProcessorAgreeBitForBit) {
    auto map = foveation::RateMap::create(1 << 14);
    ASSERT_TRUE(map.has_value()) << map.error().message();
    unsigned seed = 7;
    const auto random = [&](double low, double high) {
        seed = seed * 1664525u + 1013904223u;
        return low + (high - low) * static_cast<double>(seed >> 8) / 16777216.0;
    };
    for (int i = 0; i < 200; ++i) {
        RateSettings s;
        s.flags = static_cast<std::uint32_t>(i % 8);
        s.tile_px = 4 * (1 + i % 16);
        s.inner_radius = random(0, 0.3);
        s.outer_radius = s.inner_radius + random(0, 0.3);
        s.lens_radius = random(0.3, 1.5);
        s.focus_extent = random(0, 1);
        const RateInput in = rate_input(s, static_cast<int>(random(1, 400)), static_cast<int>(random(1, 400)),
                                        {i % 11 == 0 ? 1e30 : random(-1.5, 1.5), random(-1.5, 1.5)});
        const auto tiles = static_cast<std::size_t>(in.columns()) * static_cast<std::size_t>(in.rows());
        std::vector<std::uint8_t> expected(tiles), got(tiles, 99);
        fill_rate_map(in, expected);
        map->set_input(in);
        map->dispatch(in.columns(), in.rows());
        map->read(in.columns(), in.rows(), got);
        ASSERT_EQ(got, expected) << "map " << i;
    }
}

TEST_F(RateMaps, AreAppliedByLevelPasses) {
    constexpr int kSize = 256;
    const QuadDraw quad(footprint_shader(kSize, kSize));
    MethodSettings s;
    s.count_fragments = true;
    s.filter = gl::Filter::nearest;
    s.shading_rate = {.flags = kRateGaze | kRateOcclusion, .tile_px = 8, .inner_radius = 0.15, .outer_radius = 0.25};
    Views v(kSize, kSize);
    const auto method = make("shading_rate", v, s);
    for (const float x : {0.0f, -0.4f}) {
        v.look(0, {x, 0.1f, 4, 4, 0});
        const auto cost = method->submit(quad.list(), v.targets, v.focus);
        EXPECT_EQ(method->counted_fragments(), cost.pixels_shaded);
        EXPECT_LT(cost.pixels_shaded, cost.pixels_full / 3);
        const RateInput in = rate_input(s.shading_rate, kSize, kSize, {x, static_cast<double>(0.1f)});
        const Pixels got = read(v.targets[0]);
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const Rate rate = tile_rate(in, i / 8, j / 8);
                const int want = rate == Rate::r1x1 ? 1 : rate == Rate::r2x2 ? 2 : 4;
                ASSERT_NEAR(got[static_cast<std::size_t>(j * kSize + i) * 4] / 16.0, want, 0.1) << i << "," << j;
            }
        EXPECT_NEAR(method->full_region(0).half_width_ndc, 0.30, 0.01);
    }
}

TEST_F(RateMaps, SettingsThatCannotBeAreErrors) {
    for (const RateSettings bad : {RateSettings{.tile_px = 6}, {.inner_radius = 0.3, .outer_radius = 0.2}, {.lens_radius = 0}, {.focus_extent = std::nan("")}}) {
        MethodSettings s;
        s.shading_rate = bad;
        EXPECT_FALSE(foveation::create_method("shading_rate", s).has_value());
    }
}

}  // namespace
