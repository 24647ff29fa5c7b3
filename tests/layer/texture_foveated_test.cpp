// GL_QCOM_texture_foveated, clause by clause. docs/conformance.md names these tests beside the sentences.
#include <algorithm>
#include <atomic>
#include <climits>
#include <cmath>
#include <thread>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

constexpr GLint kEnable = GL_FOVEATION_ENABLE_BIT_QCOM, kBins = GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;

class TextureFoveated : public LayerTest {
protected:
    static GLint get(GLenum target, GLenum name) {
        GLint value = -1;
        glGetTexParameteriv(target, name, &value);
        return value;
    }
    // A foveated texture with its gaze in the middle, bound with its framebuffer.
    Surface foveated(int width, int height, float gain) {
        const Surface s = surface(width, height);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
        ext.texture_parameters(s.color, 0, 0, 0, 0, gain, gain, 0);
        return s;
    }
};

TEST_F(TextureFoveated, DefaultsOfANewTexture) {
    (void)texture(16, 16);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), 0);
    GLfloat density = -1;
    glGetTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, &density);
    EXPECT_EQ(density, 0.0f);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM), kEnable | kBins);
    EXPECT_GE(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM), 8);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, EveryTypeOfTexParameterSetsAndGets) {
    const GLuint t = texture(16, 16);
    const GLenum bits = GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, least = GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM;
    const GLint i = kEnable | kBins;
    const GLuint u = 3;
    const GLfloat f = 1.0f;
    glTexParameterf(GL_TEXTURE_2D, bits, f);
    EXPECT_EQ(get(GL_TEXTURE_2D, bits), 1);
    glTexParameteriv(GL_TEXTURE_2D, bits, &i);
    EXPECT_EQ(get(GL_TEXTURE_2D, bits), 3);
    glTexParameterfv(GL_TEXTURE_2D, bits, &f);
    EXPECT_EQ(get(GL_TEXTURE_2D, bits), 1);
    glTexParameterIiv(GL_TEXTURE_2D, bits, &i);
    EXPECT_EQ(get(GL_TEXTURE_2D, bits), 3);
    glTexParameterIuiv(GL_TEXTURE_2D, bits, &u);
    glTexParameteri(GL_TEXTURE_2D, bits, kEnable);
    GLint ii = 0;
    GLuint uu = 0;
    GLfloat ff = 0;
    glGetTexParameterIiv(GL_TEXTURE_2D, bits, &ii);
    glGetTexParameterIuiv(GL_TEXTURE_2D, bits, &uu);
    glGetTexParameterfv(GL_TEXTURE_2D, bits, &ff);
    EXPECT_EQ(ii, 1);
    EXPECT_EQ(uu, 1u);
    EXPECT_EQ(ff, 1.0f);
    glTexParameterf(GL_TEXTURE_2D, least, 0.375f);
    glGetTexParameterfv(GL_TEXTURE_2D, least, &ff);
    EXPECT_EQ(ff, 0.375f);
    glTexParameteri(GL_TEXTURE_2D, least, 1);
    EXPECT_EQ(get(GL_TEXTURE_2D, least), 1);
    EXPECT_GL(GL_NO_ERROR);
    (void)t;
}

TEST_F(TextureFoveated, QueriesCannotBeSet) {
    (void)texture(16, 16);
    const GLint one = 1;
    const GLfloat f = 1;
    for (const GLenum name : {GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM}) {
        glTexParameteri(GL_TEXTURE_2D, name, 1);
        EXPECT_GL(GL_INVALID_ENUM);
        glTexParameterf(GL_TEXTURE_2D, name, 1);
        EXPECT_GL(GL_INVALID_ENUM);
        glTexParameteriv(GL_TEXTURE_2D, name, &one);
        EXPECT_GL(GL_INVALID_ENUM);
        glTexParameterfv(GL_TEXTURE_2D, name, &f);
        EXPECT_GL(GL_INVALID_ENUM);
    }
}

