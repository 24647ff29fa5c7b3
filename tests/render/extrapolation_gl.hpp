// A context with the three backends of the GL call, and textures of known content, for the tests of the GL side of frame
// extrapolation.
#pragma once

#include <EGL/egl.h>
#include <GLES3/gl32.h>
#include <GLES2/gl2ext.h>
#include <gtest/gtest.h>

#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/extrapolation/gl_passes.hpp"
#include "render/extrapolation/gl_state.hpp"
#include "render/gl/context.hpp"
#include "tests/render/extrapolation_pictures.hpp"

namespace fovea::test {

using namespace fovea::render::extrapolation;

inline GlFunction load_gl(const char* name) { return reinterpret_cast<GlFunction>(eglGetProcAddress(name)); }
inline const GlFunctions& gl() {
    static const GlFunctions table = [] {
        GlFunctions t;
        EXPECT_EQ(load(t, load_gl), nullptr);
        return t;
    }();
    return table;
}

struct FormatRow {
    Format format;
    GLenum internal, layout, type;
};
inline constexpr FormatRow kRows[] = {{Format::rgba8, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE}, {Format::rgb8, GL_RGB8, GL_RGB, GL_UNSIGNED_BYTE},
                               {Format::r8, GL_R8, GL_RED, GL_UNSIGNED_BYTE}, {Format::rgba16f, GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT},
                               {Format::rgb16f, GL_RGB16F, GL_RGB, GL_HALF_FLOAT}, {Format::rgba32f, GL_RGBA32F, GL_RGBA, GL_FLOAT},
                               {Format::rgb32f, GL_RGB32F, GL_RGB, GL_FLOAT}};
inline const FormatRow& row_of(Format f) { return kRows[static_cast<int>(f)]; }

// How far the red of two pictures that were read back is apart, without their rims; floats of 32 bits.
inline double red_off(const Picture& p, const Picture& q) {
    constexpr int kRim = 10;
    double sum = 0;
    for (int y = kRim; y < p.height - kRim; ++y)
        for (int x = kRim; x < p.width - kRim; ++x) {
            float u = 0, v = 0;
            if (is_float(p.format)) {
                std::memcpy(&u, p.at(x, y), 4);
                std::memcpy(&v, q.at(x, y), 4);
            } else {
                u = static_cast<float>(std::to_integer<int>(*p.at(x, y)));
                v = static_cast<float>(std::to_integer<int>(*q.at(x, y)));
            }
            sum += std::fabs(static_cast<double>(u - v));
        }
    return sum;
}

// A program of two shaders, not linked yet.
inline GLuint program_of(const char* vertex, const char* fragment) {
    const GLuint program = gl().CreateProgram();
    for (const auto& [kind, source] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
        const GLuint s = gl().CreateShader(static_cast<GLenum>(kind));
        gl().ShaderSource(s, 1, &source, nullptr);
        gl().CompileShader(s);
        gl().AttachShader(program, s);
        gl().DeleteShader(s);
    }
    return program;
}

class ExtrapolationGl : public testing::Test {
protected:
    struct Side {
        Backend backend;
        GlExtrapolator engine;
    };
    // One context for all: a software driver compiles its shaders anew in each. Compute shaders do not work on softpipe of
    // Mesa 22.3, which is what create() then says.
    static void SetUpTestSuite() {
        auto c = fovea::gl::Context::create();
        if (!c) return;
        context_.emplace(std::move(*c));
        for (const Backend b : {Backend::processor, Backend::compute, Backend::fragment})
            if (auto e = GlExtrapolator::create(load_gl, {.preset = Preset::balanced, .backend = b})) sides_.push_back({b, std::move(*e)});
        EXPECT_FALSE(sides_.empty());
    }
    static void TearDownTestSuite() {
        sides_.clear();
        context_.reset();
    }
    void SetUp() override {
        if (!context_) GTEST_SKIP() << "no OpenGL ES context";
    }
    void TearDown() override {
        if (!textures_.empty()) gl().DeleteTextures(static_cast<GLsizei>(textures_.size()), textures_.data());
        textures_.clear();
    }
    GLuint texture(const Picture& p, int levels = 1) {
        GLuint t = 0;
        gl().GenTextures(1, &t);
        textures_.push_back(t);
        gl().BindTexture(GL_TEXTURE_2D, t);
        const FormatRow& row = row_of(p.format);
        gl().TexStorage2D(GL_TEXTURE_2D, levels, row.internal, p.width, p.height);
        gl().PixelStorei(GL_UNPACK_ALIGNMENT, 1);
        gl().TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, p.width, p.height, row.layout, row.type, p.bytes.data());
        gl().BindTexture(GL_TEXTURE_2D, 0);
        return t;
    }
    // What no framebuffer takes is drawn by the engine's own copy; ReadsThreeFloats checks that one against the upload.
    static void read_sampled(GLuint t, Picture& result) {
        auto passes = GlPasses::create(gl(), Preset::draft, false);
        ASSERT_TRUE(passes.has_value());
        GlStateGuard guard(gl(), true);
        ASSERT_TRUE((*passes)->read_floats(t, result.width, result.height, result.bytes.data()));
    }
    static Picture read(GLuint t, const Picture& like) {
        GLuint f = 0;
        gl().GenFramebuffers(1, &f);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, f);
        gl().FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t, 0);
        Picture result(like.width, like.height, is_float(like.format) ? Format::rgba32f : Format::rgba8);
        gl().PixelStorei(GL_PACK_ALIGNMENT, 1);
        if (gl().CheckFramebufferStatus(GL_READ_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE)
            gl().ReadPixels(0, 0, like.width, like.height, GL_RGBA, is_float(like.format) ? GL_FLOAT : GL_UNSIGNED_BYTE, result.bytes.data());
        else
            read_sampled(t, result);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
        gl().DeleteFramebuffers(1, &f);
        return result;
    }
    static inline std::optional<fovea::gl::Context> context_;
    static inline std::vector<Side> sides_;
    std::vector<GLuint> textures_;
};

}  // namespace fovea::test
