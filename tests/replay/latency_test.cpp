#include "replay/latency.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "protocol/sphere.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace std::chrono_literals;

namespace {

constexpr double kRad = std::numbers::pi / 180;

GazeSample sample(std::int64_t t_ms, double azimuth_deg, bool valid = true) {
    GazeSample s;
    s.exposed = instant_from_ns(t_ms * 1'000'000);
    s.eye(Eye::combined).valid = valid;
    s.eye(Eye::combined).gaze_dir_head = from_azimuth_elevation<HeadFrame>({azimuth_deg * kRad, 0});
    return s;
}

// A 90-degree view whose fovea is centred straight ahead and 10 degrees in radius.
FrameTiming frame(std::uint64_t n, std::int64_t photon_ms) {
    FrameTiming f;
    f.frame = n;
    f.model_sequence = n;
    f.photon = instant_from_ns(photon_ms * 1'000'000);
    f.predicted_photon = f.photon + 2ms;
    f.gpu_done = f.photon - 5ms;
    f.submitted = f.gpu_done - 9ms;
    f.latched = f.submitted - 1ms;
    f.published = f.latched - 3ms;
    f.filtered = f.published - 100us;
    f.received = f.filtered - 200us;
    f.exposed = f.received - 4ms;
    f.view_count = 1;
    f.views[0].half_width_ndc = f.views[0].half_height_ndc = std::tan(10 * kRad);
    f.pixels_shaded = 25;
    f.pixels_full = 100;
    return f;
}

}  // namespace

TEST(Percentiles, AreValuesThatOccurred) {
    std::vector<double> v;
    for (int i = 100; i >= 1; --i) v.push_back(i);
    const auto p = percentiles(v);
    EXPECT_EQ(p.p50, 50);
    EXPECT_EQ(p.p95, 95);
    EXPECT_EQ(p.p99, 99);
    EXPECT_EQ(p.max, 100);
    EXPECT_EQ(percentiles({7}).p99, 7);
    EXPECT_EQ(percentiles({}).count, 0u);
}

TEST(AnalyseLatency, StagesAddUpToMotionToPhoton) {
    const std::vector frames{frame(1, 100)};
    const std::vector samples{sample(0, 0), sample(40, 0), sample(80, 0), sample(120, 0)};
    const auto report = analyse_latency(frames, samples);
    ASSERT_EQ(report.per_frame.size(), 1u);
    const auto& s = report.per_frame[0].stage_ms;
    double sum = 0;
    for (std::size_t i = 0; i + 1 < kStageCount; ++i) sum += s[i];
    EXPECT_NEAR(sum, s.back(), 1e-9);
    EXPECT_NEAR(s.back(), 22.3, 1e-9);
    EXPECT_NEAR(report.abs_prediction_ms.max, 2, 1e-9);
    EXPECT_EQ(report.pixels_shaded * 4, report.pixels_full);
}

TEST(AnalyseLatency, JudgesByWhereTheEyeWasAtPhotonTimeNotAtLatch) {
    // The eye rests at 0 until 90 ms, and is on its way from 0 to 24 degrees at the photon (100 ms): at 12.
    const std::vector samples{sample(50, 0), sample(90, 0), sample(110, 24), sample(200, 24)};
    const auto report = analyse_latency(std::vector{frame(1, 100)}, samples);
    EXPECT_EQ(report.judged, 1u);
    EXPECT_EQ(report.missed, 1u);
    EXPECT_NEAR(report.error_deg.max, 12, 1e-6);
    EXPECT_NEAR(report.outside_deg.max, 2, 1e-6);
}

TEST(AnalyseLatency, DoesNotCallAnEyeInsideTheRegionAMiss) {
    const std::vector samples{sample(50, 9.9), sample(100, 9.9), sample(101, 9.9)};
    const auto report = analyse_latency(std::vector{frame(1, 100)}, samples);
    EXPECT_EQ(report.judged, 1u);
    EXPECT_EQ(report.missed, 0u);
    EXPECT_NEAR(report.error_deg.max, 9.9, 1e-6);
}

