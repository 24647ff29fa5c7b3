#include "render/density/density.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck/gtest.h>

#include "protocol/sphere.hpp"
#include "render/density/acuity.hpp"
#include "render/density/fovea_size.hpp"
#include "render/density/inset_outset.hpp"
#include "render/density/plan.hpp"
#include "tests/render/density_oracle.hpp"

using namespace fovea::density;
using fovea::test::exact_density;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kMax = std::numeric_limits<float>::max();

rc::Gen<float> any_extreme() {
    return rc::gen::weightedOneOf<float>(
        {{6, rc::gen::map(rc::gen::inRange(-4000, 4000), [](int i) { return static_cast<float>(i) / 1000.0f; })},
         {3, rc::gen::map(rc::gen::inRange(-400, 400), [](int i) { return static_cast<float>(i) / 10.0f; })},
         {2, rc::gen::map(rc::gen::inRange(-37, 38), [](int e) { return std::pow(10.0f, static_cast<float>(e)); })},
         {2, rc::gen::element(0.0f, -0.0f, 1.0f, -1.0f, kMax, -kMax, std::numeric_limits<float>::denorm_min(), kNan, kInf, -kInf)}});
}

rc::Gen<std::vector<FocalPoint>> any_points() {
    return rc::gen::resize(4, rc::gen::container<std::vector<FocalPoint>>(rc::gen::build<FocalPoint>(
        rc::gen::set(&FocalPoint::x_ndc, any_extreme()), rc::gen::set(&FocalPoint::y_ndc, any_extreme()),
        rc::gen::set(&FocalPoint::gain_x, any_extreme()), rc::gen::set(&FocalPoint::gain_y, any_extreme()),
        rc::gen::set(&FocalPoint::fovea_area, any_extreme()))));
}

TEST(Density, FollowsTheEquationOfTheExtension) {
    const FocalPoint p{0.25f, -0.5f, 4, 2, 1};
    EXPECT_DOUBLE_EQ(pixel_density({&p, 1}, 0.25, -0.5), 1.0);
    EXPECT_DOUBLE_EQ(pixel_density({&p, 1}, 1.25, -0.5), 1.0 / 15);   // 16 - 1
    EXPECT_DOUBLE_EQ(pixel_density({&p, 1}, 0.25, 1.5), 1.0 / 15);    // 4 * 4 - 1
    EXPECT_DOUBLE_EQ(pixel_density({&p, 1}, 1.25, 1.5), 1.0 / 31);
    EXPECT_DOUBLE_EQ(pixel_density({&p, 1}, 1.25, 1.5, 0.25), 0.25);
    const FocalPoint two[] = {p, {1.25f, 1.5f, 4, 4, 0}};
    EXPECT_DOUBLE_EQ(pixel_density(two, 1.25, 1.5), 1.0);             // the sharper of the two wins
}

TEST(Density, DefaultFocalPointAsksForEverything) {
    const FocalPoint p;
    EXPECT_EQ(pixel_density({&p, 1}, 1, -1), 1);
    EXPECT_EQ(tile_density_bound({&p, 1}, {}), 1);
}

TEST(Density, NoFocalPointAsksOnlyForTheMinimum) {
    EXPECT_EQ(pixel_density({}, 0, 0, 0.25), 0.25);
    EXPECT_GT(pixel_density({}, 0, 0), 0);
}

TEST(Density, UndefinedValuesAskForFullDensity) {
    for (const FocalPoint p : {FocalPoint{kNan, 0, 4, 4, 0}, FocalPoint{0, kNan, 4, 4, 0}, FocalPoint{0, 0, kNan, 4, 0},
                               FocalPoint{0, 0, 4, kNan, 0}, FocalPoint{0, 0, 4, 4, kNan}, FocalPoint{2, 0, kInf, 0, kInf}}) {
        EXPECT_EQ(pixel_density({&p, 1}, 0.9, 0.9), 1);
        EXPECT_EQ(tile_density_bound({&p, 1}, {0.8, 0.8, 0.9, 0.9}), 1);
    }
}

