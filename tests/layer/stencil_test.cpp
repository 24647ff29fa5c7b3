// The program's own stencil values in a foveated target, whose stencil buffer at each level the layer shares.
#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class Stencil : public LayerTest {
protected:
    static constexpr Rgba kRed{255, 0, 0, 255}, kGreen{0, 255, 0, 255}, kBlue{0, 0, 255, 255};
    static constexpr int kSize = 256;

    // Depth and stencil, or stencil alone.
    Surface foveated(bool depth) {
        Surface s = surface(kSize, kSize, depth);
        if (!depth) {
            glGenRenderbuffers(1, &s.depth);
            glBindRenderbuffer(GL_RENDERBUFFER, s.depth);
            glRenderbufferStorage(GL_RENDERBUFFER, GL_STENCIL_INDEX8, kSize, kSize);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_STENCIL_ATTACHMENT, GL_RENDERBUFFER, s.depth);
        }
        glClearStencil(0x55);
        glClear(GL_STENCIL_BUFFER_BIT);  // the program's own buffer: nothing of it may be seen later
        glFinish();
        foveate(s);
        focus(s, 0, 0, 16);
        glClearColor(1, 0, 0, 1);
        return s;
    }
    void write_stencil(float x, float y, float size, GLint value) {
        glEnable(GL_STENCIL_TEST);
        glStencilFunc(GL_ALWAYS, value, 0xff);
        glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        draw_triangle(x, y, size, 0, {1, 1, 1, 1});
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    }
    void draw_where(GLenum func, GLint value) {
        glStencilFunc(func, value, 0xff);
        glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    }
    // A program whose draws cannot be made more than once: the frame goes on at full density.
    GLuint counting() {
        GLuint buffer = 0;
        const GLuint zero = 0;
        glGenBuffers(1, &buffer);
        glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, buffer);
        glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
        return program("#version 310 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                       "#version 310 es\nprecision highp float; layout(binding = 0) uniform atomic_uint n; out vec4 c; void main() { atomicCounterIncrement(n); c = vec4(0, 1, 0, 1); }");
    }
};

TEST_F(Stencil, ValuesOfAllBitsSurviveTheWayBackToFullDensity) {
    const GLuint p = counting();
    for (const bool depth : {true, false}) {
        const Surface s = foveated(depth);
        glClearStencil(0x12);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
        write_stencil(-1, -1, 2, 0xa5);
        glFlush();
        draw_where(GL_EQUAL, 0xa5);
        glUseProgram(p);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        draw_where(GL_EQUAL, 0x12);
        draw_triangle(-1, -1, 4, 0, {0, 0, 1, 1});
        const Picture picture = read(s);
        EXPECT_EQ(picture.at(3, 3), kGreen) << depth;
        EXPECT_EQ(picture.at(120, 120), kGreen) << depth;
        EXPECT_EQ(picture.at(250, 250), kBlue) << depth;
        EXPECT_EQ(picture.at(140, 140), kBlue) << depth;
        EXPECT_GL(GL_NO_ERROR);
        glDisable(GL_STENCIL_TEST);
    }
}

TEST_F(Stencil, TheTopBitOfAClearIsThereWhenStencilIsUsedLater) {
    const GLuint p = counting();
    for (const bool native : {false, true}) {
        const Surface s = foveated(true);
        glClearStencil(0x81);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
        draw_triangle(-1, -1, 1, 0, {0, 0, 1, 1});  // stencil is not used yet: the layer has the bit
        glFlush();
        glEnable(GL_STENCIL_TEST);
        draw_where(GL_EQUAL, 0x81);
        if (native) {
            glUseProgram(p);
            glDrawArrays(GL_TRIANGLES, 0, 3);
        } else {
            draw_triangle(-1, -1, 4, 0, {0, 1, 0, 1});
        }
        for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kGreen) << native;
        glDisable(GL_STENCIL_TEST);
    }
}

}  // namespace fovea::layer_test
