// Head pose in the pipeline: the eyes turn against the head.
#include <deque>
#include <limits>

#include <gtest/gtest.h>

#include "daemon/pipeline/head_motion.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "drivers/synthetic/synthetic_eye.hpp"
#include "tests/daemon/pipeline_gaze.hpp"

namespace fovea::pipeline {
namespace {

using namespace test;

// A head turned left by `deg` about the vertical.
HeadPose yawed(double deg) { return {true, {std::cos(deg * kDegree / 2), 0, std::sin(deg * kDegree / 2), 0}}; }

TEST(HeadMotion, FindsATurnAtAnyRateOfPoses) {
    for (const std::int64_t step_us : {125, 500, 1000, 4000, 11000, 20000}) {
        HeadMotion head;
        std::int64_t t = 0;
        for (; t < 300 * kMs; t += step_us * 1000) head.update(t, yawed(80 * static_cast<double>(t) * 1e-9));
        const Vec3<HeadFrame> w = head.angular_velocity(t);
        EXPECT_NEAR(w.y / kDegree, 80, 1e-6) << step_us;
        EXPECT_NEAR(w.x, 0, 1e-9);
        EXPECT_NEAR(w.z, 0, 1e-9);
        // The head turns left, so a gaze that stays in space goes right.
        EXPECT_NEAR(against_head(w, Plane(at_deg(0, 0))).u / kDegree, 80, 1e-6);
        EXPECT_NEAR(against_head(w, Plane(at_deg(0, 0))).v, 0, 1e-9);
    }
}

TEST(HeadMotion, RepeatedPosesAreNotAHeadThatStopped) {
    HeadMotion head;  // poses at 90 Hz beside samples at 1000 Hz
    std::int64_t t = 0;
    for (; t < 300 * kMs; t += kMs) head.update(t, yawed(50 * 11e-3 * static_cast<double>(t / (11 * kMs))));
    EXPECT_NEAR(head.angular_velocity(t).y / kDegree, 50, 8);
    for (; t < 400 * kMs; t += kMs) head.update(t, yawed(15));
    EXPECT_EQ(head.angular_velocity(t), (Vec3<HeadFrame>{})) << "now it has";
}

TEST(HeadMotion, IsNothingWithoutTwoPosesAfterAGapAndForWhatNoHeadDoes) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
    const Vec3<HeadFrame> nothing{};
    HeadMotion head;
    EXPECT_EQ(head.angular_velocity(0), nothing);
    head.update(0, yawed(0));
    EXPECT_EQ(head.angular_velocity(kMs), nothing);
    head.update(3'600'000 * kMs, yawed(10));
    EXPECT_EQ(head.angular_velocity(3'600'000 * kMs), nothing) << "an hour apart";
    head.update(3'600'030 * kMs, yawed(100));
    EXPECT_EQ(head.angular_velocity(3'600'030 * kMs), nothing) << "3000 deg/s: the pose jumped";
    head.update(3'600'060 * kMs, yawed(101));
    const Vec3<HeadFrame> w = head.angular_velocity(3'600'060 * kMs);
    EXPECT_NEAR(w.y / kDegree, 1 / 0.03, 1e-3);
    for (const Rotation<WorldFrame, HeadFrame>& q : {Rotation<WorldFrame, HeadFrame>{kNan, 0, 0, 0}, {kInf, 0, 0, 0}, {0, 0, 0, 0}, {3, 0, 0, 0}})
        head.update(3'600'070 * kMs, {true, q});
    head.update(std::numeric_limits<std::int64_t>::max(), yawed(9));
    head.update(std::numeric_limits<std::int64_t>::min(), yawed(9));
    EXPECT_EQ(head.angular_velocity(3'600'060 * kMs), w) << "and none of these is a pose";
    EXPECT_EQ(head.angular_velocity(std::numeric_limits<std::int64_t>::max()), nothing);
}

// The same turn whichever sign the tracker gives its quaternion: q and -q are one rotation.
TEST(HeadMotion, DoesNotCareForTheSignOfAQuaternion) {
    HeadMotion head;
    for (std::int64_t i = 0; i < 60; ++i) {
        HeadPose p = yawed(0.3 * static_cast<double>(i));
        auto& q = p.world_from_head;
        if (i % 2) q = {-q.w, -q.x, -q.y, -q.z};
        head.update(i * 4 * kMs, p);
    }
    EXPECT_NEAR(head.angular_velocity(59 * 4 * kMs).y / kDegree, 75, 1e-6);
}

double mean_error_deg(bool head_pose, double head_at_least_deg_s) {
    using namespace drivers::synthetic;
    Scenario s;
    s.duration_s = 60;
    s.rate_hz = 120;
    s.fixations = Fixations{.median_ms = 400};
    s.saccades.emplace();
    s.head.emplace();
    s.vestibulo_ocular_reflex.emplace();
    s.noise = Noise{.std_deg = 0.1};
    PipelineSettings settings;
    settings.predictor.head_pose = head_pose;
    auto p = Pipeline::create(settings);
    SyntheticEye eye(s);
    struct Pending {
        Instant due;
        Direction<HeadFrame> foreseen;
    };
    std::deque<Pending> pending;
    HeadMotion head;
    double sum = 0, n = 0;
    int since_saccade = 0;
    for (SyntheticSample x; eye.next(x);) {
        const EyeMotion& m = p->update(x.sample).eyes[0];
        head.update(to_ns(x.sample.exposed), x.sample.head);
        since_saccade = x.movement == Movement::saccade ? 0 : since_saccade + 1;
        while (!pending.empty() && pending.front().due <= x.sample.exposed) {
            if (since_saccade > 6) sum += angle_between(pending.front().foreseen, x.truth_dir_head) / kDegree, ++n;  // a fixation throughout
            pending.pop_front();
        }
        const double turn = length(head.angular_velocity(to_ns(x.sample.exposed))) / kDegree;
        if (turn >= head_at_least_deg_s && since_saccade > 0) {
            const Instant due = x.sample.exposed + std::chrono::milliseconds(50);
            pending.push_back({due, evaluate(m, due).gaze_dir_head});
        }
    }
    EXPECT_GT(n, 300);
    return sum / n;
}

TEST(Pipeline, ForeseesThatTheEyesTurnAgainstTheHead) {
    EXPECT_LT(mean_error_deg(true, 10), 0.7 * mean_error_deg(false, 10));
    EXPECT_LT(mean_error_deg(true, 0), mean_error_deg(false, 0));
}

}  // namespace
}  // namespace fovea::pipeline
