// The quality governor against loads that are known: every frame's cost and every instant is injected.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>

#include "render/quality/governor.hpp"

using namespace fovea;
using quality::Governor;
using quality::GovernorSettings;
using quality::Reason;

namespace {

constexpr double kBudget_s = 0.020;

// A program whose frames cost load times the true cost of the setting, with some noise.
struct Program {
    std::vector<double> truth;         // of each setting, against the best
    double load_s = 0.010;             // of the best setting
    double noise = 0;                  // standard deviation, of the cost
    std::mt19937 random{1};
    Instant now = instant_from_ns(1'000'000'000);

    Duration frame(Governor& g, double times = 1) {
        std::normal_distribution<double> n(0, 1);
        const Duration cost = seconds(times * load_s * truth[g.setting()] * std::exp(noise * n(random)));
        now += std::max(cost, Duration{std::chrono::milliseconds(11)});
        g.observe(now, cost);
        return cost;
    }
    void run(Governor& g, double for_s) {
        for (const Instant end = now + seconds(for_s); now < end;) frame(g);
    }
};

GovernorSettings settings() {
    GovernorSettings s;
    s.budget = seconds(kBudget_s);
    return s;
}

const std::vector<double> kCosts{1, 0.8, 0.6, 0.45, 0.35, 0.25, 0.18};

Governor governor(const std::vector<double>& costs = kCosts, std::size_t start = 0) { return *Governor::create(settings(), costs, start); }

TEST(Governor, SettlesAtTheBestSettingThatFitsWithRoomToSpare) {
    for (std::size_t start = 0; start < kCosts.size(); ++start) {
        Governor g = governor(kCosts, start);
        Program p{kCosts, 0.040};          // 0.45 costs 18 ms of 20, 0.35 costs 14
        p.run(g, 60);
        // From above the setting at 18 ms is kept, from below the step to it has no room to spare (up_at 0.85: 17 ms).
        EXPECT_EQ(g.setting(), start <= 3 ? 3u : 4u) << "from " << start;
    }
}

TEST(Governor, StaysAtTheBestWhileItFits) {
    Governor g = governor();
    Program p{kCosts, 0.0175};
    p.noise = 0.05;
    p.run(g, 120);
    EXPECT_EQ(g.changes(), 0u);
}

TEST(Governor, OneSpikeOrFourInAWindowMoveNothing) {
    Governor g = governor();
    Program p{kCosts, 0.015};
    p.run(g, 1);
    for (int i = 0; i < 200; ++i) p.frame(g, i % 9 < 4 ? 50 : 1);
    EXPECT_EQ(g.changes(), 0u);
}

TEST(Governor, AnswersAJumpOfTheLoadWithinHalfAWindow) {
    Governor g = governor();
    Program p{kCosts, 0.015};
    p.run(g, 1);
    p.load_s = 0.060;   // 4 times as much: 0.25 fits
    int frames = 0;
    while (g.changes() == 0 && frames < 100) {
        p.frame(g);
        ++frames;
    }
    EXPECT_LE(frames, (settings().window + 1) / 2);
    EXPECT_EQ(g.setting(), 5u);   // in one step
    const auto change = g.take_change();
    ASSERT_TRUE(change.has_value());
    EXPECT_EQ(change->from, 0u);
    EXPECT_EQ(change->to, 5u);
    EXPECT_EQ(change->reason, Reason::over_budget);
    EXPECT_NEAR(to_seconds(change->measured), 0.060, 1e-6);
    EXPECT_NEAR(to_seconds(change->predicted), 0.015, 1e-6);
    EXPECT_EQ(change->budget, settings().budget);
    EXPECT_EQ(change->at, p.now);
    EXPECT_FALSE(g.take_change().has_value());
}

TEST(Governor, ClimbsOneByOneWhenTheLoadFalls) {
    Governor g = governor(kCosts, 6);
    Program p{kCosts, 0.010};
    p.run(g, 30);
    EXPECT_EQ(g.setting(), 0u);
    std::size_t at = 6;
    Instant last{};
    while (const auto c = g.take_change()) {
        EXPECT_EQ(c->from, at);
        EXPECT_EQ(c->to, --at);
        EXPECT_EQ(c->reason, Reason::headroom);
        EXPECT_GE(c->at - last, settings().up_dwell);
        last = c->at;
    }
    EXPECT_EQ(at, 0u);
}

TEST(Governor, SaysOnceThatTheCheapestIsNotCheapEnough) {
    Governor g = governor();
    Program p{kCosts, 1.0};
    p.run(g, 60);
    EXPECT_EQ(g.setting(), 6u);
    int said = 0;
    while (const auto c = g.take_change()) said += c->reason == Reason::cannot_hold;
    EXPECT_EQ(said, 1);
}

// The ladder says 0.8 to 1, in truth the best costs three times as much: tried twice, then left alone.
TEST(Governor, LeavesAStepAloneThatFailedTwiceUntilTheLoadChanges) {
    Governor g = governor(kCosts, 1);
    Program p{{3, 0.8, 0.6, 0.45, 0.35, 0.25, 0.18}, 0.015};
    p.run(g, 600);
    EXPECT_EQ(g.setting(), 1u);
    EXPECT_LE(g.changes(), 10u);   // up, down by three, up by two; twice
    const auto before = g.changes();
    p.run(g, 600);
    EXPECT_EQ(g.changes(), before);
    p.load_s = 0.006;   // 18 ms at the best: it fits only now, but not with the room that a step up needs
    p.run(g, 60);
    EXPECT_EQ(g.setting(), 0u);   // the ladder's promise counts again after the change of load, and it holds
}

TEST(Governor, RemembersTheLastChangesAndCountsWhatNobodyTook) {
    Governor g = governor();
    Program p{kCosts, 0.015};
    for (int i = 0; i < 100; ++i) {
        p.load_s = 0.3;
        p.run(g, 3);
        p.load_s = 0.001;
        p.run(g, 20);
    }
    ASSERT_GT(g.changes(), 2 * Governor::kKeptChanges);
    std::uint64_t taken = 0;
    while (g.take_change()) ++taken;
    EXPECT_LE(taken, Governor::kKeptChanges);
    EXPECT_EQ(taken + g.changes_lost(), g.changes());
}

TEST(Governor, IgnoresCostsThatAreNoTimes) {
    Governor g = governor();
    for (int i = 0; i < 100; ++i) g.observe(instant_from_ns(i), Duration{i % 2 == 0 ? 0 : -5'000'000'000});
    EXPECT_EQ(g.changes(), 0u);
}

TEST(Governor, RefusesWhatCannotBe) {
    const auto refused = [](const std::vector<double>& costs, auto change, std::size_t start = 0) {
        GovernorSettings s = settings();
        change(s);
        return !Governor::create(s, costs, start).has_value();
    };
    const auto as_it_is = [](GovernorSettings&) {};
    EXPECT_FALSE(refused(kCosts, as_it_is));
    EXPECT_TRUE(refused({}, as_it_is));
    EXPECT_TRUE(refused({1, 1}, as_it_is));
    EXPECT_TRUE(refused({1, 0}, as_it_is));
    EXPECT_TRUE(refused({1, std::nan("")}, as_it_is));
    EXPECT_TRUE(refused(kCosts, as_it_is, 7));
    EXPECT_TRUE(refused(std::vector<double>(33, 1), as_it_is));
    EXPECT_TRUE(refused(kCosts, [](GovernorSettings& s) { s.budget = Duration{}; }));
    EXPECT_TRUE(refused(kCosts, [](GovernorSettings& s) { s.window = 4; }));
    EXPECT_TRUE(refused(kCosts, [](GovernorSettings& s) { s.up_at = std::nan(""); }));
}

// A ladder of 2 to 12 settings, and what they really cost: up to twice as much or half as much as it says.
struct Case {
    std::vector<double> ladder, truth;
};
Case random_case(bool honest) {
    Case c;
    const int count = *rc::gen::inRange(2, 13);
    double cost = 1;
    for (int i = 0; i < count; ++i) {
        c.ladder.push_back(cost);
        c.truth.push_back(honest ? cost : cost * std::exp2(*rc::gen::inRange(-100, 101) / 100.0));
        cost *= *rc::gen::inRange(40, 96) / 100.0;
    }
    return c;
}

// However wrong the ladder is: under a constant load the setting comes to rest, and with noisy frames (which may put off
// the first try of a step for long) no step is taken back more than twice.
RC_GTEST_PROP(GovernorProperty, NeverOscillatesOnAConstantLoad, ()) {
    const Case c = random_case(false);
    Governor g = governor(c.ladder, *rc::gen::inRange<std::size_t>(0, c.ladder.size()));
    Program p{c.truth, *rc::gen::inRange(2, 200) * 1e-3};
    p.noise = *rc::gen::inRange(0, 6) * 0.01;
    p.random.seed(*rc::gen::arbitrary<unsigned>());
    p.run(g, 900);
    std::size_t taken_back = 0;
    bool at_rest = true;
    while (const auto change = g.take_change()) {
        taken_back += change->reason == Reason::over_budget;
        at_rest = at_rest && (change->from == change->to || p.now - change->at > seconds(300));
    }
    RC_ASSERT(g.changes_lost() == 0u);
    RC_ASSERT(taken_back <= 2 * c.ladder.size());
    if (p.noise == 0) RC_ASSERT(at_rest);
}

// An honest ladder: after a disturbance of any length the setting from before it comes back, in bounded time.
RC_GTEST_PROP(GovernorProperty, RecoversFromADisturbance, ()) {
    const Case c = random_case(true);
    Governor g = governor(c.ladder);
    Program p{c.truth, *rc::gen::inRange(2, 17) * 1e-3};   // the best fits
    p.run(g, 10);
    RC_ASSERT(g.setting() == 0u);
    const double before = p.load_s;
    p.load_s *= *rc::gen::inRange(2, 60);
    p.run(g, *rc::gen::inRange(1, 300) * 0.1);
    p.load_s = before;
    p.run(g, 40 + 2.0 * static_cast<double>(c.ladder.size()));   // at most one `retry` of what was learned while disturbed
    RC_ASSERT(g.setting() == 0u);
}

// Whatever the load does: once it has stood still for a while, the budget is held wherever the ladder can hold it.
RC_GTEST_PROP(GovernorProperty, HoldsTheBudgetWhereTheLadderCan, ()) {
    const Case c = random_case(false);
    Governor g = governor(c.ladder);
    Program p{c.truth, 0.01};
    for (int i = *rc::gen::inRange(0, 8); i > 0; --i) {
        p.load_s = *rc::gen::inRange(1, 300) * 1e-3;
        p.run(g, *rc::gen::inRange(1, 50) * 0.1);
    }
    p.load_s = *rc::gen::inRange(1, 300) * 1e-3;
    p.run(g, 700);
    const double cost = p.load_s * c.truth[g.setting()];
    RC_ASSERT(cost <= kBudget_s * 1.000001 || g.setting() + 1 == c.ladder.size());
}

// The reaction is bounded whatever came before: within settle + window frames a frame over the budget leads to a cheaper
// setting, until there is none.
RC_GTEST_PROP(GovernorProperty, ReactsWithinAWindow, ()) {
    const Case c = random_case(false);
    Governor g = governor(c.ladder, *rc::gen::inRange<std::size_t>(0, c.ladder.size()));
    Program p{c.truth, *rc::gen::inRange(1, 100) * 1e-3};
    p.run(g, *rc::gen::inRange(0, 100) * 0.1);
    p.load_s = 100;   // over the budget everywhere
    const std::size_t from = g.setting();
    while (g.take_change()) {}
    for (int i = 0; i < settings().settle + settings().window; ++i) p.frame(g);
    RC_ASSERT(g.setting() > from || from + 1 == c.ladder.size());
}

}  // namespace
