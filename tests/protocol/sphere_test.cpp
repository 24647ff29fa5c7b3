#include "protocol/sphere.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

using namespace fovea;

namespace {

constexpr double kPi = std::numbers::pi;
using Dir = Direction<HeadFrame>;

Dir random_direction(std::mt19937_64& rng) {
    std::normal_distribution<double> n;
    for (;;)
        if (auto d = Dir::from({n(rng), n(rng), n(rng)})) return *d;
}

}  // namespace

TEST(TangentBasis, IsRightAndUpStraightAhead) {
    const TangentBasis<HeadFrame> b(Dir{});
    EXPECT_EQ(b.u, (Vec3<HeadFrame>{1, 0, 0}));
    EXPECT_EQ(b.v, (Vec3<HeadFrame>{0, 1, 0}));
}

TEST(TangentBasis, IsOrthonormalEverywhereIncludingBehindAndAtTheSeam) {
    std::mt19937_64 rng(1);
    for (int i = 0; i < 10000; ++i) {
        Dir d = random_direction(rng);
        if (i == 0) d = {0, 0, 1};
        if (i == 1) d = {1, 0, 0};
        if (i == 2) d = {0, 1, -0.0};
        const TangentBasis<HeadFrame> b(d);
        EXPECT_NEAR(dot(b.u, b.v), 0, 1e-14);
        EXPECT_NEAR(length(b.u), 1, 1e-14);
        EXPECT_NEAR(length(b.v), 1, 1e-14);
        EXPECT_NEAR(dot(b.u, d.vec()), 0, 1e-14);
        EXPECT_NEAR(dot(b.v, d.vec()), 0, 1e-14);
    }
}

TEST(LogMap, IsUndoneByExpMap) {
    std::mt19937_64 rng(2);
    for (int i = 0; i < 10000; ++i) {
        const Dir a = random_direction(rng), b = random_direction(rng);
        EXPECT_LT(angle_between(exp_map(a, log_map(a, b)), b), 1e-14 + 1e-15 / (kPi - angle_between(a, b)));
    }
}

TEST(LogMap, KeepsTheAngleOfTinyAndOppositeDirections) {
    const Dir a{};
    for (double angle : {1e-12, 1e-9, 1e-3, 1.0, kPi - 1e-9}) {
        const Dir b = exp_map(a, {angle, 0});
        EXPECT_NEAR(length(log_map(a, b)), angle, 1e-15 + 1e-15 * angle);
    }
    const Tangent opposite = log_map(a, Dir{0, 0, 1});
    EXPECT_DOUBLE_EQ(opposite.u, kPi);
    EXPECT_EQ(log_map(a, a), (Tangent{0, 0}));
}

TEST(Transport, KeepsLengthAndTheAngleToTheGreatCircle) {
    std::mt19937_64 rng(3);
    for (int i = 0; i < 1000; ++i) {
        const Dir a = random_direction(rng), b = random_direction(rng);
        if (angle_between(a, b) > 3.1) continue;
        const Tangent along = log_map(a, b);
        const Tangent moved = transport(a, b, along);
        EXPECT_NEAR(length(moved), length(along), 1e-12);
        // Carried along its own great circle, the velocity points away from a.
        const Tangent back = log_map(b, a);
        EXPECT_NEAR(moved.u + back.u, 0, 1e-9);
        EXPECT_NEAR(moved.v + back.v, 0, 1e-9);
    }
}

TEST(Direction, RefusesWhatHasNoDirection) {
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(Dir::from({0, 0, 0}));
    EXPECT_FALSE(Dir::from({nan, 0, -1}));
    EXPECT_FALSE(Dir::from({inf, 0, -1}));
    EXPECT_FALSE(Dir::from({1e-200, 0, 0}));
    EXPECT_TRUE(Dir::from({3e-100, 0, -4e-100}));
    const Dir huge = Dir::from({3e300, 0, -4e300}).value();
    EXPECT_NEAR(huge.x, 0.6, 1e-15);
}

TEST(Project, MirrorsNothingFromBehindTheView) {
    const FieldOfView fov{-1, 1, 1, -1};
    EXPECT_TRUE(project(fov, Direction<ViewFrame>{0, 0, -1}));
    EXPECT_FALSE(project(fov, Direction<ViewFrame>{0, 0, 1}));
    EXPECT_FALSE(project(fov, Direction<ViewFrame>{1, 0, 0}));
    EXPECT_FALSE(project(fov, Direction<ViewFrame>::from({0.3, 0, 1}).value()));
}

TEST(Project, IsUndoneByUnprojectInAnAsymmetricView) {
    const FieldOfView fov{-1.4, 0.9, 1.1, -1.3};
    ASSERT_TRUE(fov.valid());
    for (double x : {-1.0, -0.2, 0.0, 0.7, 1.0})
        for (double y : {-1.0, 0.1, 1.0}) {
            const auto p = project(fov, unproject(fov, {x, y}));
            ASSERT_TRUE(p);
            EXPECT_NEAR(p->x, x, 1e-13);
            EXPECT_NEAR(p->y, y, 1e-13);
        }
}

TEST(AzimuthElevation, IsPositiveToTheRightAndUp) {
    const auto right = from_azimuth_elevation<HeadFrame>({0.3, 0});
    EXPECT_GT(right.x, 0);
    const auto up = from_azimuth_elevation<HeadFrame>({0, 0.3});
    EXPECT_GT(up.y, 0);
    const auto back = to_azimuth_elevation(from_azimuth_elevation<HeadFrame>({-0.5, 0.25}));
    EXPECT_NEAR(back.azimuth_rad, -0.5, 1e-15);
    EXPECT_NEAR(back.elevation_rad, 0.25, 1e-15);
}
