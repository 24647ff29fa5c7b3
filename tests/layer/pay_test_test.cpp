#include "render/layer/pay_test.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

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

constexpr int kBlock = PayTest::kSettle + PayTest::kMeasured;
constexpr int kTrial = PayTest::kBlocks * kBlock;
constexpr int kLostLevels = PayTest::kSettle + PayTest::kLost;  // frames in levels of a trial that levels lose
constexpr int kLostTrial = kBlock + kLostLevels;

}  // namespace

TEST(PayTest, KeepsFullDensityWhereLevelsTakeLonger) {
    Frames run;
    EXPECT_EQ(run.frames(kLostTrial, 1'000'000, 1'100'000, 0, 0), kLostLevels);
    EXPECT_EQ(run.frames(PayTest::kLeastHold, 1'000'000, 1'100'000, 0, 0), 0);
}

TEST(PayTest, ATrialThatLevelsLoseEndsAtOnceWhereTheyAreDear) {
    for (const bool processor : {false, true}) {
        Frames run;
        run.test.set_processor_draws(processor);
        EXPECT_EQ(run.frames(kBlock + 3, 1'000'000, 3'000'000, 1'000'000, 3'000'000), 3);
        EXPECT_FALSE(run.test.levels_now());
    }
}

TEST(PayTest, OneDearFrameEndsNoTrial) {
    Frames run;
    run.frames(kBlock + 1, 2'000'000, 1'000'000, 0, 0);
    run.frames(1, 2'000'000, 500'000'000, 0, 0);
    run.frames(kTrial - kBlock - 2, 2'000'000, 1'000'000, 0, 0);
    EXPECT_TRUE(run.test.levels_now());
}

TEST(PayTest, TrialsThatLevelsLoseCostOneFrameInAHundred) {
    for (const std::int64_t levels : {1'050'000, 1'500'000, 1'990'000, 4'000'000, 7'000'000}) {
        Frames run;
        int trials = 0;
        for (int frames = 0; frames < 2 * PayTest::kMostHold; ++frames) {
            const bool full = !run.test.levels_now();
            run.frames(1, 1'000'000, levels, 0, 0);
            if (!full || !run.test.levels_now()) continue;
            // The levels of a trial begin: those before it have been paid for.
            if (trials++ > 0) {
                EXPECT_LT(static_cast<double>(run.now), 1.01 * 1'000'000.0 * (frames + 1)) << levels << " trial " << trials;
            }
        }
        EXPECT_GT(trials, 1);
    }
}

TEST(PayTest, AGainThatIsNoiseKeepsFullDensity) {
    for (const bool processor : {false, true}) {
        Frames run;
        run.test.set_processor_draws(processor);
        run.frames(kTrial, 1'000'000, 990'000, 1'000'000, 990'000);
        EXPECT_FALSE(run.test.levels_now());
    }
}

TEST(PayTest, SaysWhatTheProgramFelt) {
    PayTest test;
    fovea::layer::PaySums sums;
    std::int64_t processor = 0;
    test.set_processor_draws(true);
    for (int i = 0; i < 250; ++i) {
        processor += i < PayTest::kSettle ? 90'000'000 : test.levels_now() ? 1'500'000 : 1'000'000;  // what is loaded does not count
        test.frame_ended(processor, processor, sums);
    }
    const auto counted = static_cast<double>(250 - PayTest::kSettle);
    EXPECT_EQ(sums.frames_levels, kLostLevels);
    EXPECT_NEAR(sums.felt(), (counted + 0.5 * kLostLevels) / counted, 1e-9);
    EXPECT_NE(sums.json().find("\"trials\": 1, "), std::string::npos) << sums.json();
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
    run.frames(kLostTrial + PayTest::kLeastHold, 1'000'000, 1'100'000, 0, 0);
    EXPECT_EQ(run.frames(kTrial, 3'000'000, 2'000'000, 0, 0), kTrial / 2);
    EXPECT_EQ(run.frames(PayTest::kLeastHold, 3'000'000, 2'000'000, 0, 0), PayTest::kLeastHold);
}

TEST(PayTest, TrialsThatAgreeComeLessOften) {
    Frames run;
    run.frames(kLostTrial + PayTest::kLeastHold + kLostTrial, 1'000'000, 1'100'000, 0, 0);
    EXPECT_EQ(run.frames(2 * PayTest::kLeastHold, 1'000'000, 1'100'000, 0, 0), 0);
    EXPECT_EQ(run.frames(kLostTrial, 1'000'000, 1'100'000, 0, 0), kLostLevels);
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
    int frames = 0, hold = 0;
    for (int i = 0; i < 20 * PayTest::kMostHold; ++i) {
        if (run.test.levels_now()) hold = std::max(hold, frames), frames = 0;
        else ++frames;
        run.frames(1, 1'000'000, 1'100'000, 0, 0);
    }
    EXPECT_EQ(hold, PayTest::kMostHold + kBlock);  // and the frames at full density that the trial begins with
}
