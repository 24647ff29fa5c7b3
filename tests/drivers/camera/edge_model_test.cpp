#include "drivers/camera/edge_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/synthetic/eye_image.hpp"

using namespace fovea::drivers::camera;
using fovea::drivers::synthetic::EyeImageScene;
using fovea::drivers::synthetic::render_eye;

namespace {

// Points all round the true edge, except above `top` (where a lid is).
std::vector<EdgePoint> edge_of(const EyeImageScene& s, double top = -1) {
    std::vector<EdgePoint> points;
    const double c = std::cos(s.pupil_angle_rad), n = std::sin(s.pupil_angle_rad);
    for (int k = 0; k < 128; ++k) {
        const double u = s.pupil_a * std::cos(2 * std::numbers::pi * k / 128), v = s.pupil_b * std::sin(2 * std::numbers::pi * k / 128);
        const EdgePoint p{s.pupil_x + u * c - v * n, s.pupil_y + u * n + v * c};
        if (p.y > top) points.push_back(p);
    }
    return points;
}

EyeImageScene oblique() {
    EyeImageScene s;
    s.pupil_x = 92.4;
    s.pupil_y = 99.7;
    s.pupil_a = 23;
    s.pupil_b = 16;
    s.pupil_angle_rad = 0.7;
    return s;
}

// Begins `far` pixels beside the truth, by default with a twentieth too much size and a little turned.
EdgeFit astray(const EyeImageScene& s, double far = 1) {
    const double grown = 1 + 0.05 * far;
    return {.ellipse = {s.pupil_x + 0.8 * far, s.pupil_y - 0.6 * far, grown * s.pupil_a, grown * s.pupil_b, s.pupil_angle_rad + 0.05 * far}, .inside = 30, .outside = 80};
}

double centre_error(const EdgeFit& f, const EyeImageScene& s) { return std::hypot(f.ellipse.x - s.pupil_x, f.ellipse.y - s.pupil_y); }

}  // namespace

TEST(EdgeModel, MovesOntoACleanEllipseAndTellsItsLevels) {
    const EyeImageScene s = oblique();
    const auto pixels = render_eye(s);
    EdgeFit fit = astray(s);
    EdgeModel model;
    ASSERT_TRUE(model.refine({pixels.data(), s.width, s.height, s.width}, 255, edge_of(s), fit));
    EXPECT_LT(centre_error(fit, s), 0.03);
    EXPECT_NEAR(fit.ellipse.a, s.pupil_a, 0.05);
    EXPECT_NEAR(fit.ellipse.b, s.pupil_b, 0.05);
    EXPECT_NEAR(std::remainder(fit.ellipse.angle_rad - s.pupil_angle_rad, std::numbers::pi), 0, 0.01);
    EXPECT_NEAR(fit.inside, s.pupil_level, 1);
    EXPECT_NEAR(fit.outside, s.iris_level, 1);
}

TEST(EdgeModel, TellsTheBlurAndIsNotPulledByIt) {
    EyeImageScene s = oblique();
    s.pupil_b = s.pupil_a;   // a circle has no turn: that must not upset the fit
    s.blur_px = 2.3;
    const auto pixels = render_eye(s);
    EdgeFit fit = astray(s);
    EdgeModel model;
    ASSERT_TRUE(model.refine({pixels.data(), s.width, s.height, s.width}, 255, edge_of(s), fit));
    EXPECT_LT(centre_error(fit, s), 0.02);
    EXPECT_NEAR(fit.edge_px, s.blur_px, 0.1);
}

TEST(EdgeModel, IsNotPulledByALidOrUnevenLight) {
    EyeImageScene s = oblique();
    s.upper_lid = 0.4;
    s.shade = 0.25;
    s.noise = 3;
    const auto pixels = render_eye(s);
    EdgeModel model;
    EdgeFit fit = astray(s);
    const double lid_y = s.pupil_y - s.pupil_b * s.iris_scale * (1 - 2 * s.upper_lid);
    ASSERT_TRUE(model.refine({pixels.data(), s.width, s.height, s.width}, 255, edge_of(s, lid_y + 3), fit));
    EXPECT_LT(centre_error(fit, s), 0.1);
    fit = astray(s);
    const bool fitted = model.refine({pixels.data(), s.width, s.height, s.width}, 255, edge_of(s), fit);
    EXPECT_TRUE(!fitted || centre_error(fit, s) < 1) << "told that all of the edge was seen, it still does not run away";
}

TEST(EdgeModel, IsHardlyPulledByLashes) {
    std::vector<double> errors;
    EdgeModel model;
    for (std::uint64_t seed = 1; seed <= 9; ++seed) {
        EyeImageScene s = oblique();
        s.lashes = 12;
        s.noise = 3;
        s.seed = seed;
        const auto pixels = render_eye(s);
        EdgeFit fit = astray(s, 0.3);   // where rays lead with lashes
        ASSERT_TRUE(model.refine({pixels.data(), s.width, s.height, s.width}, 255, edge_of(s), fit));
        EXPECT_NEAR(fit.outside, s.iris_level, 2);
        errors.push_back(centre_error(fit, s));
    }
    // Now and then a lash along the edge passes for the edge; mostly they end without weight.
    std::ranges::sort(errors);
    EXPECT_LT(errors[errors.size() / 2], 0.1);
    EXPECT_LT(errors.back(), 1);
}

TEST(EdgeModel, LeavesTheEllipseAloneWhereThePictureSupportsNone) {
    const EyeImageScene s = oblique();
    std::vector<std::uint8_t> flat(192 * 192, 60);
    const EdgeFit before = astray(s);
    EdgeFit fit = before;
    EdgeModel model;
    EXPECT_FALSE(model.refine({flat.data(), 192, 192, 192}, 255, edge_of(s), fit));
    EXPECT_EQ(fit.ellipse.x, before.ellipse.x);
    EXPECT_FALSE(model.refine({flat.data(), 192, 192, 192}, 10, edge_of(s), fit)) << "all of it a glint";
    EXPECT_FALSE(model.refine({flat.data(), 192, 192, 192}, 255, {}, fit)) << "nothing of the edge was seen";
    EXPECT_EQ(fit.ellipse.a, before.ellipse.a);
}
