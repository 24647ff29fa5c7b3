// The behaviours that another implementation's test suite names for these extensions, as tests of our own: what is drawn
// with foveation (focal point in the middle, gain 8) must be what the calls say, wherever it does not depend on density.
#include <climits>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class NamedBehaviours : public LayerTest {
protected:
    static constexpr Rgba kRed{255, 0, 0, 255}, kGreen{0, 255, 0, 255}, kBlue{0, 0, 255, 255};
    Surface foveated(GLenum format = GL_RGBA8) {
        const Surface s = surface(256, 256, true, format);
        foveate(s);
        focus(s, 0, 0, 8);
        return s;
    }
    void clear(float r, float g, float b) {
        glClearColor(r, g, b, 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    }
    void cover(std::array<float, 4> color) { draw_triangle(-1, -1, 4, 0.5f, color); }
    void expect_all(const Surface& s, Rgba color) {
        const Picture p = read(s);
        for (std::size_t i = 0; i < p.pixels.size(); ++i) ASSERT_EQ(p.pixels[i], color) << i % 256 << ' ' << i / 256;
        EXPECT_GL(GL_NO_ERROR);
    }
    void expect_foveated_scene(const Surface& s) {
        const Surface plain = surface(256, 256);
        clear(0, 0, 0);
        draw_scene();
        const Picture full = read(plain), p = read(s);
        EXPECT_EQ(p.at(128, 128), full.at(128, 128));
        int different = 0;
        for (std::size_t i = 0; i < p.pixels.size(); ++i) different += !(p.pixels[i] == full.pixels[i]);
        EXPECT_GT(different, 5000);
        EXPECT_GL(GL_NO_ERROR);
    }
};

TEST_F(NamedBehaviours, Clear) {
    const Surface s = foveated();
    clear(1, 0, 0);
    expect_all(s, kRed);
}

TEST_F(NamedBehaviours, ClearThenDraw) {
    const Surface s = foveated();
    clear(1, 0, 0);
    draw_triangle(-1, -1, 1, 0, {0, 1, 0, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(1, 1), kGreen);
    EXPECT_EQ(p.at(254, 254), kRed);
    EXPECT_EQ(p.at(128, 128), kRed);
}

TEST_F(NamedBehaviours, RenderbufferAttachmentClearThenDraw) {
    Surface s{.framebuffer = 0, .color = 0, .depth = 0, .width = 256, .height = 256};
    glGenRenderbuffers(1, &s.color);
    glBindRenderbuffer(GL_RENDERBUFFER, s.color);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 256, 256);
    glGenFramebuffers(1, &s.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, s.color);
    glViewport(0, 0, 256, 256);
    foveate(s);
    focus(s, 0, 0, 8);
    clear(1, 0, 0);
    draw_scene();
    expect_foveated_scene(s);
}

