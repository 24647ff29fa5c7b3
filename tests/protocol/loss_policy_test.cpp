#include "protocol/loss_policy.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cstring>
#include <numbers>

using namespace fovea;
using namespace std::chrono_literals;

namespace {

using Dir = Direction<HeadFrame>;
constexpr Instant kStart = instant_from_ns(1'000'000'000'000);
constexpr double kPi = std::numbers::pi;

Dir at(double azimuth, double elevation = 0) { return from_azimuth_elevation<HeadFrame>({azimuth, elevation}); }

// Steady gaze at `dir`, tracked since long ago, last seen at kStart.
EyeMotion steady(Dir dir) {
    EyeMotion m;
    m.reference = kStart;
    m.gaze_dir_head = dir;
    m.event = GazeEvent::fixation;
    m.ever_valid = true;
    m.valid_since = kStart - 10s;
    for (HorizonPoint& h : m.horizons) h.radius68_rad = 0.01f, h.radius95_rad = 0.02f;
    return m;
}

// Lost at kStart with the gaze at `held`; back since kStart + gap, last seen `run` later, now at `dir`.
EyeMotion back(Dir held, Dir dir, Duration gap, Duration run) {
    EyeMotion m = steady(dir);
    m.lost_before = true;
    m.lost_since = kStart;
    m.held_dir_head = held;
    m.valid_since = kStart + gap;
    m.reference = m.valid_since + run;
    return m;
}

LossPolicy policy_to(Dir dir) {
    LossPolicy p;
    p.static_dir_head = dir;
    return p;
}

bool sane(const GazeEstimate& e) {
    return std::abs(length(e.gaze_dir_head.vec()) - 1) < 1e-6 && e.radius68_rad >= 0 && e.radius68_rad <= kPi &&
           e.radius95_rad >= 0 && e.radius95_rad <= kPi && e.tracked >= 0 && e.tracked <= 1;
}

template <class T>
T any_bits() {
    if constexpr (sizeof(T) == 8)
        return std::bit_cast<T>(*rc::gen::resize(100, rc::gen::arbitrary<std::uint64_t>()));
    else
        return std::bit_cast<T>(*rc::gen::resize(100, rc::gen::arbitrary<std::uint32_t>()));
}
// Mostly nasty: random bits, or one of the values that break arithmetic.
double any_double() {
    const double nasty[] = {std::nan(""), INFINITY, -INFINITY, 0.0, -0.0, 5e-324, 1e308, -1e308, 1.0, -1.0};
    return *rc::gen::arbitrary<bool>() ? any_bits<double>() : nasty[*rc::gen::inRange(0, 10)];
}
float any_float() { return *rc::gen::arbitrary<bool>() ? any_bits<float>() : static_cast<float>(any_double()); }
Instant any_instant() {
    const std::int64_t nasty[] = {INT64_MIN, INT64_MAX, 0, -1, 1, to_ns(kStart)};
    return instant_from_ns(*rc::gen::arbitrary<bool>() ? any_bits<std::int64_t>() : nasty[*rc::gen::inRange(0, 6)]);
}
Dir any_dir() { return {any_double(), any_double(), any_double()}; }
EyeMotion any_motion() {
    EyeMotion m;
    m.reference = any_instant();
    m.gaze_dir_head = any_dir();
    m.velocity_rad_s = {any_double(), any_double()};
    m.event = static_cast<GazeEvent>(any_bits<std::uint32_t>() & 0xff);
    for (HorizonPoint& h : m.horizons) h = {any_float(), any_float(), any_float(), any_float()};
    m.ever_valid = *rc::gen::inRange(0, 4) != 0;
    m.valid_since = any_instant();
    m.lost_before = *rc::gen::arbitrary<bool>();
    m.lost_since = any_instant();
    m.held_dir_head = any_dir();
    return m;
}

}  // namespace

