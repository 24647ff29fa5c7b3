// Lens distortion and temporal smoothing: the arithmetic, the pictures, and that what is off costs nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "render/effects/declared.hpp"
#include "render/effects/lens_pass.hpp"
#include "render/effects/smoothing.hpp"
#include "render/scene/scene.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;
using effects::Channel;
using effects::Effect;
using effects::Lens;

namespace {

const Lens kLenses[] = {{.k1 = 0.22, .k2 = 0.24}, {.k1 = 0.1, .k2 = 0.05, .k3 = 0.02, .p1 = 0.004, .p2 = -0.006, .x = 0.08, .y = -0.02, .red = 0.994, .blue = 1.009}, {.k1 = -0.08}, {}};

// ---- the arithmetic ----

TEST(LensMaths, InverseLeadsBackToTheSamePoint) {
    for (const Lens& l : kLenses)
        for (const double aspect : {1.0, 1.3})
            for (const auto channel : {Channel::red, Channel::green, Channel::blue})
                for (double y = -0.9; y <= 0.9; y += 0.3)
                    for (double x = -0.9; x <= 0.9; x += 0.3) {
                        const NdcPoint seen = effects::rendered_of(l, {x, y}, aspect, channel);
                        const auto back = effects::panel_of(l, seen, aspect, channel);
                        ASSERT_TRUE(back.has_value()) << x << " " << y;
                        EXPECT_NEAR(back->x, x, 1e-9);
                        EXPECT_NEAR(back->y, y, 1e-9);
                        // The other way round: a gaze stays where it is.
                        if (const auto panel = effects::panel_of(l, {x, y}, aspect, channel)) {
                            const NdcPoint gaze = effects::rendered_of(l, *panel, aspect, channel);
                            EXPECT_NEAR(gaze.x, x, 1e-9);
                            EXPECT_NEAR(gaze.y, y, 1e-9);
                        }
                    }
}

TEST(LensMaths, FollowsBrownsEquation) {
    const Lens l{.k1 = 0.2, .k2 = 0.1, .p1 = 0.01, .p2 = 0.02};
    const NdcPoint p = effects::rendered_of(l, {0.5, -0.4}, 1);
    const double r2 = 0.41, k = 1 + 0.2 * r2 + 0.1 * r2 * r2;
    EXPECT_NEAR(p.x, 0.5 * k + 2 * 0.01 * 0.5 * -0.4 + 0.02 * (r2 + 2 * 0.25), 1e-12);
    EXPECT_NEAR(p.y, -0.4 * k + 0.01 * (r2 + 2 * 0.16) + 2 * 0.02 * 0.5 * -0.4, 1e-12);
    const NdcPoint red = effects::rendered_of({.k1 = 0.2, .red = 0.99}, {0.5, 0}, 1, Channel::red);
    EXPECT_NEAR(red.x, 0.99 * 0.5 * 1.05, 1e-12);
    // Circles are circles in a wide view, and the right eye's lens is the mirror image.
    const NdcPoint wide = effects::rendered_of({.k1 = 0.2}, {0.5, 0}, 2);
    EXPECT_NEAR(wide.x, 0.5 * 1.2, 1e-12);
    const Lens left{.k1 = 0.1, .p1 = 0.01, .p2 = 0.02, .x = 0.1}, right = effects::mirrored(left);
    const NdcPoint a = effects::rendered_of(left, {0.3, 0.2}, 1), b = effects::rendered_of(right, {-0.3, 0.2}, 1);
    EXPECT_NEAR(a.x, -b.x, 1e-12);
    EXPECT_NEAR(a.y, b.y, 1e-12);
}

TEST(LensMaths, ALensThatFoldsThePictureIsRefused) {
    EXPECT_FALSE(effects::check_lens({.k1 = -0.5}, "x").has_value());
    EXPECT_FALSE(effects::check_lens({.k1 = std::nan("")}, "x").has_value());
    EXPECT_FALSE(effects::check_lens({.red = 2}, "x").has_value());
    EXPECT_EQ(effects::panel_of({.k1 = -0.08}, {50, 50}, 1), std::nullopt) << "the lens shows no such point";
    for (const Lens& l : kLenses) EXPECT_TRUE(effects::check_lens(l, "x").has_value());
    const auto file = effects::read_scene_file("scene = \"text\"\n[lens]\nk1 = 0.22\nblue = 1.01\n", "a.toml");
    ASSERT_TRUE(file.has_value()) << file.error().message();
    EXPECT_EQ(file->declared.lens->k1, 0.22);
    EXPECT_EQ(file->declared.lens->blue, 1.01);
    for (const char* bad : {"[lens]\nk9 = 1\n", "[lens]\nk1 = 3\n", "[lens]\nk1 = \"a\"\n", "[lens]\nk1 = -0.6\n"}) {
        const auto r = effects::read_scene_file(std::string("scene = \"text\"\n") + bad, "a.toml");
        ASSERT_FALSE(r.has_value()) << bad;
        EXPECT_NE(r.error().message().find("a.toml"), std::string::npos);
    }
}

TEST(LensMaths, AScenesLensCallsForDistortionAndNothingElseDoes) {
    effects::Declared d;
    EXPECT_FALSE(effects::plan({}, {.method = "full"}, d).on(Effect::lens_distortion));
    d.effects[static_cast<std::size_t>(Effect::lens_distortion)] = true;
    EXPECT_FALSE(effects::plan({}, {.method = "full"}, d).on(Effect::lens_distortion)) << "without a lens there is nothing to undo";
    d.lens = kLenses[0];
    const auto p = effects::plan({}, {.method = "full"}, d);
    EXPECT_TRUE(p.on(Effect::lens_distortion));
    EXPECT_EQ(p.lens(), kLenses[0]);
    d.effects[static_cast<std::size_t>(Effect::lens_distortion)] = false;
    EXPECT_FALSE(effects::plan({}, {.method = "full"}, d).on(Effect::lens_distortion));
}

TEST(SmoothingRule, IsCalledForByDetailThatMoves) {
    effects::Needs n;
    n.thin_share = 0.07;
    n.camera_px = 4;
    EXPECT_TRUE(effects::plan(n, {.method = "inset_outset"}).on(Effect::temporal_smoothing));
    EXPECT_FALSE(effects::plan(n, {.method = "full"}).on(Effect::temporal_smoothing));
    n.camera_px = 0.2;
    EXPECT_FALSE(effects::plan(n, {.method = "inset_outset"}).on(Effect::temporal_smoothing)) << "nothing moves";
    n.camera_px = 60;
    EXPECT_FALSE(effects::plan(n, {.method = "inset_outset"}).on(Effect::temporal_smoothing)) << "too fast to be followed";
    n.camera_px = 4;
    n.thin_share = 0.01;
    EXPECT_FALSE(effects::plan(n, {.method = "inset_outset"}).on(Effect::temporal_smoothing));
}

TEST(SmoothingRule, ReprojectionFollowsTheHead) {
    const FieldOfView fov{-1.05, 0.95, 1.0, -1.0};
    const scene::Pose before{.yaw_rad = 0.3, .pitch_rad = -0.1}, now{.yaw_rad = 0.34, .pitch_rad = -0.07};
    const auto m = effects::before_from_now(fov, before, now);
    // A far point of the world, projected in both frames by the scene's own camera.
    const auto project = [&](const scene::Pose& p, std::array<double, 3> world) {
        const scene::Mat4 c = scene::multiply(scene::projection(fov, 0.1, 1e6), scene::view_from_world(p, 0));
        std::array<double, 4> r{};
        for (std::size_t i = 0; i < 4; ++i) r[i] = c[i] * world[0] + c[4 + i] * world[1] + c[8 + i] * world[2] + c[12 + i];
        return NdcPoint{r[0] / r[3], r[1] / r[3]};
    };
    for (const std::array<double, 3> world : {std::array{-300.0, -100.0, -900.0}, {100.0, 50.0, -900.0}, {-600.0, 250.0, -800.0}}) {
        const NdcPoint a = project(now, world), b = project(before, world);
        const double w = m[6] * a.x + m[7] * a.y + m[8];
        EXPECT_NEAR((m[0] * a.x + m[1] * a.y + m[2]) / w, b.x, 1e-9);
        EXPECT_NEAR((m[3] * a.x + m[4] * a.y + m[5]) / w, b.y, 1e-9);
    }
    const auto same = effects::before_from_now(fov, now, now);
    EXPECT_NEAR(same[0] / same[8], 1, 1e-12);
    EXPECT_NEAR(same[2], 0, 1e-12);
}

// ---- the pictures ----

using LensPicture = GlTest;

TEST_F(LensPicture, ShowsWhatTheEquationSays) {
    constexpr int kSize = 256;
    // Two smooth ramps: the colour at a place says which place of the rendered picture it is.
    const QuadDraw quad("color = vec4(0.5 + 0.5 * ndc.x, 0.5 + 0.5 * ndc.y, 0.5 - 0.5 * ndc.x, 1.0);");
    Views v(kSize, kSize);
    auto full = *foveation::create_method("full", {});
    full->submit(quad.list(), v.targets, v.focus);
    for (const Lens& l : kLenses) {
        auto pass = effects::LensPass::create(l);
        ASSERT_TRUE(pass.has_value()) << pass.error().message();
        ASSERT_TRUE(pass->prepare(kSize, kSize, 2).has_value());
        for (const std::size_t eye : {0u, 1u}) {
            pass->draw(eye, v.owned[0].color_texture());
            const Pixels got = read({pass->result(eye).framebuffer(), 0, 0, kSize, kSize});
            const Lens& lens = pass->lens(eye);
            std::size_t black = 0;
            for (int y = 3; y < kSize; y += 7)
                for (int x = 3; x < kSize; x += 7) {
                    const NdcPoint panel{(2.0 * x + 1) / kSize - 1, (2.0 * y + 1) / kSize - 1};
                    const std::uint8_t* p = &got[static_cast<std::size_t>(y * kSize + x) * 4];
                    const NdcPoint from[] = {effects::rendered_of(lens, panel, 1, Channel::red), effects::rendered_of(lens, panel, 1), effects::rendered_of(lens, panel, 1, Channel::blue)};
                    const double want[] = {127.5 + 127.5 * from[0].x, 127.5 + 127.5 * from[1].y, 127.5 - 127.5 * from[2].x};
                    for (std::size_t c = 0; c < 3; ++c) {
                        const double edge = std::max(std::abs(from[c].x), std::abs(from[c].y));
                        if (edge > 1.01) {
                            EXPECT_EQ(p[c], 0) << "the lens shows nothing there";
                            ++black;
                        } else if (edge < 0.98) {
                            EXPECT_NEAR(p[c], want[c], 1.6) << x << "," << y << " channel " << c;
                        }
                    }
                }
            EXPECT_EQ(black > 0, lens.k1 > 0.05) << "a pincushion lens has black corners";
        }
    }
}

// The mesh against the equation, in pixels of a large panel: linear between its corners.
TEST(LensMaths, TheMeshIsFineEnough) {
    for (const Lens& l : kLenses) {
        double worst_px = 0;
        for (int i = 0; i < effects::kLensMesh; ++i)
            for (int j = 0; j < effects::kLensMesh; ++j) {
                const auto at = [](double k) { return 2 * k / effects::kLensMesh - 1; };
                const NdcPoint a = effects::rendered_of(l, {at(i), at(j)}, 1), b = effects::rendered_of(l, {at(i + 1), at(j + 1)}, 1);
                const NdcPoint middle = effects::rendered_of(l, {at(i + 0.5), at(j + 0.5)}, 1);   // on the diagonal of its triangles
                if (std::max(std::abs(middle.x), std::abs(middle.y)) > 1) continue;
                worst_px = std::max(worst_px, std::hypot((a.x + b.x) / 2 - middle.x, (a.y + b.y) / 2 - middle.y) * 1024);
            }
        EXPECT_LT(worst_px, 1.0);
    }
}

struct SmoothedFrames {
    Pixels result, rendered;
    std::vector<bool> sharp;
};

class SmoothingPicture : public GlTest {
protected:
    static constexpr int kSize = 192;
    // Frames of a still picture under a gaze that moves; the last one, smoothed and not.
    static SmoothedFrames frames(const char* method, int count, double* flicker_plain = nullptr, double* flicker_smooth = nullptr) {
        const QuadDraw quad("float s = sin(ndc.x * 90.0) * cos(ndc.y * 80.0 + ndc.x * 31.0); color = vec4(0.5 + 0.5 * s, 0.5 + 0.4 * sin(ndc.x * 60.0), 0.5, 1.0);");
        Views v(kSize, kSize);
        foveation::MethodSettings settings;
        settings.inset_outset.blend_px = 6;
        auto m = *foveation::create_method(method, settings);
        EXPECT_TRUE(m->prepare(v.targets).has_value());
        auto s = *effects::Smoothing::create();
        EXPECT_TRUE(s.prepare(kSize, kSize, 1).has_value());
        SmoothedFrames f;
        Pixels plain_before, smooth_before;
        for (int i = 0; i < count; ++i) {
            v.look(0, {-0.3f + 0.02f * static_cast<float>(i), 0.1f, 5, 5, 0});
            m->submit(quad.list(), v.targets, v.focus);
            const bool drawn = s.draw(0, v.owned[0].color_texture(), m->plan(0), m->full_region(0), {-1, 1, 1, -1}, {});
            EXPECT_EQ(drawn, std::string(method) != "full");
            if (!drawn) return f;
            f.result = read({s.result(0).framebuffer(), 0, 0, kSize, kSize});
            f.rendered = read(v.targets[0]);
            f.sharp.assign(static_cast<std::size_t>(kSize) * kSize, false);
            const auto region = m->full_region(0);
            double plain = 0, smooth = 0;
            std::size_t n = 0;
            for (int y = 0; y < kSize; ++y)
                for (int x = 0; x < kSize; ++x) {
                    const double dx = ((2.0 * x + 1) / kSize - 1 - region.x_ndc) / region.half_width_ndc, dy = ((2.0 * y + 1) / kSize - 1 - region.y_ndc) / region.half_height_ndc;
                    const auto k = static_cast<std::size_t>(y * kSize + x);
                    f.sharp[k] = m->plan(0) != nullptr ? m->plan(0)->level_at(x / m->plan(0)->bin_px(), y / m->plan(0)->bin_px()) == 0 : dx * dx + dy * dy < 1;
                    if (f.sharp[k] || plain_before.empty() || i < count / 2) continue;
                    const auto square = [](int d) { return static_cast<double>(d * d); };
                    plain += square(int{f.rendered[4 * k]} - int{plain_before[4 * k]});
                    smooth += square(int{f.result[4 * k]} - int{smooth_before[4 * k]});
                    ++n;
                }
            if (n > 0 && flicker_plain != nullptr) {
                *flicker_plain += plain / static_cast<double>(n);
                *flicker_smooth += smooth / static_cast<double>(n);
            }
            plain_before = f.rendered;
            smooth_before = f.result;
        }
        return f;
    }
};

TEST_F(SmoothingPicture, LeavesTheFoveaBitExact) {
    for (const char* method : {"scaled_bins", "inset_outset", "dynamic_viewports", "shading_rate"}) {
        const SmoothedFrames f = frames(method, 6);
        std::size_t sharp = 0, mixed = 0;
        for (std::size_t i = 0; i < f.sharp.size(); ++i) {
            const bool same = std::equal(&f.result[4 * i], &f.result[4 * i] + 4, &f.rendered[4 * i]);
            if (f.sharp[i]) {
                ASSERT_TRUE(same) << method << " pixel " << i;
                ++sharp;
            } else {
                mixed += !same;
            }
        }
        EXPECT_GT(sharp, 300u) << method;
        if (std::string(method) == "scaled_bins") {
            EXPECT_GT(mixed, 300u) << "else this test sees nothing";
        }
    }
}

// A jump of a bin to another level is spread over frames: its sum stays, its square falls.
TEST_F(SmoothingPicture, SpreadsTheJumpsOfThePeripheryUnderAMovingEye) {
    double plain = 0, smooth = 0;
    static_cast<void>(frames("scaled_bins", 12, &plain, &smooth));
    EXPECT_GT(plain, 0.01);
    EXPECT_LT(smooth, 0.7 * plain);
    std::printf("mean squared change: %.2f plain, %.2f smooth\n", plain, smooth);
}

TEST_F(SmoothingPicture, AFullRenderIsLeftAlone) { static_cast<void>(frames("full", 2)); }

TEST_F(SmoothingPicture, WhatHasChangedLeavesNoGhost) {
    const QuadDraw white("color = vec4(1.0);"), black("color = vec4(0.0, 0.0, 0.0, 1.0);");
    Views v(64, 64);
    auto m = *foveation::create_method("scaled_bins", {});
    ASSERT_TRUE(m->prepare(v.targets).has_value());
    auto s = *effects::Smoothing::create();
    ASSERT_TRUE(s.prepare(64, 64, 1).has_value());
    v.look(0, {0.9f, 0.9f, 9, 9, 0});
    for (const QuadDraw* q : {&white, &white, &black}) {
        m->submit(q->list(), v.targets, v.focus);
        ASSERT_TRUE(s.draw(0, v.owned[0].color_texture(), m->plan(0), m->full_region(0), {-1, 1, 1, -1}, {}));
    }
    const Pixels p = read({s.result(0).framebuffer(), 0, 0, 64, 64});
    for (std::size_t i = 0; i < p.size(); i += 4) ASSERT_EQ(p[i], 0);
}

}  // namespace
