// glExtrapolateTex2DQCOM in the middle of what programs do: textures of every kind, bound everywhere, in several contexts and
// threads, inside transform feedback and queries. The engine's own tests (tests/render) hold the state bit by bit.
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <thread>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {
namespace {

struct Kind {
    GLenum internal, layout, type;
};
constexpr Kind kTable[] = {{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE}, {GL_RGB8, GL_RGB, GL_UNSIGNED_BYTE}, {GL_R8, GL_RED, GL_UNSIGNED_BYTE}, {GL_RGBA16F, GL_RGBA, GL_FLOAT},
                           {GL_RGB16F, GL_RGB, GL_FLOAT}, {GL_RGBA32F, GL_RGBA, GL_FLOAT}, {GL_RGB32F, GL_RGB, GL_FLOAT}};
constexpr int kSize = 48;

int channels(GLenum layout) { return layout == GL_RGBA ? 4 : layout == GL_RGB ? 3 : 1; }
float wave(float x, float y, int c) { return 0.5f + 0.25f * std::sin(0.35f * x + 0.2f * y + static_cast<float>(c)) + 0.2f * std::sin(0.15f * x * static_cast<float>(1 + c) - 0.3f * y); }

// A pattern that has moved by `dx`, as an upload of that kind wants it.
std::vector<std::byte> pattern(const Kind& kind, float dx) {
    const int n = channels(kind.layout);
    const bool bytes = kind.type == GL_UNSIGNED_BYTE;
    std::vector<std::byte> data(static_cast<std::size_t>(kSize * kSize * n * (bytes ? 1 : 4)));
    for (int i = 0; i < kSize * kSize * n; ++i) {
        const float v = i % n == 3 ? 1.0f : wave(static_cast<float>(i / n % kSize) - dx, static_cast<float>(i / n / kSize), i % n);
        if (bytes)
            data[static_cast<std::size_t>(i)] = static_cast<std::byte>(std::lround(255 * v));
        else
            std::memcpy(data.data() + 4 * i, &v, 4);
    }
    return data;
}

template <class Proc>
Proc proc(const char* name) { return reinterpret_cast<Proc>(eglGetProcAddress(name)); }

bool listed(const char* name) {
    GLint count = 0;
    glGetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; ++i)
        if (std::strcmp(reinterpret_cast<const char*>(glGetStringi(GL_EXTENSIONS, static_cast<GLuint>(i))), name) == 0) return true;
    return false;
}

}  // namespace

class FrameExtrapolationAmong : public LayerTest {
protected:
    // dx < 0: nothing but its size.
    GLuint immutable(const Kind& kind, float dx) {
        const GLuint t = texture(kSize, kSize, kind.internal);
        upload(kind, dx);
        return t;
    }
    static void upload(const Kind& kind, float dx) {
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kSize, kSize, kind.layout, kind.type, pattern(kind, dx).data());
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    }
    static GLuint specified(const Kind& kind, float dx) {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(GL_TEXTURE_2D, t);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(kind.internal), kSize, kSize, 0, kind.layout, kind.type, pattern(kind, dx).data());
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        return t;
    }
    // Drawn into RGBA32F by texelFetch: any format can be sampled.
    std::vector<float> red(GLuint t) {
        if (reader_ == 0) {
            reader_ = program(kCoverVertex, R"(#version 300 es
precision highp float;
uniform highp sampler2D image;
out vec4 color;
void main() { color = texelFetch(image, ivec2(gl_FragCoord.xy), 0); })");
            target_ = surface(kSize, kSize, false, GL_RGBA32F);
        }
        glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer);
        glViewport(0, 0, kSize, kSize);
        glUseProgram(reader_);
        glActiveTexture(GL_TEXTURE0);
        glBindTexture(GL_TEXTURE_2D, t);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        std::vector<float> all(static_cast<std::size_t>(4 * kSize * kSize)), first(static_cast<std::size_t>(kSize * kSize));
        glReadPixels(0, 0, kSize, kSize, GL_RGBA, GL_FLOAT, all.data());
        for (std::size_t i = 0; i < first.size(); ++i) first[i] = all[4 * i];
        glUseProgram(0);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        return first;
    }
    // How far a picture is from the pattern moved by dx, a few pixels inside.
    static double off(const std::vector<float>& picture, float dx) {
        double sum = 0;
        for (int y = 6; y < kSize - 6; ++y)
            for (int x = 6; x < kSize - 6; ++x) sum += std::fabs(picture[static_cast<std::size_t>(y * kSize + x)] - wave(static_cast<float>(x) - dx, static_cast<float>(y), 0));
        return sum;
    }