TEST(Density, ExtremesStayAboveZeroAndAtMostOne) {
    for (const float gain : {0.0f, 1e-38f, 1.0f, kMax, kInf})
        for (const float area : {-kInf, -kMax, -1.0f, 0.0f, 1.0f, kMax, kInf})
            for (const float x : {-kMax, 0.0f, 3.0f, kInf}) {
                const FocalPoint p{x, 0, gain, 0, area};   // zero gain on one axis
                const double d = pixel_density({&p, 1}, 0.5, 0.5), b = tile_density_bound({&p, 1}, {0.4, 0.4, 0.6, 0.6});
                EXPECT_GT(d, 0);
                EXPECT_LE(d, 1);
                EXPECT_GE(b, d);
                EXPECT_LE(b, 1);
            }
}

TEST(Density, InfiniteGainIsFullDensityOnlyAtItsPoint) {
    const FocalPoint p{0.5f, 0.5f, kInf, kInf, 0};
    EXPECT_EQ(pixel_density({&p, 1}, 0.5, 0.5), 1);
    EXPECT_LT(pixel_density({&p, 1}, 0.5, 0.500001), 1e-200);
    EXPECT_EQ(tile_density_bound({&p, 1}, {0.4, 0.4, 0.6, 0.6}), 1);
}

RC_GTEST_PROP(Density, EqualsTheEquationInLongDouble, ()) {
    const auto points = *any_points();
    const double x = *rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return i / 1000.0; });
    const double y = *rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return i / 1000.0; });
    const auto exact = static_cast<double>(exact_density(points, x, y, 0.0L));
    const double d = pixel_density(points, x, y);
    RC_ASSERT(d > 0);
    RC_ASSERT(d <= 1);
    // Cancellation of distance against area is the only loss; it grows with their size, so compare where it is mild.
    double scale = 1;
    for (const auto& p : points) scale = std::max({scale, std::abs(static_cast<double>(p.fovea_area)), std::abs(static_cast<double>(p.x_ndc)), std::abs(static_cast<double>(p.y_ndc))});
    if (std::isfinite(scale) && scale < 1e4) RC_ASSERT(std::abs(d - exact) <= 1e-9 * std::max(exact, 1e-300) + 1e-12);
}

RC_GTEST_PROP(Density, TileBoundIsNeverBelowAnyPointOfTheTile, ()) {
    const auto points = *any_points();
    const int width = *rc::gen::inRange(1, 3000), bin = *rc::gen::inRange(4, 65);
    const int column = *rc::gen::inRange(0, (width + bin - 1) / bin);
    const double lo = 2.0 * column * bin / width - 1, hi = std::min(2.0 * (column + 1) * bin / width - 1, 1.0);
    const double min_density = *rc::gen::element(0.0, 0.0, 0.1, 1.0);
    const double bound = tile_density_bound(points, {lo, lo, hi, hi}, min_density);
    RC_ASSERT(bound > 0);
    RC_ASSERT(bound <= 1);
    constexpr int kSamples = 12;
    for (int i = 0; i <= kSamples; ++i)
        for (int j = 0; j <= kSamples; ++j) {
            const long double x = lo + (static_cast<long double>(hi) - lo) * i / kSamples;
            const long double y = lo + (static_cast<long double>(hi) - lo) * j / kSamples;
            RC_ASSERT(static_cast<long double>(bound) >= exact_density(points, x, y, min_density));
        }
}

TEST(FoveaSize, FullDensityRegionHasTheWantedRadius) {
    const FoveaSizeSettings s{.min_radius_rad = 0.05, .reach_rad = 0.1, .power = 0.4, .max_radius_rad = 0.5, .gain = 4};
    const FocalPoint p = sized_focal_point(s, 0.1, 0.2, 0.05, 1.2, 0.9);
    const double radius = 0.1 * std::pow(0.05 * 57.29577951308232, 0.4);
    EXPECT_NEAR(full_radius_ndc(p, 0), radius * 1.2, 1e-6);
    EXPECT_NEAR(full_radius_ndc(p, 1), radius * 0.9, 1e-6);
    EXPECT_EQ(pixel_density({&p, 1}, 0.1 + radius * 1.2 * 0.999, 0.2), 1);
    EXPECT_LT(pixel_density({&p, 1}, 0.1 + radius * 1.2 * 1.01, 0.2), 1);
}

