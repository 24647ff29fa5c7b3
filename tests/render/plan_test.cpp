#include "render/density/plan.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck/gtest.h>

#include "tests/render/allocation_count.hpp"
#include "tests/render/density_oracle.hpp"

using namespace fovea::density;
using fovea::test::exact_density;

namespace {

Plan make(PlanSettings s) {
    auto plan = Plan::create(s);
    EXPECT_TRUE(plan.has_value()) << plan.error().message();
    return *std::move(plan);
}

double delivered_density(const PlanSettings& s, int level) {
    const LevelScale scale = s.levels[static_cast<std::size_t>(level)];
    const int shift = s.reading == Reading::area ? scale.x_shift + scale.y_shift : std::max(scale.x_shift, scale.y_shift);
    return std::ldexp(1.0, -shift);
}

TEST(Plan, RejectsSettingsThatCannotBeAndSaysWhich) {
    PlanSettings s;
    s.width_px = 0;
    EXPECT_FALSE(Plan::create(s));
    s = {};
    s.levels[0] = {1, 1};
    ASSERT_FALSE(Plan::create(s));
    EXPECT_NE(Plan::create(s).error().what.find("level 0"), std::string::npos);
    s = {};
    s.level_count = 9;
    EXPECT_FALSE(Plan::create(s));
    s = {};
    s.levels[2] = s.levels[1];
    EXPECT_FALSE(Plan::create(s));
    s = {};
    s.min_density = std::nan("");
    EXPECT_FALSE(Plan::create(s));
}

TEST(Plan, BeginsAtFullDensity) {
    const Plan p = make({.width_px = 100, .height_px = 60});
    EXPECT_EQ(p.texels(0), 100u * 60u);
    EXPECT_EQ(p.rectangles(0).size(), 1u);
    EXPECT_FALSE(p.uses(1));
}

TEST(Plan, EveryBinBelongsToExactlyOneRectangleOfItsLevel) {
    Plan p = make({.width_px = 512, .height_px = 384, .bin_px = 8});
    const FocalPoint points[] = {{0.3f, -0.2f, 6, 4, 0.5f}, {-0.8f, 0.9f, 10, 10, 0}};
    p.update(points);
    std::vector<int> covered(static_cast<std::size_t>(p.columns() * p.rows()), 0);
    for (int level = 0; level < 3; ++level)
        for (const BinRect& r : p.rectangles(level))
            for (int y = r.y0; y < r.y1; ++y)
                for (int x = r.x0; x < r.x1; ++x) {
                    EXPECT_EQ(p.level_at(x, y), level);
                    EXPECT_GE(x, p.bounds(level).x0);
                    EXPECT_LT(x, p.bounds(level).x1);
                    EXPECT_GE(y, p.bounds(level).y0);
                    EXPECT_LT(y, p.bounds(level).y1);
                    ++covered[static_cast<std::size_t>(y * p.columns() + x)];
                }
    for (const int n : covered) EXPECT_EQ(n, 1);
}

TEST(Plan, MergesRunsOfEqualRows) {
    Plan p = make({.width_px = 64, .height_px = 64, .bin_px = 8});
    const FocalPoint point{0, 0, 4, 0, 0};   // depends on x only: vertical bands
    p.update({&point, 1});
    for (int level = 0; level < 3; ++level)
        for (const BinRect& r : p.rectangles(level)) EXPECT_EQ(r.y1 - r.y0, 8);
    EXPECT_LE(p.rectangles(0).size() + p.rectangles(1).size() + p.rectangles(2).size(), 5u);
}

TEST(Plan, DoesNothingWhenNothingMoved) {
    Plan p = make({});
    const FocalPoint point{0.1f, 0.1f, 4, 4, 0};
    EXPECT_TRUE(p.update({&point, 1}));
    EXPECT_FALSE(p.update({&point, 1}));
    const FocalPoint odd{std::numeric_limits<float>::quiet_NaN(), 0, 4, 4, 0};
    EXPECT_TRUE(p.update({&odd, 1}));
    EXPECT_FALSE(p.update({&odd, 1}));
    EXPECT_EQ(p.generation(), 2u);
    EXPECT_EQ(p.texels(0), p.pixels_full());
}

TEST(Plan, UpdatesWithoutAllocating) {
    Plan p = make({.width_px = 2048, .height_px = 2048, .bin_px = 4});
    FocalPoint points[4] = {{0, 0, 4, 4, 0}, {0.5f, 0, 9, 3, 1}, {0, -0.5f, 30, 30, 0}, {-1, -1, 2, 2, -1}};
    const auto before = fovea::test::allocation_count();
    for (int i = 0; i < 20; ++i) {
        points[0].x_ndc += 0.05f;
        p.update(points);
    }
    EXPECT_EQ(fovea::test::allocation_count(), before);
    EXPECT_EQ(p.generation(), 20u);
}

TEST(Plan, TooManyFocalPointsMeanFullDensity) {
    Plan p = make({});
    const std::vector<FocalPoint> points(kMaxFocalPoints + 1, FocalPoint{0, 0, 50, 50, 0});
    p.update(points);
    EXPECT_EQ(p.texels(0), p.pixels_full());
}

TEST(Plan, AreaReadingIsNeverCoarserThanLinear) {
    const FocalPoint point{0.2f, 0, 5, 5, 0};
    PlanSettings s;
    Plan linear = make(s);
    s.reading = Reading::area;
    Plan area = make(s);
    linear.update({&point, 1});
    area.update({&point, 1});
    std::uint64_t finer = 0;
    for (int r = 0; r < linear.rows(); ++r)
        for (int c = 0; c < linear.columns(); ++c) {
            EXPECT_LE(area.level_at(c, r), linear.level_at(c, r));
            finer += area.level_at(c, r) < linear.level_at(c, r);
        }
    EXPECT_GT(finer, 0u);
}

TEST(Plan, MinimumDensityForbidsCoarserLevels) {
    const FocalPoint point{0, 0, 20, 20, 0};
    Plan p = make({.min_density = 0.3});
    p.update({&point, 1});
    EXPECT_FALSE(p.uses(2));
    EXPECT_TRUE(p.uses(1));
}

TEST(Plan, AnisotropicPairsSaveTexelsUnderTheAreaReading) {
    const FocalPoint point{0, 0, 4, 4, 0};
    PlanSettings s{.reading = Reading::area};
    Plan halves = make(s);
    s.levels = standard_levels(true);
    s.level_count = 5;   // down to 1/4 x 1/4, as the other
    Plan pairs = make(s);
    halves.update({&point, 1});
    pairs.update({&point, 1});
    const auto total = [](const Plan& p) {
        std::uint64_t n = 0;
        for (int i = 0; i < p.settings().level_count; ++i) n += p.texels(i);
        return n;
    };
    EXPECT_LT(total(pairs), total(halves) * 9 / 10);
}

TEST(Plan, CountsTexelsAndTheGuardRingExactly) {
    Plan p = make({.width_px = 256, .height_px = 192, .bin_px = 16});
    const FocalPoint points[] = {{0.3f, -0.2f, 6, 4, 0.2f}, {-0.9f, 0.9f, 10, 10, 0}};
    p.update(points);
    for (int level = 1; level < 3; ++level) {
        const int shift = level, w = 256 >> shift, h = 192 >> shift, bin = 16 >> shift;
        const auto in = [&](int x, int y) { return x >= 0 && y >= 0 && x < w && y < h && p.level_at(x / bin, y / bin) == level; };
        std::uint64_t inside = 0, ring = 0;
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                bool near = false;
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) near = near || in(x + dx, y + dy);
                if (in(x, y)) ++inside;
                else if (near) ++ring;
            }
        EXPECT_GT(inside, 0u);
        EXPECT_EQ(p.texels(level), inside);
        EXPECT_EQ(p.guard_texels(level), ring);
    }
}

