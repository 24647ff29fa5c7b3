// Programs of their own process, started as a user starts them: with `fovea layer run`, and without.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include <nlohmann/json.hpp>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

TEST(LayerPrograms, FramebufferExamplesOfTheSpecification) {
    expect_output(kLayer + "-- " + kBin + "/layer_framebuffer_examples",
                  "1 enabled\n"
                  "2 centre 1 corner 4\n"
                  "3 frame 0 late 1 early 4\n"
                  "3 frame 1 late 1 early 4\n"
                  "3 frame 2 late 1 early 4\n"
                  "3 frame 3 late 1 early 4\n"
                  "4 enabled 1 centre 1 corner 4\n"
                  "5 left 1 right 1 middle 4\n");
}

TEST(LayerPrograms, TextureExamplesOfTheSpecification) {
    expect_output(kLayer + "-- " + kBin + "/layer_texture_examples",
                  "1 focus 1 corner 4\n"
                  "2 eye 0 centre 1 corner 4\n"
                  "2 eye 1 centre 1 corner 4\n"
                  "3 left 1 right 1 corner 4\n");
}

TEST(LayerPrograms, ExamplesFailWithoutTheLayer) {
    EXPECT_EQ(shell(kBin + "/layer_framebuffer_examples").exit_code, 1);
}

// Functions that are linked, from a library that the program opens, from those it has, and from eglGetProcAddress: the layer has
// them all, idle and recording.
class LayerReaches : public testing::TestWithParam<const char*> {};

TEST_P(LayerReaches, FunctionsThatAProgramFinds) {
    const std::string program = kBin + "/layer_plain_program " + GetParam() + " 2";
    const Ran plain = shell(program);
    ASSERT_EQ(plain.exit_code, 0);
    ASSERT_EQ(plain.out.size(), 17u);
    EXPECT_EQ(shell(kLayer + "-- " + program).out, plain.out) << "idle";
    const std::string errors = temporary("reaches");
    EXPECT_EQ(shell(kLayer + "--stats -- " + program + " 0", errors).out, plain.out) << "recorded and replayed";
    const std::string said = file_text(errors);  // its time, then the counters
    const auto counters = nlohmann::json::parse(said.substr(std::min(said.find('{'), said.size())), nullptr, false);
    ASSERT_FALSE(counters.is_discarded()) << said;
    EXPECT_EQ(counters["draws_recorded"], 2 * 2000);
    std::remove(errors.c_str());
}

INSTANTIATE_TEST_SUITE_P(LayerPrograms, LayerReaches, testing::Values("link", "dlopen", "dlsym", "getproc"),
                         [](const auto& test) { return std::string(test.param); });

TEST(LayerPrograms, AnIdleLayerChangesNoPixelOfAProgramOfManyCalls) {
    const Ran plain = shell(kBin + "/layer_calls_program");
    ASSERT_EQ(plain.exit_code, 0);
    ASSERT_EQ(plain.out.size(), 17u);
    EXPECT_EQ(shell(kLayer + "-- " + kBin + "/layer_calls_program").out, plain.out);
}

// libglvnd lets a vendor rewrite its stubs, but does not have to.
TEST(LayerPrograms, CallsOfAnIdleLayerGoStraightToTheDriver) {
    const std::string program = kBin + "/layer_stubs_program";
#if defined(__x86_64__)
    EXPECT_EQ(shell(kLayer + "-- " + program).out,
              "idle: glUniform2f driver, glDrawArrays driver, glGenTextures driver, glGetError layer\n"
              "foveated: glUniform2f layer, glDrawArrays layer, glGenTextures driver, glGetError layer\n");
    EXPECT_EQ(shell(kLayer + "--auto -- " + program).out.substr(0, 46), "idle: glUniform2f layer, glDrawArrays layer, g");
#endif
    const Ran ran = shell("__GLVND_DISALLOW_PATCHING=1 " + kLayer + "-- " + program);
    EXPECT_EQ(ran.out.substr(0, 34), "idle: glUniform2f not rewritten, g");
}