TEST(FoveaSize, GrowsWithUncertaintyWithinItsBounds) {
    const FoveaSizeSettings s;
    constexpr double kDegree = 0.017453292519943295;
    EXPECT_EQ(fovea_radius_rad(s, 0), s.min_radius_rad);
    EXPECT_NEAR(fovea_radius_rad(s, kDegree), s.reach_rad, 1e-12);
    EXPECT_NEAR(fovea_radius_rad(s, 4 * kDegree) / fovea_radius_rad(s, 2 * kDegree), std::pow(2, 0.4), 1e-12) << "not in proportion";
    EXPECT_GT(fovea_radius_rad(s, 0.05), fovea_radius_rad(s, 0.02));
    EXPECT_EQ(fovea_radius_rad(s, 100), s.max_radius_rad);
    EXPECT_EQ(fovea_radius_rad(s, std::nan("")), s.max_radius_rad);
}

TEST(FoveaSize, AnUnknownGazeIsNeverASmallSharpSpot) {
    for (const double bad : {std::nan(""), HUGE_VAL, -1.0}) {
        const FocalPoint p = sized_focal_point({}, 0, 0, 0.01, bad, 1);
        EXPECT_EQ(pixel_density({&p, 1}, 1, 1), 1);
    }
    const FocalPoint p = sized_focal_point({}, std::nan(""), 0, 0.01, 1, 1);
    EXPECT_EQ(pixel_density({&p, 1}, 1, 1), 1);
}

RC_GTEST_PROP(Acuity, NoPlaceInTheViewGetsLessThanTheEyeResolves, ()) {
    using namespace fovea;
    const auto real = [](double low, double high) {
        return *rc::gen::map(rc::gen::inRange(0, 100001), [=](int i) { return low + (high - low) * i / 100000.0; });
    };
    AcuitySettings s;
    s.mar_slope = real(0.01, 0.1);
    s.reading = *rc::gen::element(Reading::linear, Reading::area);
    s.coarsest_density = *rc::gen::element(0.25, 1.0 / 16, 0.0);
    const FieldOfView view{real(-1.6, -0.4), real(0.4, 1.6), real(0.4, 1.4), real(-1.4, -0.4)};
    const int width = *rc::gen::inRange(300, 4000), height = *rc::gen::inRange(300, 4000);
    const NdcPoint gaze{real(-1, 1), real(-1, 1)};
    const double radius95 = real(0, 0.15);
    const FocalPoint p = acuity_focal_point(s, view, width, height, gaze, radius95);
    const double pixel = std::max((view.tan_right - view.tan_left) / width, (view.tan_up - view.tan_down) / height);
    const auto eye = unproject(view, gaze);
    for (int j = 0; j <= 40; ++j)
        for (int i = 0; i <= 40; ++i) {
            const NdcPoint at{i / 20.0 - 1, j / 20.0 - 1};
            const double scale = needed_scale(s, angle_between(eye, unproject(view, at)), radius95, pixel);
            const double need = s.reading == Reading::area ? scale * scale : scale;
            RC_ASSERT(std::max(pixel_density({&p, 1}, at.x, at.y), s.coarsest_density) >= need);
        }
}

