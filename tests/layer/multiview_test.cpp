// GL_OVR_multiview and multiview2 on a driver without them, in a program of its own.
#include <gtest/gtest.h>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {
const std::string kProgram = kBin + "/layer_multiview_program";
}

TEST(Multiview, FourViewsAreDrawnByOneDraw) {
    const Ran ran = shell(kLayer + "-- " + kProgram);
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out,
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
    const Ran ran = shell(kLayer + "-- " + kProgram + " foveated");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out,
              "view 0: corners 1 4 4 4, id 0\n"
              "view 1: corners 4 1 4 4, id 1\n"
              "view 2: corners 4 4 1 4, id 2\n"
              "view 3: corners 4 4 4 1, id 3\n");
}


// The scene and the passes of Arm's sample of foveated rendering with four views, written anew.
TEST(Multiview, LitCubesOfFourCamerasArePutTogetherForEachEye) {
    const Ran ran = shell(kLayer + "-- " + kProgram + " cubes");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out, "right eye: middle faces us 1, corner empty 1\nwide 1, twice as large in the insets: 4 4\n");
}

// The sample's framebuffers have samples, which the layer takes and does not draw; its masks keep each view from drawing what
// the other shows. The white paper's shader as it is printed names gl_ViewID, an error by the extension.
TEST(Multiview, ThePassesOfArmsSampleLeaveNoHoles) {
    const Ran ran = shell(kLayer + "-- " + kProgram + " masks");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out,
              "as printed 0\n"
              "1000 samples 0501, -1 samples 0501, complete 1\n"
              "view 0: 84 of 100 drawn, middle 0, corner 1\n"
              "view 1: 84 of 100 drawn, middle 0, corner 1\n"
              "view 2: 88 of 100 drawn, middle 1, corner 0\n"
              "view 3: 88 of 100 drawn, middle 1, corner 0\n"
              "eye 0: 0 holes\n"
              "eye 1: 0 holes\n");
}