TEST(LayerPrograms, StubsThatMustNotBeRewrittenGiveTheSame) {
    const std::string longer = "__GLVND_DISALLOW_PATCHING=1 " + kLayer + "-- " + kBin;
    EXPECT_EQ(shell(longer + "/layer_calls_program").out, shell(kBin + "/layer_calls_program").out);
    EXPECT_EQ(shell(longer + "/layer_framebuffer_examples").out, shell(kLayer + "-- " + kBin + "/layer_framebuffer_examples").out);
}

// Both ways in one process, as the measurement of an idle layer takes them; what it finds is no test's business.
TEST(LayerPrograms, TheDriversFunctionsAndTheLayersRunInOneProcess) {
    const Ran ran = shell(kBin + "/layer_calls_program " FOVEA_TWO_PATHS_LIBRARY " " FOVEA_LAYER_LIBRARY " 4");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_NE(ran.out.find("the idle layer"), std::string::npos) << ran.out;
}

TEST(LayerPrograms, MemoryIsFlatOverFrames) {
    const char* frames = std::getenv("FOVEA_LAYER_FRAMES");
    const Ran ran = shell(kLayer + "-- " + kBin + "/layer_frames_program " + (frames ? frames : "2000"));
    ASSERT_EQ(ran.exit_code, 0);
    std::istringstream numbers(ran.out);
    long early = 0, late = 0;
    numbers >> early >> late;
    ASSERT_GT(early, 0);
    EXPECT_LE(late - early, 256) << "kB";  // an allocator's slack; a leak of 200 bytes a frame would be 300 kB
}

TEST(LayerPrograms, CountersSayWhatWasLate) {
    const std::string errors = temporary("stats");
    const Ran ran = shell(kLayer + "--stats -- " + kBin + "/layer_frames_program 10", errors);
    ASSERT_EQ(ran.exit_code, 0);
    const auto counters = nlohmann::json::parse(file_text(errors));
    EXPECT_EQ(counters["draws_recorded"], 10);
    EXPECT_EQ(counters["submitted_by"]["glFinish"], 10);
    EXPECT_EQ(counters["submissions_levels"], 10);
    EXPECT_TRUE(counters["lateness_lost_by"].empty());
    EXPECT_LT(counters["pixels_planned"].get<double>(), counters["pixels_full"].get<double>());
    std::remove(errors.c_str());
}

TEST(LayerPrograms, LatenessThatIsLostIsCountedByTheCallThatTookIt) {
    const std::string errors = temporary("lost");
    const Ran ran = shell(kLayer + "--stats -- " + kBin + "/layer_frames_program 10 map", errors);
    ASSERT_EQ(ran.exit_code, 0);
    const auto counters = nlohmann::json::parse(file_text(errors));
    EXPECT_EQ(counters["submitted_by"]["glMapBufferRange"], 10);
    EXPECT_EQ(counters["lateness_lost_by"]["glMapBufferRange"], 10);
    EXPECT_EQ(counters["lateness_lost_by"].size(), 1u);
    std::remove(errors.c_str());
}

TEST(LayerPrograms, ASecondDriverGivesTheSameAnswers) {
    for (const char* program : {"/layer_framebuffer_examples", "/layer_texture_examples"}) {
        const Ran llvmpipe = shell(kLayer + "-- " + kBin + program);
        const Ran softpipe = shell("GALLIUM_DRIVER=softpipe " + kLayer + "-- " + kBin + program);
        EXPECT_EQ(softpipe.exit_code, 0);
        EXPECT_EQ(softpipe.out, llvmpipe.out);
    }
}

// Below OpenGL ES 3.2 a driver has no texture of stencil alone, which a draw could read: the values are discarded to their clear.
TEST(LayerPrograms, StencilWithoutDepthIsDiscardedToItsClearBelowVersion32) {
    const std::string program = kLayer + "-- " + kBin + "/layer_stencil_program";
    EXPECT_EQ(shell("MESA_GLES_VERSION_OVERRIDE=3.1 " + program).out, "3.1 enabled 1, cleared where nothing was written: 1, where something was: 1\n");
    EXPECT_EQ(shell(program).out, "3.2 enabled 1, cleared where nothing was written: 1, where something was: 0\n");
}