private:
    GLuint reader_ = 0;
    Surface target_;
};

TEST_F(FrameExtrapolationAmong, TexturesOfEveryFormatAndKindMove) {
    const auto view = listed("GL_OES_texture_view") ? proc<PFNGLTEXTUREVIEWOESPROC>("glTextureViewOES") : nullptr;
    for (const Kind& kind : kTable)
        for (const char* how : {"immutable", "mutable", "view"}) {
            GLuint names[3] = {};
            for (int i = 0; i < 3; ++i) {
                const float dx = i == 1 ? 3.0f : 0.0f;
                names[i] = std::strcmp(how, "mutable") == 0 ? specified(kind, dx) : immutable(kind, dx);
                if (std::strcmp(how, "view") == 0 && view != nullptr) {
                    GLuint seen = 0;
                    glGenTextures(1, &seen);
                    view(seen, GL_TEXTURE_2D, names[i], kind.internal, 0, 1, 0, 1);
                    names[i] = seen;
                }
            }
            EXPECT_GL(GL_NO_ERROR);
            ext.extrapolate(names[0], names[1], names[2], 0.5f);
            EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)) << how << std::hex << " " << kind.internal;
            EXPECT_LT(off(red(names[2]), 4.5f), 0.5 * off(red(names[1]), 4.5f)) << how << std::hex << " " << kind.internal;
            EXPECT_LT(off(red(names[0]), 0), 4) << how << ": the source is as it was";
            EXPECT_LT(off(red(names[1]), 3), 4) << how;
        }
}

TEST_F(FrameExtrapolationAmong, OnlyTwoDimensionalTexturesAreTaken) {
    const GLuint a = immutable(kTable[0], 0), b = immutable(kTable[0], 3), out = immutable(kTable[0], 0);
    GLuint others[5];
    glGenTextures(5, others);
    glBindTexture(GL_TEXTURE_2D_ARRAY, others[0]);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, kSize, kSize, 2);
    glBindTexture(GL_TEXTURE_3D, others[1]);
    glTexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA8, kSize, kSize, 2);
    glBindTexture(GL_TEXTURE_CUBE_MAP, others[2]);
    glTexStorage2D(GL_TEXTURE_CUBE_MAP, 1, GL_RGBA8, kSize, kSize);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, others[3]);
    glTexStorage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, 4, GL_RGBA8, kSize, kSize, GL_TRUE);
    glBindTexture(GL_TEXTURE_CUBE_MAP_ARRAY, others[4]);
    glTexStorage3D(GL_TEXTURE_CUBE_MAP_ARRAY, 1, GL_RGBA8, kSize, kSize, 6);
    EXPECT_GL(GL_NO_ERROR);
    for (const GLuint other : others) {
        ext.extrapolate(other, b, out, 0.5f);
        EXPECT_GL(GL_INVALID_OPERATION);
        ext.extrapolate(a, other, out, 0.5f);
        EXPECT_GL(GL_INVALID_OPERATION);
        ext.extrapolate(a, b, other, 0.5f);
        EXPECT_GL(GL_INVALID_OPERATION);
        ext.extrapolate(other, other, other, 0.5f);
        EXPECT_GL(GL_INVALID_OPERATION);
    }
    EXPECT_LT(off(red(out), 0), 4);
}

