// Framebuffers of several layers and several focal points per layer, and what happens when there is no memory for them.
#include <cstdlib>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class Layers : public LayerTest {
protected:
    static constexpr int kLayers = 16, kPoints = 8, kSize = 128;
    static constexpr std::array<float, 5> kLast{-0.5f, 0.4f, 16, 16, 0};

    GLuint make_array(GLenum format = GL_RGBA8) {
        GLuint array = 0;
        glGenTextures(1, &array);
        glBindTexture(GL_TEXTURE_2D_ARRAY, array);
        glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format, kSize, kSize, kLayers);
        return array;
    }
    Picture read_layer(GLuint array, int layer) {
        Surface s{.framebuffer = 0, .color = array, .depth = 0, .width = kSize, .height = kSize};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
        glFramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, layer);
        return read(s);
    }
    // Where each of the eight points is: seven in a far corner, the last one where the fovea is expected.
    static std::vector<std::array<float, 5>> eight_points() {
        std::vector<std::array<float, 5>> points(kPoints - 1, {0.9f, -0.9f, 30, 30, 0});
        points.push_back(kLast);
        return points;
    }
    static void expect_density(const Picture& p, const std::vector<std::array<float, 5>>& points) {
        int below = 0, saved = 0;
        for (int y = 0; y < p.height; ++y)
            for (int x = 0; x < p.width; ++x) {
                const double area = p.at(x, y).r * 8.0 / 255 * (p.at(x, y).g * 8.0 / 255);
                const double asked = spec_density(points, (x + 0.5) / p.width * 2 - 1, (y + 0.5) / p.height * 2 - 1);
                below += area <= 0 || 1 / area < asked * 0.98;
                saved += area > 3;
            }
        EXPECT_EQ(below, 0);
        EXPECT_GT(saved, p.width * p.height / 2);
        const auto at = [&p](float ndc) { return static_cast<int>((ndc + 1) * 0.5f * static_cast<float>(kSize)); };
        EXPECT_EQ(p.at(at(kLast[0]), at(kLast[1])).r, 32);  // one pixel per pixel
    }
};

TEST_F(Layers, TheEighthPointOfTheSixteenthViewDecidesItsPixels) {
    const auto attach = reinterpret_cast<PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC>(eglGetProcAddress("glFramebufferTextureMultiviewOVR"));
    ASSERT_TRUE(attach);
    const GLuint array = make_array();
    GLuint framebuffer = 0, provided = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 0, kLayers);
    ext.config(framebuffer, kLayers, kPoints, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    const GLuint p = program("#version 300 es\n#extension GL_OVR_multiview : require\nlayout(num_views = 16) in; out highp vec2 at;\n"
                             "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; at = p * 0.5 + 0.5; gl_Position = vec4(p, 0, 1); }",
                             "#version 300 es\nprecision highp float; in vec2 at; out vec4 c; void main() { c = vec4(dFdx(at.x) * 16.0, dFdy(at.y) * 16.0, 0, 1); }");
    glUseProgram(p);
    glViewport(0, 0, kSize, kSize);
    glClear(GL_COLOR_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const auto points = eight_points();
    for (GLuint i = 0; i < kPoints; ++i)
        ext.parameters(framebuffer, kLayers - 1, i, points[i][0], points[i][1], points[i][2], points[i][3], points[i][4]);
    glFlush();
    expect_density(read_layer(array, kLayers - 1), points);
    for (const Rgba& pixel : read_layer(array, kLayers - 2).pixels) ASSERT_EQ(pixel.r, 32);  // never set: full quality
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Layers, TheEighthPointOfTheSixteenthSliceDecidesItsPixels) {
    const GLuint array = make_array();
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
    const auto points = eight_points();
    for (GLuint i = 0; i < kPoints; ++i)
        ext.texture_parameters(array, kLayers - 1, i, points[i][0], points[i][1], points[i][2], points[i][3], points[i][4]);
    GLuint framebuffer = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, kSize, kSize);
    for (const int layer : {kLayers - 1, kLayers - 2}) {
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, layer);
        glClear(GL_COLOR_BUFFER_BIT);
        draw_footprint();
    }
    expect_density(read_layer(array, kLayers - 1), points);
    for (const Rgba& pixel : read_layer(array, kLayers - 2).pixels) ASSERT_EQ(pixel.r, 32);
    EXPECT_GL(GL_NO_ERROR);
}