// What needs only OpenGL ES 3.0 is listed there, and nothing else is.
TEST(LayerPrograms, FrameExtrapolationAloneIsThereInVersion30) {
    const std::string answers = "\nerrors 0x0500 0x0501 0x0502, output as before 1\nmoved on 1\n";
    const std::string turn = "3.0: GL_QCOM_frame_extrapolation" + answers;
    expect_output("MESA_GLES_VERSION_OVERRIDE=3.0 " + kLayer + "-- " + kBin + "/layer_extrapolation30_program", turn + turn);
    const std::string later = "3.2: GL_QCOM_frame_extrapolation GL_QCOM_framebuffer_foveated GL_QCOM_texture_foveated GL_OVR_multiview2" + answers;
    expect_output(kLayer + "-- " + kBin + "/layer_extrapolation30_program", later + later);
}

TEST(LayerPrograms, ExitCodeAndSignalsAreTheProgramsOwn) {
    EXPECT_EQ(shell(kLayer + "-- sh -c 'exit 7'").exit_code, 7);
    EXPECT_EQ(shell(kLayer + "-- sh -c 'kill -9 $$'").exit_code, 137);
    EXPECT_EQ(shell(kLayer + "-- /nonexistent/program").exit_code, 127);
    EXPECT_EQ(shell(kBin + "/fovea layer run --library /nonexistent.so -- true").exit_code, 3);
    EXPECT_EQ(shell(kBin + "/fovea layer run").exit_code, 2);
}

TEST(LayerPrograms, ADriverThatCannotBeLoadedIsNamed) {
    const std::string errors = temporary("driver");
    EXPECT_NE(shell(kLayer + "--vendor libnosuch.so.0 -- " + kBin + "/layer_plain_program", errors).exit_code, 0);
    EXPECT_NE(file_text(errors).find("libnosuch.so.0"), std::string::npos) << file_text(errors);
    EXPECT_NE(shell(kLayer + "--vendor libc.so.6 -- " + kBin + "/layer_plain_program", errors).exit_code, 0);
    EXPECT_NE(file_text(errors).find("no EGL vendor library"), std::string::npos) << file_text(errors);
    std::remove(errors.c_str());
}

TEST(LayerPrograms, ATraceIsOnePageWithCallsPlansAndPictures) {
    const std::string page = temporary("trace.html");
    const std::string trace = kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " -o " + page + " ";
    expect_output(trace + "--frames 2 -- " + kBin + "/layer_framebuffer_examples", shell(kLayer + "-- " + kBin + "/layer_framebuffer_examples").out);  // traced frames are the same frames
                  const std::string html = file_text(page);
                  const auto count = [&html](const std::string& what) {
                  std::size_t n = 0;
                  for (std::size_t at = html.find(what); at != std::string::npos; at = html.find(what, at + 1)) ++n;
                  return n;
                  };
                  EXPECT_EQ(count("glFramebufferFoveationConfigQCOM"), 3u);
                  EXPECT_GE(count("<h3>Submission"), 5u);
                  EXPECT_GE(count("alt='before'"), 5u);
                  EXPECT_EQ(count("alt='before'"), count("alt='after'"));
                  EXPECT_EQ(count("<svg"), count("alt='after'"));
                  EXPECT_EQ(count("http"), 0u);  // needs no other file
                  std::remove(page.c_str());
}

TEST(LayerPrograms, ATraceHasTheCallsThatExtrapolate) {
    const std::string page = temporary("extrapolating.html");
    const Ran ran = shell(kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " --vendor " FOVEA_LOSING_DRIVER " -o " + page + " -- " + kBin + "/layer_losing_program status");
    EXPECT_EQ(ran.exit_code, 0);
    const std::string html = file_text(page);
    const std::size_t at = html.find("glExtrapolateTex2DQCOM");
    ASSERT_NE(at, std::string::npos);
    EXPECT_NE(html.substr(at, 60).find("0.5]"), std::string::npos) << html.substr(at, 60);  // names and the factor
    std::remove(page.c_str());
}

TEST(LayerPrograms, AProgramThatNeverFoveatesLeavesNoPageAndIsToldWhy) {
    const std::string page = temporary("none.html"), errors = temporary("none");
    EXPECT_EQ(shell(kBin + "/fovea layer trace --library " FOVEA_LAYER_LIBRARY " -o " + page + " -- true", errors).exit_code, 1);
    EXPECT_NE(file_text(errors).find("--auto"), std::string::npos);
    EXPECT_TRUE(file_text(page).empty());
    std::remove(errors.c_str());
}
