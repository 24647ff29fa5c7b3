// A GLES context under the layer, in the test process itself: libEGL reads the vendor to load when EGL is first used,
// and this fixture tells it before.
//
// Drawing to a framebuffer that nobody has foveated is the driver's own drawing; tests compare with it. Tests that need
// a process without the layer run tests/layer/gles_program.c.
#pragma once

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl32.h>
#include <GLES2/gl2ext.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace fovea::layer_test {

struct Rgba {
    std::uint8_t r = 0, g = 0, b = 0, a = 0;
    bool operator==(const Rgba&) const = default;
};

struct Picture {
    int width = 0, height = 0;
    std::vector<Rgba> pixels;
    [[nodiscard]] Rgba at(int x, int y) const { return pixels[static_cast<std::size_t>(y * width + x)]; }
    bool operator==(const Picture&) const = default;
};

// A texture (or renderbuffer) with a framebuffer object; depth is a renderbuffer.
struct Surface {
    GLuint framebuffer = 0, color = 0, depth = 0;
    int width = 0, height = 0;
};

// The entry points as the official header declares them, from eglGetProcAddress.
struct Extension {
    PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config = nullptr;
    PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters = nullptr;
    PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC texture_parameters = nullptr;
    PFNGLEXTRAPOLATETEX2DQCOMPROC extrapolate = nullptr;
};

class LayerTest : public ::testing::Test {
protected:
    void SetUp() override;
    void TearDown() override;

    [[nodiscard]] EGLContext make_context(EGLContext share = EGL_NO_CONTEXT);
    void use(EGLContext context);
    [[nodiscard]] GLuint program(const char* vertex, const char* fragment);
    // Any stages; `captured` is the varying that transform feedback records.
    [[nodiscard]] GLuint link(std::initializer_list<std::pair<GLenum, const char*>> stages, const char* captured = nullptr);
    [[nodiscard]] Surface surface(int width, int height, bool depth = true, GLenum format = GL_RGBA8);
    [[nodiscard]] GLuint texture(int width, int height, GLenum format = GL_RGBA8);
    // Framebuffer config with ENABLE, one layer; and one focal point.
    void foveate(const Surface& s, GLuint points = 1);
    void focus(const Surface& s, float x, float y, float gain, float area = 0, GLuint point = 0);
    [[nodiscard]] Picture read(const Surface& s);
    // A detailed picture with the whole surface covered; `seed` changes it.
    void draw_scene(float seed = 0);
    // Binds, clears and draws it.
    void draw_scene_to(const Surface& s);
    // Full-screen: red = pixels per rendered pixel along x / 8.
    void draw_footprint();
    void draw_triangle(float x, float y, float size, float depth, std::array<float, 4> color);
    static void expect_error(GLenum error, const char* where);

    static EGLDisplay display;
    static EGLConfig config;
    EGLContext context = EGL_NO_CONTEXT;
    Extension ext;
    std::vector<EGLContext> contexts;

private:
    GLuint scene_ = 0, footprint_ = 0, triangle_ = 0;
};

// Covers the viewport with one triangle, depth 0.5; `at` is 0 to 1.
extern const char* const kCoverVertex;

// The equation of the specifications, written down from their text.
[[nodiscard]] double spec_density(const std::vector<std::array<float, 5>>& points, double x_ndc, double y_ndc, double least = 0);

// The counters that FOVEA_LAYER_STATS would hold now: written by eglTerminate, so a test reads differences only at exit.
[[nodiscard]] std::string layer_library();

}  // namespace fovea::layer_test

#define EXPECT_GL(error) expect_error(static_cast<GLenum>(error), #error)