TEST(AnalyseLatency, JudgesNoFrameInABlinkInAGapOrAfterTheEnd) {
    const std::vector samples{sample(80, 0), sample(99, 0), sample(101, 0, false), sample(190, 0), sample(260, 0)};
    const auto report = analyse_latency(std::vector{frame(1, 100), frame(2, 200), frame(3, 300)}, samples);
    EXPECT_EQ(report.judged, 0u);
    EXPECT_EQ(report.unjudged_no_gaze, 2u);
    EXPECT_EQ(report.unjudged_after_recording, 1u);
}

TEST(AnalyseLatency, CountsAGazeBehindTheViewAsAMiss) {
    const std::vector samples{sample(99, 170), sample(101, 170)};
    const auto report = analyse_latency(std::vector{frame(1, 100)}, samples);
    EXPECT_EQ(report.missed, 1u);
    EXPECT_NEAR(report.outside_deg.max, 170, 1e-6);
}

TEST(AnalyseLatency, ReportsRenderedAndExtrapolatedFramesApart) {
    // The eye jumps 20 degrees at 110 ms: the rendered frame at 100 ms saw it right, the one made from it at 120 ms could not.
    auto extrapolated = frame(2, 120);
    extrapolated.kind = FrameKind::extrapolated;
    extrapolated.exposed = frame(1, 100).exposed;
    const std::vector samples{sample(60, 0), sample(109, 0), sample(111, 20), sample(130, 20)};
    const auto report = analyse_latency(std::vector{frame(1, 100), extrapolated}, samples);
    EXPECT_EQ(report.judged, 2u);
    EXPECT_EQ(report.missed, 1u);
    const auto &r = report.of(FrameKind::rendered), &x = report.of(FrameKind::extrapolated);
    EXPECT_EQ(r.frames, 1u);
    EXPECT_EQ(r.judged, 1u);
    EXPECT_EQ(r.missed, 0u);
    EXPECT_NEAR(r.motion_to_photon_ms.p50, 22.3, 1e-9);
    EXPECT_EQ(x.frames, 1u);
    EXPECT_EQ(x.missed, 1u);
    EXPECT_NEAR(x.motion_to_photon_ms.p50, 42.3, 1e-9);
    EXPECT_NEAR(x.error_deg.p50, 20, 1e-6);
}

TEST(AnalyseLatency, LeavesFramesWithoutAModelOutOfTheStages) {
    auto f = frame(1, 100);
    f.model_sequence = 0;
    const auto report = analyse_latency(std::vector{f, frame(2, 150)}, std::vector{sample(0, 0)});
    EXPECT_EQ(report.frames, 2u);
    EXPECT_EQ(report.frames_without_model, 1u);
    EXPECT_EQ(report.stage_ms[0].count, 1u);
    EXPECT_NEAR(report.frame_rate_hz, 20, 1e-9);
}

TEST(GazeAt, UsesTheCombinedGazeWhereTheEyeIsUnknown) {
    auto a = sample(10, 1), b = sample(20, 3);
    a.eye(Eye::left).valid = b.eye(Eye::left).valid = true;
    a.eye(Eye::left).gaze_dir_head = b.eye(Eye::left).gaze_dir_head = from_azimuth_elevation<HeadFrame>({5 * kRad, 0});
    const std::vector samples{a, b};
    const auto at = instant_from_ns(15'000'000);
    EXPECT_NEAR(to_azimuth_elevation(*gaze_at(samples, Eye::left, at, 50ms)).azimuth_rad, 5 * kRad, 1e-12);
    EXPECT_NEAR(to_azimuth_elevation(*gaze_at(samples, Eye::right, at, 50ms)).azimuth_rad, 2 * kRad, 1e-12);
}
