#include "render/density/rectangle_cover.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/render/allocation_count.hpp"

using namespace fovea::density;

namespace {

Plan make(PlanSettings s) {
    auto plan = Plan::create(s);
    EXPECT_TRUE(plan.has_value()) << plan.error().message();
    return *std::move(plan);
}

// How often each texel of a level is covered.
std::vector<int> painted(const Plan& plan, int level, std::span<const PixelRect> rectangles) {
    const int w = plan.level_width_px(level), h = plan.level_height_px(level);
    std::vector<int> count(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    for (const PixelRect& r : rectangles)
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) ++count.at(static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x));
    return count;
}

// Must the texel be drawn? One of the level's bins is within the guard ring.
bool needed(const Plan& plan, int level, int x, int y) {
    const LevelScale s = plan.settings().levels[static_cast<std::size_t>(level)];
    const int ring = level > 0 ? plan.settings().guard_texels : 0;
    for (int dy = -ring; dy <= ring; ++dy)
        for (int dx = -ring; dx <= ring; ++dx) {
            const int px = (x + dx) << s.x_shift, py = (y + dy) << s.y_shift;
            if (px < 0 || py < 0 || px >= plan.settings().width_px || py >= plan.settings().height_px) continue;
            if (plan.level_at(px / plan.bin_px(), py / plan.bin_px()) == level) return true;
        }
    return false;
}

RC_GTEST_PROP(RectangleCover, CoversTheLevelAndItsRingAndNothingTwice, ()) {
    PlanSettings s;
    s.width_px = *rc::gen::inRange(1, 40) * 8;    // whole texels of every level: then the union is exact
    s.height_px = *rc::gen::inRange(1, 40) * 8;
    s.bin_px = *rc::gen::element(8, 16, 24);
    s.levels = standard_levels(*rc::gen::arbitrary<bool>());
    s.level_count = *rc::gen::inRange(1, 5);
    s.guard_texels = *rc::gen::inRange(0, 3);
    Plan plan = make(s);
    std::vector<FocalPoint> points;
    for (int i = *rc::gen::inRange(0, 4); i > 0; --i) {
        const auto value = [](int low, int high) { return static_cast<float>(*rc::gen::inRange(low, high)) * 0.01f; };
        points.push_back({value(-120, 120), value(-120, 120), value(50, 1200), value(50, 1200), 0});
    }
    plan.update(points);
    const double worth = *rc::gen::element(0.0, 10.0, 50.0, 150.0, 400.0, 2000.0, 1e9);
    RectangleCover cover, exact;
    for (int level = 0; level < s.level_count; ++level) {
        if (plan.rectangles(level).size() > RectangleCover::kMost) {
            RC_ASSERT(!cover.update(plan, level, worth));
            continue;
        }
        RC_ASSERT(cover.update(plan, level, worth));
        RC_ASSERT(exact.update(plan, level, 0));
        const std::vector<int> count = painted(plan, level, cover.rectangles()), least = painted(plan, level, exact.rectangles());
        const int w = plan.level_width_px(level);
        for (std::size_t i = 0; i < count.size(); ++i) {
            const bool must = needed(plan, level, static_cast<int>(i) % w, static_cast<int>(i) / w);
            RC_ASSERT(count[i] <= 1);
            RC_ASSERT(least[i] == (must ? 1 : 0));
            RC_ASSERT(count[i] >= least[i]);
        }
        // What is covered beyond need has saved a rectangle for each such share of it.
        const std::size_t saved = exact.rectangles().size() - cover.rectangles().size();
        RC_ASSERT(static_cast<double>(cover.texels() - exact.texels()) <= worth * static_cast<double>(saved));
    }
}

TEST(RectangleCover, AFoveaIsAFewRectanglesAndItsSurroundingsABandOfThem) {
    Plan plan = make({.width_px = 1024, .height_px = 1024});
    const FocalPoint p{0.05f, -0.1f, 4, 4, 0};
    plan.update({&p, 1});
    RectangleCover cover;
    ASSERT_TRUE(cover.update(plan, 0, 1e9));
    EXPECT_EQ(cover.rectangles().size(), 1u);
    ASSERT_TRUE(cover.update(plan, 2, 2000));
    EXPECT_LE(cover.rectangles().size(), 8u);
    EXPECT_GE(cover.rectangles().size(), 2u);
    ASSERT_TRUE(cover.update(plan, 2, 0));
    EXPECT_GT(cover.rectangles().size(), 20u) << "exactly, it takes many";
}

TEST(RectangleCover, MoreRectanglesThanItTakesAreRefused) {
    PlanSettings s{.width_px = 256, .height_px = 256, .bin_px = 4};
    Plan plan = make(s);
    std::vector<std::uint8_t> board;
    for (int r = 0; r < plan.rows(); ++r)
        for (int c = 0; c < plan.columns(); ++c) board.push_back(static_cast<std::uint8_t>((r + c) % 2));
    plan.assign_levels(board);
    RectangleCover cover;
    EXPECT_FALSE(cover.update(plan, 0, 0));
    EXPECT_TRUE(cover.rectangles().empty());
}

TEST(RectangleCover, UpdatesWithoutAllocating) {
    Plan plan = make({.width_px = 1024, .height_px = 1024});
    RectangleCover cover;
    const auto before = fovea::test::allocation_count();
    for (int i = 0; i < 50; ++i) {
        const FocalPoint p{0.02f * static_cast<float>(i) - 0.5f, 0.1f, 4, 5, 0};
        plan.update({&p, 1});
        for (int level = 0; level < 3; ++level) static_cast<void>(cover.update(plan, level, i * 100));
    }
    EXPECT_EQ(fovea::test::allocation_count(), before);
}

}  // namespace
