#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/tools/command_runner.hpp"

using testing::HasSubstr;

namespace {

const std::string kEyelink = FOVEA_SOURCE_DIR "/tests/data/recordings/eyelink_lookatpoint_s1.csv";
const std::string kVive = FOVEA_SOURCE_DIR "/tests/data/recordings/vive_pro_eye_360vr.csv";

}  // namespace

class Convert : public fovea::test::CommandTest {};

TEST_F(Convert, SessionAndCsvAreTheSameBothWays) {
    ASSERT_EQ(fovea("convert " + kVive + " " + file("a.fovea")).exit_code, 0);
    ASSERT_EQ(fovea("convert " + file("a.fovea") + " " + file("b.csv")).exit_code, 0);
    EXPECT_EQ(bytes(file("b.csv")), bytes(kVive));
    ASSERT_EQ(fovea("convert " + file("b.csv") + " " + file("c.fovea")).exit_code, 0);
    ASSERT_EQ(fovea("convert " + file("c.fovea") + " " + file("d.csv")).exit_code, 0);
    EXPECT_EQ(bytes(file("d.csv")), bytes(kVive));
}

TEST_F(Convert, TellsWhatItDidAsJson) {
    const auto r = fovea("convert --json --start 10 --duration 5 " + kEyelink + " " + file("a.fovea"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto summary = nlohmann::json::parse(r.out);
    EXPECT_EQ(summary["samples"], 5000);
    EXPECT_EQ(summary["format"], "fovea_csv");
    EXPECT_EQ(summary["rate_hz"], 1000.0);
    EXPECT_EQ(summary["labels"], true);
}

TEST_F(Convert, ListsTheFormats) {
    const auto text = fovea("convert --list");
    EXPECT_EQ(text.exit_code, 0);
    const auto list = fovea("convert --list --json");
    ASSERT_EQ(list.exit_code, 0);
    const auto rows = nlohmann::json::parse(list.out);
    EXPECT_GE(rows.size(), 15u);
    for (const auto& row : rows) EXPECT_THAT(text.out, HasSubstr(row["name"].get<std::string>()));
}

TEST_F(Convert, ExitCodesSayWhoseFaultItIs) {
    EXPECT_EQ(fovea("convert").exit_code, 2);
    EXPECT_EQ(fovea("convert " + kVive + " " + file("a.fovea") + " --start 1000").exit_code, 2);
    EXPECT_EQ(fovea("convert /nonexistent " + file("a.fovea")).exit_code, 3);
    EXPECT_EQ(fovea("convert " + kVive + " " + file("a.fovea") + " --from gif").exit_code, 3);
    EXPECT_EQ(fovea("convert " + kVive + " " + file("a.xyz")).exit_code, 1);
    ASSERT_EQ(fovea("convert " + kVive + " " + file("a.fovea")).exit_code, 0);
    const auto again = fovea("convert " + kVive + " " + file("a.fovea"));
    EXPECT_EQ(again.exit_code, 1);
    EXPECT_THAT(again.err, HasSubstr("the file exists"));
    EXPECT_THAT(again.err, HasSubstr("--force"));
    EXPECT_EQ(fovea("convert --force " + kVive + " " + file("a.fovea")).exit_code, 0);
    std::ofstream(file("a.csv")) << "kept";
    EXPECT_EQ(fovea("convert " + kVive + " " + file("a.csv")).exit_code, 1);
    EXPECT_EQ(bytes(file("a.csv")), "kept");
    EXPECT_EQ(fovea("convert --force " + kVive + " " + file("a.csv")).exit_code, 0);
    EXPECT_EQ(bytes(file("a.csv")), bytes(kVive));
}

TEST_F(Convert, ATornInputLeavesNothingBehind) {
    std::ofstream(file("torn.csv")) << bytes(kVive).substr(0, 5000);
    const auto r = fovea("convert " + file("torn.csv") + " " + file("out.fovea"));
    EXPECT_EQ(r.exit_code, 3);
    EXPECT_THAT(r.err, HasSubstr("torn.csv:"));
    EXPECT_FALSE(std::filesystem::exists(file("out.fovea")));
}

TEST_F(Convert, NeverOverwritesItsOwnInput) {
    ASSERT_EQ(fovea("convert " + kVive + " " + file("a.fovea")).exit_code, 0);
    const std::string before = bytes(file("a.fovea"));
    const auto r = fovea("convert --force " + file("a.fovea") + " " + file("a.fovea"));
    EXPECT_EQ(r.exit_code, 2);
    EXPECT_THAT(r.err, HasSubstr("same file"));
    EXPECT_EQ(bytes(file("a.fovea")), before);
}
