// Several contexts: what the layer leaves behind when one goes.
#include <thread>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class Contexts : public LayerTest {};

TEST_F(Contexts, OneThatIsDestroyedLeavesNothingInItsShareGroup) {
    const auto textures = [] {
        int n = 0;
        for (GLuint name = 1; name < 512; ++name) n += glIsTexture(name) == GL_TRUE;
        return n;
    };
    const auto draw_in = [this](EGLContext c) {
        use(c);
        const Surface s = surface(64, 64);
        foveate(s);
        focus(s, 0, 0, 8);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        const GLuint p = program("#version 300 es\nvoid main() { gl_Position = vec4(0, 0, 0, 1); }", "#version 300 es\nvoid main() {}");
        glUseProgram(p);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glFinish();
        glUseProgram(0);
        glDeleteProgram(p);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glDeleteFramebuffers(1, &s.framebuffer);
        glDeleteTextures(1, &s.color);
        glDeleteRenderbuffers(1, &s.depth);
    };
    const EGLContext whole = make_context();
    use(whole);
    const int before = textures();
    for (const bool current : {true, false}) {
        const EGLContext gone = make_context(whole);
        draw_in(gone);
        if (!current) use(whole);
        contexts.pop_back();
        ASSERT_TRUE(eglDestroyContext(display, gone));
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        use(whole);
        EXPECT_EQ(textures(), before) << (current ? "destroyed while current" : "destroyed while another was");
    }
}

TEST_F(Contexts, ARecordedFrameGoesOnInAnotherThreadWithItsDepth) {
    const Surface s = surface(128, 128);
    glClear(GL_DEPTH_BUFFER_BIT);  // the program's own depth: everything would be in front of it
    glFinish();
    foveate(s);
    focus(s, 0, 0, 16);
    glEnable(GL_DEPTH_TEST);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    std::thread thief([this] {
        // Current elsewhere: refused, and what is recorded there stays as it is.
        eglBindAPI(EGL_OPENGL_ES_API);
        EXPECT_FALSE(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context));
        EXPECT_EQ(eglGetError(), EGL_BAD_ACCESS);
        eglReleaseThread();
    });
    thief.join();
    focus(s, 0.5f, 0.5f, 16);  // still late
    use(EGL_NO_CONTEXT);
    std::thread heir([&, this] {
        eglBindAPI(EGL_OPENGL_ES_API);
        use(context);
        draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});  // behind
        eglReleaseThread();
    });
    heir.join();
    use(context);
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, (Rgba{0, 255, 0, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Contexts, AThreadThatEndsWithItsDestroyedContextCurrentDoesNoHarm) {
    const Surface s = surface(64, 64);
    std::thread thread([this] {
        eglBindAPI(EGL_OPENGL_ES_API);
        const EGLContext own = make_context(context);
        contexts.pop_back();
        use(own);
        const Surface mine = surface(64, 64);
        foveate(mine);
        focus(mine, 0, 0, 16);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        glFinish();
        glClear(GL_COLOR_BUFFER_BIT);
        draw_footprint();  // recorded for ever
        EXPECT_TRUE(eglDestroyContext(display, own));
    });
    thread.join();
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glClearColor(0, 1, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_EQ(read(s).at(5, 5), (Rgba{0, 255, 0, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Contexts, AnExtrapolatorOfADestroyedContextLeavesNothingInTheShareGroup) {
    const auto objects = [] {
        int n = 0;
        for (GLuint name = 1; name < 512; ++name) n += (glIsTexture(name) == GL_TRUE) + (glIsProgram(name) == GL_TRUE) + (glIsSampler(name) == GL_TRUE);
        return n;
    };
    const EGLContext whole = make_context();
    use(whole);
    const GLuint pictures[3] = {texture(32, 32), texture(32, 32), texture(32, 32)};
    const int before = objects();
    const EGLContext gone = make_context(whole);
    use(gone);
    ext.extrapolate(pictures[0], pictures[1], pictures[2], 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_GT(objects(), before);
    use(whole);
    contexts.pop_back();
    ASSERT_TRUE(eglDestroyContext(display, gone));  // not current
    use(EGL_NO_CONTEXT);
    use(whole);
    EXPECT_EQ(objects(), before);
    ext.extrapolate(pictures[0], pictures[1], pictures[2], 0.5f);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Contexts, TwoOfAShareGroupRecordIntoTheirOwnFramebuffersAtOnce) {
    const GLuint images[2] = {texture(128, 128), texture(128, 128)};
    const EGLContext second = make_context(context);
    use(EGL_NO_CONTEXT);
    const auto draw = [&](EGLContext c, GLuint image, bool red) {
        eglBindAPI(EGL_OPENGL_ES_API);
        use(c);
        Surface s{.framebuffer = 0, .color = image, .depth = 0, .width = 128, .height = 128};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, image, 0);
        glViewport(0, 0, 128, 128);
        foveate(s);
        const GLuint p = program("#version 300 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                                 "#version 300 es\nprecision highp float; uniform vec4 tint; out vec4 c; void main() { c = tint; }");
        for (int frame = 0; frame < 20; ++frame) {
            focus(s, static_cast<float>(frame) * 0.1f - 1, 0, 16);
            glClear(GL_COLOR_BUFFER_BIT);
            glUseProgram(p);
            glUniform4f(glGetUniformLocation(p, "tint"), red, !red, 0, 1);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            glFlush();
        }
        for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, (Rgba{static_cast<std::uint8_t>(red ? 255 : 0), static_cast<std::uint8_t>(red ? 0 : 255), 0, 255}));
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
        eglReleaseThread();
    };
    std::thread a([&] { draw(context, images[0], true); }), b([&] { draw(second, images[1], false); });
    a.join();
    b.join();
    use(context);
}

}  // namespace fovea::layer_test
