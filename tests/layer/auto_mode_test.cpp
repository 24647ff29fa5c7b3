// Auto mode: a program that knows nothing of foveation, started as a user starts it.
#include <gtest/gtest.h>

#include <fstream>

#include <nlohmann/json.hpp>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {

const std::string kProgram = kBin + "/layer_auto_program ";
const std::string kAuto = kLayer + "--auto --always --focus 0,0 --gain 4 ";
constexpr const char* kEvery = "scene no_clear frag_coord overlay depth_after_overlay visit full_screen_pass small blit swap scene";

std::string last_line(const std::string& text) {
    const std::size_t end = text.find_last_not_of('\n'), from = text.rfind('\n', end);
    return text.substr(from + 1, end - from);
}

}  // namespace

TEST(AutoMode, FoveatesAProgramThatKnowsNothingOfIt) {
    EXPECT_EQ(shell(kProgram + "scene").out.substr(0, 26), "scene: middle 1 corner 1\nh");
    EXPECT_EQ(shell(kAuto + "-- " + kProgram + "scene").out.substr(0, 26), "scene: middle 1 corner 4\nh");
}

TEST(AutoMode, DrawsWhereItWouldBeWrongKeepFullDensity) {
    const Ran ran = shell(kAuto + "-- " + kProgram + "scene no_clear frag_coord full_screen_pass overlay");
    EXPECT_EQ(ran.out.substr(0, ran.out.find("hash")),
              "scene: middle 1 corner 4\n"
              "no_clear: middle 1 corner 1\n"
              "frag_coord: middle 1 corner 1\n"
              "full_screen_pass: middle 1 corner 1\n"
              "overlay beside it: 4\n"
              "overlay: middle 1 corner 1\n");
}

TEST(AutoMode, TheReportNamesTheReasonOfEachProgram) {
    const std::string errors = temporary("report");
    ASSERT_EQ(shell(kAuto + "--report -- " + kProgram + "scene no_clear frag_coord full_screen_pass overlay", errors).exit_code, 0);
    const std::string report = file_text(errors);
    for (const char* reason : {"gl_frag_coord 1", "full_screen_pass 1", "blended_2d 1", "because of no_clear: 1"})
        EXPECT_NE(report.find(reason), std::string::npos) << reason << "\n" << report;
    std::remove(errors.c_str());
}

TEST(AutoMode, GainZeroGivesTheDriversPixelsInEveryCase) {
    const Ran plain = shell(kProgram + kEvery);
    ASSERT_EQ(plain.exit_code, 0);
    const Ran zero = shell(kLayer + "--auto --gain 0 --focus 0,0 --always -- " + kProgram + kEvery);
    EXPECT_EQ(zero.exit_code, 0);
    EXPECT_EQ(last_line(zero.out), last_line(plain.out));
}

TEST(AutoMode, WhatCannotAskForLessGoesStraightToTheDriver) {
    const std::string errors = temporary("straight");
    const Ran plain = shell(kProgram + kEvery), ran = shell(kLayer + "--auto --gain 0 --stats -- " + kProgram + kEvery, errors);
    EXPECT_EQ(last_line(ran.out), last_line(plain.out));
    const auto counters = nlohmann::json::parse(file_text(errors), nullptr, false);
    ASSERT_FALSE(counters.is_discarded()) << file_text(errors);
    EXPECT_EQ(counters["draws_recorded"], 0);
    EXPECT_GT(counters["auto"]["full_density_submissions"]["full_density"], 5);
    EXPECT_EQ(counters["pixels_planned"], counters["pixels_full"]);
    std::remove(errors.c_str());
}

// Eight frames of the trial go straight to the driver; the report knows their draws all the same.
TEST(AutoMode, ATrialBeginsWithTheDriversOwnFrames) {
    const std::string errors = temporary("trial");
    ASSERT_EQ(shell(kLayer + "--auto --focus 0,0 --stats -- " + kProgram + "scene scene frag_coord scene", errors).exit_code, 0);
    const auto counters = nlohmann::json::parse(file_text(errors), nullptr, false);
    ASSERT_FALSE(counters.is_discarded()) << file_text(errors);
    EXPECT_EQ(counters["draws_recorded"], 0);
    EXPECT_EQ(counters["auto"]["full_density_submissions"]["does_not_pay"], 4);
    EXPECT_EQ(counters["auto"]["trial"]["frames_full"], 2);  // the first two load things
    EXPECT_EQ(counters["auto"]["trial"]["felt_processor"], 1.0);
    int foveated = 0, coord = 0;
    for (const auto& program : counters["auto"]["programs"]) {
        foveated += program["draws_foveated"].get<int>();
        coord += program["draws_full"].value("gl_frag_coord", 0);
    }
    EXPECT_EQ(foveated, 3);
    EXPECT_EQ(coord, 1);
    std::remove(errors.c_str());
}