TEST_F(TextureFoveated, OtherFeatureBitsAreInvalidEnums) {
    (void)texture(16, 16);
    for (const GLint bits : {kBins, 4, 5, 7, -1, INT_MAX}) {
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, bits);
        EXPECT_GL(GL_INVALID_ENUM);
    }
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, 0.5f);
    EXPECT_GL(GL_INVALID_ENUM);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), 0);
}

TEST_F(TextureFoveated, CannotBeDisabledOnceEnabled) {
    (void)texture(16, 16);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, 0);  // not enabled yet: legal
    EXPECT_GL(GL_NO_ERROR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable | kBins);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), kEnable | kBins);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, MinimumDensityOutsideZeroToOneIsAnInvalidOperation) {
    (void)texture(16, 16);
    for (const float value : {-0.01f, 1.01f, -1e30f, 1e30f, std::nanf("")}) {
        glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, value);
        EXPECT_GL(GL_INVALID_OPERATION);
        glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, &value);
        EXPECT_GL(GL_INVALID_OPERATION);
    }
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, 2);
    EXPECT_GL(GL_INVALID_OPERATION);
    for (const float value : {0.0f, 1.0f}) {
        glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, value);
        EXPECT_GL(GL_NO_ERROR);
    }
}

TEST_F(TextureFoveated, TargetsWithoutSupportSaySoAndRefuse) {
    for (const GLenum target : {GL_TEXTURE_3D, GL_TEXTURE_CUBE_MAP}) {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(target, t);
        EXPECT_EQ(get(target, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM), 0);
        glTexParameteri(target, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
        EXPECT_GL(GL_INVALID_OPERATION);
        EXPECT_GT(get(target, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM), 0);
    }
    for (const GLenum target : {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_2D_MULTISAMPLE}) {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(target, t);
        EXPECT_EQ(get(target, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM), kEnable | kBins);
        glTexParameteri(target, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
        EXPECT_GL(GL_NO_ERROR);
    }
    GLint value = 5;
    glGetTexParameteriv(0x1234, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, &value);
    EXPECT_GL(GL_INVALID_ENUM);
    glTexParameteri(0x1234, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    EXPECT_GL(GL_INVALID_ENUM);
}

TEST_F(TextureFoveated, ParametersRefuseWhatIsNoFoveatedTexture) {
    GLuint unborn = 0;
    glGenTextures(1, &unborn);
    for (const GLuint name : {0u, 4711u, unborn}) {
        ext.texture_parameters(name, 0, 0, 0, 0, 4, 4, 0);
        EXPECT_GL(GL_INVALID_VALUE);
    }
    const GLuint t = texture(16, 16);
    ext.texture_parameters(t, 0, 0, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    const auto points = static_cast<GLuint>(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM));
    ext.texture_parameters(t, 0, points, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.texture_parameters(t, 0, UINT_MAX, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.texture_parameters(t, 0, points - 1, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_NO_ERROR);
    ext.texture_parameters(t, UINT_MAX, 0, 0, 0, 4, 4, 0);  // the specification has no error for the layer
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, ADeletedTexturesNameStartsAgain) {
    GLuint t = texture(16, 16);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    glDeleteTextures(1, &t);
    glBindTexture(GL_TEXTURE_2D, t);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), 0);
}

TEST_F(TextureFoveated, DefaultsAreFullQualityAndOnePointSetFoveates) {
    const Surface plain = surface(256, 256), s = surface(256, 256);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    for (const Surface* to : {&plain, &s}) draw_scene_to(*to);
    EXPECT_EQ(read(plain), read(s));
    draw_scene_to(s);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    EXPECT_NE(read(plain), read(s));
}

TEST_F(TextureFoveated, TwoFoveatedColorsAreIncomplete) {
    (void)surface(64, 64);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    const GLuint second = texture(64, 64);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, second, 0);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    for (const GLenum target : {GL_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER, GL_READ_FRAMEBUFFER})
        EXPECT_EQ(glCheckFramebufferStatus(target), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_FOVEATION_QCOM));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, FoveatedDepthIsIncomplete) {
    (void)surface(64, 64, false);
    GLuint depth = texture(64, 64, GL_DEPTH_COMPONENT24);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_FOVEATION_QCOM));
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, 0, 0);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    depth = texture(64, 64, GL_DEPTH24_STENCIL8);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_FOVEATION_QCOM));
}