TEST(MotionModel, AnswersTheReferenceBeforeItAndTheLastHorizonAfterIt) {
    EyeMotion m = steady(at(0.1));
    for (std::size_t i = 0; i < kHorizons_ns.size(); ++i)
        m.horizons[i].du_rad = 0.001f * static_cast<float>(i + 1);
    EXPECT_EQ(evaluate(m, kStart - 1h), evaluate(m, kStart));
    EXPECT_EQ(evaluate(m, kStart + 150ms), evaluate(m, kStart + 1h));
    EXPECT_NEAR(angle_between(m.gaze_dir_head, evaluate(m, kStart - 1h).gaze_dir_head), 0.001, 1e-9);
    EXPECT_NEAR(angle_between(m.gaze_dir_head, evaluate(m, kStart + 1h).gaze_dir_head), 0.012, 1e-9);
}

TEST(MotionModel, StatesEachHorizonExactlyAndInterpolatesBetweenThem) {
    EyeMotion m = steady(at(-0.3, 0.2));
    for (std::size_t i = 0; i < kHorizons_ns.size(); ++i) {
        const float x = static_cast<float>(i);
        m.horizons[i] = {0.01f * x * x, -0.02f * x, 0.01f + 0.001f * x, 0.02f + 0.002f * x};
    }
    for (std::size_t i = 0; i < kHorizons_ns.size(); ++i) {
        const GazeEstimate e = evaluate(m, kStart + Duration{kHorizons_ns[i]});
        const Tangent d = log_map(m.gaze_dir_head, e.gaze_dir_head);
        EXPECT_NEAR(d.u, static_cast<double>(m.horizons[i].du_rad), 1e-12);
        EXPECT_NEAR(d.v, static_cast<double>(m.horizons[i].dv_rad), 1e-12);
        EXPECT_NEAR(e.radius68_rad, static_cast<double>(m.horizons[i].radius68_rad), 1e-12);
        if (i == 0) continue;
        const GazeEstimate mid = evaluate(m, kStart + Duration{(kHorizons_ns[i] + kHorizons_ns[i - 1]) / 2});
        const Tangent h = log_map(m.gaze_dir_head, mid.gaze_dir_head);
        EXPECT_NEAR(h.u, 0.5 * (static_cast<double>(m.horizons[i].du_rad) + static_cast<double>(m.horizons[i - 1].du_rad)), 1e-12);
        EXPECT_NEAR(mid.radius95_rad,
                    0.5 * (static_cast<double>(m.horizons[i].radius95_rad) +
                           static_cast<double>(m.horizons[i - 1].radius95_rad)), 1e-12);
    }
}

TEST(MotionModel, AgreesWithTheExponentialMapForEveryDisplacement) {
    for (const double u : {0.0, 1e-9, 0.1, 0.4999, 0.5001, 1.5, 3.1}) {
        EyeMotion m = steady(at(0.4, -0.3));
        for (HorizonPoint& h : m.horizons) h.du_rad = static_cast<float>(u), h.dv_rad = 0.01f;
        const Dir expected = exp_map(m.gaze_dir_head, {static_cast<double>(static_cast<float>(u)), static_cast<double>(0.01f)});
        EXPECT_LT(angle_between(evaluate(m, kStart + 7ms).gaze_dir_head, expected), 4e-16) << u;
    }
}

RC_GTEST_PROP(MotionModel, IsNeverNaNWhateverItsBits, ()) {
    const EyeMotion m = any_motion();
    RC_ASSERT(sane(evaluate(m, any_instant())));
}

RC_GTEST_PROP(LossPolicy, IsNeverNaNWhateverTheBitsOfModelAndPolicy, ()) {
    LossPolicy p;
    p.hold = Duration{any_bits<std::int64_t>()};
    p.ease = Duration{any_bits<std::int64_t>()};
    p.recover = Duration{any_bits<std::int64_t>()};
    p.static_dir_head = any_dir();
    p.static_radius_rad = any_double();
    RC_ASSERT(sane(evaluate(any_motion(), p, any_instant())));
}

TEST(LossPolicy, IsThePredictionItselfWhileTracked) {
    EyeMotion m = steady(at(0.2, 0.1));
    for (HorizonPoint& h : m.horizons) h.du_rad = 0.05f;
    for (const Duration d : {0ms, 20ms, 150ms, 250ms}) EXPECT_EQ(evaluate(m, LossPolicy{}, kStart + d), evaluate(m, kStart + d));
}