TEST_F(FrameExtrapolationAmong, WhatIsBoundAndSetElsewhereReachesNothing) {
    const Kind& kind = kTable[0];
    const GLuint a = immutable(kind, 0), b = immutable(kind, 3), out = immutable(kind, 0), clean = immutable(kind, 0);
    ext.extrapolate(a, b, clean, 0.5f);
    const std::vector<float> wanted = red(clean);
    GLuint buffer = 0, sampler = 0, array = 0, framebuffer = 0, pipeline = 0;
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, 1 << 16, nullptr, GL_STATIC_DRAW);
    glGenSamplers(1, &sampler);
    glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glGenVertexArrays(1, &array);
    glGenFramebuffers(1, &framebuffer);
    glGenProgramPipelines(1, &pipeline);
    const struct {
        const char* name;
        std::function<void()> set, undo;
    } kAll[] = {
        {"pixel buffers", [&] { glBindBuffer(GL_PIXEL_PACK_BUFFER, buffer); glBindBuffer(GL_PIXEL_UNPACK_BUFFER, buffer); }, [] { glBindBuffer(GL_PIXEL_PACK_BUFFER, 0); glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0); }},
        {"row lengths", [] { glPixelStorei(GL_UNPACK_ROW_LENGTH, 77); glPixelStorei(GL_UNPACK_SKIP_ROWS, 3); glPixelStorei(GL_PACK_ROW_LENGTH, 91); glPixelStorei(GL_PACK_SKIP_PIXELS, 5); },
         [] { for (const GLenum s : {GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_PIXELS}) glPixelStorei(s, 0); }},
        {"attached", [&] { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer); glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, out, 0); glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, b, 0); },
         [] { glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0); glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, 0, 0); glBindFramebuffer(GL_FRAMEBUFFER, 0); }},
        {"images", [&] { glBindImageTexture(0, a, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA8); glBindImageTexture(1, out, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8); },
         [] { glBindImageTexture(0, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R32UI); glBindImageTexture(1, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R32UI); }},
        {"units and samplers", [&] { for (GLuint u = 0; u < 6; ++u) { glActiveTexture(GL_TEXTURE0 + u); glBindTexture(GL_TEXTURE_2D, u % 2 == 0 ? out : a); glBindSampler(u, sampler); } },
         [] { for (GLuint u = 0; u < 6; ++u) { glActiveTexture(GL_TEXTURE0 + u); glBindTexture(GL_TEXTURE_2D, 0); glBindSampler(u, 0); } glActiveTexture(GL_TEXTURE0); }},
        {"discard and masks", [] { glEnable(GL_RASTERIZER_DISCARD); glColorMask(GL_FALSE, GL_FALSE, GL_TRUE, GL_FALSE); glEnable(GL_SCISSOR_TEST); glScissor(1, 1, 2, 2); }, [] { glDisable(GL_RASTERIZER_DISCARD); glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE); glDisable(GL_SCISSOR_TEST); }},
        {"tests", [] { glEnable(GL_DEPTH_TEST); glDepthFunc(GL_NEVER); glEnable(GL_STENCIL_TEST); glStencilFunc(GL_NEVER, 1, 1); glEnable(GL_SAMPLE_COVERAGE); glSampleCoverage(0, GL_FALSE); glEnable(GL_POLYGON_OFFSET_FILL); },
         [] { glDisable(GL_DEPTH_TEST); glDepthFunc(GL_LESS); glDisable(GL_STENCIL_TEST); glStencilFunc(GL_ALWAYS, 0, ~0u); glDisable(GL_SAMPLE_COVERAGE); glSampleCoverage(1, GL_FALSE); glDisable(GL_POLYGON_OFFSET_FILL); }},
        {"blend", [] { glEnable(GL_BLEND); glBlendFunc(GL_ZERO, GL_SRC_COLOR); }, [] { glDisable(GL_BLEND); glBlendFunc(GL_ONE, GL_ZERO); }},
        {"arrays and pipelines", [&] { glBindVertexArray(array); glBindProgramPipeline(pipeline); glEnable(GL_PRIMITIVE_RESTART_FIXED_INDEX); }, [] { glBindVertexArray(0); glBindProgramPipeline(0); glDisable(GL_PRIMITIVE_RESTART_FIXED_INDEX); }},
    };
    constexpr std::size_t kCount = std::size(kAll);
    for (std::size_t which = 0; which <= kCount; ++which) {   // each alone, and all at once
        glBindTexture(GL_TEXTURE_2D, out);
        upload(kind, 20);
        glBindTexture(GL_TEXTURE_2D, 0);
        for (std::size_t i = 0; i < kCount; ++i)
            if (which == i || which == kCount) kAll[i].set();
        const char* const name = which < kCount ? kAll[which].name : "all";
        EXPECT_GL(GL_NO_ERROR);
        ext.extrapolate(a, b, out, 0.5f);
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)) << name;
        GLint pipeline_now = 0, pack = 0;
        glGetIntegerv(GL_PROGRAM_PIPELINE_BINDING, &pipeline_now);
        glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack);
        EXPECT_EQ(pipeline_now != 0, which == 8 || which == kCount) << name;
        EXPECT_EQ(pack != 0, which == 0 || which == kCount) << name;
        for (std::size_t i = kCount; i-- > 0;)
            if (which == i || which == kCount) kAll[i].undo();
        EXPECT_GL(GL_NO_ERROR);
        EXPECT_EQ(red(out), wanted) << name;
    }
}