TEST(Plan, DefaultBinsAreFinerInLargerPicturesUnlessTheyWouldBeTiny) {
    const auto bin = [](int width, int height) { return make({.width_px = width, .height_px = height}).bin_px(); };
    EXPECT_EQ(bin(64, 100), 4);
    EXPECT_EQ(bin(512, 512), 8);
    EXPECT_EQ(bin(1024, 512), 16);
    EXPECT_EQ(bin(1440, 1600), 16);
    EXPECT_EQ(bin(2048, 2048), 16);
    EXPECT_EQ(bin(4096, 100), 32);
}

TEST(Plan, FinerBinsNearTheContinuousLimit) {
    const FocalPoint point{0, 0, 4, 4, 0};
    double before = 1;
    for (const int bin : {128, 64, 32, 16}) {   // 8x8 to 64x64 bins
        Plan p = make({.width_px = 1024, .height_px = 1024, .bin_px = bin});
        p.update({&point, 1});
        const double fraction = static_cast<double>(p.texels(0) + p.texels(1) + p.texels(2)) / static_cast<double>(p.pixels_full());
        EXPECT_LT(fraction, before);
        before = fraction;
    }
    EXPECT_NEAR(before, 0.185, 0.01);   // continuous: 0.173
}

RC_GTEST_PROP(Plan, DeliversAtLeastTheEquationAtEveryPixel, ()) {
    PlanSettings s;
    s.width_px = *rc::gen::inRange(1, 300);
    s.height_px = *rc::gen::inRange(1, 300);
    s.bin_px = *rc::gen::element(0, 4, 7, 16, 33);
    s.reading = *rc::gen::element(Reading::linear, Reading::area);
    const bool anisotropic = *rc::gen::arbitrary<bool>();
    s.levels = standard_levels(anisotropic);
    s.level_count = *rc::gen::inRange(1, anisotropic ? 8 : 5);
    s.min_density = *rc::gen::element(0.0, 0.1, 0.5, 1.0);
    Plan plan = make(s);
    const auto number = rc::gen::map(rc::gen::inRange(-3000, 3000), [](int i) { return static_cast<float>(i) / 1000.0f; });
    const auto gain = rc::gen::map(rc::gen::inRange(0, 60), [](int i) { return static_cast<float>(i); });
    const auto points = *rc::gen::resize(4, rc::gen::container<std::vector<FocalPoint>>(rc::gen::build<FocalPoint>(
        rc::gen::set(&FocalPoint::x_ndc, number), rc::gen::set(&FocalPoint::y_ndc, number),
        rc::gen::set(&FocalPoint::gain_x, gain), rc::gen::set(&FocalPoint::gain_y, gain),
        rc::gen::set(&FocalPoint::fovea_area, number))));
    plan.update(points);
    for (int y = 0; y < s.height_px; y += 3)
        for (int x = 0; x < s.width_px; x += 3) {
            const long double need =
                exact_density(points, (2.0L * x + 1) / s.width_px - 1, (2.0L * y + 1) / s.height_px - 1, s.min_density);
            const int level = plan.level_at(x / plan.bin_px(), y / plan.bin_px());
            RC_ASSERT(static_cast<long double>(delivered_density(s, level)) >= need);
        }
}

}  // namespace
