#include <gmock/gmock.h>

#include "render/quality/ladder.hpp"

using namespace fovea::quality;
using testing::HasSubstr;

namespace {

constexpr const char* kText = R"([quality]
pick = "middle"
[[quality.setting]]
label = "cheap"
method = "inset_outset"
ratio = 0.35
cost = 0.2
error = 3
[[quality.setting]]
label = "best"
method = "full"
cost = 1
error = 0
[[quality.setting]]
label = "middle"
method = "scaled_bins"
gain = 2.5
levels = 4
reading = "area"
executor = "rectangles"
cost = 0.6
error = 1.25
)";

std::string fault_of(const std::string& text) {
    const auto ladder = parse_ladder(text, "q.toml");
    return ladder ? "" : ladder.error().message();
}

TEST(Ladder, ReadsSettingsOrdersThemByCostAndFindsThePick) {
    const auto ladder = parse_ladder(kText, "q.toml");
    ASSERT_TRUE(ladder.has_value()) << ladder.error().message();
    ASSERT_EQ(ladder->settings.size(), 3u);
    EXPECT_EQ(ladder->settings[0].method, "full");
    EXPECT_EQ(ladder->pick, 1u);
    const Setting& middle = ladder->settings[1];
    EXPECT_EQ(middle.gain, 2.5);
    EXPECT_EQ(middle.parameters.plan.level_count, 4);
    EXPECT_EQ(middle.parameters.plan.reading, fovea::density::Reading::area);
    EXPECT_EQ(middle.parameters.executor, fovea::foveation::BinExecutor::rectangles);
    EXPECT_EQ(ladder->settings[2].parameters.inset_outset.ratio, 0.35);
    EXPECT_THAT(ladder->costs(), testing::ElementsAre(1, 0.6, 0.2));
}

TEST(Ladder, IsReadBackAsItWasWritten) {
    for (const Ladder& ladder : {*parse_ladder(kText, ""), built_in_ladder()}) {
        const auto again = parse_ladder(to_toml(ladder), "again");
        ASSERT_TRUE(again.has_value()) << again.error().message() << '\n' << to_toml(ladder);
        EXPECT_EQ(to_toml(*again), to_toml(ladder));
        EXPECT_EQ(again->pick, ladder.pick);
        for (std::size_t i = 0; i < ladder.settings.size(); ++i) EXPECT_TRUE(again->settings[i].same_method(ladder.settings[i])) << i;
    }
}

TEST(Ladder, LeavesOutWhatACheaperSettingBeats) {
    std::string text = kText;
    text += "[[quality.setting]]\nlabel = \"beaten\"\nmethod = \"dynamic_viewports\"\ncost = 0.7\nerror = 2\n";
    const auto ladder = parse_ladder(text, "q.toml");
    ASSERT_TRUE(ladder.has_value());
    EXPECT_EQ(ladder->settings.size(), 3u);
}

TEST(Ladder, SharesAMethodBetweenGains) {
    const Ladder ladder = built_in_ladder();
    for (std::size_t i = 2; i < ladder.settings.size(); ++i) EXPECT_TRUE(ladder.settings[i].same_method(ladder.settings[1]));
    EXPECT_FALSE(ladder.settings[0].same_method(ladder.settings[1]));
    Setting lists = ladder.settings[1];
    lists.parameters.executor = fovea::foveation::BinExecutor::rectangles;
    EXPECT_FALSE(lists.same_method(ladder.settings[1])) << "another executor is prepared anew";
}

TEST(Ladder, SaysWhereAFileIsWrongAndWhatIsRight) {
    const std::string head = "[quality]\n[[quality.setting]]\n";
    EXPECT_THAT(fault_of("x = "), HasSubstr("q.toml:1:"));
    EXPECT_THAT(fault_of(""), HasSubstr("no table [quality]"));
    EXPECT_THAT(fault_of("[quality]\n"), HasSubstr("no [[quality.setting]]"));
    EXPECT_THAT(fault_of("[quality]\npik = 1\n"), testing::AllOf(HasSubstr("q.toml:2:"), HasSubstr("pik")));
    EXPECT_THAT(fault_of(head + "gain = 4\n"), HasSubstr("without a method"));
    EXPECT_THAT(fault_of(head + "method = \"auto\"\n"), testing::AllOf(HasSubstr("q.toml:3:"), HasSubstr("scaled_bins")));
    EXPECT_THAT(fault_of(head + "method = \"full\"\ngain = 4\n"), testing::AllOf(HasSubstr("q.toml:4:"), HasSubstr("unknown key 'gain'")));
    EXPECT_THAT(fault_of(head + "method = \"scaled_bins\"\ngain = 0\n"), HasSubstr("0.1 to 1000"));
    EXPECT_THAT(fault_of(head + "method = \"scaled_bins\"\ngain = nan\n"), HasSubstr("0.1 to 1000"));
    EXPECT_THAT(fault_of(head + "method = \"scaled_bins\"\nreading = \"log\"\n"), HasSubstr("\"area\""));
    EXPECT_THAT(fault_of(head + "method = \"scaled_bins\"\nexecutor = \"lists\"\n"), HasSubstr("\"rectangles\""));
    EXPECT_THAT(fault_of(head + "method = \"scaled_bins_late\"\nexecutor = \"masks\"\n"), HasSubstr("unknown key"));
    EXPECT_THAT(fault_of(head + "method = \"full\"\ncost = 0\n"), HasSubstr("cost"));
    EXPECT_THAT(fault_of("[quality]\npick = \"none\"\n[[quality.setting]]\nmethod = \"full\"\n"), HasSubstr("there are: full"));
    EXPECT_FALSE(load_ladder("/nonexistent/q.toml").has_value());
}

}  // namespace
