// Whatever of a box is seen lies within its projected bounds: for random boxes and matrices, before, around and behind the eye.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "render/scene/camera.hpp"

using namespace fovea;
using scene::Aabb;
using scene::Mat4;

namespace {

// As the vertex shader computes it.
std::array<float, 4> shaded(const Mat4& m, const std::array<float, 3>& p) {
    std::array<float, 4> r{};
    for (std::size_t i = 0; i < 4; ++i)
        r[i] = static_cast<float>(m[i]) * p[0] + static_cast<float>(m[4 + i]) * p[1] + static_cast<float>(m[8 + i]) * p[2] + static_cast<float>(m[12 + i]);
    return r;
}

bool seen(const std::array<float, 4>& c) {
    return c[3] > 0 && std::abs(c[0]) <= c[3] && std::abs(c[1]) <= c[3] && std::abs(c[2]) <= c[3];
}

double real(double low, double high) { return low + (high - low) * *rc::gen::inRange(0, 1'000'001) * 1e-6; }
double magnitude(double least_exp, double most_exp) { return std::pow(10.0, real(least_exp, most_exp)); }

std::array<float, 3> point_in(const Aabb& box, double u, double v, double w) {
    const double at[3] = {u, v, w};
    std::array<float, 3> p{};
    for (std::size_t i = 0; i < 3; ++i) p[i] = static_cast<float>((1 - at[i]) * double(box.low[i]) + at[i] * double(box.high[i]));
    return p;
}

void all_that_is_seen_is_inside(const Mat4& m, const Aabb& box, const gl::Box& bounds) {
    constexpr int kSteps = 12;
    for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; j <= kSteps; ++j)
            for (int k = 0; k <= kSteps; ++k) {
                const auto c = shaded(m, point_in(box, i / double(kSteps), j / double(kSteps), k / double(kSteps)));
                if (!seen(c)) continue;
                const double x = double(c[0]) / double(c[3]), y = double(c[1]) / double(c[3]);
                RC_ASSERT(!bounds.empty());
                RC_ASSERT(x >= double(bounds.x0) && x <= double(bounds.x1));
                RC_ASSERT(y >= double(bounds.y0) && y <= double(bounds.y1));
            }
}

RC_GTEST_PROP(DrawBounds, HoldWhateverIsSeenOfABox, ()) {
    const double scale = magnitude(-4, 4);   // of the world: tenths of a millimetre to ten kilometres
    const auto place = [&] { return scale * real(-3, 3); };
    const scene::Pose pose{place(), place(), place(), real(-3.2, 3.2), real(-1.6, 1.6)};
    const double near = scale * magnitude(-4, 0), half = magnitude(-2, 1);
    const FieldOfView fov{-half * real(0.1, 2), half * real(0.1, 2), half * real(0.1, 2), -half * real(0.1, 2)};
    const Mat4 m = scene::multiply(scene::projection(fov, near, near * magnitude(0.5, 5)), scene::view_from_world(pose, 0.03 * scale));
    Aabb box;
    for (std::size_t i = 0; i < 3; ++i) {
        const double size = scale * magnitude(-3, 0.7), eye = i == 0 ? pose.x_m : i == 1 ? pose.y_m : pose.z_m;
        const double centre = *rc::gen::arbitrary<bool>() ? eye + size * real(-1, 1) : place();   // around the eye as often as not
        box.low[i] = static_cast<float>(centre - size / 2);
        box.high[i] = static_cast<float>(centre + size / 2);
    }
    all_that_is_seen_is_inside(m, box, scene::project_bounds(m, box));
}

RC_GTEST_PROP(DrawBounds, HoldUnderMatricesThatAreNoCamera, ()) {
    Mat4 m{};
    for (double& v : m) v = *rc::gen::arbitrary<bool>() ? real(-2, 2) : 0;
    m[15] = *rc::gen::element(0.0, 1e-6, 1e-4, 0.5);   // w near zero somewhere in the box
    Aabb box;
    for (std::size_t i = 0; i < 3; ++i) {
        const double centre = real(-1, 1), size = magnitude(-3, 0.5);
        box.low[i] = static_cast<float>(centre - size / 2);
        box.high[i] = static_cast<float>(centre + size / 2);
    }
    all_that_is_seen_is_inside(m, box, scene::project_bounds(m, box));
}

RC_GTEST_PROP(DrawBounds, HoldWhatIsFarFromTheOriginWhereFloatsAreCoarse, ()) {
    const double far_off = magnitude(3, 7);
    const scene::Pose pose{far_off, real(-2, 2), -far_off, real(-3.2, 3.2), 0};
    const Mat4 m = scene::multiply(scene::projection({-1, 1, 1, -1}, 0.1, 100), scene::view_from_world(pose, 0));
    Aabb box;
    for (std::size_t i = 0; i < 3; ++i) {
        const double centre = (i == 0 ? pose.x_m : i == 1 ? pose.y_m : pose.z_m) + real(-8, 8), size = magnitude(-1, 0.7);
        box.low[i] = static_cast<float>(centre - size / 2);
        box.high[i] = static_cast<float>(centre + size / 2);
    }
    all_that_is_seen_is_inside(m, box, scene::project_bounds(m, box));
}

TEST(DrawBounds, AreTightBeforeTheEyeAndEmptyBehindIt) {
    const Mat4 m = scene::projection({-1, 1, 1, -1}, 0.1, 100);
    const gl::Box ahead = scene::project_bounds(m, {{-1, -1, -5}, {1, 1, -4}});
    EXPECT_NEAR(ahead.x0, -0.25, 1e-3);
    EXPECT_NEAR(ahead.y1, 0.25, 1e-3);
    EXPECT_TRUE(scene::project_bounds(m, {{-1, -1, 4}, {1, 1, 5}}).empty());
    EXPECT_TRUE(scene::project_bounds(m, {{-20, -1, 3}, {-9, 1, -5}}).empty()) << "to the left, partly behind";
    const gl::Box around = scene::project_bounds(m, {{-1, -1, -1}, {1, 1, 1}});
    EXPECT_EQ(around.x0, -1);
    EXPECT_EQ(around.x1, 1);
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(scene::project_bounds(m, {{kNan, -1, -5}, {1, 1, -4}}).x0, -1) << "not known: the whole view";
}

}  // namespace