TEST_F(TextureFoveated, MixedWithAConfiguredFramebufferIsIncomplete) {
    const Surface s = surface(64, 64);
    foveate(s);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glBindTexture(GL_TEXTURE_2D, s.color);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_FOVEATION_QCOM));
}

TEST_F(TextureFoveated, IncompleteFramebuffersRefuseDrawsClearsReadsAndBlits) {
    const Surface good = surface(64, 64), s = surface(64, 64);
    foveate(s);
    glBindTexture(GL_TEXTURE_2D, s.color);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    draw_scene();
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    std::uint32_t pixel = 0;
    glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, &pixel);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, good.framebuffer);
    glBlitFramebuffer(0, 0, 8, 8, 0, 0, 8, 8, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, good.framebuffer);
    glBlitFramebuffer(0, 0, 8, 8, 0, 0, 8, 8, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    glCopyTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 0, 0, 8, 8, 0);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
}

TEST_F(TextureFoveated, OtherAttachmentsInheritTheFoveation) {
    const Surface s = surface(256, 256);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    const GLuint second = texture(256, 256);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, second, 0);
    const GLenum both[2] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(2, both);
    const GLuint p = program(
        "#version 300 es\nout highp vec2 at; void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; at = p * 0.5 + 0.5; gl_Position = vec4(p, 0, 1); }",
        "#version 300 es\nprecision highp float; in vec2 at; layout(location = 0) out vec4 a; layout(location = 1) out vec4 b;\n"
        "void main() { a = vec4(dFdx(at.x) * 32.0, 0, 0, 1); b = a; }");
    glUseProgram(p);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    EXPECT_EQ(read(s).at(2, 2).r, 128);
}

TEST_F(TextureFoveated, TextureUploadsAreNotFoveated) {
    const Surface s = foveated(64, 64, 20);
    std::vector<Rgba> noise(64 * 64);
    for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = {static_cast<std::uint8_t>(i * 37), static_cast<std::uint8_t>(i * 101), 7, 255};
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 64, 64, GL_RGBA, GL_UNSIGNED_BYTE, noise.data());
    EXPECT_EQ(read(s).pixels, noise);
}

TEST_F(TextureFoveated, BlitsAreNotFoveated) {
    const Surface source = surface(128, 128), s = surface(128, 128);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 20, 20, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, source.framebuffer);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_scene();
    glBindFramebuffer(GL_READ_FRAMEBUFFER, source.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.framebuffer);
    glBlitFramebuffer(0, 0, 128, 128, 0, 0, 128, 128, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_EQ(read(source), read(s));
}

TEST_F(TextureFoveated, GeometryShadersAreDrawnAtFullDensity) {
    const GLuint p = link({{GL_VERTEX_SHADER, "#version 320 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }"},
                           {GL_GEOMETRY_SHADER, "#version 320 es\nlayout(triangles) in; layout(triangle_strip, max_vertices = 3) out;\n"
                                                "void main() { for (int i = 0; i < 3; ++i) { gl_Position = gl_in[i].gl_Position; EmitVertex(); } EndPrimitive(); }"},
                           {GL_FRAGMENT_SHADER, "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(gl_FragCoord.xy / 256.0, 0, 1); }"}});
    const Surface s = foveated(256, 256, 8);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const Picture picture = read(s);
    EXPECT_EQ(picture.at(250, 4).r, 250);  // gl_FragCoord is absolute in the periphery
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, TessellationIsDrawnAtFullDensity) {
    const GLuint p = link({{GL_VERTEX_SHADER, "#version 320 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }"},
                           {GL_TESS_CONTROL_SHADER, "#version 320 es\nlayout(vertices = 3) out; void main() { gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;\n"
                                                    "gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = gl_TessLevelInner[0] = 1.0; }"},
                           {GL_TESS_EVALUATION_SHADER, "#version 320 es\nlayout(triangles) in; void main() { gl_Position = gl_in[0].gl_Position * gl_TessCoord.x + gl_in[1].gl_Position * gl_TessCoord.y + gl_in[2].gl_Position * gl_TessCoord.z; }"},
                           {GL_FRAGMENT_SHADER, "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(gl_FragCoord.xy / 256.0, 0, 1); }"}});
    const Surface s = foveated(256, 256, 8);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    glPatchParameteri(GL_PATCH_VERTICES, 3);
    glDrawArrays(GL_PATCHES, 0, 3);
    EXPECT_EQ(read(s).at(250, 4).r, 250);
    EXPECT_GL(GL_NO_ERROR);
}

