#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "daemon/pipeline/blink_gate.hpp"
#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/fours.hpp"
#include "daemon/pipeline/history.hpp"
#include "daemon/pipeline/loss_tracker.hpp"
#include "daemon/pipeline/one_euro.hpp"
#include "daemon/pipeline/validate.hpp"
#include "tests/daemon/pipeline_gaze.hpp"

namespace fovea::pipeline {
namespace {

using namespace test;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

EyeState eye_at(double x_deg, double y_deg = 0) {
    EyeState e;
    e.valid = true;
    e.gaze_dir_head = at_deg(x_deg, y_deg);
    return e;
}

// --- Validator

TEST(Validator, RefusesNanInfinityAndZeroLength) {
    Validator v;
    std::int64_t t = 0;
    for (const Direction<HeadFrame> bad : {Direction<HeadFrame>{kNan, 0, -1}, {0, kInf, -1}, {0, 0, 0}, {1e-200, 0, 0}, {kInf, kInf, kNan}}) {
        EyeState e;
        e.valid = true;
        e.gaze_dir_head = bad;
        EXPECT_EQ(v.update(t += kMs, e).verdict, Verdict::not_finite);
    }
}

TEST(Validator, MakesUnitVectorsOfUnnormalisedDirections) {
    Validator v;
    EyeState e;
    e.valid = true;
    for (double scale : {1e-30, 3.0, 1e30}) {
        e.gaze_dir_head = {0.6 * scale, 0, -0.8 * scale};
        const auto c = v.update(static_cast<std::int64_t>(scale > 1 ? scale > 10 ? 3 : 2 : 1), e);
        ASSERT_EQ(c.verdict, Verdict::good) << scale;
        EXPECT_NEAR(c.gaze_dir_head.x, 0.6, 1e-12);
        EXPECT_NEAR(length(c.gaze_dir_head.vec()), 1, 1e-12);
    }
}

TEST(Validator, RefusesDuplicateAndOlderExposures) {
    Validator v;
    EXPECT_EQ(v.update(10 * kMs, eye_at(0)).verdict, Verdict::good);
    EXPECT_EQ(v.update(10 * kMs, eye_at(1)).verdict, Verdict::duplicate);
    EXPECT_EQ(v.update(9 * kMs, eye_at(2)).verdict, Verdict::out_of_order);
    EXPECT_EQ(v.update(11 * kMs, eye_at(3)).verdict, Verdict::good);
}

TEST(Validator, TakesRepeatedValuesForDuplicatesButNotForEver) {
    Validator v;
    EXPECT_EQ(v.update(0, eye_at(5)).verdict, Verdict::good);
    EXPECT_EQ(v.update(11 * kMs, eye_at(5)).verdict, Verdict::duplicate);
    EXPECT_EQ(v.update(22 * kMs, eye_at(6)).verdict, Verdict::good);
    EXPECT_EQ(v.update(33 * kMs, eye_at(6)).verdict, Verdict::duplicate);
    EXPECT_EQ(v.update(66 * kMs, eye_at(6)).verdict, Verdict::good) << "an eye at rest is not lost";
}

TEST(Validator, RefusesTimesWhoseDifferencesWouldOverflow) {
    Validator v;
    EXPECT_EQ(v.update(std::numeric_limits<std::int64_t>::min(), eye_at(0)).verdict, Verdict::out_of_order);
    EXPECT_EQ(v.update(std::numeric_limits<std::int64_t>::max(), eye_at(0)).verdict, Verdict::out_of_order);
    EXPECT_EQ(v.update(1'650'000'000'000'000'000, eye_at(0)).verdict, Verdict::good) << "epoch nanoseconds are legal";
}

TEST(CombinedEye, IsTheMeanOfBothWhereTheTrackerGivesNone) {
    GazeSample s;
    s.eye(Eye::left) = eye_at(4);
    s.eye(Eye::right) = eye_at(8);
    s.eye(Eye::left).openness = 0.2;
    s.eye(Eye::right).openness = 0.9;
    EyeState c = combined_eye(s);
    ASSERT_TRUE(c.valid);
    EXPECT_NEAR(to_azimuth_elevation(c.gaze_dir_head).azimuth_rad, 6 * kDegree, 1e-9);
    EXPECT_EQ(c.openness, 0.9) << "one closed eye is a wink";
    s.eye(Eye::right).valid = false;
    EXPECT_EQ(combined_eye(s).gaze_dir_head, s.eye(Eye::left).gaze_dir_head);
    s.eye(Eye::left).valid = false;
    EXPECT_FALSE(combined_eye(s).valid);
}

// --- Geometry

TEST(Nearby, AgreesWithTheLogarithmToTenThousandthsUpToFortyDegrees) {
    for (double angle = 0.01; angle <= 40; angle *= 1.3)
        for (double turn = 0; turn < 6.28; turn += 0.7) {
            const Direction<HeadFrame> at = at_deg(50, -30);
            const Direction<HeadFrame> d =
                exp_map(at, Tangent{angle * kDegree * std::cos(turn), angle * kDegree * std::sin(turn)});
            EXPECT_LT(length(nearby(TangentBasis<HeadFrame>(at), at, d) - log_map(at, d)), 3e-4 * angle * kDegree) << angle;
        }
}

TEST(Plane, ItsMapsAreThoseOfTheSphereToTheLastPlacesWhetherSmallOrFar) {
    for (double angle = 1e-7; angle < 170; angle *= 1.03)
        for (double turn = 0; turn < 6.28; turn += 0.7) {
            const Plane at(at_deg(50, -30));
            const Tangent t{angle * kDegree * std::cos(turn), angle * kDegree * std::sin(turn)};
            const Direction<HeadFrame> there = exp_map(at.at, t);
            EXPECT_LT(length(reached(at, t).vec() - there.vec()), 4e-16) << angle;
            EXPECT_LT(length(way_to(at, there) - log_map(at.at, there)), 4e-16 + 2e-15 * angle * kDegree) << angle;
            const Plane to(there);
            EXPECT_LT(length(carried(at, to, {0.3, -2}) - transport(at.at, there, {0.3, -2})), 1e-14) << angle;
        }
    const Direction<HeadFrame> any = unit(Vec3<HeadFrame>{3e-145, 0, -4e-145}).value();
    EXPECT_NEAR(any.x, 0.6, 1e-12) << "squares that vanish";
    EXPECT_FALSE(unit(Vec3<HeadFrame>{std::nan(""), 0, -1}));
    EXPECT_FALSE(unit(Vec3<HeadFrame>{0, 0, 0}));
}

TEST(Fours, PowersOfTwoAndBoundsAreThoseOfEachLane) {
    for (float x = -20; x < 20; x += 0.0137f) {
        const Four y = exp2_four(Four{x, -x, 0, x / 7});
        EXPECT_NEAR(y[0] / std::exp2(static_cast<double>(x)), 1, 2e-7) << x;
        EXPECT_NEAR(y[1] / std::exp2(-static_cast<double>(x)), 1, 2e-7) << x;
        EXPECT_EQ(y[2], 1);
    }
    const float nan = std::nanf("");
    const Four low = at_least(Four{nan, -9, 9, -8}, -8), high = at_most(Four{nan, -9, 9, 6}, 6), most = larger(Four{1, 2, -3, 0}, Four{2, 1, -4, 0});
    for (const auto& [got, wanted] : {std::pair{low, Four{-8, -8, 9, -8}}, {high, Four{6, -9, 6, 6}}, {most, Four{2, 2, -3, 0}},
                                      {magnitude(Four{-1, 2, -0.0f, -3}), Four{1, 2, 0, 3}}})
        for (int i = 0; i < 4; ++i) EXPECT_EQ(got[i], wanted[i]) << i;
}

TEST(History, SlopeOfALineIsItsSpeedWhateverTheSpacing) {
    History h;
    std::int64_t t = 1'650'000'000'000'000'000;  // beyond 2^53: must not pass through a double
    double x = 80;                                // and near the side, where azimuth still behaves but projections do not
    for (int i = 0; i < 40; ++i) {
        const std::int64_t dt = i % 2 ? 4 * kMs : 8 * kMs;  // Pupil Invisible
        t += dt;
        x += 20 * static_cast<double>(dt) * 1e-9;
        h.push(t, at_deg(x, 0));
    }
    const Slope s = h.slope(h.within(40 * kMs, 2));
    EXPECT_NEAR(length(s.velocity_rad_s) / kDegree, 20, 2e-6);
}

// --- BlinkGate

TEST(BlinkGate, GuardsAfterABlinkButNotAfterADropOut) {
    BlinkGate gate{BlinkSettings{}};
    std::int64_t t = 0;
    EyeState closed = eye_at(0);
    closed.valid = false;
    for (; t < 100 * kMs; t += kMs) EXPECT_EQ(gate.update(t, true, eye_at(0)), GateState::open);
    for (int i = 0; i < 5; ++i, t += kMs) EXPECT_EQ(gate.update(t, false, closed), GateState::drop_out);
    EXPECT_EQ(gate.update(t, true, eye_at(0)), GateState::open) << "5 ms are a drop-out";
    t += kMs;
    for (int i = 0; i < 100; ++i, t += kMs) EXPECT_EQ(gate.update(t, false, closed), i < 19 ? GateState::drop_out : GateState::blink) << i;
    for (int i = 0; i < 60; ++i, t += kMs) EXPECT_EQ(gate.update(t, true, eye_at(0)), GateState::blink) << "guard, " << i;
    EXPECT_EQ(gate.update(t, true, eye_at(0)), GateState::open);
}

TEST(BlinkGate, SeesAClosedEyeAtOnceAndALongOneAsLost) {
    BlinkGate gate{BlinkSettings{}};
    EyeState e = eye_at(0);
    EXPECT_EQ(gate.update(0, true, e), GateState::open);
    e.openness = 0.1;
    EXPECT_EQ(gate.update(8 * kMs, true, e), GateState::blink);
    EXPECT_EQ(gate.update(490 * kMs, true, e), GateState::blink);
    EXPECT_EQ(gate.update(510 * kMs, true, e), GateState::lost);
    e.openness = kNan;  // unknown again: no evidence of a closed eye
    EXPECT_EQ(gate.update(520 * kMs, true, e), GateState::lost) << "guard";
    EXPECT_EQ(gate.update(590 * kMs, true, e), GateState::open);
    e.confidence = 0.2;
    EXPECT_EQ(gate.update(600 * kMs, true, e), GateState::drop_out);
    e.confidence = 0.9;
    e.pupil_mm = 0;
    EXPECT_EQ(gate.update(601 * kMs, true, e), GateState::blink);
}

// --- LossTracker

struct LossRun {
    LossPolicy policy;
    LossTracker tracker{policy};
    EyeMotion motion;
    void valid(std::int64_t from_ms, std::int64_t to_ms) {
        for (std::int64_t t = from_ms; t <= to_ms; ++t) tracker.valid(instant_from_ns(t * kMs), at_deg(static_cast<double>(t) * 1e-3, 0));
        tracker.fill(motion);
    }
};

TEST(LossTracker, ForgetsAGapWithinHold) {
    LossRun r;
    r.valid(0, 100);
    r.tracker.invalid();
    r.valid(340, 400);
    EXPECT_TRUE(r.motion.ever_valid);
    EXPECT_FALSE(r.motion.lost_before);
    EXPECT_EQ(r.motion.valid_since, instant_from_ns(0));
}

TEST(LossTracker, RemembersALongGapUntilTheWayBackIsComplete) {
    LossRun r;
    r.valid(0, 100);
    r.valid(1000, 1000);
    EXPECT_TRUE(r.motion.lost_before);
    EXPECT_EQ(r.motion.lost_since, instant_from_ns(100 * kMs));
    EXPECT_EQ(r.motion.valid_since, instant_from_ns(1000 * kMs));
    EXPECT_EQ(r.motion.held_dir_head, at_deg(0.1, 0));
    r.valid(1001, 1339);  // recover 40 + ease 300: not yet
    EXPECT_TRUE(r.motion.lost_before);
    r.valid(1340, 1340);
    EXPECT_FALSE(r.motion.lost_before);
    EXPECT_EQ(r.tracker.losses(), 1u);
}

TEST(LossTracker, ARunShorterThanRecoverDoesNotEndTheLoss) {
    LossRun r;
    r.valid(0, 100);
    r.valid(1000, 1030);
    r.tracker.invalid();
    r.valid(1100, 1130);  // within hold, but the run before it had not recovered
    EXPECT_EQ(r.motion.valid_since, instant_from_ns(1100 * kMs));
    EXPECT_EQ(r.motion.lost_since, instant_from_ns(100 * kMs));
    EXPECT_TRUE(r.motion.lost_before);
}

TEST(LossTracker, ALossOnTheWayBackGoesOnFromWhereItWas) {
    LossRun r;
    r.valid(0, 100);
    r.valid(1000, 1190);  // recover 40, then half of ease 300
    r.valid(2000, 2000);
    // Half way back at 1190: as if held 250 and eased 150 of 300 by then.
    EXPECT_EQ(r.motion.lost_since, instant_from_ns((1190 - 250 - 150) * kMs));
    EXPECT_EQ(r.motion.held_dir_head, at_deg(1.19, 0));
    EXPECT_EQ(r.motion.valid_since, instant_from_ns(2000 * kMs));
}

// --- OneEuro

TEST(OneEuro, PassesTheFirstSampleAfterResetUnchanged) {
    OneEuro f{OneEuroSettings{}};
    for (int i = 0; i < 50; ++i) (void)f.update(i * kMs, at_deg(10, 10));
    f.reset();
    EXPECT_EQ(f.update(60 * kMs, at_deg(-20, 3)), at_deg(-20, 3));
}

TEST(OneEuro, HalvesTheScatterOfAStillEyeAndFollowsASaccade) {
    OneEuro f{OneEuroSettings{}};
    OneSaccade eye{.onset_s = 1};
    double raw2 = 0, out2 = 0;
    for (int i = 0; i < 950; ++i) {
        const auto g = eye.gaze(i * 1e-3);
        const auto o = f.update(i * kMs, g);
        if (i < 100) continue;
        raw2 += std::pow(angle_between(g, at_deg(0, 0)), 2);
        out2 += std::pow(angle_between(o, at_deg(0, 0)), 2);
    }
    EXPECT_LT(out2, 0.25 * raw2);
    Direction<HeadFrame> o;
    for (int i = 950; i < 1070; ++i) o = f.update(i * kMs, eye.gaze(i * 1e-3));
    EXPECT_LT(angle_between(o, at_deg(10, 0)), 0.2 * kDegree) << "30 ms after landing";
}

TEST(OneEuro, IsTheSameFilterStraightUpAsStraightAhead) {
    // The same wiggle about two gazes; azimuth and elevation would break down about the pole.
    OneEuro ahead{OneEuroSettings{}}, up{OneEuroSettings{}};
    const Direction<HeadFrame> a = at_deg(0, 0), u = at_deg(0, 90);
    for (int i = 0; i < 300; ++i) {
        const Tangent w{0.05 * std::sin(0.03 * i), 0.05 * std::cos(0.05 * i)};
        const auto oa = ahead.update(i * kMs, exp_map(a, w));
        const auto ou = up.update(i * kMs, exp_map(u, w));
        ASSERT_NEAR(angle_between(oa, a), angle_between(ou, u), 1e-9) << i;
    }
}

// --- Classifier

struct Seen {
    int saccades = 0;
    double onset_delay_ms = 0, end_delay_ms = 0;
};
Seen classify(OneSaccade eye, double rate_hz, double end_s) {
    Classifier c{ClassifierSettings{}};
    History h;
    Seen seen;
    GazeEvent before = GazeEvent::fixation;
    for (int i = 0; i / rate_hz < end_s; ++i) {
        const double t = i / rate_hz;
        h.push(static_cast<std::int64_t>(t * 1e9), eye.gaze(t));
        const Classified& now = c.update(h);
        if (now.event == GazeEvent::saccade && before != GazeEvent::saccade) {
            ++seen.saccades;
            seen.onset_delay_ms = (t - eye.onset_s) * 1e3;
        }
        if (now.event != GazeEvent::saccade && before == GazeEvent::saccade)
            seen.end_delay_ms = (t - eye.onset_s - eye.duration_s()) * 1e3;
        before = now.event;
    }
    return seen;
}

TEST(Classifier, SeesASaccadeOnceAndSoon) {
    for (double rate : {1000.0, 500.0, 250.0, 120.0, 90.0})
        for (double amplitude : {2.0, 5.0, 10.0, 20.0}) {
            const Seen s = classify({.amplitude_deg = amplitude}, rate, 1.0);
            EXPECT_EQ(s.saccades, 1) << rate << " Hz, " << amplitude << " deg";
            EXPECT_LT(s.onset_delay_ms, 12 + 1.5e3 / rate) << rate << " Hz, " << amplitude << " deg";
            EXPECT_GT(s.onset_delay_ms, 0);
            EXPECT_LT(std::fabs(s.end_delay_ms), 10 + 1.5e3 / rate) << rate << " Hz, " << amplitude << " deg";
        }
}

TEST(Classifier, DoesNotTakeNoiseForSaccades) {
    for (double noise : {0.01, 0.05, 0.2, 0.5})
        for (double rate : {1000.0, 200.0, 90.0}) {
            const Seen s = classify({.amplitude_deg = 0, .noise_deg = noise}, rate, 30);
            EXPECT_LE(s.saccades, 3) << noise << " deg at " << rate << " Hz in 30 s";
        }
}

TEST(Classifier, TellsPursuitFromFixationAndSaccade) {
    Classifier c{ClassifierSettings{}};
    History h;
    std::mt19937_64 random{3};
    std::normal_distribution<double> n(0, 0.03);
    int pursuit = 0, saccade = 0;
    for (int i = 0; i < 2000; ++i) {
        const double x = i < 500 ? 0 : (i - 500) * 1e-3 * 15;
        h.push(i * kMs, at_deg(x + n(random), n(random)));
        const Classified& now = c.update(h);
        if (i < 500) {
            EXPECT_EQ(now.event, GazeEvent::fixation) << i;
        }
        if (i >= 700) pursuit += now.event == GazeEvent::pursuit;
        saccade += now.event == GazeEvent::saccade;
    }
    EXPECT_GT(pursuit, 1200) << "of 1300";
    EXPECT_LT(saccade, 50);
}

}  // namespace
}  // namespace fovea::pipeline
