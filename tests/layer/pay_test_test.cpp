#include "render/layer/pay_test.hpp"

#include <gtest/gtest.h>

using fovea::layer::PayTest;

namespace {

// Runs frames that take `full` or `levels` nanoseconds (of a processor: the same, unless `processor_levels` is given),
// as the test wants them drawn; says how many were in levels.
struct Frames {
    PayTest test;
    std::int64_t now = 0, processor = 0;
    int frames(int n, std::int64_t full, std::int64_t levels, std::int64_t processor_full, std::int64_t processor_levels) {
        int in_levels = 0;
        for (int i = 0; i < n; ++i) {
            const bool as_levels = test.levels_now();
            in_levels += as_levels;
            now += as_levels ? levels : full;
            processor += as_levels ? processor_levels : processor_full;
            test.frame_ended(now, processor);
        }
        return in_levels;
    }
};

constexpr int kTrial = PayTest::kBlocks * (PayTest::kSettle + PayTest::kMeasured);

}  // namespace

TEST(PayTest, KeepsFullDensityWhereLevelsTakeLonger) {
    Frames run;
    EXPECT_EQ(run.frames(kTrial, 1'000'000, 2'000'000, 0, 0), kTrial / 2);
    EXPECT_EQ(run.frames(PayTest::kLeastHold, 1'000'000, 2'000'000, 0, 0), 0);
}

TEST(PayTest, GoesToLevelsWhereTheyAreFaster) {
    Frames run;
    run.frames(kTrial, 2'000'000, 1'000'000, 0, 0);
    EXPECT_EQ(run.frames(PayTest::kLeastHold, 2'000'000, 1'000'000, 0, 0), PayTest::kLeastHold);
}

TEST(PayTest, AtTheDisplaysPaceTheProcessorDecides) {
    Frames run;
    run.frames(kTrial, 16'666'667, 16'666'667, 4'000'000, 9'000'000);
    EXPECT_FALSE(run.test.levels_now());
    Frames other;
    other.frames(kTrial, 16'666'667, 16'666'667, 9'000'000, 4'000'000);
    EXPECT_TRUE(other.test.levels_now());
}

TEST(PayTest, WhereTheProcessorDrawsItDecides) {
    Frames run;
    run.test.set_processor_draws(true);
    run.frames(kTrial, 20'000'000, 10'000'000, 4'000'000, 9'000'000);  // another program ran meanwhile
    EXPECT_FALSE(run.test.levels_now());
}

TEST(PayTest, LevelsMustBeFasterInBothHalves) {
    for (const bool second : {false, true}) {
        Frames run;
        run.frames(second ? kTrial / 2 : 0, 1'000'000, 2'000'000, 0, 0);
        run.frames(kTrial / 2, 2'000'000, 1'000'000, 0, 0);
        run.frames(second ? 0 : kTrial / 2, 1'000'000, 2'000'000, 0, 0);
        EXPECT_FALSE(run.test.levels_now());
    }
}

TEST(PayTest, TriesAgainAndFollowsAChangeOfScene) {
    Frames run;
    run.frames(kTrial + PayTest::kLeastHold, 1'000'000, 2'000'000, 0, 0);
    EXPECT_EQ(run.frames(kTrial, 3'000'000, 2'000'000, 0, 0), kTrial / 2);
    EXPECT_EQ(run.frames(PayTest::kLeastHold, 3'000'000, 2'000'000, 0, 0), PayTest::kLeastHold);
}

TEST(PayTest, TrialsThatAgreeComeLessOften) {
    Frames run;
    run.frames(kTrial + PayTest::kLeastHold + kTrial, 1'000'000, 2'000'000, 0, 0);
    EXPECT_EQ(run.frames(2 * PayTest::kLeastHold, 1'000'000, 2'000'000, 0, 0), 0);
    EXPECT_EQ(run.frames(kTrial, 1'000'000, 2'000'000, 0, 0), kTrial / 2);
}

TEST(PayTest, OneSlowFrameOfTheMeasuredDecidesNothing) {
    Frames run;
    run.frames(PayTest::kSettle + 3, 1'000'000, 900'000, 0, 0);
    run.now += 500'000'000;  // the machine was elsewhere
    run.frames(kTrial - PayTest::kSettle - 3, 1'000'000, 900'000, 0, 0);
    EXPECT_TRUE(run.test.levels_now());
}

TEST(PayTest, OneFastFrameOfTheMeasuredDecidesNothing) {
    Frames run;
    // In both blocks of levels one frame takes no time: the last of it is counted with the one before.
    const auto block = [&run](bool skips) {
        run.frames(PayTest::kSettle + 1, 1'000'000, 1'500'000, 0, 0);
        if (skips) run.now -= 1'400'000;
        run.frames(PayTest::kMeasured - 1, 1'000'000, 1'500'000, 0, 0);
    };
    for (const bool levels : {false, true, true, false}) block(levels);
    EXPECT_FALSE(run.test.levels_now());
}

TEST(PayTest, TrialsComeNeverLessOftenThanTheMostHold) {
    Frames run;
    const auto next_hold = [&run] {  // frames between two trials
        run.frames(kTrial, 1'000'000, 2'000'000, 0, 0);
        int frames = 0;
        for (; !run.test.levels_now() && frames <= 2 * PayTest::kMostHold; ++frames) {
            Frames before = run;
            before.frames(PayTest::kSettle + PayTest::kMeasured, 1'000'000, 2'000'000, 0, 0);
            if (before.test.levels_now()) break;  // the second block of the next trial would begin
            run.frames(1, 1'000'000, 2'000'000, 0, 0);
        }
        return frames;
    };
    int hold = 0;
    for (int i = 0; i < 8; ++i) hold = next_hold();
    EXPECT_EQ(hold, PayTest::kMostHold);
}