TEST(AutoMode, ComparesAllWaysInOneRun) {
    const std::string errors = temporary("compare");
    std::string frames;
    for (int i = 0; i < 60; ++i) frames += " scene";
    ASSERT_EQ(shell(kLayer + "--auto --focus 0,0 --compare -- " + kProgram + frames, errors).exit_code, 0);
    EXPECT_NE(file_text(errors).find("1 pairs of blocks"), std::string::npos) << file_text(errors);
    EXPECT_NE(file_text(errors).find("recorded, replayed at full density"), std::string::npos);
    ASSERT_EQ(shell(kLayer + "--auto --focus 0,0 --compare -- " + kProgram + "scene", errors).exit_code, 0);
    EXPECT_NE(file_text(errors).find("no comparison"), std::string::npos) << file_text(errors);
    std::remove(errors.c_str());
}

// A pbuffer keeps its depth from frame to frame, whichever way the two are drawn.
TEST(AutoMode, DepthGoesFromFrameToFrameThroughEveryWay) {
    std::string frames = "scene";  // one frame: the ways change between the two frames of a case
    for (int i = 0; i < 30; ++i) frames += " next_frame";
    const auto lines = [](const Ran& ran) { return ran.out.substr(0, ran.out.find("hash")); };
    const Ran plain = shell(kProgram + frames);
    EXPECT_EQ(lines(shell(kLayer + "--auto --focus 0,0 --gain 8 --compare -- " + kProgram + frames)), lines(plain));
    // The trial: 6 frames straight; 3, 5 or 12 in levels, as they cost; then straight. The last in levels is the first of a pair.
    EXPECT_EQ(lines(shell(kLayer + "--auto --focus 0,0 --gain 8 -- " + kProgram + frames)), lines(plain));
    const std::string even = frames.substr(frames.find(' ') + 1);
    EXPECT_EQ(lines(shell(kLayer + "--auto --focus 0,0 --gain 8 -- " + kProgram + even)), lines(shell(kProgram + even)));
}

TEST(AutoMode, DepthOfTheSceneOutlivesAnOverlay) {
    const Ran plain = shell(kProgram + "depth_after_overlay"), levels = shell(kAuto + "-- " + kProgram + "depth_after_overlay");
    EXPECT_EQ(levels.out.substr(0, levels.out.find('\n')), plain.out.substr(0, plain.out.find('\n')));
}

TEST(AutoMode, AClearBeforeAVisitElsewhereIsNotLost) {
    const Ran ran = shell(kAuto + "-- " + kProgram + "visit");
    EXPECT_EQ(ran.out.substr(0, ran.out.find("hash")), "visit cleared to 128\nvisit: middle 1 corner 4\n");
}

TEST(AutoMode, SurfacesBlitsAndSwapsWithoutADraw) {
    const Ran ran = shell(kAuto + "-- " + kProgram + "small swap blit scene");
    EXPECT_EQ(ran.out.substr(0, ran.out.find("hash")),
              "small: middle 1 corner 4\n"
              "blit: middle 1 corner 4\n"
              "scene: middle 1 corner 4\n");
}

TEST(AutoMode, WithoutADaemonTheMiddleStaysSharp) {
    const Ran ran = shell("FOVEA_SOCKET=/nonexistent/focus.sock " + kLayer + "--auto --always --gain 8 -- " + kProgram + "scene");
    EXPECT_EQ(ran.out.substr(0, 24), "scene: middle 1 corner 4");
}

TEST(AutoMode, FollowsFoveadsGaze) {
    const std::string folder = temporary("fovead"), page = folder + "/page.html";
    ASSERT_EQ(mkdir(folder.c_str(), 0700), 0);
    const std::string fovead = kBin + "/fovead --set source.driver=synthetic --set source.path=" FOVEA_SOURCE_DIR "/configs/scenarios/reading.toml --run-dir " +
                               folder + " --ready-file " + folder + "/ready";
    const std::string trace = "FOVEA_SOCKET=" + folder + "/focus.sock " + kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " --auto -o " + page + " -- " +
                              kProgram + "scene scene scene";
    const Ran ran = shell("sh -c 'mkfifo " + folder + "/ready; " + fovead + " >/dev/null & read line < " + folder + "/ready; " + trace + "; kill $!'");
    EXPECT_NE(ran.out.find("scene"), std::string::npos);
    EXPECT_NE(file_text(page).find("from a live fovead"), std::string::npos);
    (void)shell("rm -r " + folder);
}

