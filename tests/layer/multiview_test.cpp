// GL_OVR_multiview and multiview2 on a driver without them, in a program of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {
const std::string kProgram = kBin + "/layer_multiview_program";
}

TEST(Multiview, FourViewsAreDrawnByOneDraw) {
    expect_output(kLayer + "-- " + kProgram,
                  "at least four views: 1\n"
                  "depth without views: 1\n"
                  "layers that the texture has not: 1\n"
                  "base view 1, views 4, complete 1\n"
                  "errors: no views 0501, base -1 0501, 1000 views 0501, no array 0502, reading 0506, program of one view 0502\n"
                  "view 0: 1024 pixels, red 0, cleared 1\n"
                  "view 1: 1024 pixels, red 1, cleared 1\n"
                  "view 2: 4096 pixels, red 2, cleared 1\n"
                  "view 3: 4096 pixels, red 3, cleared 1\n"
                  "four views into a framebuffer of one: 0502\n"
                  "composition: 0 1 2 3\n");
}

TEST(Multiview, EachViewIsFoveatedByItsOwnFocalPoint) {
    expect_output(kLayer + "-- " + kProgram + " foveated",
                  "view 0: corners 1 4 4 4, id 0\n"
                  "view 1: corners 4 1 4 4, id 1\n"
                  "view 2: corners 4 4 1 4, id 2\n"
                  "view 3: corners 4 4 4 1, id 3\n");
}


// The scene and the passes of Arm's sample of foveated rendering with four views, written anew.
TEST(Multiview, LitCubesOfFourCamerasArePutTogetherForEachEye) {
    expect_output(kLayer + "-- " + kProgram + " cubes", "right eye: middle faces us 1, corner empty 1\nwide 1, twice as large in the insets: 4 4\n");
}

// The sample's framebuffers have samples: what counts here is drawn in all of them; its masks keep each view from drawing what
// the other shows. The white paper's shader as it is printed names gl_ViewID, an error by the extension.
TEST(Multiview, ThePassesOfArmsSampleLeaveNoHoles) {
    expect_output(kLayer + "-- " + kProgram + " masks",
                  "as printed 0\n"
                  "1000 samples 0501, -1 samples 0501, complete 1\n"
                  "view 0: 84 of 100 drawn, middle 0, corner 1\n"
                  "view 1: 84 of 100 drawn, middle 0, corner 1\n"
                  "view 2: 87 of 100 drawn, middle 1, corner 0\n"
                  "view 3: 87 of 100 drawn, middle 1, corner 0\n"
                  "eye 0: 0 holes\n"
                  "eye 1: 0 holes\n");
}

// Arm's own code from a checkout (docs/layer.md): tutorials Multiview and FoveatedRendering, each a program of four views.
namespace {
std::string without_first_line(const std::string& text) { return text.substr(std::min(text.find('\n') + 1, text.size())); }
}  // namespace

TEST(Multiview, ArmsSampleOfFourViewsRuns) {
    if (!std::filesystem::exists(kBin + "/layer_arm_multiview"))
        GTEST_SKIP() << "no checkout of Arm's OpenGL ES SDK was named: cmake --preset release -DFOVEA_ARM_SDK=PATH (docs/layer.md)";
    expect_output(kLayer + "-- " + kBin + "/layer_arm_multiview",
                  "view 0: 13 of 100 drawn, middle 1, corner 0, edges antialiased 0\n"
                  "view 1: 13 of 100 drawn, middle 1, corner 0, edges antialiased 0\n"
                  "view 2: 39 of 100 drawn, middle 1, corner 0, edges antialiased 0\n"
                  "view 3: 39 of 100 drawn, middle 1, corner 0, edges antialiased 0\n"
                  "eye 0: 0 holes, put together of both within 3 of 255, both views alike within 0 of 255 on the mean\n"
                  "eye 1: 0 holes, put together of both within 3 of 255, both views alike within 0 of 255 on the mean\n"
                  "moves: 1, GL error 0000\n");
}

// How far the two views of an eye are alike depends on the textures, which a checkout may have or not.
TEST(Multiview, ArmsSampleOfFoveatedRenderingRuns) {
    if (!std::filesystem::exists(kBin + "/layer_arm_foveated"))
        GTEST_SKIP() << "no checkout of Arm's OpenGL ES SDK was named: cmake --preset release -DFOVEA_ARM_SDK=PATH (docs/layer.md)";
    const Ran ran = shell(kLayer + "-- " + kBin + "/layer_arm_foveated");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(std::regex_replace(without_first_line(ran.out), std::regex(", both views alike[^\n]*"), ""),
              "view 0: 95 of 100 drawn, middle 0, corner 1, edges antialiased 1\n"
              "view 1: 95 of 100 drawn, middle 0, corner 1, edges antialiased 1\n"
              "view 2: 88 of 100 drawn, middle 1, corner 0, edges antialiased 1\n"
              "view 3: 88 of 100 drawn, middle 1, corner 0, edges antialiased 1\n"
              "eye 0: 0 holes, put together of both within 3 of 255\n"
              "eye 1: 0 holes, put together of both within 3 of 255\n"
              "moves: 1, GL error 0000\n");
}