// "If this bit is not specified foveated rendering will not be used": a density alone foveates nothing.
TEST_F(TextureFoveated, WithoutTheEnableBitADensityFoveatesNothing) {
    const Surface plain = surface(256, 256), s = surface(256, 256);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, 0.0625f);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, 0);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 20, 20, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    for (const Surface* to : {&plain, &s}) draw_scene_to(*to);
    EXPECT_TRUE(read(plain) == read(s));
}

TEST_F(TextureFoveated, InterpolationOffsetsAndSamplePositionsAreNotCorrected) {
    const Surface s = foveated(256, 256, 16);
    const GLuint p = program("#version 320 es\nout highp vec2 at; void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; at = p * 128.0 + 128.0; gl_Position = vec4(p, 0, 1); }",
                             "#version 320 es\nprecision highp float; in vec2 at; out vec4 c; void main() { c = vec4((interpolateAtOffset(at, vec2(0.25, 0.0)) - at).x / 4.0, gl_SamplePosition, 1); }");
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const Picture picture = read(s);
    EXPECT_NEAR(picture.at(128, 128).r, 16, 1);  // a quarter of a pixel
    EXPECT_NEAR(picture.at(6, 6).r, 64, 1);      // a quarter of a pixel of the level, which is four wide
    EXPECT_NEAR(picture.at(6, 6).g, 128, 1);     // the middle, at every level
    EXPECT_NEAR(picture.at(128, 128).b, 128, 1);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, LinesHaveTheirWidthInPixelsOfTheLevel) {
    GLfloat widths[2] = {1, 1};
    glGetFloatv(GL_ALIASED_LINE_WIDTH_RANGE, widths);
    const GLfloat width = std::min(4.0f, std::floor(widths[1]));
    const Surface s = foveated(256, 256, 16);
    const GLuint p = program("#version 300 es\nuniform float y; void main() { gl_Position = vec4(float(gl_VertexID) * 4.0 - 2.0, y, 0, 1); }",
                             "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }");
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    glLineWidth(width);
    for (const float y : {0.0f, -0.75f}) {
        glUniform1f(glGetUniformLocation(p, "y"), y + 1.0f / 512);
        glDrawArrays(GL_LINES, 0, 2);
    }
    const Picture picture = read(s);
    const auto height = [&picture](int x, int from, int to) {
        int n = 0;
        for (int y = from; y < to; ++y) n += picture.at(x, y).r > 127;
        return n;
    };
    EXPECT_EQ(height(128, 64, 192), static_cast<int>(width));
    EXPECT_NEAR(height(32, 0, 64), 4 * static_cast<int>(width), 3);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, PointsHaveTheirSizeInPixelsOfTheLevelAndFragCoordCountsThem) {
    const Surface s = foveated(256, 256, 16);
    const GLuint p = program("#version 300 es\nuniform vec2 place; void main() { gl_Position = vec4(place, 0, 1); gl_PointSize = 8.0; }",
                             "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(1, gl_FragCoord.x / 256.0, 0, 1); }");
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    for (const float x : {0.0f, -0.75f}) {
        glUniform2f(glGetUniformLocation(p, "place"), x, x);
        glDrawArrays(GL_POINTS, 0, 1);
    }
    const Picture picture = read(s);
    const auto width = [&picture](int row) {
        int n = 0;
        for (int x = 0; x < picture.width; ++x) n += picture.at(x, row).r > 127;
        return n;
    };
    EXPECT_EQ(width(128), 8);
    EXPECT_NEAR(width(32), 32, 2);  // a quarter of the pixels along the axis, none of the correction
    EXPECT_NEAR(picture.at(32, 32).g, 32 / 4, 2);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, LoadingAnImageLeavesItsStateAlone) {
    const Surface s = surface(128, 128, false);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, 0.125f);
    for (const float x : {-0.5f, 0.5f}) {  // the second pass begins without a clear
        ext.texture_parameters(s.color, 0, 0, x, 0, 16, 16, 0);
        draw_triangle(x, -1, 0.5f, 0, {0, 1, 0, 1});
        glFlush();
    }
    GLint features = 0;
    GLfloat least = 0;
    glBindTexture(GL_TEXTURE_2D, s.color);
    glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, &features);
    glGetTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, &least);
    EXPECT_EQ(features, static_cast<GLint>(kEnable));
    EXPECT_EQ(least, 0.125f);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(TextureFoveated, StateIsSharedWithTheShareGroup) {
    const Surface s = surface(256, 256);
    const EGLContext other = make_context(context), stranger = make_context();
    use(other);
    glBindTexture(GL_TEXTURE_2D, s.color);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 8, 8, 0);
    EXPECT_GL(GL_NO_ERROR);
    use(context);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), kEnable);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_footprint();
    EXPECT_EQ(read(s).at(2, 2).r, 128);
    use(stranger);
    (void)texture(16, 16);
    EXPECT_EQ(get(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM), 0);
}

