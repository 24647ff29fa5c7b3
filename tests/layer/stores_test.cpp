// Images of a pass that something else than its own draws writes: image stores of draws to another framebuffer, mipmaps.
#include "tests/layer/late_fixture.hpp"

namespace fovea::layer_test {

class Stores : public LateFixture {
protected:
    static constexpr int kSize = 256;
    // A level of a texture of several.
    static Surface on_level(GLuint color, GLint level, bool depth) {
        Surface s{.framebuffer = 0, .color = color, .depth = 0, .width = kSize, .height = kSize};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, level);
        if (depth) {
            glGenRenderbuffers(1, &s.depth);
            glBindRenderbuffer(GL_RENDERBUFFER, s.depth);
            glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, kSize, kSize);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, s.depth);
        }
        glViewport(0, 0, kSize, kSize);
        return s;
    }
    static GLuint mipmapped(int size, GLsizei levels) {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(GL_TEXTURE_2D, t);
        glTexStorage2D(GL_TEXTURE_2D, levels, GL_RGBA8, size, size);
        return t;
    }
    Picture level(GLuint color, GLint of) {
        const Surface s = on_level(color, of, false);
        return read(s);
    }
    GLuint storing() {
        return program("#version 310 es\nvoid main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                       "#version 310 es\nprecision highp float; layout(rgba8, binding = 1) writeonly uniform highp image2D image; out vec4 c;\n"
                       "void main() { imageStore(image, ivec2(gl_FragCoord.xy), vec4(0, 1, 0, 1)); c = vec4(1); }");
    }
    static bool fragments_store() {
        GLint images = 0;
        glGetIntegerv(GL_MAX_FRAGMENT_IMAGE_UNIFORMS, &images);
        return images > 0;
    }
};

TEST_F(Stores, WhatDrawsToAnotherFramebufferStoreStays) {
    if (!fragments_store()) GTEST_SKIP() << "the driver's fragment shaders have no images";
    const GLuint store = storing();
    for (const bool other_is_foveated : {false, true}) {
        const Surface other = other_is_foveated ? foveated() : surface(kSize, kSize), s = foveated();
        focus(s, 0, 0, 12);
        draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
        glBindFramebuffer(GL_FRAMEBUFFER, other.framebuffer);
        glUseProgram(store);
        glBindImageTexture(1, s.color, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT);
        glBindImageTexture(1, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
        glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
        draw_triangle(-0.2f, -0.2f, 0.6f, 0, {0, 0, 1, 1});
        const Picture p = read(s);
        EXPECT_EQ(p.at(3, 3), kGreen) << other_is_foveated;
        EXPECT_EQ(p.at(250, 250), kGreen) << other_is_foveated;
        EXPECT_EQ(p.at(128, 128), kBlue) << other_is_foveated;
        EXPECT_EQ(read(other).at(3, 3), (Rgba{255, 255, 255, 255})) << other_is_foveated;
        EXPECT_GL(GL_NO_ERROR);
    }
}

TEST_F(Stores, AMipmapOverTheImageOfAPassStays) {
    const GLuint color = mipmapped(2 * kSize, 2);
    const std::vector<Rgba> green(4 * kSize * kSize, kGreen);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 2 * kSize, 2 * kSize, GL_RGBA, GL_UNSIGNED_BYTE, green.data());
    const Surface s = on_level(color, 1, false);
    foveate(s);
    focus(s, 0, 0, 12);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
    glBindTexture(GL_TEXTURE_2D, color);
    glGenerateMipmap(GL_TEXTURE_2D);
    draw_triangle(-0.2f, -0.2f, 0.6f, 0, {0, 0, 1, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(3, 3), kGreen);
    EXPECT_EQ(p.at(250, 250), kGreen);
    EXPECT_EQ(p.at(128, 128), kBlue);
    EXPECT_GL(GL_NO_ERROR);
}

// The pass goes on with its depth when another level of its texture is written.
TEST_F(Stores, IntoOtherLevelsOfItsTextureDoNotEndAPass) {
    const GLuint store = link({{GL_COMPUTE_SHADER, "#version 310 es\nlayout(local_size_x = 8, local_size_y = 8) in; layout(rgba8, binding = 0) writeonly uniform highp image2D image;\n"
                                                  "void main() { imageStore(image, ivec2(gl_GlobalInvocationID.xy), vec4(0, 1, 0, 1)); }"}});
    for (const bool by_mipmap : {false, true}) {
        const GLuint color = mipmapped(kSize, 2);
        const Surface s = on_level(color, 0, true);
        foveate(s);
        focus(s, 0, 0, 12);
        glEnable(GL_DEPTH_TEST);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
        if (by_mipmap) {
            glBindTexture(GL_TEXTURE_2D, color);
            glGenerateMipmap(GL_TEXTURE_2D);
        } else {
            glUseProgram(store);
            glBindImageTexture(0, color, 1, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
            glDispatchCompute(16, 16, 1);
            glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT);
            glBindImageTexture(0, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
        }
        draw_triangle(-1, -1, 4, 0.5f, {0, 0, 1, 1});  // behind
        draw_triangle(-0.2f, -0.2f, 0.6f, -0.5f, {0, 1, 0, 1});
        const Picture p = read(s);
        EXPECT_EQ(p.at(3, 3), kRed) << by_mipmap;
        EXPECT_EQ(p.at(128, 128), kGreen) << by_mipmap;
        EXPECT_EQ(level(color, 1).at(3, 3), by_mipmap ? kRed : kGreen);
        EXPECT_GL(GL_NO_ERROR);
    }
}

}  // namespace fovea::layer_test
