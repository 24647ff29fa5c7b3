#include "render/layer/comparison.hpp"

#include <gtest/gtest.h>

using fovea::layer::Comparison;
using fovea::layer::Way;

namespace {

// Frames of a program whose frame takes `whole` straight, and these multiples in the other ways. What a frame's swap does is
// counted with the next frame, as it is at a real swap.
struct Program {
    Comparison comparison;
    std::int64_t now = 1'000'000'000, processor = 500'000'000, in_the_swap = 0;
    std::vector<Way> ways;
    void frame(double whole, double recorded, double levels) {
        const Way way = comparison.way();
        ways.push_back(way);
        const double takes = whole * (way == Way::recorded ? recorded : way == Way::levels ? levels : 1.0);
        now += in_the_swap, processor += in_the_swap;
        in_the_swap = static_cast<std::int64_t>(takes * 1e6);
        comparison.frame_ended(now, processor);
    }
};

constexpr int kBlock = Comparison::kMeasured + 1, kCycle = 3 * kBlock, kFirst = (Comparison::kWarmCycles + 1) * kCycle;

}  // namespace

TEST(Comparison, HasNoResultBeforeAWholeCycleAfterTheWarmOnes) {
    Program p;
    for (int i = 0; i < kFirst - 1; ++i) p.frame(2, 1, 1);
    EXPECT_FALSE(p.comparison.result().has_value());
    p.frame(2, 1, 1);
    ASSERT_TRUE(p.comparison.result().has_value());
    EXPECT_EQ(p.comparison.result()->pairs, 1u);
}

TEST(Comparison, FindsTheRatiosOfTheThreeWays) {
    Program p;
    for (int i = 0; i < kFirst + 10 * kCycle; ++i) p.frame(4, 1.25, 0.5);
    const auto r = *p.comparison.result();
    EXPECT_NEAR(r.processor_ms, 4, 0.01);
    EXPECT_NEAR(r.recorded_processor.median, 1.25, 0.01);
    EXPECT_NEAR(r.levels_processor.median, 0.5, 0.01);
    EXPECT_NEAR(r.levels_time.high, 0.5, 0.01);
}

TEST(Comparison, AProgramThatGrowsSlowlyFavoursNoWay) {
    Program p;
    for (int i = 0; i < kFirst + 200 * kCycle; ++i) p.frame(4 + 0.002 * i, 1, 1);
    const auto r = *p.comparison.result();
    EXPECT_NEAR(r.recorded_processor.median, 1, 0.01);  // blocks forwards and backwards in turns
    EXPECT_NEAR(r.levels_processor.median, 1, 0.01);
}

TEST(Comparison, OneFrameOfABlockThatTookLongDecidesNothing) {
    Program p;
    for (int i = 0; i < kFirst + 20 * kCycle; ++i) {
        if (i % kBlock == 3) p.now += 50'000'000, p.processor += 20'000'000;
        p.frame(4, 1.1, 2);
    }
    EXPECT_NEAR(p.comparison.result()->recorded_time.median, 1.1, 0.01);
    EXPECT_NEAR(p.comparison.result()->recorded_processor.median, 1.1, 0.01);
}

TEST(Comparison, BlocksFollowEachOtherForwardsAndBackwards) {
    Program p;
    for (int i = 0; i < 2 * kCycle; ++i) p.frame(1, 1, 1);
    for (int block = 0; block < 6; ++block)
        EXPECT_EQ(p.ways[static_cast<std::size_t>(block * kBlock)],
                  (std::array{Way::straight, Way::recorded, Way::levels, Way::levels, Way::recorded, Way::straight})[static_cast<std::size_t>(block)]);
}

TEST(Comparison, AProgramThatRunsForDaysKeepsNoMoreThanTheFirstCycles) {
    Program p;
    constexpr std::size_t kCycles = Comparison::kMostCycles + 20;
    for (std::size_t i = 0; i < kFirst + kCycles * kCycle; ++i) p.frame(4, 1.1, 0.5);
    EXPECT_EQ(p.comparison.result()->pairs, Comparison::kMostCycles);
    EXPECT_NEAR(p.comparison.result()->recorded_processor.median, 1.1, 0.01);
}
