#include "tests/layer/layer_test.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#if defined(__SANITIZE_ADDRESS__)
// The driver keeps shaders and screens until the process ends.
extern "C" const char* __asan_default_options() { return "detect_leaks=0"; }
#endif

namespace fovea::layer_test {
namespace {

// Before main, and so before the first EGL call.
const struct Vendor {
    Vendor() {
        path = "/tmp/fovea_layer_test_" + std::to_string(getpid()) + ".json";
        std::ofstream(path) << R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")" << FOVEA_LAYER_LIBRARY << "\"}}\n";
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", path.c_str(), 1);
    }
    ~Vendor() { std::remove(path.c_str()); }
    std::string path;
} vendor;

constexpr const char* kSceneFragment = R"(#version 300 es
precision highp float;
in vec2 at;
uniform float seed;
out vec4 color;
void main() {
    vec2 c = floor(at * 64.0);
    float k = fract(sin(dot(c, vec2(12.9898, 78.233)) + seed) * 43758.5453);
    color = vec4(k, at, 1.0);
})";

constexpr const char* kFootprintFragment = R"(#version 300 es
precision highp float;
in vec2 at;
uniform vec2 size;
out vec4 color;
void main() { color = vec4(dFdx(at.x) * size.x / 8.0, abs(dFdy(at.y)) * size.y / 8.0, 0.0, 1.0); })";

constexpr const char* kTriangleVertex = R"(#version 300 es
uniform vec4 place;  // x, y, size, depth
void main() {
    vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
    gl_Position = vec4(place.xy + p * place.z, place.w, 1.0);
})";

constexpr const char* kColorFragment = R"(#version 300 es
precision highp float;
uniform vec4 tint;
out vec4 color;
void main() { color = tint; })";

}  // namespace

const char* const kCoverVertex = R"(#version 300 es
out highp vec2 at;
void main() {
    vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;
    at = p * 0.5 + 0.5;
    gl_Position = vec4(p, 0.5, 1.0);
})";

EGLDisplay LayerTest::display = EGL_NO_DISPLAY;
EGLConfig LayerTest::config = nullptr;

std::string layer_library() { return FOVEA_LAYER_LIBRARY; }

void LayerTest::SetUp() {
    if (display == EGL_NO_DISPLAY) {
        display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
        ASSERT_NE(display, EGL_NO_DISPLAY);
        ASSERT_TRUE(eglInitialize(display, nullptr, nullptr));
    }
    ASSERT_TRUE(eglBindAPI(EGL_OPENGL_ES_API));
    context = make_context();
    use(context);
    ext.config = reinterpret_cast<PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC>(eglGetProcAddress("glFramebufferFoveationConfigQCOM"));
    ext.parameters = reinterpret_cast<PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC>(eglGetProcAddress("glFramebufferFoveationParametersQCOM"));
    ext.texture_parameters = reinterpret_cast<PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC>(eglGetProcAddress("glTextureFoveationParametersQCOM"));
    ext.extrapolate = reinterpret_cast<PFNGLEXTRAPOLATETEX2DQCOMPROC>(eglGetProcAddress("glExtrapolateTex2DQCOM"));
    ASSERT_TRUE(ext.config && ext.parameters && ext.texture_parameters && ext.extrapolate);
    scene_ = footprint_ = triangle_ = 0;
}

void LayerTest::TearDown() {
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    for (const EGLContext c : contexts) eglDestroyContext(display, c);
    contexts.clear();
}

EGLContext LayerTest::make_context(EGLContext share) {
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 2, EGL_NONE};
    const EGLContext made = eglCreateContext(display, EGL_NO_CONFIG_KHR, share, attributes);
    EXPECT_NE(made, EGL_NO_CONTEXT);
    contexts.push_back(made);
    return made;
}

void LayerTest::use(EGLContext c) { ASSERT_TRUE(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, c)); }

GLuint LayerTest::program(const char* vertex, const char* fragment) {
    return link({{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}});
}