TEST(LossPolicy, LooksAtTheStaticPointWhenThereHasNeverBeenAGaze) {
    EyeMotion m = steady(at(0.2));
    m.ever_valid = false;
    const GazeEstimate e = evaluate(m, policy_to(at(-0.1)), kStart);
    EXPECT_EQ(e.gaze_dir_head, at(-0.1));
    EXPECT_EQ(e.tracked, 0);
    EXPECT_EQ(e.event, GazeEvent::lost);
    EXPECT_EQ(e.radius68_rad, LossPolicy{}.static_radius_rad);
}

TEST(LossPolicy, HoldsThenEasesThenRestsOnTheStaticPoint) {
    const EyeMotion m = steady(at(0.5));
    const LossPolicy p = policy_to(at(-0.1));
    EXPECT_EQ(evaluate(m, p, kStart + 250ms).tracked, 1);
    const GazeEstimate half = evaluate(m, p, kStart + 400ms);
    EXPECT_NEAR(half.tracked, 0.5, 1e-12);
    EXPECT_NEAR(angle_between(half.gaze_dir_head, at(0.2)), 0, 1e-12);
    EXPECT_NEAR(half.radius95_rad, 0.5 * (static_cast<double>(0.02f) + 0.35), 1e-12);
    const GazeEstimate rest = evaluate(m, p, kStart + 550ms);
    EXPECT_EQ(rest.tracked, 0);
    EXPECT_EQ(rest.event, GazeEvent::lost);
    EXPECT_LT(angle_between(rest.gaze_dir_head, at(-0.1)), 1e-15);
    EXPECT_EQ(evaluate(m, p, kStart + 1h), rest);
}

TEST(LossPolicy, GrowsTheRadiiWithoutAStepBackWhileItEasesOut) {
    const EyeMotion m = steady(at(0.5));
    double before = 0;
    for (Duration d = 0ms; d < 700ms; d += 1ms) {
        const double r = evaluate(m, LossPolicy{}, kStart + d).radius95_rad;
        EXPECT_GE(r, before);
        before = r;
    }
    EXPECT_EQ(before, 0.35);
}

TEST(LossPolicy, AGapWithinHoldLeavesNoTrace) {
    for (const Duration gap : {Duration{1}, Duration{200ms}, Duration{250ms}}) {
        EyeMotion m = back(at(0.5), at(0.1), gap, 1ms);
        EyeMotion never_lost = m;
        never_lost.lost_before = false;
        for (Duration d = 0ms; d < 900ms; d += 7ms)
            EXPECT_EQ(evaluate(m, LossPolicy{}, kStart + d), evaluate(never_lost, LossPolicy{}, kStart + d));
    }
}

TEST(LossPolicy, ComesBackOnlyAfterRecoverOfValidDataAndThenEases) {
    const LossPolicy p = policy_to(at(0));
    const Instant seen = kStart + 2s;   // long lost: it starts at the static point
    EyeMotion m = back(at(0.5), at(-0.3), 2s, 39ms);
    EXPECT_EQ(evaluate(m, p, seen + 39ms).tracked, 0);
    m.reference = seen + 190ms;
    EXPECT_EQ(evaluate(m, p, seen + 40ms).tracked, 0);
    EXPECT_LT(angle_between(evaluate(m, p, seen + 40ms).gaze_dir_head, at(0)), 1e-15);
    EXPECT_NEAR(evaluate(m, p, seen + 190ms).tracked, 0.5, 1e-12);
    EXPECT_NEAR(angle_between(evaluate(m, p, seen + 190ms).gaze_dir_head, at(-0.15)), 0, 1e-12);
    m.reference = seen + 400ms;
    const GazeEstimate live = evaluate(m, p, seen + 400ms);
    EXPECT_EQ(live.tracked, 1);
    EXPECT_EQ(live.gaze_dir_head, m.gaze_dir_head);
}

