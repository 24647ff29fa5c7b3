#include "drivers/clock_sync.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace fovea::drivers {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// A device whose clock runs (1 + ppm) times as fast as ours, and a transport with a least delay and random extra.
struct Link {
    double ppm = 0;
    std::int64_t offset_ns = 1'650'000'000'000'000'000;  // its epoch: UTC
    std::int64_t least_ns = 2 * kMs;
    double jitter_ms = 1;
    std::mt19937_64 random{11};
    std::int64_t last_arrival = 0;
    double tail = 0.05;  // share of packets that are held up for long

    std::int64_t device(std::int64_t t) const { return offset_ns + t + static_cast<std::int64_t>(static_cast<double>(t) * ppm * 1e-6); }
    std::int64_t arrival(std::int64_t t) {
        std::exponential_distribution<double> extra(1 / jitter_ms);
        double ms = extra(random);
        if (std::uniform_real_distribution<double>(0, 1)(random) < tail) ms += 20;
        // Packets do not overtake each other.
        return last_arrival = std::max(last_arrival, t + least_ns + static_cast<std::int64_t>(ms * 1e6));
    }
};

TEST(ClockSync, FindsOffsetAndSkewUnderJitter) {
    for (const double ppm : {-200.0, -20.0, 0.0, 200.0}) {
        Link link{.ppm = ppm};
        ClockSync sync(std::chrono::milliseconds(2));
        double worst = 0;
        for (std::int64_t t = 0; t < 60'000 * kMs; t += 8 * kMs) {
            const auto m = sync.update({link.device(t)}, instant_from_ns(link.arrival(t)));
            if (t > 20'000 * kMs) {
                EXPECT_TRUE(m.settled);
                worst = std::max(worst, std::fabs(static_cast<double>(to_ns(m.exposed) - t)) * 1e-6);
            }
        }
        EXPECT_LT(worst, 0.4) << ppm << " ppm; the jitter alone is up to 25 ms";
        EXPECT_NEAR(sync.skew() * 1e6, -ppm, 15) << ppm;
    }
}

TEST(ClockSync, MarksTimesUntilItHasSettled) {
    Link link;
    ClockSync sync;
    EXPECT_FALSE(sync.update({link.device(0)}, instant_from_ns(link.arrival(0))).settled);
    EXPECT_FALSE(sync.update({link.device(900 * kMs)}, instant_from_ns(link.arrival(900 * kMs))).settled);
    EXPECT_TRUE(sync.update({link.device(1100 * kMs)}, instant_from_ns(link.arrival(1100 * kMs))).settled);
}

