#include "drivers/camera/ellipse_fit.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/camera/glint_finder.hpp"

namespace fovea::drivers::camera {
namespace {

std::vector<EdgePoint> on(const PupilEllipse& e, int n, double from = 0, double to = 2 * std::numbers::pi) {
    std::vector<EdgePoint> all;
    for (int k = 0; k < n; ++k) {
        const double t = from + (to - from) * k / n, u = e.a * std::cos(t), v = e.b * std::sin(t), c = std::cos(e.angle_rad), s = std::sin(e.angle_rad);
        all.push_back({e.x + u * c - v * s, e.y + u * s + v * c});
    }
    return all;
}

TEST(FitEllipse, FindsTheEllipseThatItsPointsLieOn) {
    for (const double ratio : {1.0, 0.999, 0.8, 0.45})
        for (const double turn : {-1.3, 0.0, 0.4, 1.5}) {
            const PupilEllipse e{310.25, 97.5, 24, 24 * ratio, turn};
            for (const int n : {6, 24, 64}) {
                const auto found = fit_ellipse(on(e, n));
                ASSERT_TRUE(found) << ratio << " " << turn << " " << n;
                EXPECT_NEAR(found->x, e.x, 1e-5);
                EXPECT_NEAR(found->y, e.y, 1e-5);
                EXPECT_NEAR(found->a, e.a, 1e-4);
                EXPECT_NEAR(found->b, e.b, 1e-4);
                if (ratio < 0.9) {
                    EXPECT_NEAR(std::sin(found->angle_rad - turn), 0, 1e-6);
                }
            }
        }
}

TEST(FitEllipse, ErrsByLittleWhenItsPointsDoAndWhenAThirdOfTheEdgeIsHidden) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0, 0.1);
    const PupilEllipse e{100, 80, 20, 15, 0.7};
    for (int run = 0; run < 50; ++run) {
        auto points = on(e, 40, 0.3, 0.3 + 4.2);
        for (EdgePoint& p : points) p.x += noise(random), p.y += noise(random);
        const auto found = fit_ellipse(points);
        ASSERT_TRUE(found);
        EXPECT_LT(std::hypot(found->x - e.x, found->y - e.y), 0.5);
        EXPECT_NEAR(found->b / found->a, 0.75, 0.05);
    }
}

TEST(FitEllipse, GivesNothingForALineAPointOrTooFew) {
    EXPECT_FALSE(fit_ellipse(on({50, 50, 10, 8, 0}, 5)));
    EXPECT_FALSE(fit_ellipse(std::vector<EdgePoint>(8, EdgePoint{3, 4})));
    std::vector<EdgePoint> line;
    for (int k = 0; k < 10; ++k) line.push_back({5.0 + k, 7.0 + 2.0 * k});
    EXPECT_FALSE(fit_ellipse(line));
    EXPECT_FALSE(fit_ellipse(on({50, 50, 0.4, 0.3, 0}, 12)));
}

TEST(GlintFinder, JoinsPatchesOverSidesAndCornersAndTellsTheirMiddle) {
    const char* picture[] = {"#..##.....", ".#..#..#.#", "......#...", "####....##", "...#....##", "####......"};
    std::vector<std::uint8_t> pixels;
    for (const char* row : picture)
        for (int x = 0; x < 10; ++x) pixels.push_back(row[x] == '#' ? 230 : 229);
    GlintFinder finder;
    for (int again = 0; again < 2; ++again) {
        const auto found = finder.find({pixels.data(), 10, 6, 10}, 229.5);
        ASSERT_EQ(found.size(), 6u);
        const double areas[] = {2, 3, 2, 1, 9, 4};   // the bow of nine is joined at its right end only
        for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(found[i].area_px, areas[i]) << i;
        EXPECT_DOUBLE_EQ(found[0].x, 0.5);
        EXPECT_DOUBLE_EQ(found[0].y, 0.5);
        EXPECT_DOUBLE_EQ(found[5].x, 8.5);
        EXPECT_DOUBLE_EQ(found[5].y, 3.5);
        EXPECT_DOUBLE_EQ(found[4].y, 4);
    }
    EXPECT_TRUE(finder.find({pixels.data(), 10, 6, 10}, 230.5).empty());
}

// A comb: the teeth are patches of their own until the last row joins them.
TEST(GlintFinder, JoinsWhatMeetsOnlyInALaterRow) {
    std::vector<std::uint8_t> pixels(9 * 4, 0);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 9; x += 2) pixels[static_cast<std::size_t>(y * 9 + x)] = 255;
    GlintFinder finder;
    EXPECT_EQ(finder.find({pixels.data(), 9, 4, 9}, 200).size(), 5u);
    for (int x = 0; x < 9; ++x) pixels[static_cast<std::size_t>(3 * 9 + x)] = 255;
    const auto found = finder.find({pixels.data(), 9, 4, 9}, 200);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].area_px, 24);
    EXPECT_DOUBLE_EQ(found[0].x, 4);
}

}  // namespace
}  // namespace fovea::drivers::camera
