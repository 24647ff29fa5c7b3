#include <gmock/gmock.h>

#include "render/quality/control.hpp"
#include "tests/render/allocation_count.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;
using quality::Control;

namespace {

using QualityControl = GlTest;

constexpr const char* kLadder = R"([quality]
pick = "full"
[[quality.setting]]
label = "full"
method = "full"
[[quality.setting]]
label = "gain 3"
method = "scaled_bins"
gain = 3.0
cost = 0.5
error = 1
[[quality.setting]]
label = "gain 9"
method = "scaled_bins"
gain = 9.0
cost = 0.3
error = 2
[[quality.setting]]
label = "arm"
method = "inset_outset"
ratio = 0.3
cost = 0.2
error = 3
)";

void draw(Control& c, const QuadDraw& quad, Views& views) {
    const float gain = static_cast<float>(c.setting().gain);
    views.look(0, {0, 0, gain, gain, 0});
    c.method().submit(quad.list(), views.targets, views.focus);
    gl::finish();
}

TEST_F(QualityControl, WalksTheLadderWithoutAllocatingAndSaysWhy) {
    quality::GovernorSettings g;
    g.budget = std::chrono::milliseconds(10);
    auto made = Control::create(*quality::parse_ladder(kLadder, "ladder"), g);
    ASSERT_TRUE(made.has_value()) << made.error().message();
    Control& c = *made;
    Views views(128, 128);
    const QuadDraw quad(kPattern);
    ASSERT_TRUE(c.prepare(views.targets).has_value());
    EXPECT_EQ(c.left_out(), 0u);
    c.warm_up(quad.list(), views.targets);
    draw(c, quad, views);
    const Pixels full = read(views.targets[0]);
    std::vector<Pixels> pictures;
    Instant now = instant_from_ns(1);
    for (int i = 0; i < 4; ++i) {
        const std::uint64_t before = allocation_count();
        draw(c, quad, views);
        for (int k = 0; k < 12; ++k) c.observe(now += std::chrono::milliseconds(20), std::chrono::milliseconds(12));
        EXPECT_EQ(allocation_count(), before) << "setting " << i;
        pictures.push_back(read(views.targets[0]));
    }
    EXPECT_EQ(c.setting().label, "arm");
    EXPECT_EQ(pictures[0], full);
    EXPECT_NE(pictures[1], full);
    EXPECT_NE(pictures[2], pictures[1]);
    EXPECT_NE(pictures[3], pictures[2]);
    EXPECT_EQ(c.take_log_line().value_or(""), "quality: full -> gain 3: over the budget (12.0 ms, budget 10.0 ms, 6.0 ms expected)");
    EXPECT_THAT(c.take_log_line().value_or(""), testing::HasSubstr("gain 3 -> gain 9"));
}

TEST_F(QualityControl, DrawsThePickAndNothingElseWithoutABudget) {
    auto c = Control::create(quality::built_in_ladder(), std::nullopt);
    ASSERT_TRUE(c.has_value());
    Views views(64, 64);
    ASSERT_TRUE(c->prepare(views.targets).has_value());
    for (int k = 0; k < 100; ++k) c->observe(instant_from_ns(k), std::chrono::seconds(1));
    EXPECT_EQ(c->setting().label, "scaled_bins, gain 4");
    EXPECT_EQ(c->changes(), 0u);
    EXPECT_FALSE(c->take_log_line().has_value());
}

// Views too large for any target: what is left of the ladder is what can be had.
TEST_F(QualityControl, LeavesOutSettingsThatCannotBeHad) {
    auto ladder = quality::parse_ladder(kLadder, "ladder");
    ladder->settings[3].parameters.inset_outset.ratio = -1;   // refused by the method
    quality::GovernorSettings g;
    auto c = Control::create(*ladder, g);
    ASSERT_TRUE(c.has_value());
    Views views(64, 64);
    ASSERT_TRUE(c->prepare(views.targets).has_value());
    EXPECT_EQ(c->left_out(), 1u);
    EXPECT_EQ(c->ladder().settings.size(), 3u);
}

}  // namespace
