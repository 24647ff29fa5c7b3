// The program's own stencil values in a foveated target, whose stencil buffer at each level the layer shares.
#include <cstdlib>

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

// Every comparison and operation, with masks that leave the layer the top bit and with masks that do not, on either face.
TEST_F(Stencil, EveryTestAndOperationGivesThePlainDriversPixelsAtEveryLevel) {
    static constexpr GLenum kOps[] = {GL_KEEP, GL_ZERO, GL_REPLACE, GL_INCR, GL_DECR, GL_INVERT, GL_INCR_WRAP, GL_DECR_WRAP};
    const Surface plain = surface(kSize, kSize), s = surface(kSize, kSize);
    foveate(s);
    focus(s, 0, 0, 16);
    std::vector<Picture> pictures[2];
    for (const Surface* to : {&plain, &s}) {
        glBindFramebuffer(GL_FRAMEBUFFER, to->framebuffer);
        for (const GLint first : {0, 0x7f, 0x80})
            for (GLenum op : kOps)
                for (const GLuint mask : {0xffu, 0x7fu, 0x0fu}) {
                    glClearStencil(first);
                    glStencilMask(0xff);
                    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
                    glEnable(GL_STENCIL_TEST);
                    glStencilMask(mask);
                    glStencilFuncSeparate(GL_FRONT_AND_BACK, GL_ALWAYS, 0x25, mask);
                    glStencilOpSeparate(GL_BACK, GL_ZERO, GL_ZERO, GL_INVERT);
                    glStencilOpSeparate(GL_FRONT, GL_KEEP, GL_KEEP, op);
                    draw_triangle(-1, -1, 2, 0, {0, 0, 0, 1});
                    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
                    // Each comparison in a strip of its own.
                    glEnable(GL_SCISSOR_TEST);
                    for (int i = 0; i < 8; ++i) {
                        glScissor(i * kSize / 8, 0, kSize / 8, kSize);
                        glStencilFunc(GL_NEVER + static_cast<GLenum>(i), 0x25, mask);
                        draw_triangle(-1, -1, 4, 0, {0, 1, static_cast<float>(i) / 8, 1});
                    }
                    glDisable(GL_SCISSOR_TEST);
                    glDisable(GL_STENCIL_TEST);
                    pictures[to == &s].push_back(read(*to));
                }
    }
    for (std::size_t k = 0; k < pictures[0].size(); ++k)
        for (const int y : {8, 120, 136, 248})
            for (int i = 0; i < 8; ++i) {
                const int x = i * kSize / 8 + kSize / 16;
                // Away from the edge of the triangle and of the strips, where levels round.
                if (std::abs(x + y - kSize) > 24) {
                    ASSERT_EQ(pictures[0][k].at(x, y), pictures[1][k].at(x, y)) << "case " << k << " comparison " << i << " y " << y;
                }
            }
    EXPECT_GL(GL_NO_ERROR);
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

// "The depth and/or stencil attachments should be discarded or invalidated after rendering" (texture_foveated, issue 5). Samples
// cannot be read by a draw: when the frame goes on at full density, depth and stencil hold what the pass was cleared to.
TEST_F(Stencil, OfMultisampledTargetsIsDiscardedToItsClear) {
    Surface s{.width = kSize, .height = kSize};
    GLuint colors = 0;
    glGenFramebuffers(1, &s.framebuffer);
    glGenRenderbuffers(1, &colors);
    glGenRenderbuffers(1, &s.depth);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glBindRenderbuffer(GL_RENDERBUFFER, colors);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, GL_RGBA8, kSize, kSize);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colors);
    glBindRenderbuffer(GL_RENDERBUFFER, s.depth);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, 4, GL_DEPTH24_STENCIL8, kSize, kSize);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, s.depth);
    const Surface plain = surface(kSize, kSize, false);
    const GLuint p = counting();
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glClearStencil(0x55);
    glClearDepthf(0);
    glClear(GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);  // the program's own buffer: nothing of it may be seen later
    glFinish();
    foveate(s);
    focus(s, 0, 0, 16);
    glClearColor(1, 0, 0, 1);
    glClearStencil(0x12);
    glClearDepthf(1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    write_stencil(-1, -1, 2, 0x25);
    glFlush();
    draw_where(GL_EQUAL, 0x12);
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    draw_where(GL_EQUAL, 0x55);
    draw_triangle(-1, -1, 4, -1, {0, 0, 1, 1});
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_DEPTH_TEST);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, plain.framebuffer);
    glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    for (const Rgba& pixel : read(plain).pixels) ASSERT_EQ(pixel, kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