// glFramebufferTexture attaches all layers: clears go to each, draws without a geometry shader to the first.
TEST_F(Layers, ALayeredFramebufferIsFoveatedByThePointsOfItsFirstLayer) {
    for (const bool textures : {false, true}) {
        const GLuint array = make_array(), depth = make_array(GL_DEPTH_COMPONENT24);
        GLuint framebuffer = 0, provided = 0;
        glBindTexture(GL_TEXTURE_2D_ARRAY, array);
        if (textures) glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
        glGenFramebuffers(1, &framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0);
        glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0);
        if (!textures) ext.config(framebuffer, kLayers, kPoints, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
        ASSERT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
        glViewport(0, 0, kSize, kSize);
        glEnable(GL_DEPTH_TEST);
        glClearColor(0, 0, 1, 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        draw_triangle(-1, -1, 4, 0.9f, {1, 1, 1, 1});  // behind
        const auto points = eight_points();
        for (GLuint i = 0; i < kPoints; ++i) {
            const auto& p = points[i];
            textures ? ext.texture_parameters(array, 0, i, p[0], p[1], p[2], p[3], p[4]) : ext.parameters(framebuffer, 0, i, p[0], p[1], p[2], p[3], p[4]);
        }
        glFlush();
        expect_density(read_layer(array, 0), points);
        for (const int layer : {1, kLayers - 1})
            for (const Rgba& pixel : read_layer(array, layer).pixels) ASSERT_EQ(pixel, (Rgba{0, 0, 255, 255})) << layer;
        EXPECT_GL(GL_NO_ERROR);
        glDisable(GL_DEPTH_TEST);
    }
}

TEST_F(Layers, AClearAmongTheDrawsOfALayeredFramebufferKeepsItsPlace) {
    const GLuint array = make_array();
    GLuint framebuffer = 0, provided = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0);
    ext.config(framebuffer, kLayers, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    ext.parameters(framebuffer, 0, 0, 0, 0, 16, 16, 0);
    glViewport(0, 0, kSize, kSize);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, kSize / 2, kSize);
    glClearColor(0, 1, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    draw_triangle(-1, -1, 0.5f, 0, {0, 0, 1, 1});
    glFlush();
    const Picture first = read_layer(array, 0), last = read_layer(array, kLayers - 1);
    EXPECT_EQ(first.at(2, 2), (Rgba{0, 0, 255, 255}));
    EXPECT_EQ(first.at(2, kSize - 3), (Rgba{0, 255, 0, 255}));
    EXPECT_EQ(first.at(kSize - 3, 2), (Rgba{255, 0, 0, 255}));
    EXPECT_EQ(last.at(2, 2), (Rgba{0, 255, 0, 255}));
    EXPECT_EQ(last.at(kSize - 3, 2), (Rgba{0, 0, 0, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Layers, AConfigWithoutMemoryForItsLevelsFailsAndLeavesTheFramebufferAsItWas) {
    setenv("FOVEA_LAYER_MEMORY_MIB", "2", 1);
    const EGLContext small = make_context();
    use(small);  // contexts read it when they are first used
    unsetenv("FOVEA_LAYER_MEMORY_MIB");
    const Surface large = surface(1024, 1024), little = surface(256, 256);
    GLuint provided = 77;
    ext.config(large.framebuffer, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    EXPECT_GL(GL_OUT_OF_MEMORY);
    EXPECT_EQ(provided, 77u);
    focus(large, 0, 0, 8);
    EXPECT_GL(GL_INVALID_OPERATION);  // not configured
    ext.config(large.framebuffer, 1, 1, 0, &provided);  // a question reserves nothing
    EXPECT_GL(GL_NO_ERROR);
    foveate(little);
    focus(little, 0, 0, 8);
    for (const Surface& s : {large, little}) {
        glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
        glViewport(0, 0, s.width, s.height);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        EXPECT_EQ(read(s).at(2, 2).r, s.width == 256 ? 128 : 32) << s.width;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Layers, AttachmentsThatComeAfterTheConfigAndFindNoMemoryAreDrawnAtFullDensity) {
    setenv("FOVEA_LAYER_MEMORY_MIB", "0", 1);
    const EGLContext none = make_context();
    use(none);
    unsetenv("FOVEA_LAYER_MEMORY_MIB");
    GLuint framebuffer = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    const GLuint color = texture(kSize, kSize);
    const Surface s{framebuffer, color, 0, kSize, kSize};
    foveate(s);
    focus(s, 0, 0, 16);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
    glViewport(0, 0, kSize, kSize);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_footprint();
    EXPECT_EQ(read(s).at(2, 2).r, 32);
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