// The machine slept: its clock stood still, the device's went on. Whoever opens the device anew resets the clock; who does
// not (a sleep too short to be noticed as one, a device that hides a reset) still gets right times after three samples.
TEST(ClockSync, SurvivesThatOurClockStoodStill) {
    for (const bool opened_anew : {true, false}) {
        Link link{.ppm = 50};
        ClockSync sync(std::chrono::milliseconds(2));
        constexpr std::int64_t kNight = 8 * 3'600'000 * kMs;
        Instant before{std::chrono::nanoseconds::min()};
        for (std::int64_t t = 0; t < 20'000 * kMs; t += 4 * kMs) {
            const bool after = t >= 10'000 * kMs;
            if (opened_anew && t == 10'000 * kMs) sync.reset();
            const std::int64_t arrival = link.arrival(t);
            const auto m = sync.update({link.device(t + (after ? kNight : 0))}, instant_from_ns(arrival));
            EXPECT_LE(to_ns(m.exposed), arrival);
            EXPECT_GE(m.exposed, before) << t;
            before = m.exposed;
            if (after && t < 10'900 * kMs) {
                EXPECT_FALSE(m.settled) << t;
            }
            if (t > 15'000 * kMs) {
                EXPECT_NEAR(static_cast<double>(to_ns(m.exposed) - t) * 1e-6, 0, 0.5) << t;
            }
        }
        EXPECT_EQ(sync.jumps(), opened_anew ? 0u : 1u);
    }
}

TEST(ClockSync, StartsAnewAfterAJumpAndNeverRunsBackwards) {
    for (const std::int64_t jump : {10'000 * kMs, -10'000 * kMs, std::int64_t{3'000'000'000'000'000}}) {
        Link link;
        ClockSync sync(std::chrono::milliseconds(2));
        Instant before{std::chrono::nanoseconds::min()};
        for (std::int64_t t = 0; t < 30'000 * kMs; t += 4 * kMs) {
            const std::int64_t device = link.device(t) + (t >= 15'000 * kMs ? jump : 0);
            const std::int64_t arrival = link.arrival(t);
            const auto m = sync.update({device}, instant_from_ns(arrival));
            EXPECT_GE(m.exposed, before) << t;
            EXPECT_LE(to_ns(m.exposed), arrival) << t;
            before = m.exposed;
            if (t == 15'020 * kMs) {
                EXPECT_EQ(sync.jumps(), 1u) << jump << ": the third stranger in a row proves the jump";
            }
            if (t > 22'000 * kMs) {
                EXPECT_NEAR(static_cast<double>(to_ns(m.exposed) - t) * 1e-6, 0, 0.5) << t;
            }
        }
        EXPECT_EQ(sync.jumps(), 1u) << jump;
    }
}

TEST(ClockSync, OneBrokenStampIsNoJump) {
    Link link;
    ClockSync sync(std::chrono::milliseconds(2));
    for (std::int64_t t = 0; t < 10'000 * kMs; t += 4 * kMs) {
        const std::int64_t device = t == 6'000 * kMs ? 0 : link.device(t);
        const auto m = sync.update({device}, instant_from_ns(link.arrival(t)));
        if (t > 8'000 * kMs) {
            EXPECT_NEAR(static_cast<double>(to_ns(m.exposed) - t) * 1e-6, 0, 0.5);
        }
    }
    EXPECT_EQ(sync.jumps(), 0u);
}

TEST(ClockSync, IsAsGoodAfterAYearAsAfterAMinute) {
    Link link{.ppm = 50, .jitter_ms = 0.2};
    ClockSync sync(std::chrono::milliseconds(2));
    const std::int64_t year = 365LL * 24 * 3600 * 1000 * kMs;
    double worst = 0;
    std::int64_t t = 0;
    for (; t < year; t += 60'000 * kMs) (void)sync.update({link.device(t)}, instant_from_ns(link.arrival(t)));
    const std::int64_t end = t + 60'000 * kMs;
    for (; t < end; t += 8 * kMs) {
        const auto m = sync.update({link.device(t)}, instant_from_ns(link.arrival(t)));
        worst = std::max(worst, std::fabs(static_cast<double>(to_ns(m.exposed) - t)) * 1e-6);
    }
    EXPECT_LT(worst, 0.5);
    EXPECT_EQ(sync.jumps(), 0u);
}

TEST(CounterUnwrap, GoesOnWhereTheCounterWraps) {
    for (const int bits : {16, 32}) {
        const std::uint64_t range = std::uint64_t{1} << bits;
        const std::int64_t tick = bits == 16 ? kMs : 1000;
        CounterUnwrap unwrap(bits, tick);
        std::uint64_t count = range - 5000;
        const std::int64_t first = unwrap.update(count % range).ns;
        for (int i = 1; i < 200'000; ++i) {
            count += range / 100;
            ASSERT_EQ(unwrap.update(count % range).ns - first, static_cast<std::int64_t>(count - (range - 5000)) * tick) << bits << " bits, step " << i;
        }
    }
}

TEST(CounterUnwrap, TakesASmallStepBackForALateSample) {
    CounterUnwrap unwrap(16, 1000);
    const auto a = unwrap.update(3);
    EXPECT_EQ(unwrap.update(65534).ns - a.ns, -5000);
    EXPECT_EQ(unwrap.update(10).ns - a.ns, 7000);
}

TEST(CounterUnwrap, StopsAtTheEndOfTimeInsteadOfTurningNegative) {
    CounterUnwrap unwrap(63, 1000);
    EXPECT_EQ(unwrap.update(std::uint64_t{1} << 61).ns, std::numeric_limits<std::int64_t>::max());
}

TEST(ClockSync, DoesNotBelieveASkewThatNoCrystalHas) {
    for (const double ppm : {-3000.0, 3000.0}) {
        Link link{.ppm = ppm};
        ClockSync sync;
        double most = 0;
        for (std::int64_t t = 0; t < 60'000 * kMs; t += 8 * kMs) {
            const std::int64_t arrival = link.arrival(t);
            EXPECT_LE(to_ns(sync.update({link.device(t)}, instant_from_ns(arrival)).exposed), arrival);
            most = std::max(most, std::fabs(sync.skew()));
        }
        EXPECT_EQ(most, ClockSync::kMaxSkew);
    }
}

TEST(ClockSyncProperty, AnyStampsGiveRisingExposuresThatNeverLieInTheFuture) {
    EXPECT_TRUE(rc::check("any stamps", [] {
        ClockSync sync(std::chrono::milliseconds(*rc::gen::inRange(-5, 5)));
        std::int64_t now = 1'000'000'000;
        Instant before{std::chrono::nanoseconds::min()};
        std::int64_t device = *rc::gen::element<std::int64_t>(0, 1'650'000'000'000'000'000, std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min());
        const int n = *rc::gen::inRange(1, 400);
        for (int i = 0; i < n; ++i) {
            now += *rc::gen::inRange<std::int64_t>(0, 300 * kMs);
            const auto step = *rc::gen::weightedElement<std::int64_t>({{20, 4 * kMs}, {5, 250 * kMs}, {2, 0}, {2, -4 * kMs}, {1, 3'600'000 * kMs}, {1, std::int64_t{1} << 61}, {1, -(std::int64_t{1} << 61)}});
            device = static_cast<std::int64_t>(static_cast<std::uint64_t>(device) + static_cast<std::uint64_t>(step));
            const auto m = sync.update({device}, instant_from_ns(now));
            RC_ASSERT(m.exposed >= before);
            RC_ASSERT(to_ns(m.exposed) <= now);
            RC_ASSERT(std::fabs(sync.skew()) <= ClockSync::kMaxSkew);
            before = m.exposed;
        }
    }));
}

}  // namespace
}  // namespace fovea::drivers