TEST_F(TextureFoveated, ParametersOfAnotherThreadReachTheNextSubmission) {
    const Surface s = surface(256, 256);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    const EGLContext other = make_context(context);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_footprint();
    std::thread([&] {
        use(other);
        ext.texture_parameters(s.color, 0, 0, 0.5f, 0.5f, 8, 8, 0);
        EXPECT_GL(GL_NO_ERROR);
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglReleaseThread();
    }).join();
    const Picture p = read(s);
    EXPECT_EQ(p.at(192, 192).r, 32);
    EXPECT_EQ(p.at(2, 2).r, 128);
}

TEST_F(TextureFoveated, FourThreadsDrawIntoLayersOfOneArray) {
    GLuint array = 0;
    glGenTextures(1, &array);
    glBindTexture(GL_TEXTURE_2D_ARRAY, array);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, 128, 128, 4);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, kEnable);
    glFinish();
    std::vector<EGLContext> theirs;
    for (int i = 0; i < 4; ++i) theirs.push_back(make_context(context));
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&, i] {
            eglBindAPI(EGL_OPENGL_ES_API);
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, theirs[static_cast<std::size_t>(i)]);
            GLuint framebuffer = 0;
            glGenFramebuffers(1, &framebuffer);
            glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
            glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, i);
            glViewport(0, 0, 128, 128);
            for (int frame = 0; frame < 20; ++frame) {
                glClearColor(static_cast<float>(i) * 0.2f, static_cast<float>(frame) / 20, 0, 1);
                glClear(GL_COLOR_BUFFER_BIT);
                ext.texture_parameters(array, static_cast<GLuint>(i), 0, static_cast<float>(frame) / 20, 0, 8, 8, 0);
                std::array<std::uint8_t, 4> pixel{};
                glReadPixels(1, 1, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
                if (std::abs(pixel[0] - i * 51) > 1 || std::abs(pixel[1] - frame * 255 / 20) > 1 || glGetError() != GL_NO_ERROR) ++wrong;
            }
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
            eglReleaseThread();
        });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(wrong, 0);
}

}  // namespace fovea::layer_test