TEST_F(NamedBehaviours, DrawClearDrawWithFlushInsideTheFrame) {
    const Surface s = foveated();
    cover({1, 0, 0, 1});
    glFlush();
    clear(0, 0, 1);
    glFlush();
    draw_triangle(-1, -1, 1, 0, {0, 1, 0, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(1, 1), kGreen);
    EXPECT_EQ(p.at(254, 254), kBlue);
    EXPECT_EQ(p.at(140, 140), kBlue);
}

TEST_F(NamedBehaviours, DrawThenEnableFoveationAndDraw) {
    const Surface s = surface(256, 256);
    clear(1, 0, 0);
    cover({1, 0, 0, 1});
    expect_all(s, kRed);
    foveate(s);
    focus(s, 0, 0, 8);
    clear(0, 0, 0);
    draw_scene();
    expect_foveated_scene(s);
}

TEST_F(NamedBehaviours, DrawChangeParametersThenDraw) {
    const Surface s = foveated();
    clear(0, 0, 0);
    cover({1, 0, 0, 1});
    ext.parameters(s.framebuffer, 0, 0, 0.5f, 0.5f, 3, 3, 3);
    draw_footprint();
    const Picture p = read(s);  // the parameters set last hold for all
    EXPECT_EQ(p.at(192, 192).r, 32);
    EXPECT_EQ(p.at(1, 1).r, 128);
}

TEST_F(NamedBehaviours, DrawThenUseAsBlitSource) {
    const Surface s = foveated(), to = surface(256, 256);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    clear(0, 0, 0);
    draw_scene();
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.framebuffer);
    glBlitFramebuffer(0, 0, 256, 256, 0, 0, 256, 256, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_EQ(read(s), read(to));
    expect_foveated_scene(s);
}

TEST_F(NamedBehaviours, DrawThenUseAsBlitTarget) {
    const Surface s = foveated(), from = surface(256, 256);
    clear(0, 1, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    clear(1, 0, 0);
    draw_scene();
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer);
    glBlitFramebuffer(0, 0, 256, 256, 0, 0, 128, 256, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    const Picture p = read(s);
    EXPECT_EQ(p.at(3, 3), kGreen);
    EXPECT_EQ(p.at(127, 200), kGreen);
    EXPECT_FALSE(p.at(200, 200) == kGreen);
    // Drawing goes on over what was blitted.
    draw_triangle(-1, -1, 0.5f, 0, {0, 0, 1, 1});
    const Picture q = read(s);
    EXPECT_EQ(q.at(2, 2), kBlue);
    EXPECT_EQ(q.at(100, 200), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(NamedBehaviours, OneTextureInTwoConfiguredFramebuffers) {
    const Surface first = foveated();
    Surface second = first;
    glGenFramebuffers(1, &second.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, second.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, first.color, 0);
    foveate(second);
    focus(second, 0.5f, 0.5f, 8);
    for (int i = 0; i < 3; ++i) {
        glBindFramebuffer(GL_FRAMEBUFFER, first.framebuffer);
        clear(1, 0, 0);
        glBindFramebuffer(GL_FRAMEBUFFER, second.framebuffer);
        draw_triangle(-1, -1, 1, 0, {0, 1, 0, 1});
        glBindFramebuffer(GL_FRAMEBUFFER, first.framebuffer);
        draw_triangle(0.5f, -1, 1, 0, {0, 0, 1, 1});
        const Picture p = read(first);
        EXPECT_EQ(p.at(1, 1), kGreen) << i;
        EXPECT_EQ(p.at(200, 1), kBlue) << i;
        EXPECT_EQ(p.at(254, 254), kRed) << i;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(NamedBehaviours, DestroyTheFramebufferWhileWorkIsPending) {
    const Surface s = foveated();
    clear(1, 0, 0);
    draw_triangle(-1, -1, 1, 0, {0, 1, 0, 1});
    glDeleteFramebuffers(1, &s.framebuffer);
    Surface again = s;
    glGenFramebuffers(1, &again.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, again.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    const Picture p = read(again);
    EXPECT_EQ(p.at(1, 1), kGreen);
    EXPECT_EQ(p.at(254, 254), kRed);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(NamedBehaviours, DrawToMultisampledRenderbuffers) {
    Surface s{.framebuffer = 0, .color = 0, .depth = 0, .width = 256, .height = 256};
    GLuint buffers[2];
    glGenRenderbuffers(2, buffers);
    glGenFramebuffers(1, &s.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[0]);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, GL_RGBA8, 256, 256);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[1]);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, GL_DEPTH24_STENCIL8, 256, 256);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, buffers[1]);
    glViewport(0, 0, 256, 256);
    foveate(s);
    focus(s, 0, 0, 8);
    glEnable(GL_DEPTH_TEST);
    clear(1, 0, 0);
    draw_scene();
    const Surface resolved = surface(256, 256);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glBlitFramebuffer(0, 0, 256, 256, 0, 0, 256, 256, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_NO_ERROR);
    expect_foveated_scene(resolved);
}

TEST_F(NamedBehaviours, ThreeAttachmentsAreEqualAndFoveated) {
    const Surface s = surface(256, 256);
    GLuint more[2] = {texture(256, 256), texture(256, 256)};
    const GLenum all[3] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
    for (int i = 0; i < 2; ++i) glFramebufferTexture2D(GL_FRAMEBUFFER, all[i + 1], GL_TEXTURE_2D, more[i], 0);
    glDrawBuffers(3, all);
    const GLuint p = program(
        "#version 300 es\nout highp vec2 at; void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; at = p * 0.5 + 0.5; gl_Position = vec4(p, 0, 1); }",
        "#version 300 es\nprecision highp float; in vec2 at; layout(location = 0) out vec4 a; layout(location = 1) out vec4 b; layout(location = 2) out vec4 c;\n"
        "void main() { vec2 k = floor(at * 64.0); a = vec4(fract(sin(dot(k, vec2(12.9898, 78.233))) * 43758.5453), at, 1); b = a; c = a; }");
    glUseProgram(p);
    clear(0, 0, 0);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const Picture full = read(s);
    foveate(s);
    focus(s, 0, 0, 8);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    clear(0, 0, 0);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    Picture got[3];
    for (int i = 0; i < 3; ++i) {
        glReadBuffer(all[i]);
        got[i] = read(s);
    }
    EXPECT_EQ(got[0], got[1]);
    EXPECT_EQ(got[0], got[2]);
    EXPECT_NE(got[0], full);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(NamedBehaviours, FoveatedTextureDraw) {
    const Surface s = surface(256, 256);
    GLint features = 0, points = 0;
    glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM, &features);
    glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM, &points);
    EXPECT_TRUE(features & GL_FOVEATION_ENABLE_BIT_QCOM);
    EXPECT_GE(points, 1);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    clear(0, 0, 0);
    draw_scene();
    expect_foveated_scene(s);
}

TEST_F(NamedBehaviours, MultisampledTextureDrawThenUseAsBlitSource) {
    Surface s{.framebuffer = 0, .color = 0, .depth = 0, .width = 256, .height = 256};
    glGenTextures(1, &s.color);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, s.color);
    glTexStorage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, 4, GL_RGBA8, 256, 256, GL_TRUE);
    glTexParameteri(GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
    EXPECT_GL(GL_NO_ERROR);
    glGenFramebuffers(1, &s.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D_MULTISAMPLE, s.color, 0);
    glViewport(0, 0, 256, 256);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    clear(0, 0, 0);
    draw_scene();
    const Surface to = surface(256, 256);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glBlitFramebuffer(0, 0, 256, 256, 0, 0, 256, 256, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_NO_ERROR);
    expect_foveated_scene(to);
}

TEST_F(NamedBehaviours, NegativeCases) {
    const Surface s = surface(256, 256);
    GLuint provided = 0;
    ext.parameters(s.framebuffer, 0, 0, 0, 0, 8, 8, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    ext.config(s.framebuffer, UINT_MAX, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(s.framebuffer, 1, UINT_MAX, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    foveate(s);
    ext.config(s.framebuffer, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_INVALID_OPERATION);  // elsewhere: INVALID_VALUE; the text says INVALID_OPERATION
    const GLuint other = texture(256, 256);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, other, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_OPERATION);
    draw_scene();
    EXPECT_GL(GL_INVALID_OPERATION);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM);
    EXPECT_GL(GL_INVALID_ENUM);
    ext.texture_parameters(other, 0, 0, 0, 0, 8, 8, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(NamedBehaviours, FoveatedTextureSeenByASecondContext) {
    const Surface s = surface(256, 256);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
    glFinish();
    const EGLContext other = make_context(context);
    use(other);
    Surface theirs = s;
    glGenFramebuffers(1, &theirs.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, theirs.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    glViewport(0, 0, 256, 256);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    // The programs of the fixture belong to the first context, and are shared.
    const GLuint p = program("#version 300 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                             "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(dFdx(gl_FragCoord.x), 0, 1, 1); }");
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_EQ(read(theirs).at(1, 1).b, 255);
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