// A recorded session through the real fovead: the eye rests at 8 degrees to the right and 4 below, and so does the fovea.
TEST(AutoMode, TheFoveaLiesWhereTheEyeOfASessionLooks) {
    const std::string folder = temporary("session"), page = folder + "/page.html", errors = folder + "/errors";
    ASSERT_EQ(mkdir(folder.c_str(), 0700), 0);
    {
        std::ofstream csv(folder + "/gaze.csv");
        csv << "# fovea-gaze-csv 1\n# rate_hz: 250\nt_ns,combined_az_deg,combined_el_deg,combined_valid\n";
        for (int i = 0; i < 250 * 60; ++i) csv << i * std::int64_t{4'000'000} << ",8,-4,1\n";
    }
    ASSERT_EQ(shell(kBin + "/fovea convert " + folder + "/gaze.csv " + folder + "/gaze.fovea", errors).exit_code, 0) << file_text(errors);
    const std::string fovead = kBin + "/fovead --set source.driver=replay --set source.path=" + folder + "/gaze.fovea --set source.wait_for_client=true --run-dir " + folder +
                               " --ready-file " + folder + "/ready";
    std::string frames;
    for (int i = 0; i < 60; ++i) frames += " small";
    const std::string trace = "FOVEA_SOCKET=" + folder + "/focus.sock " + kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " --auto --fov 40 --frames 60 -o " + page +
                              " -- " + kProgram + frames;
    // The first client opens the source, and on a busy machine it is gone before the first sample: then another one comes.
    const std::string until_live = "for i in 1 2 3 4 5 6 7 8 9 10; do " + trace + "; [ $(grep -o \"from a live fove\" " + page + " | wc -l) -ge 20 ] && break; done";
    (void)shell("sh -c 'mkfifo " + folder + "/ready; " + fovead + " >/dev/null & read line < " + folder + "/ready; " + until_live + "; kill $!'", errors);
    const std::string html = file_text(page), label = "Points (x, y, gain x, gain y, area): <code>";
    int live = 0;
    nlohmann::json last;
    for (std::size_t at = html.find(label); at != std::string::npos; at = html.find(label, at + 1)) {
        const std::size_t end = html.find("</code>", at);
        if (html.compare(end, 25, "</code>, from a live fove") != 0) continue;
        ++live;
        last = nlohmann::json::parse(html.substr(at + label.size(), end - at - label.size()), nullptr, false);
    }
    ASSERT_GT(live, 0) << file_text(errors);
    ASSERT_TRUE(last.is_array()) << last;
    // The surface is twice as wide as high and 40 degrees wide: x = tan 8 / tan 20, y = -2 tan 4 / (cos 8 tan 20).
    EXPECT_NEAR(last[0][0].get<double>(), 0.386, 0.02);
    EXPECT_NEAR(last[0][1].get<double>(), -0.388, 0.03);
    (void)shell("rm -r " + folder);
}

TEST(AutoMode, RulesOfTheProgramAreFoundByItsName) {
    const std::string folder = temporary("rules");
    ASSERT_EQ(mkdir(folder.c_str(), 0700), 0);
    std::ofstream(folder + "/a.toml") << "programs = [\"layer_auto_*\"]\nexcept = [\"gl_frag_coord\"]\n";
    EXPECT_EQ(shell(kAuto + "--rules " + folder + " -- " + kProgram + "frag_coord").out.substr(0, 29), "frag_coord: middle 1 corner 4");
    std::ofstream(folder + "/a.toml") << "programs = [\"layer_auto_*\"]\ngian_x = 3\n";
    const std::string errors = temporary("rules_errors");
    EXPECT_EQ(shell(kAuto + "--rules " + folder + " -- " + kProgram + "scene", errors).exit_code, 3);
    EXPECT_NE(file_text(errors).find("gian_x"), std::string::npos) << file_text(errors);
    std::ofstream(folder + "/a.toml") << "programs = [\"another\"]\nexcept = [\"gl_frag_coord\"]\n";
    EXPECT_EQ(shell(kAuto + "--rules " + folder + " -- " + kProgram + "frag_coord").out.substr(0, 29), "frag_coord: middle 1 corner 1");
    std::remove((folder + "/a.toml").c_str());
    std::remove(folder.c_str());
    std::remove(errors.c_str());
}

TEST(AutoMode, WrongOptionsAreNamed) {
    const std::string errors = temporary("wrong");
    EXPECT_EQ(shell(kLayer + "--auto --gain x -- true", errors).exit_code, 3);
    EXPECT_NE(file_text(errors).find("--gain"), std::string::npos);
    EXPECT_EQ(shell(kLayer + "--auto --focus 1 -- true", errors).exit_code, 3);
    EXPECT_EQ(shell(kLayer + "--gain 4 -- true", errors).exit_code, 2);  // needs --auto
    std::remove(errors.c_str());
}