TEST_F(FrameExtrapolationAmong, TransformFeedbackAndQueriesGoOnAroundIt) {
    const GLuint a = immutable(kTable[0], 0), b = immutable(kTable[0], 3), out = immutable(kTable[0], 0), clean = immutable(kTable[0], 0);
    ext.extrapolate(a, b, clean, 0.5f);
    const GLuint capturing = link({{GL_VERTEX_SHADER, "#version 300 es\nout float v;\nvoid main() { v = 7.0; gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }"},
                                   {GL_FRAGMENT_SHADER, "#version 300 es\nvoid main() {}"}}, "v");
    const Surface s = surface(16, 16);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    GLuint buffer = 0, queries[2];
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    const float zeros[4] = {};
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, sizeof zeros, zeros, GL_STATIC_READ);
    glGenQueries(2, queries);
    glUseProgram(capturing);
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginQuery(GL_ANY_SAMPLES_PASSED, queries[0]);
    glBeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, queries[1]);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, 1);
    ext.extrapolate(a, b, out, 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    glDrawArrays(GL_POINTS, 0, 1);
    glEndTransformFeedback();
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    glEndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN);
    glDisable(GL_RASTERIZER_DISCARD);
    GLuint passed = 7, written = 0;
    glGetQueryObjectuiv(queries[0], GL_QUERY_RESULT, &passed);
    glGetQueryObjectuiv(queries[1], GL_QUERY_RESULT, &written);
    EXPECT_EQ(passed, 0u);
    EXPECT_EQ(written, 2u);
    const auto* values = static_cast<const float*>(glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, sizeof zeros, GL_MAP_READ_BIT));
    ASSERT_NE(values, nullptr);
    EXPECT_TRUE(values[0] == 7 && values[1] == 7 && values[2] == 0);
    glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_LT(off(red(out), 4.5f), 0.5 * off(red(b), 4.5f));
}

TEST_F(FrameExtrapolationAmong, ContextsOfOneShareGroupAndAnyVersionTakeTheSameTextures) {
    const GLuint a = immutable(kTable[0], 0), b = immutable(kTable[0], 3), out = immutable(kTable[0], 0), other_out = immutable(kTable[0], 20);
    glFinish();
    ext.extrapolate(a, b, out, 0.5f);
    const std::vector<float> wanted = red(out);
    for (const EGLint minor : {0, 1, 2}) {
        const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, minor, EGL_NONE};
        const EGLContext second = eglCreateContext(display, EGL_NO_CONFIG_KHR, context, attributes);
        ASSERT_NE(second, EGL_NO_CONTEXT);
        contexts.push_back(second);
        use(second);
        if (!listed("GL_QCOM_frame_extrapolation")) continue;   // a driver that gives no more than 3.0
        ext.extrapolate(a, b, other_out, 0.5f);
        EXPECT_GL(GL_NO_ERROR);
        glFinish();
        use(context);
        EXPECT_LT(off(red(other_out), 4.5f), 0.5 * off(red(b), 4.5f)) << "3." << minor;
        // Which side the probe chose for each context may differ, and then their pictures do, a little.
        glBindTexture(GL_TEXTURE_2D, other_out);
        upload(kTable[0], 20);
        glFinish();   // what one context has changed is another's only when it is done
    }
    EXPECT_EQ(red(out), wanted) << "the first context's output is its own";
}

TEST_F(FrameExtrapolationAmong, TwoThreadsAtOnceDoNotDisturbEachOther) {
    const GLuint a = immutable(kTable[0], 0), b = immutable(kTable[0], 3);
    const GLuint outs[2] = {immutable(kTable[0], 20), immutable(kTable[0], 20)};
    glFinish();
    const EGLContext workers[2] = {make_context(context), make_context(context)};
    std::atomic<int> errors{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&, i] {
            eglBindAPI(EGL_OPENGL_ES_API);
            if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, workers[i])) ++errors;
            for (int k = 0; k < 12; ++k) {
                ext.extrapolate(a, b, outs[i], k % 2 == 0 ? -0.3f : 0.5f);
                if (glGetError() != GL_NO_ERROR) ++errors;
            }
            glFinish();
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(errors, 0);
    for (const GLuint out : outs) EXPECT_LT(off(red(out), 4.5f), 0.5 * off(red(b), 4.5f));
    EXPECT_LT(off(red(a), 0), 4);
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
