#include "daemon/pipeline/pipeline.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "daemon/pipeline/settings_table.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/daemon/pipeline_gaze.hpp"

namespace fovea::pipeline {
namespace {

using namespace test;

Pipeline make(const char* filter, const char* predictor) {
    PipelineSettings s;
    s.filter = filter;
    s.predictor.name = predictor;
    s.per_eye = true;
    auto p = Pipeline::create(s);
    EXPECT_TRUE(p) << p.error().message();
    return *std::move(p);
}

bool finite(const EyeMotion& m) {
    bool ok = std::fabs(length(m.gaze_dir_head.vec()) - 1) < 1e-9 && std::fabs(length(m.held_dir_head.vec()) - 1) < 1e-9 &&
              std::isfinite(length(m.velocity_rad_s));
    for (const HorizonPoint& h : m.horizons)
        ok = ok && std::isfinite(h.du_rad) && std::isfinite(h.dv_rad) && std::hypot(h.du_rad, h.dv_rad) < 3.2f &&
             h.radius68_rad >= 0 && h.radius95_rad >= h.radius68_rad && h.radius95_rad < 3.2f;
    if (m.event == GazeEvent::saccade)
        ok = ok && std::fabs(length(m.saccade.landing_dir_head.vec()) - 1) < 1e-9 && m.saccade.duration.count() >= 0;
    return ok;
}

TEST(Pipeline, RefusesSettingsOutsideTheTable) {
    PipelineSettings s;
    s.one_euro.min_cutoff_hz = 0;
    EXPECT_FALSE(Pipeline::create(s));
    s = {};
    s.filter = "bogus";
    EXPECT_FALSE(Pipeline::create(s));
}

TEST(Pipeline, UpdateAllocatesNothing) {
    for (const char* filter : filter_names())
        for (const char* predictor : predictor_names()) {
            Pipeline p = make(filter, predictor);
            OneSaccade eye;
            const std::size_t before = fovea::test::allocations();
            for (int i = 0; i < 1000; ++i) (void)p.update(sample_at(i * kMs, eye.gaze(i * 1e-3), i < 700 || i > 800));
            EXPECT_EQ(fovea::test::allocations(), before) << filter << " and " << predictor;
        }
}

TEST(Pipeline, GivesTheSameBitsOnEveryRunAndAfterReset) {
    Pipeline a = make("one_euro", "damped_velocity"), b = make("one_euro", "damped_velocity");
    OneSaccade warm;
    for (int i = 0; i < 900; ++i) (void)b.update(sample_at(i * kMs, warm.gaze(i * 1e-3)));
    b.reset();
    OneSaccade ea, eb;
    for (int i = 0; i < 900; ++i) {
        const EyeMotion& x = a.update(sample_at(i * kMs, ea.gaze(i * 1e-3))).eyes[0];
        const EyeMotion& y = b.update(sample_at(i * kMs, eb.gaze(i * 1e-3))).eyes[0];
        ASSERT_EQ(x.gaze_dir_head, y.gaze_dir_head) << i;
        ASSERT_EQ(x.event, y.event) << i;
        for (std::size_t h = 0; h < x.horizons.size(); ++h) ASSERT_EQ(x.horizons[h].du_rad, y.horizons[h].du_rad) << i;
    }
}

TEST(Pipeline, LearnsTheSameWhetherSettleIsCalledOrNot) {
    Pipeline a = make("saccade_aware", "auto"), b = make("saccade_aware", "auto");
    OneSaccade ea, eb;
    float changed = 0, before = 0;
    for (int i = 0; i < 2000; ++i) {
        const bool valid = i < 1400 || i > 1450;   // a blink, too
        const EyeMotion& x = a.update(sample_at(i * kMs, ea.gaze(i * 1e-3), valid)).eyes[0];
        const EyeMotion& y = b.update(sample_at(i * kMs, eb.gaze(i * 1e-3), valid)).eyes[0];
        for (std::size_t h = 0; h < x.horizons.size(); ++h) {
            ASSERT_EQ(x.horizons[h].du_rad, y.horizons[h].du_rad) << i;
            ASSERT_EQ(x.horizons[h].radius68_rad, y.horizons[h].radius68_rad) << i;
        }
        changed += std::fabs(x.horizons[5].radius68_rad - before);
        before = x.horizons[5].radius68_rad;
        if (i % 3 != 0) a.settle();
    }
    EXPECT_GT(changed, 0.0f);
}

TEST(Pipeline, GivesTheSameBitsWhetherItRehearsesOrNot) {
    for (const char* filter : filter_names())
        for (const char* predictor : predictor_names()) {
            PipelineSettings settings;
            settings.filter = filter;
            settings.predictor.name = predictor;
            settings.per_eye = true;
            Pipeline a = Pipeline::create(settings).value(), b = Pipeline::create(settings).value();
            OneSaccade eye;
            std::size_t allocated = 0;
            for (int i = 0; i < 400; ++i) {
                GazeSample s = sample_at(i * 4 * kMs, eye.gaze(i * 4e-3), i < 300 || i > 320);
                s.eye(Eye::left) = s.eye(Eye::right) = s.eye(Eye::combined);
                s.head = {true, Rotation<WorldFrame, HeadFrame>{1, 0, 0.001 * (i % 20), 0}};
                const MotionModel &x = a.update(s), &y = b.update(s);
                for (std::size_t e = 0; e < kEyeCount; ++e) {
                    ASSERT_EQ(x.eyes[e].gaze_dir_head, y.eyes[e].gaze_dir_head) << filter << ", " << predictor << ", " << i;
                    ASSERT_EQ(x.eyes[e].event, y.eyes[e].event);
                    for (std::size_t h = 0; h < x.eyes[e].horizons.size(); ++h) {
                        ASSERT_EQ(x.eyes[e].horizons[h].du_rad, y.eyes[e].horizons[h].du_rad);
                        ASSERT_EQ(x.eyes[e].horizons[h].radius68_rad, y.eyes[e].horizons[h].radius68_rad);
                    }
                }
                const std::size_t before = fovea::test::allocations();
                for (int again = i % 4; again > 0; --again) a.rehearse(s, again * std::chrono::milliseconds(4));
                allocated += fovea::test::allocations() - before;
            }
            EXPECT_EQ(allocated, 0u);
            EXPECT_EQ(a.counters().samples, b.counters().samples);
            EXPECT_EQ(a.counters().blinks, b.counters().blinks);
        }
}

TEST(Pipeline, DoesNotDependOnWhenTheRecordingWasMade) {
    Pipeline a = make("one_euro", "damped_velocity"), b = make("one_euro", "damped_velocity");
    OneSaccade ea, eb;
    for (int i = 0; i < 900; ++i) {
        const EyeMotion& x = a.update(sample_at(i * kMs, ea.gaze(i * 1e-3))).eyes[0];
        const EyeMotion& y = b.update(sample_at(1'650'000'000'000'000'007 + i * kMs, eb.gaze(i * 1e-3))).eyes[0];
        ASSERT_EQ(x.gaze_dir_head, y.gaze_dir_head) << i;
    }
}

TEST(Pipeline, ShowsTheGazeBeforeTheBlinkThroughIt) {
    Pipeline p = make("one_euro", "damped_velocity");
    int i = 0;
    for (; i < 500; ++i) (void)p.update(sample_at(i * kMs, at_deg(5 + 0.01 * (i % 3), 0)));
    for (; i < 530; ++i) (void)p.update(sample_at(i * kMs, at_deg(5, -0.8 * (i - 500))));  // the lid drags it down 24 degrees
    for (; i < 650; ++i) {
        const EyeMotion& m = p.update(sample_at(i * kMs, at_deg(0, 0), false)).eyes[0];
        if (i < 551) continue;
        EXPECT_EQ(m.event, GazeEvent::blink);
        EXPECT_LT(angle_between(m.gaze_dir_head, at_deg(5, 0)), 0.5 * kDegree) << i;
        EXPECT_EQ(m.horizons[5].du_rad, 0);
        EXPECT_GT(m.horizons[5].radius95_rad, 5 * kDegree);
    }
    EXPECT_EQ(p.counters().blinks, 1u);
    for (; i < 709; ++i) EXPECT_EQ(p.update(sample_at(i * kMs, at_deg(9 + 0.01 * (i % 3), 0))).eyes[0].event, GazeEvent::blink);
    for (; i < 720; ++i) (void)p.update(sample_at(i * kMs, at_deg(9 + 0.01 * (i % 3), 0)));
    const EyeMotion& m = p.update(sample_at(i * kMs, at_deg(9, 0))).eyes[0];
    EXPECT_LT(angle_between(m.gaze_dir_head, at_deg(9, 0)), 0.1 * kDegree) << "not pulled towards where it was before";
    EXPECT_FALSE(m.lost_before);
}

TEST(Pipeline, IgnoresDuplicatesAndOldSamplesAndCountsThem) {
    Pipeline p = make("none", "hold");
    (void)p.update(sample_at(10 * kMs, at_deg(1, 0)));
    GazeSample old = sample_at(5 * kMs, at_deg(9, 0));
    old.id = 77;
    const MotionModel& m = p.update(old);
    EXPECT_EQ(m.eyes[0].gaze_dir_head, at_deg(1, 0));
    EXPECT_EQ(m.exposed, instant_from_ns(10 * kMs));
    EXPECT_NE(m.sample_id, 77u);
    (void)p.update(sample_at(10 * kMs, at_deg(9, 0)));
    (void)p.update(sample_at(12 * kMs, at_deg(1, 0)));
    EXPECT_EQ(p.counters().out_of_order, 1u);
    EXPECT_EQ(p.counters().duplicates, 2u);
    EXPECT_EQ(p.counters().samples, 4u);
}

TEST(Pipeline, AnHourlyGapStartsTheMotionAfresh) {
    Pipeline p = make("one_euro", "damped_velocity");
    std::int64_t t = 0;
    for (int i = 0; i < 200; ++i) (void)p.update(sample_at(t += kMs, at_deg(0.1 * i, 0)));
    t += 3'600'000 * kMs;
    const EyeMotion& m = p.update(sample_at(t, at_deg(-15, 2))).eyes[0];
    EXPECT_LT(angle_between(m.gaze_dir_head, at_deg(-15, 2)), 1e-12);
    EXPECT_EQ(m.velocity_rad_s, Tangent{});
    EXPECT_TRUE(m.lost_before);
}

TEST(Pipeline, FollowsGazeAcrossTheSideAndBehind) {
    // The seam of the tangent basis lies at 90 degrees; a steady turn must stay steady across it.
    Pipeline p = make("none", "damped_velocity");
    for (int i = 0; i < 1000; ++i) {
        const EyeMotion& m = p.update(sample_at(i * kMs, at_deg(70 + 0.04 * i, 3))).eyes[0];
        ASSERT_TRUE(finite(m));
        if (i > 20) {
            ASSERT_NEAR(length(m.velocity_rad_s), 40 * kDegree * std::cos(3 * kDegree), 0.5 * kDegree) << i;
        }
    }
}

TEST(Pipeline, PutsEachEyeThroughItsOwnCalibration) {
    std::vector<CalibrationPoint> shifted;
    for (const double x : {-10.0, 0.0, 10.0})
        for (const double y : {-10.0, 0.0, 10.0}) shifted.push_back({at_deg(x + 2, y), at_deg(x, y)});
    const auto c = fit_calibration(shifted);
    ASSERT_TRUE(c) << c.error().message();
    Pipeline p = make("none", "hold");
    p.set_calibration(Eye::left, *c);
    GazeSample s = sample_at(kMs, at_deg(0, 0), false);
    s.eye(Eye::left).valid = s.eye(Eye::right).valid = true;
    s.eye(Eye::left).gaze_dir_head = s.eye(Eye::right).gaze_dir_head = at_deg(5, 0);
    const MotionModel& m = p.update(s);
    EXPECT_NEAR(to_azimuth_elevation(m.eye(Eye::left).gaze_dir_head).azimuth_rad / kDegree, 3, 0.05);
    EXPECT_NEAR(to_azimuth_elevation(m.eye(Eye::right).gaze_dir_head).azimuth_rad / kDegree, 5, 1e-9);
    EXPECT_NEAR(to_azimuth_elevation(m.eyes[0].gaze_dir_head).azimuth_rad / kDegree, 4, 0.05) << "the mean of both";
}

// Any sequence of samples whatever gives finite output and instants that do not go back.
TEST(PipelineProperty, AnySequenceGivesFiniteOutputAndMonotonicInstants) {
    const auto odd = rc::gen::element(0.0, -0.0, 1.0, -1.0, 1e-320, 1e300, -1e300, std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::quiet_NaN(), 1e-8, 0.5);
    const auto ordinary = rc::gen::map(rc::gen::inRange(-1000, 1000), [](int v) { return v * 1e-3; });
    const auto value = rc::gen::weightedOneOf<double>({{6, ordinary}, {1, odd}});
    const auto step = rc::gen::weightedElement<std::int64_t>(
        {{20, kMs}, {6, 4 * kMs}, {6, 8 * kMs}, {2, 0}, {2, 1}, {2, -kMs}, {2, 3'600'000 * kMs}, {1, -3'600'000 * kMs}, {3, 100 * kMs},
         {1, std::int64_t{1} << 62}, {1, -(std::int64_t{1} << 62)}});
    for (const char* filter : filter_names())
        for (const char* predictor : predictor_names()) {
            const bool ok = rc::check(std::string(filter) + " + " + predictor, [&] {
                Pipeline p = make(filter, predictor);
                std::uint64_t t = static_cast<std::uint64_t>(*rc::gen::element<std::int64_t>(0, 1'650'000'000'000'000'000));
                Instant reference{std::chrono::nanoseconds::min()}, exposed = reference;
                const auto n = *rc::gen::inRange(1, 300);
                const auto valid = *rc::gen::inRange(1, 10);
                for (int i = 0; i < n; ++i) {
                    t += static_cast<std::uint64_t>(*step);  // wraps, as a broken device clock may
                    GazeSample s;
                    s.exposed = s.received = instant_from_ns(static_cast<std::int64_t>(t));
                    for (EyeState& e : s.eyes) {
                        e.valid = *rc::gen::inRange(0, valid) > 0 || valid == 1;
                        e.gaze_dir_head = {*value, *value, *value};
                        e.openness = *value;
                        e.confidence = *rc::gen::element(1.0, 0.9, kUnknown);
                    }
                    s.head.valid = *rc::gen::inRange(0, 3) > 0;
                    if (*rc::gen::inRange(0, 4) == 0) s.head.world_from_head = {*value, *value, *value, *value};
                    else s.head.world_from_head = {std::cos(0.1 * i), 0, std::sin(0.1 * i), 0};
                    const MotionModel& m = p.update(s);
                    for (const EyeMotion& e : m.eyes) RC_ASSERT(finite(e));
                    if (!m.eyes[0].ever_valid) continue;
                    RC_ASSERT(m.eyes[0].reference >= reference);
                    RC_ASSERT(m.exposed >= exposed);
                    RC_ASSERT(m.eyes[0].reference <= m.exposed);
                    RC_ASSERT(m.eyes[0].valid_since <= m.eyes[0].reference);
                    reference = m.eyes[0].reference;
                    exposed = m.exposed;
                }
            });
            EXPECT_TRUE(ok) << filter << " + " << predictor;
        }
}

}  // namespace
}  // namespace fovea::pipeline
