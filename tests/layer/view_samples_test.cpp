// GL_OVR_multiview_multisampled_render_to_texture: views with several samples per pixel, resolved into the layers of an array.
// What a view must hold is what the driver draws with as many samples into a renderbuffer and resolves itself.
#include "tests/layer/layer_test.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace fovea::layer_test {

class ViewSamples : public LayerTest {
protected:
    using AttachSamples = void(GL_APIENTRYP)(GLenum, GLenum, GLuint, GLint, GLsizei, GLint, GLsizei);
    static constexpr int kViews = 4, kSize = 64, kSamples = 4;
    static constexpr GLenum kSamplesOfTexture = GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_SAMPLES_EXT;
    // A triangle that leans further in each view, and one behind it that cuts through.
#define FOVEA_BODY \
    "layout(location = 0) in vec3 p; uniform float turn; uniform mat2 rotations[4]; out vec4 v;\n" \
    "void main() { v = vec4(float(VIEW + 1u) * 0.2, p.z * 0.5 + 0.5, 1.0 - turn, 1); gl_Position = vec4(rotations[VIEW] * p.xy, p.z, 1); }"
    static constexpr const char* kViewsVertex = "#version 310 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 4) in;\n#define VIEW gl_ViewID_OVR\n" FOVEA_BODY;
    static constexpr const char* kOneVertex = "#version 310 es\nuniform highp uint VIEW;\n" FOVEA_BODY;
#undef FOVEA_BODY
    static constexpr const char* kFragment = "#version 310 es\nprecision highp float; in vec4 v; out vec4 c; void main() { c = v; }";
    static constexpr float kTriangles[18] = {-0.8f, -0.7f, -0.6f, 0.9f, -0.3f, 0.6f, 0, 0.8f, 0, -0.9f, 0.5f, 0.6f, 0.7f, 0.6f, -0.6f, 0.1f, -0.9f, 0};

    void SetUp() override {
        LayerTest::SetUp();
        attach = reinterpret_cast<AttachSamples>(eglGetProcAddress("glFramebufferTextureMultisampleMultiviewOVR"));
        ASSERT_TRUE(attach);
        views_program = program(kViewsVertex, kFragment);
        one_program = program(kOneVertex, kFragment);
        glEnableVertexAttribArray(0);
        glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, kTriangles);
        glEnable(GL_DEPTH_TEST);
        glViewport(0, 0, kSize, kSize);
        glClearColor(0, 0, 0, 1);
    }
    GLuint make_array(GLenum format, int size = kSize) {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(GL_TEXTURE_2D_ARRAY, t);
        glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format, size, size, kViews);
        return t;
    }
    void make_views(int size = kSize) {
        color = make_array(GL_RGBA8, size);
        depth = make_array(GL_DEPTH_COMPONENT24, size);
        glGenFramebuffers(1, &framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 0, kViews);
        attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, kSamples, 0, kViews);
        ASSERT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    }
    static void draw(GLuint drawing, float turn) {
        float rotations[kViews][4];
        for (int view = 0; view < kViews; ++view) {
            const float a = 0.3f + turn + static_cast<float>(view) * 0.7f, c = std::cos(a), n = std::sin(a);
            const float matrix[4] = {c, n, -n, c};
            std::copy(matrix, matrix + 4, rotations[view]);
        }
        glUseProgram(drawing);
        glUniform1f(glGetUniformLocation(drawing, "turn"), turn);
        glUniformMatrix2fv(glGetUniformLocation(drawing, "rotations"), kViews, GL_FALSE, rotations[0]);
        glDrawArrays(GL_TRIANGLES, 0, 6);
    }
    void draw_views(float turn) { draw(views_program, turn); }
    Picture read_layer(GLuint array, int view, int size = kSize) {
        Surface s{.framebuffer = 0, .color = array, .depth = 0, .width = size, .height = size};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
        glFramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, view);
        Picture p = read(s);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
        glDeleteFramebuffers(1, &s.framebuffer);
        return p;
    }
    // The driver's own samples and resolve.
    Picture reference(int view, std::initializer_list<float> turns) {
        GLuint names[2], buffers[2];
        glGenFramebuffers(2, names);
        glGenRenderbuffers(2, buffers);
        glBindFramebuffer(GL_FRAMEBUFFER, names[0]);
        for (int i = 0; i < 2; ++i) {
            glBindRenderbuffer(GL_RENDERBUFFER, buffers[i]);
            glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, i == 0 ? GL_RGBA8 : GL_DEPTH_COMPONENT24, kSize, kSize);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, i == 0 ? GL_COLOR_ATTACHMENT0 : GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[i]);
        }
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glUseProgram(one_program);
        glUniform1ui(glGetUniformLocation(one_program, "VIEW"), static_cast<GLuint>(view));
        for (const float turn : turns) draw(one_program, turn);
        const Surface s{.framebuffer = names[1], .color = texture(kSize, kSize), .depth = 0, .width = kSize, .height = kSize};
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, names[1]);
        glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
        glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
        return read(s);
    }
    // How many pixels of an edge between black and colour are a mixture.
    static long mixed(const Picture& p) {
        return std::count_if(p.pixels.begin(), p.pixels.end(), [](const Rgba& c) { return c.b > 0 && c.b < 255; });
    }
    static GLint value(GLenum point, GLenum name) {
        GLint v = -1;
        glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, point, name, &v);
        return v;
    }

    AttachSamples attach = nullptr;
    GLuint views_program = 0, one_program = 0, framebuffer = 0, color = 0, depth = 0;
};

