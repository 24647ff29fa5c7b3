// What must hold whatever the numbers: docs/numerics.md names these tests.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "daemon/pipeline/ballistic.hpp"
#include "daemon/pipeline/kalman.hpp"
#include "daemon/pipeline/motion_net.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/self_judge.hpp"
#include "replay/recording.hpp"
#include "tests/daemon/pipeline_gaze.hpp"

namespace fovea::pipeline {
namespace {

using namespace test;

TEST(Covariance, StaysPositiveThroughTenMillionUpdatesOfAnyKind) {
    // dt from nothing to an hour, noise and acceleration over ratios of 1e12 and more, in no order.
    std::mt19937_64 random{1};
    const double dts[] = {0, 1e-9, 1e-3, 4e-3, 0.1, 3600, 1e9};
    const double noises[] = {0, 1e-300, 1e-12, 1e-6, 1, 1e12, std::numeric_limits<double>::infinity()};
    const double psds[] = {1e-12, 1, 1e6};
    Covariance c{1e-6, 0, 1};
    for (int i = 0; i < 10'000'000; ++i) {
        const std::uint64_t r = random();
        c = predict_covariance(c, dts[r % 7], psds[(r >> 8) % 3]);
        ASSERT_TRUE(c.positive_semidefinite()) << "after the time update of step " << i;
        const double noise = noises[(r >> 16) % 7];
        const Gain k = kalman_gain(c, noise);
        ASSERT_TRUE(k.p >= 0 && k.p <= 1 && std::isfinite(k.v)) << i;
        c = update_covariance(c, k, noise);
        ASSERT_TRUE(c.positive_semidefinite()) << "after the measurement of step " << i;
    }
}

TEST(Covariance, ReachesItsStationaryValueAndStaysThereToTheBit) {
    Covariance c{1e-6, 0, 1}, before;
    int settled = -1;
    for (int i = 0; i < 1'000'000; ++i) {
        before = c;
        c = predict_covariance(c, 1e-3, 0.3);
        c = update_covariance(c, kalman_gain(c, 1e-6), 1e-6);
        if (settled < 0 && std::fabs(c.pp - before.pp) <= 1e-15 * c.pp && std::fabs(c.vv - before.vv) <= 1e-15 * c.vv) settled = i;
    }
    EXPECT_GT(settled, 0);
    EXPECT_LT(settled, 10'000) << "so a billion updates are no different from ten thousand";
    EXPECT_LE(std::fabs(c.vv - before.vv), 1e-14 * c.vv);
}

TEST(KalmanCv, FollowsASteadyTurnOnTheSphere) {
    KalmanCv f(1000);
    for (int i = 0; i < 2000; ++i) (void)f.update(i * kMs, at_deg(-60 + 0.06 * i, 0), 1e-8);
    EXPECT_NEAR(length(f.velocity_rad_s()) / kDegree, 60, 0.1);
}

TEST(Imm, ProbabilitiesSurviveWhatNoModelExpects) {
    Imm imm;
    for (int i = 0; i < 100; ++i) imm.update(i * kMs, at_deg(0, 0), 1e-12);
    // Half a turn within a millisecond, at a noise of a millionth of a radian: every likelihood underflows.
    for (int i = 100; i < 200; ++i) {
        imm.update(i * kMs, at_deg(i % 2 ? 179 : -90, i % 3 ? 80 : -80), 1e-12);
        double sum = 0;
        for (std::size_t m = 0; m < Imm::kModels; ++m) {
            EXPECT_GT(imm.probabilities()[m], 0);
            EXPECT_TRUE(imm.covariance(m).positive_semidefinite());
            sum += imm.probabilities()[m];
        }
        ASSERT_NEAR(sum, 1, 1e-12);
        ASSERT_TRUE(std::isfinite(length(imm.displacement(0.15))));
    }
    for (int i = 200; i < 1200; ++i) imm.update(i * kMs, at_deg(5, 5), 1e-8);
    EXPECT_GT(imm.probabilities()[0], 0.5) << "and the fixation is found again";
}

TEST(Ballistic, OneOrTwoSamplesGiveABoundedAnswer) {
    for (const double speed : {0.001, 30.0, 500.0, 1e6}) {
        History raw;
        raw.push(0, at_deg(0, 0));
        MotionFeatures f = motion_features(raw, {speed * kDegree, 0});
        EXPECT_FALSE(f.usable) << "one sample has no direction";
        raw.push(kMs, at_deg(std::fmin(speed * 1e-3, 80), 0));
        f = motion_features(raw, {speed * kDegree, 0});
        ASSERT_TRUE(f.usable);
        Classified now;
        now.event = GazeEvent::saccade;
        now.onset_ns = 0;
        const Landing l = ballistic(f, now, kMs);
        EXPECT_GT(l.amplitude_deg, 0);
        EXPECT_LE(l.amplitude_deg, 40);
        for (const double a : l.advance_deg) {
            EXPECT_GE(a, 0);
            EXPECT_LE(a, 40);
        }
    }
}

TEST(Ballistic, FindsTheLandingOfASaccadeHalfWay) {
    for (const double amplitude : {4.0, 10.0, 20.0}) {
        const double duration_ms = MainSequence::duration_s(amplitude) * 1e3;
        History raw;
        const auto half = static_cast<int>(0.5 * duration_ms);
        for (int i = -100; i <= half; ++i) raw.push((i + 200) * kMs, at_deg(amplitude * saccade_profile(i / duration_ms), 0));
        Classified now;
        now.event = GazeEvent::saccade;
        now.onset_ns = 200 * kMs;
        const Slope s = raw.slope(raw.within(6 * kMs, 2));
        const Landing l = ballistic(motion_features(raw, s.velocity_rad_s), now, (200 + half) * kMs);
        EXPECT_NEAR(l.amplitude_deg, amplitude, 0.25 * amplitude);
    }
}

TEST(MotionNet, AnyInputGivesBoundedRadiiAndFiniteAdvance) {
    EXPECT_TRUE(rc::check("any features", [] {
        const auto value = rc::gen::element(0.0, 1e-300, 1e-9, 0.1, 3.0, 90.0, 1e6, -0.1, -90.0);
        MotionFeatures f;
        f.usable = true;
        f.speed_deg_s = std::fabs(*value);
        f.interval_ms = std::fabs(*value);
        for (double& d : f.came_deg) d = *value;
        for (double& d : f.across_deg) d = std::fabs(*value);
        const NetInput in = net_input(f, std::fabs(*value), *value);
        for (const float a : net_advance(in, f.speed_deg_s)) RC_ASSERT(std::isfinite(a));
        const NetRadii r = net_radii(in);
        for (std::size_t h = 0; h < kNetHorizons; ++h) {
            RC_ASSERT(r.r68_deg[h] > 0);
            RC_ASSERT(r.r95_deg[h] >= r.r68_deg[h]);
            RC_ASSERT(std::isfinite(r.r95_deg[h]));
        }
    }));
}

TEST(SelfJudge, StopsBelievingInWhatProvesWrongAndGoesOnInWhatProvesRight) {
    for (const bool right : {true, false}) {
        SelfJudge judge(true);
        for (int i = 0; i < 4000; ++i) {
            const double x = 0.02 * i;  // a steady 20 deg/s
            judge.observe(i * kMs, at_deg(x, 0));
            Ahead ahead;
            for (std::size_t h = 0; h < kAhead; ++h)
                ahead.du_rad[h] = static_cast<float>((right ? 20 : -20) * kDegree * static_cast<double>(kHorizons_ns[h + 1]) * 1e-9);
            ahead.radius68_rad.fill(0.01f);
            ahead.radius95_rad.fill(0.02f);
            judge.apply(i * kMs, at_deg(x, 0), Phase::pursuit, ahead);
        }
        EXPECT_EQ(judge.belief(Phase::pursuit, 4).share, right ? 1 : 0);
    }
}

// While nothing of a displacement is believed, it may be told later: shown and learned is the same.
TEST(SelfJudge, LearnsTheSameFromADisplacementToldAfterwards) {
    SelfJudge at_once(true), afterwards(true);
    int held = 0, believed = 0;
    double x = 0;
    for (int i = 0; i < 12'000; ++i) {
        const bool moves = i / 3000 % 2 == 1;   // rests, drifts, rests, drifts
        x += moves ? 0.02 : 0;
        at_once.observe(i * kMs, at_deg(x, 0));
        afterwards.observe(i * kMs, at_deg(x, 0));
        Ahead full;
        for (std::size_t h = 0; h < kAhead; ++h) full.du_rad[h] = static_cast<float>(20 * kDegree * static_cast<double>(kHorizons_ns[h + 1]) * 1e-9);
        full.radius68_rad.fill(0.01f);
        full.radius95_rad.fill(0.02f);
        Ahead a = full, b = full;
        at_once.apply(i * kMs, at_deg(x, 0), Phase::quiet, a);
        const bool holds = afterwards.holds(Phase::quiet);
        if (holds) b.du_rad.fill(0);
        afterwards.apply(i * kMs, at_deg(x, 0), Phase::quiet, b);
        if (holds) afterwards.complete(full);
        (holds ? held : believed) += 1;
        for (std::size_t h = 0; h < kAhead; ++h) {
            ASSERT_EQ(a.du_rad[h], b.du_rad[h]) << i;
            ASSERT_EQ(a.radius68_rad[h], b.radius68_rad[h]) << i;
            ASSERT_EQ(at_once.belief(Phase::quiet, h).share, afterwards.belief(Phase::quiet, h).share) << i;
        }
    }
    EXPECT_GT(held, 200);
    EXPECT_GT(believed, 200);
}

TEST(SelfJudge, RadiiComeToHoldWhatTheySay) {
    for (const float stated : {0.0002f, 0.05f}) {  // far too narrow and far too wide for a noise of 0.1 degrees
        SelfJudge judge(true);
        std::mt19937_64 random{2};
        std::normal_distribution<double> noise(0, 0.1);
        std::vector<std::pair<float, float>> radii;
        std::vector<double> errors;
        for (int i = 0; i < 40'000; ++i) {
            const auto raw = at_deg(noise(random), noise(random));
            judge.observe(i * kMs, raw);
            Ahead ahead;
            ahead.radius68_rad.fill(stated);
            ahead.radius95_rad.fill(2 * stated);
            judge.apply(i * kMs, at_deg(0, 0), Phase::quiet, ahead);
            radii.push_back({ahead.radius68_rad[4], ahead.radius95_rad[4]});
            errors.push_back(angle_between(at_deg(0, 0), raw));
        }
        int in68 = 0, in95 = 0, n = 0;
        for (std::size_t i = 20'000; i + 50 < errors.size(); ++i, ++n) {
            in68 += errors[i + 50] <= static_cast<double>(radii[i].first);
            in95 += errors[i + 50] <= static_cast<double>(radii[i].second);
        }
        EXPECT_NEAR(static_cast<double>(in68) / n, 0.68, 0.04) << stated;
        EXPECT_NEAR(static_cast<double>(in95) / n, 0.95, 0.02) << stated;
    }
}

// On real gaze that ships with the project: of all outcomes 50 ms ahead, the share inside the stated radii.
TEST(Pipeline, RadiiHoldWhatTheySayOnRecordings) {
    for (const char* name : {"eyelink_lookatpoint_s1.csv", "vive_pro_eye_360vr.csv"}) {
        const auto recording = replay::load_recording(std::filesystem::path(FOVEA_SOURCE_DIR) / "tests/data/recordings" / name);
        ASSERT_TRUE(recording) << recording.error().message();
        auto p = Pipeline::create({});
        ASSERT_TRUE(p);
        struct Pending {
            Instant due;
            GazeEstimate estimate;
        };
        std::vector<Pending> pending;
        std::size_t next = 0, in68 = 0, in95 = 0, n = 0;
        for (const auto& r : recording->samples) {
            const EyeMotion& m = p->update(r.sample).eyes[0];
            const bool used = m.reference == r.sample.exposed && m.event != GazeEvent::blink && m.event != GazeEvent::lost;
            for (; next < pending.size() && pending[next].due <= r.sample.exposed; ++next) {
                if (!used || r.sample.exposed - pending[next].due > std::chrono::milliseconds(5)) continue;
                const double e = angle_between(pending[next].estimate.gaze_dir_head, r.sample.eye(Eye::combined).gaze_dir_head);
                in68 += e <= pending[next].estimate.radius68_rad;
                in95 += e <= pending[next].estimate.radius95_rad;
                ++n;
            }
            if (used) pending.push_back({r.sample.exposed + std::chrono::milliseconds(50), evaluate(m, r.sample.exposed + std::chrono::milliseconds(50))});
        }
        ASSERT_GT(n, 300u) << name;
        EXPECT_NEAR(static_cast<double>(in68) / static_cast<double>(n), 0.68, 0.06) << name;
        EXPECT_NEAR(static_cast<double>(in95) / static_cast<double>(n), 0.95, 0.03) << name;
    }
}

}  // namespace
}  // namespace fovea::pipeline