GLuint LayerTest::link(std::initializer_list<std::pair<GLenum, const char*>> stages, const char* captured) {
    const GLuint p = glCreateProgram();
    for (const auto& [stage, text] : stages) {
        const GLuint s = glCreateShader(stage);
        glShaderSource(s, 1, &text, nullptr);
        glCompileShader(s);
        GLint good = 0;
        glGetShaderiv(s, GL_COMPILE_STATUS, &good);
        char log[512] = {};
        if (!good) glGetShaderInfoLog(s, sizeof log, nullptr, log);
        EXPECT_TRUE(good) << log;
        glAttachShader(p, s);
        glDeleteShader(s);
    }
    if (captured) glTransformFeedbackVaryings(p, 1, &captured, GL_INTERLEAVED_ATTRIBS);
    glLinkProgram(p);
    GLint good = 0;
    glGetProgramiv(p, GL_LINK_STATUS, &good);
    EXPECT_TRUE(good);
    return p;
}

GLuint LayerTest::texture(int width, int height, GLenum format) {
    GLuint t = 0;
    glGenTextures(1, &t);
    glBindTexture(GL_TEXTURE_2D, t);
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return t;
}

Surface LayerTest::surface(int width, int height, bool depth, GLenum format) {
    Surface s{.framebuffer = 0, .color = texture(width, height, format), .depth = 0, .width = width, .height = height};
    glGenFramebuffers(1, &s.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    if (depth) {
        glGenRenderbuffers(1, &s.depth);
        glBindRenderbuffer(GL_RENDERBUFFER, s.depth);
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH24_STENCIL8, width, height);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, s.depth);
    }
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glViewport(0, 0, width, height);
    return s;
}

void LayerTest::foveate(const Surface& s, GLuint points) {
    GLuint provided = 0;
    ext.config(s.framebuffer, 1, points, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_TRUE(provided & GL_FOVEATION_ENABLE_BIT_QCOM);
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

void LayerTest::focus(const Surface& s, float x, float y, float gain, float area, GLuint point) {
    ext.parameters(s.framebuffer, 0, point, x, y, gain, gain, area);
}

Picture LayerTest::read(const Surface& s) {
    Picture p{s.width, s.height, std::vector<Rgba>(static_cast<std::size_t>(s.width * s.height))};
    GLint bound = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &bound);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glReadPixels(0, 0, s.width, s.height, GL_RGBA, GL_UNSIGNED_BYTE, p.pixels.data());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(bound));
    return p;
}

void LayerTest::draw_scene(float seed) {
    if (!scene_) scene_ = program(kCoverVertex, kSceneFragment);
    glUseProgram(scene_);
    glUniform1f(glGetUniformLocation(scene_, "seed"), seed);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

void LayerTest::draw_scene_to(const Surface& s) {
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_scene();
}

void LayerTest::draw_footprint() {
    if (!footprint_) footprint_ = program(kCoverVertex, kFootprintFragment);
    glUseProgram(footprint_);
    GLint viewport[4];
    glGetIntegerv(GL_VIEWPORT, viewport);
    glUniform2f(glGetUniformLocation(footprint_, "size"), static_cast<float>(viewport[2]), static_cast<float>(viewport[3]));
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

void LayerTest::draw_triangle(float x, float y, float size, float depth, std::array<float, 4> color) {
    if (!triangle_) triangle_ = program(kTriangleVertex, kColorFragment);
    glUseProgram(triangle_);
    glUniform4f(glGetUniformLocation(triangle_, "place"), x, y, size, depth);
    glUniform4fv(glGetUniformLocation(triangle_, "tint"), 1, color.data());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

void LayerTest::expect_error(GLenum error, const char* where) { EXPECT_EQ(glGetError(), error) << where; }

double spec_density(const std::vector<std::array<float, 5>>& points, double px, double py, double least) {
    double density = 0;
    for (const auto& [x, y, gain_x, gain_y, area] : points) {
        const double dx = (static_cast<double>(x) - px) * static_cast<double>(gain_x);
        const double dy = (static_cast<double>(y) - py) * static_cast<double>(gain_y);
        density = std::max(density, 1.0 / std::max(dx * dx + dy * dy - static_cast<double>(area), 1.0));
    }
    return std::max(density, least);
}

}  // namespace fovea::layer_test