TEST_F(ViewSamples, TheExtensionIsListed) {
    const std::string all = reinterpret_cast<const char*>(glGetString(GL_EXTENSIONS));
    EXPECT_NE(all.find("GL_OVR_multiview_multisampled_render_to_texture"), std::string::npos);
}

TEST_F(ViewSamples, EveryViewIsResolvedAsTheDriverResolves) {
    make_views();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_views(0);
    glFlush();
    for (int view = 0; view < kViews; ++view) {
        const Picture seen = read_layer(color, view);
        EXPECT_GT(mixed(seen), 40) << view;
        EXPECT_TRUE(seen == reference(view, {0})) << view;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, SamplesGoOnAfterAFlush) {
    make_views();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_views(0);
    glFlush();
    draw_views(0.5f);
    for (int view = 0; view < kViews; ++view) EXPECT_TRUE(read_layer(color, view) == reference(view, {0, 0.5f})) << view;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    draw_views(0.25f);
    for (int view = 0; view < kViews; ++view) EXPECT_TRUE(read_layer(color, view) == reference(view, {0, 0.5f, 0.25f})) << view;
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, WhatElseIsWrittenIntoTheArrayIsDrawnOnto) {
    make_views();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_views(0);
    const std::vector<Rgba> green(kSize * kSize, Rgba{0, 255, 0, 255});
    glBindTexture(GL_TEXTURE_2D_ARRAY, color);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 2, kSize, kSize, 1, GL_RGBA, GL_UNSIGNED_BYTE, green.data());
    glScissor(0, 0, kSize / 2, kSize);
    glEnable(GL_SCISSOR_TEST);
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    glFlush();
    for (int view = 0; view < kViews; ++view) EXPECT_EQ(read_layer(color, view).at(4, 4), (Rgba{0, 0, 255, 255})) << view;
    EXPECT_EQ(read_layer(color, 2).at(kSize - 4, 4), (Rgba{0, 255, 0, 255}));
    EXPECT_EQ(read_layer(color, 1).at(kSize - 2, 2), (Rgba{0, 0, 0, 255}));
    // Another framebuffer draws into a layer.
    GLuint other = 0;
    glGenFramebuffers(1, &other);
    glBindFramebuffer(GL_FRAMEBUFFER, other);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 3);
    glClearColor(1, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glEnable(GL_SCISSOR_TEST);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    EXPECT_EQ(read_layer(color, 3).at(kSize - 4, 4), (Rgba{255, 0, 0, 255}));
    EXPECT_EQ(read_layer(color, 2).at(kSize - 4, 4), (Rgba{0, 255, 0, 255}));
    EXPECT_EQ(read_layer(color, 2).at(4, 4), (Rgba{255, 0, 0, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, DepthIsResolvedToo) {
    make_views();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, kSize / 2, kSize);
    glClearDepthf(0.25f);
    glClear(GL_DEPTH_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    glClearDepthf(1);
    glFlush();
    // A framebuffer of one layer tests against it.
    const GLuint drawn = texture(kSize, kSize);
    GLuint other = 0;
    glGenFramebuffers(1, &other);
    glBindFramebuffer(GL_FRAMEBUFFER, other);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, drawn, 0);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 3);
    glClear(GL_COLOR_BUFFER_BIT);
    glUseProgram(program(kCoverVertex, "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }"));
    glDrawArrays(GL_TRIANGLES, 0, 3);  // depth 0.5
    const Picture p = read({.framebuffer = other, .color = drawn, .depth = 0, .width = kSize, .height = kSize});
    EXPECT_EQ(p.at(4, 4), (Rgba{0, 0, 0, 255}));
    EXPECT_EQ(p.at(kSize - 4, 4), (Rgba{255, 255, 255, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, StencilThatAnotherFramebufferWroteIsTestedAgainst) {
    const GLuint cover = program("#version 310 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 4) in;\n"
                                 "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                                 "#version 310 es\nprecision highp float; uniform vec4 color; out vec4 c; void main() { c = color; }");
    color = make_array(GL_RGBA8);
    depth = make_array(GL_DEPTH24_STENCIL8);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 0, kViews);
    attach(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, depth, 0, kSamples, 0, kViews);
    ASSERT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glClearStencil(0x5c);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    glFlush();
    GLuint other = 0;
    glGenFramebuffers(1, &other);
    glBindFramebuffer(GL_FRAMEBUFFER, other);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, depth, 0, 2);
    glScissor(0, 0, kSize / 2, kSize);
    glEnable(GL_SCISSOR_TEST);
    glClearStencil(0xa6);
    glClear(GL_STENCIL_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glDisableVertexAttribArray(0);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_STENCIL_TEST);
    glUseProgram(cover);
    for (const bool written : {true, false}) {
        glStencilFunc(GL_EQUAL, written ? 0xa6 : 0x5c, 0xff);
        glUniform4f(glGetUniformLocation(cover, "color"), written, !written, 0, 1);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    glFlush();
    for (int view = 0; view < kViews; ++view) {
        const Picture p = read_layer(color, view);
        EXPECT_EQ(p.at(4, 4), view == 2 ? (Rgba{255, 0, 0, 255}) : (Rgba{0, 255, 0, 255})) << view;
        EXPECT_EQ(p.at(kSize - 4, 4), (Rgba{0, 255, 0, 255})) << view;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, TheAttachmentIsTheProgramsTexture) {
    make_views();
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE), GL_TEXTURE);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME), static_cast<GLint>(color));
    EXPECT_EQ(value(GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME), static_cast<GLint>(depth));
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL), 0);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER), 0);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR), kViews);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE), 8);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, kSamplesOfTexture), kSamples);
    GLint samples = 0;
    glGetIntegerv(GL_SAMPLES, &samples);
    EXPECT_EQ(samples, kSamples);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, 0, kViews);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, kSamplesOfTexture), 0);
    // Attachments of different numbers of samples.
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_MULTISAMPLE));
    attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 0, 0, kViews);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glGetIntegerv(GL_SAMPLES, &samples);
    EXPECT_EQ(samples, 0);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 1000, 0, kViews);
    EXPECT_GL(GL_INVALID_VALUE);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 2, kViews);  // layers that the texture has not
    attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, kSamples, 0, kViews);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT));
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 0, kViews);
    glDeleteTextures(1, &color);
    EXPECT_EQ(value(GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE), GL_NONE);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, ImagesThatAreGivenAnewAreMatched) {
    glGenTextures(1, &color);
    glBindTexture(GL_TEXTURE_2D_ARRAY, color);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 0, kViews);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT));
    glDisable(GL_DEPTH_TEST);
    for (const int size : {kSize / 2, kSize}) {
        glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, size, size, kViews, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
        EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
        glViewport(0, 0, size, size);
        glClear(GL_COLOR_BUFFER_BIT);
        draw_views(0);
        EXPECT_GT(mixed(read_layer(color, 3, size)), size / 2);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, OneViewCanBeRead) {
    color = make_array(GL_RGBA8);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, kSamples, 2, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_DEPTH_TEST);
    glUseProgram(one_program);
    glUniform1ui(glGetUniformLocation(one_program, "VIEW"), 1);
    draw(one_program, 0);
    const Picture here = read({.framebuffer = framebuffer, .color = color, .depth = 0, .width = kSize, .height = kSize});
    EXPECT_GT(mixed(here), 40);
    EXPECT_TRUE(here == read_layer(color, 2));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, FoveatedViewsHaveSamplesAtEveryLevel) {
    make_views(512);
    GLuint provided = 0;
    ext.config(framebuffer, kViews, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    ASSERT_TRUE(provided & GL_FOVEATION_ENABLE_BIT_QCOM);
    glViewport(0, 0, 512, 512);
    std::vector<Picture> foveated;
    for (const float gain : {8.0f, 0.0f}) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        for (GLuint view = 0; view < kViews; ++view) ext.parameters(framebuffer, view, 0, view & 1 ? 0.75f : -0.75f, 0, gain, gain, 0);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_views(0);
        glFlush();
        for (int view = 0; view < kViews; ++view) {
            const Picture p = read_layer(color, view, 512);
            EXPECT_GT(mixed(p), 300) << view << " gain " << gain;
            if (gain > 0) foveated.push_back(p);
            else EXPECT_FALSE(p == foveated[static_cast<std::size_t>(view)]) << "was at full density already";
        }
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, CountAgainstTheMemoryOfLevels) {
    setenv("FOVEA_LAYER_MEMORY_MIB", "36", 1);
    const EGLContext small = make_context();
    use(small);  // contexts read it when they are first used
    unsetenv("FOVEA_LAYER_MEMORY_MIB");
    const Surface large = surface(1024, 1024);
    make_views(512);  // colour and depth of four views with four samples: 32 MiB
    GLuint provided = 0;
    ext.config(large.framebuffer, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_OUT_OF_MEMORY);
    glDeleteFramebuffers(1, &framebuffer);
    ext.config(large.framebuffer, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(ViewSamples, LeaveNothingInTheShareGroup) {
    const auto renderbuffers = [] {
        int n = 0;
        for (GLuint name = 1; name < 256; ++name) n += glIsRenderbuffer(name) == GL_TRUE;
        return n;
    };
    const EGLContext whole = make_context();
    use(whole);
    const int before = renderbuffers();
    for (const int how : {0, 1, 2, 3, 4}) {
        const EGLContext gone = make_context(whole);
        use(gone);
        make_views();
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glFlush();
        use(whole);
        EXPECT_GE(renderbuffers(), before + 2 * kViews);
        use(gone);
        if (how == 0) glDeleteFramebuffers(1, &framebuffer);
        if (how == 1) attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, 0, 0, 0, 0, 0), attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, 0, 0, 0, 0, 0);
        if (how == 2) glDeleteTextures(1, &color), glDeleteTextures(1, &depth);
        if (how == 3) {
            const GLuint other = make_array(GL_RGBA8);
            glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, other, 0, 0);
            glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, 0, 0);
            EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
        }
        EXPECT_GL(GL_NO_ERROR);
        if (how < 4) {
            EXPECT_EQ(renderbuffers(), before) << how;
        }
        contexts.pop_back();
        use(whole);
        ASSERT_TRUE(eglDestroyContext(display, gone));
        use(whole);
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        use(whole);
        EXPECT_EQ(renderbuffers(), before) << how;
    }
}