TEST(Acuity, NeedsLessOnAFinerDisplayAndMoreForAnUncertainGaze) {
    const fovea::FieldOfView view;   // 90 degrees
    const auto shaded = [&](int px, double radius95) {
        AcuitySettings s;
        auto plan = *Plan::create({.width_px = px, .height_px = px});
        const FocalPoint p = acuity_focal_point(s, view, px, px, {0, 0}, radius95);
        plan.update({&p, 1});
        return static_cast<double>(plan.texels(0) + plan.texels(1) + plan.texels(2)) / static_cast<double>(plan.pixels_full());
    };
    EXPECT_LT(shaded(4096, 0), shaded(2048, 0));
    EXPECT_LT(shaded(2048, 0), shaded(2048, 0.1));
    EXPECT_LT(shaded(2048, 0), 0.20);
}

TEST(Acuity, ValuesThatCannotBeGiveFullDensity) {
    for (const FocalPoint p : {acuity_focal_point({}, {}, 1000, 1000, {std::nan(""), 0}, 0), acuity_focal_point({}, {}, 1000, 1000, {0, 0}, std::nan("")),
                               acuity_focal_point({}, {1, -1, 1, -1}, 1000, 1000, {0, 0}, 0), acuity_focal_point({.mar_slope = 0}, {}, 1000, 1000, {0, 0}, 0)})
        EXPECT_EQ(p, FocalPoint{});
}

// Tables 2 to 4 of Arm's white paper, both eyes of 1024 x 1024; the paper counts with pi = 3.14.
TEST(InsetOutset, FieldOfViewIsThatOfTheWhitePaper) {
    constexpr double kDeg = 3.14159265358979323846 / 180;
    EXPECT_NEAR(inset_fov_rad(90 * kDeg, 0.35) / kDeg, 38.580, 0.0005);
    EXPECT_NEAR(inset_fov_rad(90 * kDeg, 1), 90 * kDeg, 1e-12);
}

TEST(InsetOutset, PixelsAreThoseOfTheWhitePapersTablesToThePixel) {
    struct Row {
        double view_px, ratio;
        double unmasked, inset, outset, total, inset_256, outset_256, total_256;
    };
    for (const Row& r : {Row{716, 0.70, 2'050'624, 804'870, 630'926, 1'435'796, 102'892, 975'008, 1'077'899},
                         Row{512, 0.50, 1'048'576, 411'566, 421'396, 832'963, 102'892, 498'565, 601'457},
                         Row{366, 0.35, 535'824, 210'311, 242'149, 452'460, 102'892, 254'768, 357'659}}) {
        EXPECT_EQ(4 * r.view_px * r.view_px, r.unmasked);
        const MaskedPixels table3 = masked_pixels(r.view_px, r.view_px, r.view_px * r.ratio, 3.14);
        EXPECT_NEAR(table3.inset, r.inset, 0.5);
        EXPECT_NEAR(table3.outset, r.outset, 0.5);
        EXPECT_NEAR(table3.total(), r.total, 0.5);
        const MaskedPixels table4 = masked_pixels(r.view_px, 256, 256 * r.view_px / 1024, 3.14);
        EXPECT_NEAR(table4.inset, r.inset_256, 0.5);
        EXPECT_NEAR(table4.outset, r.outset_256, 0.5);
        EXPECT_NEAR(table4.total(), r.total_256, 0.5);
    }
}

TEST(InsetOutset, CountsPixelsInACircleByTheirCentres) {
    const auto slowly = [](int w, int h, double x, double y, double r) {
        std::uint64_t n = 0;
        for (int j = 0; j < h; ++j)
            for (int i = 0; i < w; ++i) n += std::hypot(i + 0.5 - x, j + 0.5 - y) < r;
        return n;
    };
    for (const double x : {-3.0, 0.0, 10.3, 20.0, 44.7})
        for (const double r : {0.0, 0.4, 3.3, 12.25, 80.1}) EXPECT_EQ(pixels_in_circle(40, 30, x, 14.6, r), slowly(40, 30, x, 14.6, r)) << x << " " << r;
    EXPECT_EQ(pixels_in_circle(40, 30, std::nan(""), 0, 10), 0u);
    EXPECT_EQ(pixels_in_circle(40, 30, 0, 0, std::nan("")), 0u);
}

}  // namespace
