// A context that the driver loses under the running viewer: still current, as a GPU reset leaves it, or really destroyed.
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <unistd.h>

#include "render/gl/context.hpp"
#include "render/viewer/viewer.hpp"

using namespace fovea;

namespace {

// The driver's answer to "was the context lost?", one poll after the other. libepoxy calls through these pointers.
struct Script {
    int polls = 0, resets_at[3] = {-1, -1, -1};
    GLenum status = GL_INNOCENT_CONTEXT_RESET;
    bool destroys = false;
};
Script script;

GLenum answer() {
    const int poll = script.polls++;
    for (const int at : script.resets_at) {
        if (poll != at) continue;
        if (script.destroys) {   // nothing is current afterwards, and all its objects are gone
            const EGLDisplay display = eglGetCurrentDisplay();
            const EGLContext context = eglGetCurrentContext();
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
            eglDestroyContext(display, context);
        }
        return script.status;
    }
    return GL_NO_ERROR;
}

class ContextLoss : public ::testing::Test {
protected:
    void SetUp() override {
        const auto c = gl::Context::create();
        ASSERT_TRUE(c.has_value()) << c.error().message();
        if (!epoxy_has_gl_extension("GL_EXT_robustness") && !epoxy_has_gl_extension("GL_KHR_robustness"))
            GTEST_SKIP() << c->info().renderer << " does not tell when a context was lost";
        original_ = epoxy_glGetGraphicsResetStatusEXT;
        epoxy_glGetGraphicsResetStatusEXT = &answer;
        script = {};
        out_ = std::filesystem::temp_directory_path() / ("fovea_context_loss_" + std::to_string(getpid()));
    }
    void TearDown() override {
        if (original_ != nullptr) epoxy_glGetGraphicsResetStatusEXT = original_;
        std::filesystem::remove_all(out_);
    }
    viewer::Options options(const char* method) const {
        viewer::Options o;
        o.socket = (out_ / "nobody").string();
        o.wait = o.quiet = true;
        o.present = "surfaceless";
        o.scene = "fragbox";
        o.method = method;
        o.width_px = o.height_px = 64;
        o.frames = 4;
        o.speed = 0;
        o.out = out_.string();
        return o;
    }

private:
    decltype(epoxy_glGetGraphicsResetStatusEXT) original_ = nullptr;
    std::filesystem::path out_;
};

const std::atomic<bool> kNeverStops{false};

TEST_F(ContextLoss, TheViewerMakesEverythingAnewAndGoesOn) {
    for (const bool destroys : {false, true}) {
        script = {.polls = 0, .resets_at = {1, 3, -1}, .status = GL_INNOCENT_CONTEXT_RESET, .destroys = destroys};
        const auto summary = viewer::run(options(destroys ? "inset_outset" : "scaled_bins_late"), kNeverStops);
        ASSERT_TRUE(summary.has_value()) << summary.error().error.message();
        EXPECT_EQ(summary->resets, 2u);
        EXPECT_EQ(summary->frames, 4u) << "those that were lost are not counted";
        EXPECT_EQ(script.polls, 6) << "once a frame";
        EXPECT_GT(summary->snapshot_frame, 0u);
    }
}

TEST_F(ContextLoss, ADriverThatLosesEveryContextIsGivenUpWithAReason) {
    epoxy_glGetGraphicsResetStatusEXT = [] { return GLenum{GL_GUILTY_CONTEXT_RESET}; };
    const auto summary = viewer::run(options("full"), kNeverStops);
    ASSERT_FALSE(summary.has_value());
    EXPECT_NE(summary.error().error.message().find("by what was drawn"), std::string::npos) << summary.error().error.message();
}

TEST(ContextReset, ADriverThatCanIsAskedToTell) {
    const auto c = gl::Context::create();
    ASSERT_TRUE(c.has_value());
    const bool has = epoxy_has_gl_extension("GL_EXT_robustness") || epoxy_has_gl_extension("GL_KHR_robustness");
    EXPECT_EQ(c->info().tells_resets, has);
    EXPECT_EQ(gl::poll_reset(), gl::Reset::none);
    gl::Context::release();
    EXPECT_EQ(gl::poll_reset(), gl::Reset::none) << "no context is current";
}

}  // namespace