// Random sequences against the driver's own samples, one framebuffer per view, put into the layers of another array by hand.
class RandomViewSamples : public ViewSamples {
protected:
    struct Plain {
        std::array<GLuint, kViews> framebuffers{};
        GLuint array = 0, reader = 0;
    };
    Plain make_plain() {
        Plain p;
        p.array = make_array(GL_RGBA8);
        glGenFramebuffers(kViews, p.framebuffers.data());
        glGenFramebuffers(1, &p.reader);
        for (const GLuint name : p.framebuffers) {
            GLuint buffers[2];
            glGenRenderbuffers(2, buffers);
            glBindFramebuffer(GL_FRAMEBUFFER, name);
            for (int i = 0; i < 2; ++i) {
                glBindRenderbuffer(GL_RENDERBUFFER, buffers[i]);
                glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, i == 0 ? GL_RGBA8 : GL_DEPTH_COMPONENT24, kSize, kSize);
                glFramebufferRenderbuffer(GL_FRAMEBUFFER, i == 0 ? GL_COLOR_ATTACHMENT0 : GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[i]);
            }
        }
        return p;
    }
    void resolve(const Plain& p, int view) {
        const GLboolean scissor = glIsEnabled(GL_SCISSOR_TEST);
        glDisable(GL_SCISSOR_TEST);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, p.framebuffers[static_cast<std::size_t>(view)]);
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, p.reader);
        glFramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, p.array, 0, view);
        glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
        if (scissor) glEnable(GL_SCISSOR_TEST);
    }
    // Every sample of a pixel becomes what the layer holds.
    void load(const Plain& p, int view) {
        glBindFramebuffer(GL_FRAMEBUFFER, p.framebuffers[static_cast<std::size_t>(view)]);
        for (const GLenum cap : {GL_DEPTH_TEST, GL_BLEND, GL_SCISSOR_TEST}) glDisable(cap);
        glUseProgram(loader);
        glBindTexture(GL_TEXTURE_2D_ARRAY, p.array);
        glUniform1i(glGetUniformLocation(loader, "view"), view);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    GLuint loader = 0;
};