TEST(LossPolicy, KeepsEasingOutUntilEnoughDataHaveComeAndStartsBackFromThere) {
    const LossPolicy p = policy_to(at(0));
    const EyeMotion m = back(at(0.5), at(-0.3), 300ms, 200ms);
    // Halfway out at 400 ms had nothing come back; frozen at 340 ms, when recovery began.
    const double at_recovery = evaluate(m, p, kStart + 340ms).tracked;
    EXPECT_GT(at_recovery, 0.7);
    EXPECT_LT(at_recovery, 0.8);
    EXPECT_NEAR(angle_between(evaluate(m, p, kStart + 340ms).gaze_dir_head, at(0.5 * at_recovery)), 0, 1e-12);
    const double middle = evaluate(m, p, kStart + 490ms).tracked;
    EXPECT_NEAR(middle, at_recovery + 0.5 * (1 - at_recovery), 1e-12);
}

TEST(LossPolicy, ARunThatBreaksOffBeforeRecoverNeverShowsDeadGaze) {
    EyeMotion m = back(at(0.5), at(-0.3), 2s, 20ms);
    m.event = GazeEvent::lost;
    for (Duration d = 0ms; d < 2s; d += 5ms) EXPECT_EQ(evaluate(m, LossPolicy{}, kStart + 2s + d).tracked, 0);
}

TEST(LossPolicy, ADaemonThatDiesDuringRecoveryNeverCountsAsTrackedInTheEnd) {
    const EyeMotion m = back(at(0.5), at(-0.3), 2s, 20ms);   // event says fixation, and nothing comes any more
    EXPECT_EQ(evaluate(m, LossPolicy{}, kStart + 3s).tracked, 0);
    for (Duration d = 0ms; d < 2s; d += 5ms) EXPECT_LT(evaluate(m, LossPolicy{}, kStart + 2s + d).tracked, 0.9);
}

RC_GTEST_PROP(LossPolicy, NeverJumps, ()) {
    const auto angle = [] { return 0.001 * *rc::gen::inRange(-1000, 1000); };
    const auto ms = [](int low, int high) { return Duration{std::chrono::milliseconds(*rc::gen::inRange(low, high))}; };
    EyeMotion m = back(at(angle(), angle()), at(angle(), angle()), ms(0, 900), ms(0, 900));
    m.lost_before = *rc::gen::inRange(0, 4) != 0;
    if (*rc::gen::arbitrary<bool>()) m.event = GazeEvent::lost;
    double fastest = 0;   // of the prediction
    for (std::size_t i = 0; i < m.horizons.size(); ++i) {
        m.horizons[i].du_rad = static_cast<float>(0.1 * angle());
        if (i == 0) continue;
        const double step = std::abs(static_cast<double>(m.horizons[i].du_rad - m.horizons[i - 1].du_rad));
        fastest = std::max(fastest, step / (1e-9 * static_cast<double>(kHorizons_ns[i] - kHorizons_ns[i - 1])));
    }
    LossPolicy p = policy_to(at(angle(), angle()));
    p.hold = ms(0, 400), p.ease = ms(50, 400), p.recover = ms(0, 200);
    // Smooth steps are at most 1.5 times as fast as straight ones; the ways are at most 3.2 rad long, each way back and
    // out may bend the other, and near-opposite directions turn the great circle between them.
    const Duration dt = 100us;
    const double ease_s = to_seconds(p.ease);
    const double limit = 4 * (fastest + 1.5 * 3.2 / ease_s) * to_seconds(dt) + 1e-9;
    GazeEstimate before = evaluate(m, p, kStart - 10ms);
    for (Duration d = -10ms; d < 2500ms; d += dt) {
        const GazeEstimate e = evaluate(m, p, kStart + d);
        RC_ASSERT(angle_between(before.gaze_dir_head, e.gaze_dir_head) <= limit);
        RC_ASSERT(std::abs(before.tracked - e.tracked) <= 2 * 1.5 / ease_s * to_seconds(dt) + 1e-9);
        before = e;
    }
}
