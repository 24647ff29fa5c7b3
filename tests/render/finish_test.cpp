// The effects between method and display in the running viewer: what a scene does not call for is in no shader and no call.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "render/viewer/viewer.hpp"
#include "tests/render/gl_calls.hpp"

using namespace fovea;
using namespace fovea::test;
namespace fs = std::filesystem;

namespace {

const std::atomic<bool> kNeverStops{false};

class Finish : public ::testing::Test {
protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    // Three frames of a scene file with these tables.
    GlCalls run(const std::string& tables, const std::string& out = {}) {
        std::ofstream(folder_ / "scene.toml") << "scene = \"fragbox\"\n" << tables;
        viewer::Options o;
        o.socket = (folder_ / "nobody").string();
        o.wait = o.quiet = true;
        o.present = "surfaceless";
        o.scene = (folder_ / "scene.toml").string();
        o.width_px = o.height_px = 64;
        o.frames = 3;
        if (!out.empty()) o.out = (folder_ / out).string();
        return calls_of([&] {
            const auto summary = viewer::run(o, kNeverStops);
            ASSERT_TRUE(summary.has_value()) << summary.error().error.message();
        });
    }
    const fs::path folder_ = fs::temp_directory_path() / ("fovea_finish_" + std::to_string(getpid()));
};

TEST_F(Finish, WhatIsNotCalledForIsInNoShaderAndNoCall) {
    static_cast<void>(run("[effects]\ntemporal_smoothing = false\n"));   // the probe, and what a process does once
    const GlCalls plain = run("[effects]\ntemporal_smoothing = false\n");
    const GlCalls lens = run("[effects]\ntemporal_smoothing = false\n[lens]\nk1 = 0.2\n", "out");
    const GlCalls off = run("[effects]\ntemporal_smoothing = false\nlens_distortion = false\n[lens]\nk1 = 0.2\n");
    const GlCalls smooth = run("[effects]\ntemporal_smoothing = true\n");
    for (const GlCalls* c : {&plain, &off}) {
        EXPECT_FALSE(c->any_shader_has("uniform vec3 channels"));
        EXPECT_FALSE(c->any_shader_has("before_from_now"));
        EXPECT_EQ(c->of("glUniformMatrix3fv"), 0u);
    }
    for (const char* name : {"glLinkProgram", "glGenTextures", "glGenFramebuffers", "glDrawArrays", "glUseProgram"}) EXPECT_EQ(off.of(name), plain.of(name)) << name;
    EXPECT_TRUE(lens.any_shader_has("uniform vec3 channels"));
    EXPECT_EQ(lens.of("glLinkProgram"), plain.of("glLinkProgram") + 1);
    EXPECT_EQ(lens.of("glGenFramebuffers"), plain.of("glGenFramebuffers") + 2) << "a picture for each eye's panel";
    EXPECT_EQ(lens.of("glDrawArrays"), plain.of("glDrawArrays") + 8) << "a mesh for each eye and frame, and for the picture that is kept";
    EXPECT_FALSE(lens.any_shader_has("before_from_now"));
    EXPECT_EQ(smooth.of("glUniformMatrix3fv"), 6u) << "each eye and frame";
    EXPECT_EQ(smooth.of("glGenFramebuffers"), plain.of("glGenFramebuffers") + 4) << "this picture and the one before, of each eye";
    EXPECT_FALSE(smooth.any_shader_has("uniform vec3 channels"));
    EXPECT_TRUE(fs::exists(folder_ / "out" / "frame_lens.png"));
}

}  // namespace
