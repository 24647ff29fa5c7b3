// The ways to draw the levels: which one is chosen, and that the rectangle lists draw what the masks draw.
#include <gtest/gtest.h>

#include <cstdlib>

#include "render/density/rectangle_cover.hpp"
#include "render/foveation/auto.hpp"
#include "render/scene/scene.hpp"
#include "tests/render/allocation_count.hpp"
#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::BinExecutor;
using foveation::ExecutorChoice;
using foveation::FrameCost;
using foveation::Method;
using foveation::MethodSettings;

namespace {

// ---- the choice, with injected costs ----

using Costs = std::array<double, ExecutorChoice::kWays>;   // milliseconds, by way

std::array<int, ExecutorChoice::kWays> run(ExecutorChoice& choice, const Costs& ms, int frames) {
    std::array<int, ExecutorChoice::kWays> drawn{};
    for (int i = 0; i < frames; ++i) {
        const auto way = choice.next();
        ++drawn[way];
        choice.observe(seconds(ms[way] * 1e-3));
    }
    return drawn;
}

TEST(ExecutorChoice, PicksEachWayWhereItWins) {
    for (const auto winner : {ExecutorChoice::masks, ExecutorChoice::full, ExecutorChoice::late, ExecutorChoice::rectangles}) {
        ExecutorChoice choice({.late_allowance = 0.15, .rectangles = true});
        Costs ms{30, 30, 35, 30};   // late: not even with its allowance cheaper
        ms[winner] = 20;
        run(choice, ms, 600);
        EXPECT_EQ(choice.settled(), winner);
        const auto drawn = run(choice, ms, 6000);
        EXPECT_GT(drawn[winner], 5950) << "trying costs next to nothing";
        for (const auto other : {ExecutorChoice::masks, ExecutorChoice::full, ExecutorChoice::late, ExecutorChoice::rectangles}) EXPECT_GT(drawn[other], 0) << "but each is tried";
    }
}

TEST(ExecutorChoice, FallsBackToFullWhereFoveationLosesAndReturnsWhereItWins) {
    ExecutorChoice choice({.rectangles = false});
    EXPECT_GT(run(choice, {30, 100, 0, 0}, 1000)[ExecutorChoice::masks], 980);
    EXPECT_EQ(choice.settled(), ExecutorChoice::masks);
    run(choice, {220, 100, 0, 0}, 100);
    EXPECT_EQ(choice.settled(), ExecutorChoice::full) << "a much dearer frame is looked into at once";
    EXPECT_LT(run(choice, {220, 100, 0, 0}, 4000)[ExecutorChoice::masks], 12) << "trying costs next to nothing";
    run(choice, {30, 100, 0, 0}, 1100);
    EXPECT_EQ(choice.settled(), ExecutorChoice::masks);
}

TEST(ExecutorChoice, DoesNotFlutterWhenAllCostTheSame) {
    ExecutorChoice choice({.late_allowance = 0.02, .rectangles = true});
    int switches = 0;
    auto last = choice.settled();
    unsigned noise = 1;
    for (int i = 0; i < 20'000; ++i) {
        noise = noise * 1664525u + 1013904223u;
        choice.observe(seconds(0.020 * (0.98 + 0.04 * static_cast<double>(noise >> 8) / 16777216.0)));
        switches += choice.settled() != last;
        last = choice.settled();
    }
    EXPECT_EQ(switches, 0);
    EXPECT_FALSE(choice.take_switch().has_value());
    choice.observe(Duration{0});
    choice.observe(Duration{-5});
    EXPECT_EQ(choice.settled(), last);
}

TEST(ExecutorChoice, TakesTheLateFoveaWhileItCostsLittleMore) {
    ExecutorChoice choice({.late_allowance = 0.15, .rectangles = false});
    run(choice, {30, 100, 31, 0}, 600);
    EXPECT_EQ(choice.settled(), ExecutorChoice::late) << "3 % more";
    run(choice, {30, 100, 45, 0}, 1500);
    EXPECT_EQ(choice.settled(), ExecutorChoice::masks) << "half as much again is too much";
    run(choice, {220, 100, 230, 0}, 1500);
    EXPECT_EQ(choice.settled(), ExecutorChoice::full);
    const auto drawn = run(choice, {220, 100, 230, 0}, 6000);
    EXPECT_LT(drawn[ExecutorChoice::masks] + drawn[ExecutorChoice::late], 20) << "trying costs next to nothing";
}

TEST(ExecutorChoice, WaysThatAreNoChoiceAreNeverDrawn) {
    ExecutorChoice neither({.late_allowance = 0, .rectangles = false});
    const auto drawn = run(neither, {20, 20, 1, 1}, 3000);
    EXPECT_EQ(drawn[ExecutorChoice::late], 0);
    EXPECT_EQ(drawn[ExecutorChoice::rectangles], 0);
}

TEST(ExecutorChoice, SaysWhyAndTellsEachSwitchOnce) {
    ExecutorChoice choice({.rectangles = true});
    EXPECT_STREQ(choice.why(), "not everything is measured yet");
    bool saw_trial = false;
    for (int i = 0; i < 600; ++i) {
        saw_trial |= choice.trying() && std::string(choice.why()) == "a trial of what it costs";
        choice.observe(std::chrono::milliseconds(choice.next() == ExecutorChoice::rectangles ? 12 : choice.next() == ExecutorChoice::full ? 40 : 20));
    }
    EXPECT_TRUE(saw_trial);
    const auto told = choice.take_switch();
    ASSERT_TRUE(told.has_value());
    EXPECT_EQ(told->from, ExecutorChoice::masks);
    EXPECT_EQ(told->to, ExecutorChoice::rectangles);
    EXPECT_EQ(told->from_cost, std::chrono::milliseconds(20));
    EXPECT_EQ(told->to_cost, std::chrono::milliseconds(12));
    EXPECT_FALSE(choice.take_switch().has_value());
    while (choice.trying()) choice.observe(std::chrono::milliseconds(50));
    EXPECT_STREQ(choice.why(), "the cheapest by the last trials");
}

// ---- the rectangle lists ----

using Executors = GlTest;

MethodSettings by(BinExecutor executor, MethodSettings s = {}) {
    s.executor = executor;
    return s;
}

// Many draws with bounds, some of them blended, some that write their depth; and one without bounds behind them.
struct Mosaic {
    Mosaic() {
        back = std::make_unique<QuadDraw>(kPattern, QuadOptions{.depth = 0.95f, .depth_right = 0.9f});
        for (int i = 0; i < 40; ++i) {
            const float x = -1.1f + 0.3f * static_cast<float>(i % 8), y = -1.05f + 0.4f * static_cast<float>(i / 8), near = 0.2f + 0.015f * static_cast<float>(i);
            const char* body = i % 5 == 3 ? "color = vec4(fract(ndc * 7.0), 0.3, 0.5);"
                               : i % 5 == 4 ? "gl_FragDepth = 0.5 + 0.2 * sin(ndc.x * 30.0); color = vec4(1.0, fract(ndc * 11.0), 1.0);"
                                            : "color = vec4(0.2, fract(ndc * 13.0), 1.0);";
            tiles.push_back(std::make_unique<QuadDraw>(body, QuadOptions{.where = {x, y, x + 0.37f, y + 0.29f}, .depth = near, .depth_right = near + 0.1f}));
        }
        fill({});
    }
    void fill(const gl::Clear& clear) {
        list.begin(clear, {});
        list.add(back->list().draws()[0]);
        for (std::size_t i = 0; i < tiles.size(); ++i) {
            gl::Draw d = tiles[i]->list().draws()[0];
            d.blend = i % 5 == 3;
            list.add(d);
        }
    }
    std::unique_ptr<QuadDraw> back;
    std::vector<std::unique_ptr<QuadDraw>> tiles;
    gl::CommandList list;
};

constexpr density::FocalPoint kGazes[] = {{0.1f, -0.2f, 6, 6, 0}, {-0.9f, 0.95f, 9, 5, 0}, {0, 0, 2, 3, 1}, {5, 5, 3, 3, 0}};

TEST_F(Executors, RectanglesDrawThePictureOfTheMasksBitForBit) {
    const Mosaic mosaic;
    for (const int edge : {96, 131})   // the second is no whole number of texels
        for (const int levels : {1, 2, 3, 4})
            for (const double worth : {0.0, 300.0, 1e9}) {
                MethodSettings settings;
                settings.plan.levels = density::standard_levels(levels == 3);
                settings.plan.level_count = levels;
                settings.texels_per_rectangle = worth;
                if (levels == 4) settings.filter = gl::Filter::cubic;
                const Surface a = color_surface(edge), b = color_surface(edge);
                const auto masks = make_method("scaled_bins", a, by(BinExecutor::masks, settings)), lists = make_method("scaled_bins", b, by(BinExecutor::rectangles, settings));
                for (const density::FocalPoint& gaze : kGazes) {
                    const FrameCost by_masks = submit(*masks, mosaic.list, a, gaze), by_lists = submit(*lists, mosaic.list, b, gaze);
                    ASSERT_EQ(read(a.target), read(b.target)) << edge << " px, " << levels << " levels, worth " << worth << ", gaze " << gaze.x_ndc;
                    if (worth == 0 && edge == 96) {
                        EXPECT_EQ(by_lists.pixels_shaded, by_masks.pixels_shaded);
                    }
                    EXPECT_GE(by_lists.pixels_shaded, by_masks.pixels_shaded);
                }
            }
    EXPECT_EQ(gl::pending_error(), "");
}

TEST_F(Executors, RectanglesDrawWhatMasksDrawInEveryKindOfFramebuffer) {
    Mosaic mosaic;
    std::vector<SurfaceOptions> kinds{{.renderbuffer = true}, {.format = 0x881A /* RGBA16F */}, {.stencil = false}};
    if (context().info().max_samples >= 4) kinds.push_back({.renderbuffer = true, .samples = 4});
    for (const SurfaceOptions& kind : kinds) {
        const Surface a = color_surface(96, kind), b = color_surface(96, kind);
        const auto masks = make_method("scaled_bins", a, by(BinExecutor::masks)), lists = make_method("scaled_bins", b, by(BinExecutor::rectangles));
        submit(*masks, mosaic.list, a, kGazes[0]);
        submit(*lists, mosaic.list, b, kGazes[0]);
        EXPECT_EQ(read_resolved(a), read_resolved(b)) << kind.samples << " samples, format " << kind.format;
    }
    // Going on over a picture, with its depth.
    MethodSettings settings;
    settings.resolve_depth = true;
    const Surface a = color_surface(96), b = color_surface(96);
    const auto masks = make_method("scaled_bins", a, by(BinExecutor::masks, settings)), lists = make_method("scaled_bins", b, by(BinExecutor::rectangles, settings));
    for (const auto& [method, surface] : {std::pair{masks.get(), &a}, {lists.get(), &b}}) {
        mosaic.fill({});
        submit(*method, mosaic.list, *surface, kGazes[0]);
        mosaic.fill({.keep_color = true, .keep_depth = true});
        EXPECT_FALSE(submit(*method, mosaic.list, *surface, kGazes[1]).fell_back);
    }
    EXPECT_EQ(read(a.target), read(b.target)) << "what blends is drawn once, also where rectangles meet";
    EXPECT_EQ(gl::pending_error(), "");
}

TEST_F(Executors, RectanglesDrawAScenesPictureWithFewerFragments) {
    auto scene = scene::Scene::create({});
    gl::CommandList list;
    const auto eyes = scene::stereo_views();
    Views a(160, 128, 2), b(160, 128, 2);
    const auto make = [](const Views& v, BinExecutor executor) {
        auto m = foveation::create_method("scaled_bins", by(executor));
        EXPECT_TRUE((*m)->prepare(v.targets).has_value());
        return *std::move(m);
    };
    const auto masks = make(a, BinExecutor::masks), lists = make(b, BinExecutor::rectangles);
    for (int step = 0; step < 4; ++step) {
        scene->record(9.0 * step, eyes, list);
        for (Views* v : {&a, &b})
            for (std::size_t i = 0; i < 2; ++i) v->look(i, {0.3f * static_cast<float>(step) - 0.5f, 0.1f, 5, 5, 0});
        masks->submit(list, a.targets, a.focus);
        lists->submit(list, b.targets, b.focus);
        for (std::size_t i = 0; i < 2; ++i) ASSERT_EQ(read(a.targets[i]), read(b.targets[i])) << "step " << step;
    }
}

// Which draw goes into which rectangle, found out without the executor.
TEST_F(Executors, EveryDrawIsIssuedOnceForEachRectangleThatItsBoundsTouch) {
    const Mosaic mosaic;
    const Surface s = color_surface(96);
    MethodSettings settings;
    settings.texels_per_rectangle = 100;
    const auto lists = make_method("scaled_bins", s, by(BinExecutor::rectangles, settings));
    for (const density::FocalPoint& gaze : kGazes) {
        const FrameCost cost = submit(*lists, mosaic.list, s, gaze);
        if (std::string(cost.executor) == "full") continue;   // everything is wanted at full density
        const density::Plan& plan = *lists->plan(0);
        density::RectangleCover cover;
        std::uint32_t draws = 0, rectangles = 0, without_bounds = 0;
        for (int level = 0; level < plan.settings().level_count; ++level) {
            ASSERT_TRUE(cover.update(plan, level, settings.texels_per_rectangle));
            for (const density::PixelRect& r : cover.rectangles()) {
                ++rectangles;
                const double w = plan.level_width_px(level), h = plan.level_height_px(level);
                for (const gl::Draw& d : mosaic.list.draws()) {
                    const gl::Box& box = d.bounds[0];
                    const bool whole = box.x0 == -1 && box.x1 == 1 && box.y0 == -1 && box.y1 == 1;
                    const bool touches = double(box.x0) < 2 * r.x1 / w - 1 + 1e-6 && double(box.x1) > 2 * r.x0 / w - 1 - 1e-6 && double(box.y0) < 2 * r.y1 / h - 1 + 1e-6 && double(box.y1) > 2 * r.y0 / h - 1 - 1e-6;
                    draws += touches;
                    without_bounds += whole && touches;
                }
            }
        }
        EXPECT_EQ(cost.draws, draws);
        EXPECT_EQ(cost.submissions, rectangles);
        EXPECT_EQ(without_bounds, rectangles) << "a draw without bounds is never left out";
        EXPECT_LE(cost.draws, rectangles * mosaic.list.size());
        if (rectangles > 3) {
            EXPECT_LT(cost.draws, rectangles * mosaic.list.size() / 2) << "most draws are small";
        }
        EXPECT_STREQ(cost.executor, "rectangle lists");
    }
}

// A fragment that writes its depth cannot be rejected early: a mask does not spare it, a rectangle does.
TEST_F(Executors, RectanglesSpareFragmentsThatMasksCannot) {
    if (context().info().renderer.find("llvmpipe") == std::string::npos) GTEST_SKIP() << "when a driver shades what it rejects is its own business";
    const QuadDraw quad("color = vec4(1.0);");
    // Counts itself, without asking for early tests as the counting variants do.
    const auto program = gl::build_program("depths", "#version 310 es\nlayout(location = 0) uniform vec4 crop;\nlayout(location = 0) in vec3 p;\nvoid main() { gl_Position = vec4(p.xy * crop.xy + crop.zw, 0.0, 1.0); }\n",
                                           "#version 310 es\nprecision highp float;\nlayout(binding = 0, offset = 0) uniform highp atomic_uint n;\n"
                                           "out vec4 color;\nvoid main() { atomicCounterIncrement(n); gl_FragDepth = 0.5; color = vec4(1.0); }\n");
    ASSERT_TRUE(program.has_value()) << program.error().message();
    const Surface s = color_surface(128);
    constexpr density::FocalPoint kRound{0, 0, 3, 3, 0};
    std::array<std::uint64_t, 2> shaded{};
    for (const BinExecutor executor : {BinExecutor::masks, BinExecutor::rectangles}) {
        MethodSettings settings = by(executor);
        settings.texels_per_rectangle = 0;
        settings.count_fragments = true;   // binds the counter
        const auto m = make_method("scaled_bins", s, settings);
        gl::CommandList list;
        list.begin({}, {});
        gl::Draw d = quad.list().draws()[0];
        d.program = program->name();
        d.counting_program = 0;
        list.add(d);
        submit(*m, list, s, kRound);
        shaded[static_cast<std::size_t>(executor)] = m->counted_fragments();
        if (executor == BinExecutor::rectangles) {
            EXPECT_EQ(shaded[1], submit(*m, list, s, kRound).pixels_shaded);
        }
    }
    EXPECT_LT(shaded[1], shaded[0] * 8 / 10);
}

TEST_F(Executors, AFrameSaysWhatDrewItAndWhy) {
    const Mosaic mosaic;
    const Surface s = color_surface(96);
    const auto said = [&](const char* method, const MethodSettings& settings, const density::FocalPoint& gaze) {
        const FrameCost cost = submit(*make_method(method, s, settings), mosaic.list, s, gaze);
        return std::string(cost.executor) + ": " + cost.why;
    };
    EXPECT_EQ(said("full", {}, kGazes[0]), "full: the method");
    EXPECT_EQ(said("scaled_bins", {}, kGazes[0]), "level masks: the setting");
    EXPECT_EQ(said("scaled_bins", by(BinExecutor::rectangles), kGazes[0]), "rectangle lists: the setting");
    EXPECT_EQ(said("scaled_bins", {}, {0, 0, 0, 0, 0}), "full: full density is wanted everywhere");
    EXPECT_EQ(said("scaled_bins_late", {}, kGazes[0]), "late level 0: the method");
    EXPECT_EQ(said("auto", {}, kGazes[0]), "level masks: not everything is measured yet");
}

TEST_F(Executors, AutoSettlesOnTheRectanglesWhereTheyCostLeast) {
    const Mosaic mosaic;
    const Surface s = color_surface(96), m = color_surface(96);
    const auto automatic = make_method("auto", s), masks = make_method("scaled_bins", m);
    submit(*masks, mosaic.list, m, kGazes[0]);
    const Pixels foveated = read(m.target), whole = full_picture(mosaic.list, m);
    int by_rectangles = 0;
    for (int i = 0; i < 150; ++i) {
        const FrameCost cost = submit(*automatic, mosaic.list, s, kGazes[0]);
        const std::string executor = cost.executor;
        ASSERT_EQ(read(s.target), executor == "full" ? whole : foveated) << executor;
        by_rectangles += executor == "rectangle lists";
        automatic->observe(std::chrono::microseconds(executor == "full" ? 20'000 : executor == "level masks" ? 12'000 : 9'000));
    }
    EXPECT_GT(by_rectangles, 60);
    EXPECT_EQ(automatic->executor(), "scaled_bins, rectangle lists");
    const auto told = automatic->take_switch();
    ASSERT_TRUE(told.has_value());
    EXPECT_STREQ(told->from, "level masks");
    EXPECT_STREQ(told->to, "rectangle lists");
    EXPECT_FALSE(automatic->take_switch().has_value());
}

TEST_F(Executors, RectanglesAllocateNothing) {
    const Mosaic mosaic;
    const Surface s = color_surface(96);
    const auto lists = make_method("scaled_bins", s, by(BinExecutor::rectangles));
    for (const density::FocalPoint& gaze : kGazes) submit(*lists, mosaic.list, s, gaze);
    gl::finish();
    foveation::ViewFocus focus;
    focus.count = 1;
    std::uint64_t counted = 0;
    for (int i = 0; i < 8; ++i) {
        focus.points[0] = {0.1f * static_cast<float>(i), 0, 5, 5, 0};
        const auto before = allocation_count();
        lists->submit(mosaic.list, {&s.target, 1}, {&focus, 1});
        if (i >= 2) counted += allocation_count() - before;   // the driver compiles in the first frames
        gl::finish();
    }
    EXPECT_EQ(counted, 0u);
}

}  // namespace
