// Several contexts: what the layer leaves behind when one goes.
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

}  // namespace fovea::layer_test
