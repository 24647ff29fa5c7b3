// Auto mode, draw by draw: every reason for full density, and the targets that are foveated by rule.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {

const std::string kProgram = kBin + "/layer_auto_program ";
const std::string kAuto = kLayer + "--auto --always --focus 0,0 --gain 4 ";

struct Case {
    const char* name;    // of the program's case, and of the reason
    const char* report;  // what the report must say of it
    bool draws = true;   // it prints a line
};

class FullDensity : public testing::TestWithParam<Case> {};

}  // namespace

TEST_P(FullDensity, IsKeptAndReported) {
    const Case& c = GetParam();
    const std::string errors = temporary(c.name);
    const Ran ran = shell(kAuto + "--report -- " + kProgram + "scene " + c.name, errors);
    EXPECT_EQ(ran.exit_code, 0);
    if (ran.out.find("no binaries") != std::string::npos) GTEST_SKIP() << "this driver gives no program binaries";
    EXPECT_EQ(ran.out.find(std::string(c.name) + ": middle 1 corner 1") != std::string::npos, c.draws) << ran.out;
    EXPECT_NE(file_text(errors).find(c.report), std::string::npos) << file_text(errors);
    std::remove(errors.c_str());
}

INSTANTIATE_TEST_SUITE_P(AutoMode, FullDensity,
                         testing::Values(Case{"frag_coord", "gl_frag_coord 1"}, Case{"texel_fetch", "texel_fetch 1"}, Case{"no_source", "no_source 1"},
                                         Case{"points", "points 1"}, Case{"lines", "lines 1"}, Case{"textured_2d", "textured_2d 1"},
                                         Case{"picture_with_depth", "textured_2d 1"}, Case{"full_screen_pass", "full_screen_pass 1"}, Case{"no_clear", "because of no_clear: 1"},
                                         Case{"keeps_depth", "because of keeps_depth: 1"}, Case{"side_effects", "because of side_effects: 1"},
                                         Case{"clears_only", "because of clears_only: 1", false}, Case{"cannot_match", "because of cannot_match: 1"}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(AutoMode, ATexturedQuadOfAWorldIsFoveated) {
    EXPECT_NE(shell(kAuto + "-- " + kProgram + "quad_of_a_world").out.find("quad_of_a_world: middle 1 corner 4"), std::string::npos);
}

TEST(AutoMode, ATraceSaysInWordsWhatKeptFullDensity) {
    const std::string page = temporary("words.html");
    ASSERT_EQ(shell(kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " --auto --focus 0,0 --gain 4 --frames 9 -o " + page + " -- " + kProgram +
                    "scene frag_coord overlay points textured_2d full_screen_pass").exit_code, 0);
    const std::string html = file_text(page);
    for (const char* words : {"reads the place of its pixel in the window (<code>gl_frag_coord", "as text is (<code>blended_2d", "points have a size in pixels (<code>points",
                              "a picture, not a scene (<code>textured_2d", "post-processing of a picture that was drawn before (<code>full_screen_pass"})
        EXPECT_NE(html.find(words), std::string::npos) << words;
    std::remove(page.c_str());
}

// The same draws where the rules say that the reason does not count.
TEST(AutoMode, AReasonCanBeLeftOutByRule) {
    const std::string folder = temporary("except");
    std::filesystem::create_directories(folder);
    for (const char* name : {"texel_fetch", "points", "lines", "textured_2d", "full_screen_pass"}) {
        std::ofstream(folder + "/a.toml") << "programs = [\"layer_auto_program\"]\nexcept = [\"" << name << "\"]\n";
        const Ran ran = shell(kAuto + "--rules " + folder + " -- " + kProgram + name);
        // They are textured quads without a world as well.
        const bool still = std::string(name) == "full_screen_pass" || std::string(name) == "texel_fetch";
        EXPECT_NE(ran.out.find(std::string(name) + ": middle 1 corner " + (still ? "1" : "4")), std::string::npos) << ran.out;
    }
    std::filesystem::remove_all(folder);
}

// The scene's texture is as large as the window, and by rule foveated; the small one of another case is not.
TEST(AutoMode, ByRuleTheMainOffScreenTargetIsFoveated) {
    const std::string folder = temporary("offscreen");
    std::filesystem::create_directories(folder);
    EXPECT_NE(shell(kAuto + "-- " + kProgram + "offscreen").out.find("offscreen: middle 1 corner 1"), std::string::npos);
    std::ofstream(folder + "/a.toml") << "programs = [\"layer_auto_program\"]\noffscreen = 0.9\n";
    const std::string ruled = kAuto + "--rules " + folder + " ";
    const Ran ran = shell(ruled + "-- " + kProgram + "offscreen full_screen_pass offscreen");
    EXPECT_EQ(ran.out.substr(0, ran.out.find("hash")),
              "offscreen: middle 1 corner 4\n"
              "full_screen_pass: middle 1 corner 1\n"
              "offscreen: middle 1 corner 4\n");
    const Ran plain = shell(kProgram + "offscreen visit offscreen"), zero = shell(kLayer + "--auto --always --gain 0 --focus 0,0 --rules " + folder + " -- " + kProgram + "offscreen visit offscreen");
    EXPECT_EQ(zero.out, plain.out);
    std::filesystem::remove_all(folder);
}
