// The actual gaze: between measured samples, never ahead of them.
#include "render/viewer/measured_gaze.hpp"

#include <gtest/gtest.h>

using namespace fovea;
using viewer::Latched;
using viewer::MeasuredGaze;

namespace {

Latched sample(std::int64_t exposed_ms, float x, bool live = true) {
    Latched l;
    l.info.flags = live ? static_cast<std::uint32_t>(FOVEA_LATCH_LIVE) : 0u;
    l.info.exposed_ns = exposed_ms * 1'000'000;
    for (auto& f : l.focals) {
        f.x_ndc = x;
        f.y_ndc = -x;
    }
    return l;
}
constexpr Instant at(double ms) { return instant_from_ns(static_cast<std::int64_t>(ms * 1e6)); }

TEST(MeasuredGaze, LiesBetweenTheSamplesAroundTheInstant) {
    MeasuredGaze g;
    EXPECT_EQ(g.at(at(5)), std::nullopt);
    g.add(sample(10, 0.1f));
    g.add(sample(10, 0.9f));                 // the same sample asked for again
    g.add(sample(20, 0.3f));
    g.add(sample(25, 7, false));             // dead gaze is no measurement
    EXPECT_EQ(g.at(at(21)), std::nullopt) << "where the eye is then is not known yet";
    EXPECT_EQ(g.at(at(9)), std::nullopt);
    ASSERT_TRUE(g.at(at(15)).has_value());
    EXPECT_NEAR((*g.at(at(15)))[0].x, 0.2, 1e-6);
    EXPECT_NEAR((*g.at(at(15)))[1].y, -0.2, 1e-6);
    EXPECT_NEAR((*g.at(at(20)))[0].x, 0.3, 1e-6);
    g.add(sample(500, 0.5f));
    EXPECT_EQ(g.at(at(300)), std::nullopt) << "too far from any sample";
    EXPECT_TRUE(g.at(at(12)).has_value()) << "earlier instants are still known";
}

TEST(MeasuredGaze, KeepsTheNewestSamplesForAsLongAsItRuns) {
    MeasuredGaze g;
    for (int i = 0; i < 10'000; ++i) g.add(sample(i, static_cast<float>(i)));
    EXPECT_NEAR((*g.at(at(9'950.5)))[0].x, 9'950.5, 1e-2);
    EXPECT_EQ(g.at(at(100)), std::nullopt) << "long overwritten";
}

}  // namespace
