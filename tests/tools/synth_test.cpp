// `fovea synth`: sessions of the synthetic eye, and what the rest of the line makes of them.
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "replay/session_file.hpp"
#include "tests/tools/command_runner.hpp"

namespace fovea {
namespace {

using testing::HasSubstr;
using SynthCommand = test::CommandTest;
const std::string kScenarios = FOVEA_SOURCE_DIR "/configs/scenarios/";

TEST_F(SynthCommand, WritesASessionWithTruthLabelsAndHead) {
    const auto r = fovea("synth " + kScenarios + "vr_head.toml " + file("s.fovea") + " --duration-s 10");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.err, HasSubstr("vestibulo_ocular_reflex"));
    const auto recording = replay::load_recording(file("s.fovea"));
    ASSERT_TRUE(recording) << recording.error().message();
    EXPECT_TRUE(recording->info.has_truth && recording->info.has_labels && recording->info.has_head_pose);
    EXPECT_NEAR(static_cast<double>(recording->samples.size()), 1200, 30);
    for (const auto& s : recording->samples) ASSERT_TRUE(s.truth_dir_head);
    const auto reader = replay::SessionReader::open(file("s.fovea"));
    EXPECT_THAT(reader->meta().at("scenario"), HasSubstr("[vergence]"));
}

TEST_F(SynthCommand, WritesTheSameSamplesEachTimeAndOthersWithAnotherSeed) {
    const std::string scenario = kScenarios + "noisy_tracker.toml ";
    ASSERT_EQ(fovea("synth " + scenario + file("a.fovea")).exit_code, 0);
    ASSERT_EQ(fovea("synth " + scenario + file("b.fovea")).exit_code, 0);
    ASSERT_EQ(fovea("synth " + scenario + file("c.fovea") + " --seed 99").exit_code, 0);
    for (const char* name : {"a", "b", "c"}) ASSERT_EQ(fovea("convert " + file(name) + ".fovea " + file(name) + ".csv").exit_code, 0);
    EXPECT_GT(bytes(file("a.csv")).size(), 100'000u);
    EXPECT_EQ(bytes(file("a.csv")), bytes(file("b.csv")));
    EXPECT_NE(bytes(file("a.csv")), bytes(file("c.csv")));
}

TEST_F(SynthCommand, LeavesOutWhatIsNotWanted) {
    const auto r = fovea("synth " + kScenarios + "search.toml " + file("s.fovea") + " --duration-s 20 --without blinks,noise");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.err, HasSubstr("0 invalid"));
    EXPECT_EQ(fovea("synth " + kScenarios + "search.toml " + file("t.fovea") + " --without blink").exit_code, 2);
}

TEST_F(SynthCommand, SaysWhatIsWrong) {
    std::ofstream(file("bad.toml")) << "[noise]\ncolour = 3\n";
    auto r = fovea("synth " + file("bad.toml") + " " + file("s.fovea"));
    EXPECT_EQ(r.exit_code, 3);
    EXPECT_THAT(r.err, HasSubstr("bad.toml:2:10: 'noise.colour' cannot be 3 (legal: a number from 0 to 2)"));
    EXPECT_EQ(fovea("synth " + file("none.toml") + " " + file("s.fovea")).exit_code, 3);
    EXPECT_EQ(fovea("synth").exit_code, 2);
    EXPECT_EQ(fovea("synth " + kScenarios + "search.toml " + file("no/such/folder/s.fovea")).exit_code, 1);
    EXPECT_FALSE(std::filesystem::exists(file("s.fovea")) || std::filesystem::exists(file("s.fovea.part")));
    std::ofstream(file("there.fovea")) << "x";
    EXPECT_EQ(fovea("synth " + kScenarios + "search.toml " + file("there.fovea")).exit_code, 1);
    EXPECT_EQ(bytes(file("there.fovea")), "x");
    EXPECT_THAT(fovea("synth --keys").out, HasSubstr("[tremor]"));
}

// Against the truth the noise that no predictor can foresee does not count: hold errs less than its own noise would cost.
TEST_F(SynthCommand, IsJudgedAgainstTheTruth) {
    std::ofstream(file("still.toml")) << "name = \"still\"\nduration_s = 20\nrate_hz = 250\n[noise]\nstd_deg = 0.5\n";
    ASSERT_EQ(fovea("synth " + file("still.toml") + " " + file("s.fovea")).exit_code, 0);
    const auto r = fovea("tradeoff predict " + file("s.fovea") + " --json --horizon 30");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto tables = nlohmann::json::parse(r.out);
    double hold = 0;
    for (const auto& row : tables[0]["rows"])
        if (row["method"] == "hold") hold = row["mean_30ms"];
    EXPECT_NEAR(hold, 0.5 * 1.2533, 0.05) << "one sample's noise (Rayleigh); against the noisy samples it would be 1.41 times that";
}

}  // namespace
}  // namespace fovea
