#include "daemon/pipeline/calibration.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/daemon/pipeline_gaze.hpp"

namespace fovea::pipeline {
namespace {

using namespace test;

// A tracker that is turned, stretched and bent.
Direction<HeadFrame> distorted(double x_deg, double y_deg) {
    return at_deg(1.5 + 1.08 * x_deg + 0.05 * y_deg + 0.002 * x_deg * x_deg, -2 + 0.95 * y_deg - 0.03 * x_deg + 0.001 * x_deg * y_deg);
}

std::vector<CalibrationPoint> grid(int n, double noise_deg = 0.1) {
    std::mt19937_64 random{5};
    std::normal_distribution<double> e(0, noise_deg);
    std::vector<CalibrationPoint> points;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = -15 + 30.0 * i / (n - 1), y = -15 + 30.0 * j / (n - 1);
            const auto m = to_azimuth_elevation(distorted(x, y));
            points.push_back({at_deg(m.azimuth_rad / kDegree + e(random), m.elevation_rad / kDegree + e(random)), at_deg(x, y)});
        }
    return points;
}

double error_deg(const Calibration& c) {
    double worst = 0;
    for (double x = -14; x <= 14; x += 3.5)
        for (double y = -14; y <= 14; y += 3.5) worst = std::fmax(worst, angle_between(c.apply(distorted(x, y)), at_deg(x, y)) / kDegree);
    return worst;
}

TEST(Calibration, UndoesABentTrackerAndSaysHowWell) {
    const auto c = fit_calibration(grid(4));
    ASSERT_TRUE(c) << c.error().message();
    EXPECT_LT(error_deg(*c), 0.5);
    EXPECT_LT(c->leave_one_out_deg(), 0.5);
    EXPECT_GT(c->leave_one_out_deg(), 0.02) << "the noise alone is 0.1";
    EXPECT_EQ(c->outliers(), 0);
}

TEST(Calibration, IsNotMovedByATargetThatNobodyLookedAt) {
    auto points = grid(4);
    points[5].measured = at_deg(-20, 18);
    points[9].measured = at_deg(20, -18);
    const auto c = fit_calibration(points);
    ASSERT_TRUE(c) << c.error().message();
    EXPECT_EQ(c->outliers(), 2);
    EXPECT_LT(error_deg(*c), 0.6);
}

TEST(Calibration, RefusesTooFewCollinearAndRepeatedTargets) {
    auto points = grid(3);
    EXPECT_FALSE(fit_calibration(std::span(points).first(3)));
    std::vector<CalibrationPoint> line, heap;
    for (int i = 0; i < 12; ++i) {
        line.push_back({distorted(-12 + 2 * i, 3), at_deg(-12 + 2 * i, 3)});
        heap.push_back(points[static_cast<std::size_t>(i % 2)]);
    }
    const auto l = fit_calibration(line);
    ASSERT_FALSE(l);
    EXPECT_NE(l.error().what.find("line"), std::string::npos) << l.error().message();
    EXPECT_FALSE(fit_calibration(heap));
    // In one place, to the last bit or within a fiftieth of a degree: whatever fits there says nothing of the rest.
    for (const double spread : {0.0, 0.02}) {
        std::vector<CalibrationPoint> close;
        for (int i = 0; i < 12; ++i) close.push_back({at_deg(3 + spread * std::cos(i), spread * std::sin(i)), at_deg(3 + spread * std::cos(i), spread * std::sin(i))});
        const auto one_place = fit_calibration(close);
        ASSERT_FALSE(one_place) << spread;
        EXPECT_NE(one_place.error().what.find("on top of each other"), std::string::npos) << one_place.error().message();
    }
}

// On a circle the squares of x and y add up to a constant: nothing tells a bend from a shift of the whole.
TEST(Calibration, DoesNotFitABendThatTheTargetsCannotTell) {
    std::vector<CalibrationPoint> ring;
    for (int i = 0; i < 12; ++i) {
        const double angle = 2 * 3.14159265358979 * i / 12, x = 0.2 * std::cos(angle), y = 0.2 * std::sin(angle);
        ring.push_back({*Direction<HeadFrame>::from({x, y, -1}), *Direction<HeadFrame>::from({x + 0.3 * x * x, y, -1})});
    }
    const auto c = fit_calibration(ring, 10);
    if (c) {
        EXPECT_NE(c->model(), CalibrationModel::quadratic);
    }
}

TEST(Calibration, ATargetThatIsNoNumberIsLeftOut) {
    auto points = grid(4);
    points[3].measured.x = std::numeric_limits<double>::quiet_NaN();
    const auto c = fit_calibration(points);
    ASSERT_TRUE(c) << c.error().message();
    EXPECT_LT(error_deg(*c), 0.6);
}

TEST(Calibration, LeavesAGazeAloneThatItWouldThrowOutOfTheView) {
    const auto c = Calibration::from_toml("[calibration.left]\nmodel = \"quadratic\"\ncoefficients = [0.0, 1.0, 0.0, 1000.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]\n", "left", "test");
    ASSERT_TRUE(c) << c.error().message();
    EXPECT_EQ(c->apply(at_deg(20, 5)), at_deg(20, 5)) << "and not at 89.5 degrees";
    EXPECT_NE(c->apply(at_deg(1, 5)), at_deg(1, 5));
}

TEST(Calibration, RefusesWhatDoesNotFit) {
    std::mt19937_64 random{5};
    std::uniform_real_distribution<double> any(-15, 15);
    std::vector<CalibrationPoint> points;
    for (int i = 0; i < 16; ++i) points.push_back({at_deg(any(random), any(random)), at_deg(any(random), any(random))});
    const auto c = fit_calibration(points);
    ASSERT_FALSE(c);
    EXPECT_FALSE(c.error().way_out.empty());
}

TEST(Calibration, ReadsBackWhatItWroteBitForBit) {
    const auto c = fit_calibration(grid(4));
    ASSERT_TRUE(c);
    const auto d = Calibration::from_toml(c->to_toml("left"), "left", "test");
    ASSERT_TRUE(d) << d.error().message();
    for (double x = -40; x < 40; x += 7) EXPECT_EQ(c->apply(at_deg(x, x / 3)), d->apply(at_deg(x, x / 3)));
    EXPECT_FALSE(Calibration::from_toml(c->to_toml("left"), "right", "test"));
    EXPECT_FALSE(Calibration::from_toml("[calibration.left]\nmodel = ", "left", "test"));
}

TEST(CalibrationProperty, AnyPointsGiveARefusalOrFiniteDirections) {
    EXPECT_TRUE(rc::check("any points", [] {
        const auto n = *rc::gen::inRange(0, 20);
        const auto value = rc::gen::map(rc::gen::inRange(-60, 60), [](int v) { return v * 1.0; });
        std::vector<CalibrationPoint> points;
        for (int i = 0; i < n; ++i) {
            CalibrationPoint p{at_deg(*value, *value), at_deg(*value, *value)};
            if (*rc::gen::inRange(0, 20) == 0) p.measured.x = std::numeric_limits<double>::quiet_NaN();
            points.push_back(p);
        }
        const auto c = fit_calibration(points, 90);
        if (!c) return;
        for (int i = 0; i < 20; ++i) RC_ASSERT(std::fabs(length(c->apply(at_deg(*rc::gen::inRange(-180, 180), *rc::gen::inRange(-90, 90))).vec()) - 1) < 1e-9);
    }));
}

}  // namespace
}  // namespace fovea::pipeline