TEST_F(RandomViewSamples, AreThePlainDrivers) {
    loader = program(kCoverVertex, "#version 300 es\nprecision highp float; precision highp sampler2DArray; uniform sampler2DArray views; uniform int view; out vec4 c;\n"
                                   "void main() { c = texelFetch(views, ivec3(gl_FragCoord.xy, view), 0); }");
    const char* many = std::getenv("FOVEA_LAYER_SEEDS");
    const char* from = std::getenv("FOVEA_LAYER_FIRST_SEED");
    const unsigned first = from ? static_cast<unsigned>(std::atoi(from)) : 1, count = many ? static_cast<unsigned>(std::atoi(many)) : 6;
    for (unsigned seed = first; seed < first + count; ++seed) {
        std::mt19937 random(seed);
        const auto pick = [&random](unsigned n) { return static_cast<int>(random() % n); };
        make_views();
        const Plain plain = make_plain();
        bool written = false, blend = false, scissor = false;  // written: the arrays, by other means
        const auto state = [&](bool on) {
            glEnable(GL_DEPTH_TEST);
            blend && on ? glEnable(GL_BLEND) : glDisable(GL_BLEND);
            scissor && on ? glEnable(GL_SCISSOR_TEST) : glDisable(GL_SCISSOR_TEST);
        };
        glBlendFunc(GL_ONE, GL_ONE);
        const auto on_both = [&](GLbitfield clears, float turn, bool draws) {
            state(true);
            glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
            if (clears) glClear(clears);
            if (draws) draw_views(turn);
            for (int view = 0; view < kViews; ++view) {
                if (written && !((clears & GL_COLOR_BUFFER_BIT) && !scissor)) load(plain, view);
                state(true);
                glBindFramebuffer(GL_FRAMEBUFFER, plain.framebuffers[static_cast<std::size_t>(view)]);
                if (clears) glClear(clears);
                glUseProgram(one_program);
                glUniform1ui(glGetUniformLocation(one_program, "VIEW"), static_cast<GLuint>(view));
                if (draws) draw(one_program, turn);
            }
            written = false;
        };
        on_both(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, 0, true);
        for (int step = 0; step < 24; ++step) {
            const float turn = static_cast<float>(pick(100)) / 100;
            const int kind = pick(9), view = pick(kViews), x = pick(kSize - 8), y = pick(kSize - 8);
            glClearColor(static_cast<float>(pick(16)) / 15, static_cast<float>(pick(16)) / 15, static_cast<float>(pick(16)) / 15, 1);
            switch (kind) {
                case 0: on_both(GL_COLOR_BUFFER_BIT, turn, pick(2) == 0); break;
                case 1: on_both(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, turn, pick(2) == 0); break;
                case 2: on_both(GL_DEPTH_BUFFER_BIT, turn, pick(2) == 0); break;
                case 3: case 4: on_both(0, turn, true); break;
                case 5: pick(2) ? glFlush() : glFinish(); break;
                case 6: blend = pick(2) == 0; break;
                case 7:
                    scissor = pick(2) == 0;
                    glScissor(x, y, 20, 30);
                    break;
                default: {  // an upload, or another framebuffer's clear
                    const bool upload = pick(2) == 0;
                    const std::vector<Rgba> pixels(64, Rgba{static_cast<std::uint8_t>(pick(256)), 7, 9, 255});
                    for (int v = 0; !written && v < kViews; ++v) resolve(plain, v);
                    state(false);
                    for (const GLuint array : {color, plain.array}) {
                        if (upload) {
                            glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
                            glBindTexture(GL_TEXTURE_2D_ARRAY, array);
                            glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, x, y, view, 8, 8, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
                        } else {
                            glBindFramebuffer(GL_FRAMEBUFFER, plain.reader);
                            glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, view);
                            glEnable(GL_SCISSOR_TEST);
                            glScissor(x, y, 11, 13);
                            glClear(GL_COLOR_BUFFER_BIT);
                            glDisable(GL_SCISSOR_TEST);
                        }
                    }
                    written = true;
                    break;
                }
            }
        }
        glDisable(GL_SCISSOR_TEST);
        for (int view = 0; view < kViews; ++view) {
            if (!written) resolve(plain, view);
            ASSERT_TRUE(read_layer(color, view) == read_layer(plain.array, view)) << "seed " << seed << " view " << view;
        }
        EXPECT_GL(GL_NO_ERROR);
    }
}

}  // namespace fovea::layer_test
