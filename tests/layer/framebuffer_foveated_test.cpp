// GL_QCOM_framebuffer_foveated, clause by clause. docs/conformance.md names these tests beside the sentences.
#include <climits>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

constexpr GLuint kEnable = GL_FOVEATION_ENABLE_BIT_QCOM, kBins = GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;

class FramebufferFoveated : public LayerTest {
protected:
    // For glDraw*Indirect at offset 0; it wants an array object.
    static void bind_indirect_triangle() {
        const GLuint command[5] = {3, 1, 0, 0, 0};
        GLuint commands = 0, array = 0;
        glGenVertexArrays(1, &array);
        glBindVertexArray(array);
        glGenBuffers(1, &commands);
        glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands);
        glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof command, command, GL_STATIC_DRAW);
    }
    // A geometry shader that passes triangles on.
    GLuint geometry_program() {
        return link({{GL_VERTEX_SHADER, "#version 320 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }"},
                     {GL_GEOMETRY_SHADER, "#version 320 es\nlayout(triangles) in; layout(triangle_strip, max_vertices = 3) out;\n"
                                          "void main() { for (int i = 0; i < 3; ++i) { gl_Position = gl_in[i].gl_Position; EmitVertex(); } EndPrimitive(); }"},
                     {GL_FRAGMENT_SHADER, "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }"}});
    }
    GLuint tessellation_program() {
        return link({{GL_VERTEX_SHADER, "#version 320 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1), float(gl_VertexID >> 1), 0, 1); }"},
                     {GL_TESS_CONTROL_SHADER, "#version 320 es\nlayout(vertices = 3) out; void main() { gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;"
                                              " gl_TessLevelInner[0] = 1.0; gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = 1.0; }"},
                     {GL_TESS_EVALUATION_SHADER, "#version 320 es\nlayout(triangles) in; void main() { gl_Position = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position + gl_TessCoord.z * gl_in[2].gl_Position; }"},
                     {GL_FRAGMENT_SHADER, "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }"}});
    }
};

TEST_F(FramebufferFoveated, IsListedInBothKindsOfExtensionString) {
    const std::string all = reinterpret_cast<const char*>(glGetString(GL_EXTENSIONS));
    EXPECT_NE((" " + all + " ").find(" GL_QCOM_framebuffer_foveated "), std::string::npos);
    EXPECT_NE((" " + all + " ").find(" GL_QCOM_texture_foveated "), std::string::npos);
    GLint count = 0;
    GLint64 count64 = 0;
    GLfloat count_float = 0;
    GLboolean any = GL_FALSE;
    glGetIntegerv(GL_NUM_EXTENSIONS, &count);
    glGetInteger64v(GL_NUM_EXTENSIONS, &count64);
    glGetFloatv(GL_NUM_EXTENSIONS, &count_float);
    glGetBooleanv(GL_NUM_EXTENSIONS, &any);
    EXPECT_EQ(count, count64);
    EXPECT_EQ(static_cast<float>(count), count_float);
    EXPECT_TRUE(any);
    int found = 0;
    std::string joined;
    for (GLint i = 0; i < count; ++i) {
        const std::string name = reinterpret_cast<const char*>(glGetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
        found += name == "GL_QCOM_framebuffer_foveated" || name == "GL_QCOM_texture_foveated" ||
                 name == "GL_QCOM_frame_extrapolation";
        EXPECT_NE((" " + all + " ").find(" " + name + " "), std::string::npos) << name;
    }
    EXPECT_EQ(found, 3);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(glGetStringi(GL_EXTENSIONS, static_cast<GLuint>(count)), nullptr);
    EXPECT_GL(GL_INVALID_VALUE);
}

TEST_F(FramebufferFoveated, ConfigRefusesWhatIsNoFramebuffer) {
    GLuint provided = 77, unborn = 0;
    ext.config(4711, 1, 1, kEnable, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(0, 1, 1, kEnable, &provided);  // the default framebuffer is no framebuffer object
    EXPECT_GL(GL_INVALID_VALUE);
    glGenFramebuffers(1, &unborn);
    ext.config(unborn, 1, 1, kEnable, &provided);  // a name, no object yet
    EXPECT_GL(GL_INVALID_VALUE);
    EXPECT_EQ(provided, 77u);
}

TEST_F(FramebufferFoveated, ConfigRefusesTooManyLayers) {
    const Surface s = surface(64, 64);
    GLint most = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most);
    GLuint provided = 0;
    ext.config(s.framebuffer, static_cast<GLuint>(most), 1, kEnable, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(s.framebuffer, UINT_MAX, 1, kEnable, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(s.framebuffer, static_cast<GLuint>(most) - 1, 1, kEnable, &provided);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, SupportsSixteenLayersAndEightFocalPoints) {
    const Surface s = surface(64, 64);
    GLuint provided = 0;
    ext.config(s.framebuffer, 16, UINT_MAX, kEnable, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(s.framebuffer, 16, 9, kEnable, &provided);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.config(s.framebuffer, 16, 8, kEnable, &provided);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(provided & kEnable, kEnable);
    ext.parameters(s.framebuffer, 15, 7, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, RefusedConfigLeavesTheFramebufferUnconfigured) {
    const Surface s = surface(64, 64);
    ext.config(s.framebuffer, UINT_MAX, 1, kEnable, nullptr);
    EXPECT_GL(GL_INVALID_VALUE);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_INVALID_OPERATION);
    foveate(s);
}

TEST_F(FramebufferFoveated, SecondConfigIsAnInvalidOperation) {
    const Surface s = surface(64, 64);
    foveate(s);
    GLuint provided = 0;
    ext.config(s.framebuffer, 1, 1, kEnable, &provided);
    EXPECT_GL(GL_INVALID_OPERATION);
    ext.config(s.framebuffer, 1, 1, 0, &provided);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FramebufferFoveated, QuestionAnswersFeaturesAndConfiguresNothing) {
    const Surface s = surface(64, 64);
    GLuint provided = 0xff;
    ext.config(s.framebuffer, 1, 1, 0, &provided);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(provided, kBins);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_INVALID_OPERATION);
    foveate(s);
}

TEST_F(FramebufferFoveated, FeaturesAreNegotiated) {
    for (const GLuint requested : {kEnable, kEnable | kBins, kEnable | kBins | 0x80u}) {
        const Surface s = surface(64, 64);
        GLuint provided = 0;
        ext.config(s.framebuffer, 1, 1, requested, &provided);
        EXPECT_GL(GL_NO_ERROR);
        EXPECT_EQ(provided, kEnable | kBins);
    }
}

TEST_F(FramebufferFoveated, EnableIsNotProvidedForAFormatThatCannotBeFoveated) {
    const char* all = reinterpret_cast<const char*>(glGetString(GL_EXTENSIONS));
    if (!std::strstr(all, "GL_EXT_texture_norm16")) GTEST_SKIP() << "no format that the driver draws to and the layer cannot match";
    const Surface s = surface(64, 64, true, GL_RGBA16_EXT);
    GLuint provided = 0;
    ext.config(s.framebuffer, 1, 1, kEnable, &provided);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(provided, kBins);
    focus(s, 0, 0, 16);  // configured all the same
    EXPECT_GL(GL_NO_ERROR);
    glClearColor(0, 1, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
    std::array<std::uint16_t, 4> pixel{};
    glReadPixels(2, 2, 1, 1, GL_RGBA, GL_UNSIGNED_SHORT, pixel.data());
    EXPECT_EQ(pixel, (std::array<std::uint16_t, 4>{65535, 0, 0, 65535}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, WithoutTheEnableBitNothingIsFoveated) {
    const Surface plain = surface(256, 256), s = surface(256, 256);
    GLuint provided = 0;
    ext.config(s.framebuffer, 1, 1, kBins, &provided);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(provided & kEnable, 0u);
    focus(s, 0, 0, 20);  // legal, and without effect
    EXPECT_GL(GL_NO_ERROR);
    for (const Surface* to : {&plain, &s}) {
        glBindFramebuffer(GL_FRAMEBUFFER, to->framebuffer);
        glClear(GL_COLOR_BUFFER_BIT);
        draw_scene();
    }
    EXPECT_EQ(read(plain), read(s));
}

TEST_F(FramebufferFoveated, ParametersRefuseWhatIsNotConfigured) {
    const Surface s = surface(64, 64);
    ext.parameters(4711, 0, 0, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.parameters(0, 0, 0, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FramebufferFoveated, ParametersRefuseLayersAndPointsBeyondTheConfig) {
    const Surface s = surface(64, 64);
    GLuint provided = 0;
    ext.config(s.framebuffer, 2, 3, kEnable, &provided);
    ext.parameters(s.framebuffer, 2, 0, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.parameters(s.framebuffer, 0, 3, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.parameters(s.framebuffer, UINT_MAX, UINT_MAX, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.parameters(s.framebuffer, 1, 2, 0, 0, 4, 4, 0);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, AnyNumberIsALegalParameter) {
    const Surface s = surface(256, 256);
    foveate(s);
    const float huge = std::numeric_limits<float>::max(), inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    const float values[][5] = {{0, 0, huge, huge, 0}, {nan, 0, 4, 4, 0}, {0, 0, nan, 4, 0}, {0, 0, 4, 4, nan},
                               {inf, inf, 4, 4, 0}, {0, 0, inf, inf, 0}, {0, 0, -4, -4, -huge}, {0, 0, 4, 0, inf}};
    for (const auto& v : values) {
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        ext.parameters(s.framebuffer, 0, 0, v[0], v[1], v[2], v[3], v[4]);
        EXPECT_GL(GL_NO_ERROR);
        const Picture p = read(s);
        for (const Rgba& pixel : p.pixels) ASSERT_GE(pixel.r, 31);  // drawn, at density 1 or less
    }
}

TEST_F(FramebufferFoveated, DefaultsAreFullQuality) {
    const Surface plain = surface(256, 256), s = surface(256, 256);
    foveate(s, 8);
    for (const Surface* to : {&plain, &s}) draw_scene_to(*to);
    EXPECT_EQ(read(plain), read(s));
    // One point given, the others have their defaults and still ask for full quality: the equation's maximum.
    draw_scene_to(s);
    focus(s, 0, 0, 20);
    EXPECT_EQ(read(plain), read(s));
}

TEST_F(FramebufferFoveated, StaysFoveatedOverFrames) {
    const Surface s = surface(256, 256);
    foveate(s);
    focus(s, 0, 0, 8);
    Picture last;
    for (int frame = 0; frame < 5; ++frame) {
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        const Picture p = read(s);
        EXPECT_EQ(p.at(2, 2).r, 128) << frame;  // four pixels for one rendered
        if (frame > 0) {
            EXPECT_EQ(p, last);
        }
        last = p;
    }
}

TEST_F(FramebufferFoveated, WritesAfterAChangeOfAttachmentsAreInvalidOperations) {
    const Surface s = surface(64, 64);
    foveate(s);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_scene();
    EXPECT_GL(GL_NO_ERROR);
    const GLuint other = texture(64, 64);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, other, 0);
    EXPECT_GL(GL_NO_ERROR);  // the change is legal
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_OPERATION);
    draw_scene();
    EXPECT_GL(GL_INVALID_OPERATION);
    const GLfloat black[4] = {};
    glClearBufferfv(GL_COLOR, 0, black);
    EXPECT_GL(GL_INVALID_OPERATION);
    const GLint zero = 0;
    glClearBufferiv(GL_STENCIL, 0, &zero);
    EXPECT_GL(GL_INVALID_OPERATION);
    glClearBufferfi(GL_DEPTH_STENCIL, 0, 1, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    const GLubyte indices[3] = {0, 1, 2};
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, indices);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawRangeElements(GL_TRIANGLES, 0, 2, 3, GL_UNSIGNED_BYTE, indices);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawArraysInstanced(GL_TRIANGLES, 0, 3, 2);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawElementsInstancedBaseVertex(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, indices, 2, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    bind_indirect_triangle();
    glDrawArraysIndirect(GL_TRIANGLES, nullptr);
    EXPECT_GL(GL_INVALID_OPERATION);
    const Surface from = surface(64, 64);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.framebuffer);
    glBlitFramebuffer(0, 0, 64, 64, 0, 0, 64, 64, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_INVALID_OPERATION);
    // "have changed" does not end by changing back.
    glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_OPERATION);
    // Reading is no write.
    std::uint32_t pixel = 0;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
    glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, &pixel);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, AttachingTheSameImageAgainIsNoChange) {
    const Surface s = surface(64, 64);
    foveate(s);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_scene();
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, FirstAttachmentsAfterTheConfigAreNoChange) {
    GLuint framebuffer = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    foveate({framebuffer, 0, 0, 64, 64});
    const GLuint color = texture(64, 64);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
    glViewport(0, 0, 64, 64);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_scene();
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, ADeletedAttachmentIsAChange) {
    const Surface s = surface(64, 64);
    foveate(s);
    glClear(GL_COLOR_BUFFER_BIT);
    glDeleteRenderbuffers(1, &s.depth);
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FramebufferFoveated, GeometryShadersAreRefused) {
    const Surface s = surface(64, 64);
    const GLuint p = geometry_program();
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_NO_ERROR);  // not foveated yet
    foveate(s);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_INVALID_OPERATION);
    glClear(GL_COLOR_BUFFER_BIT);  // a clear runs no program
    EXPECT_GL(GL_NO_ERROR);
}

// "The current bound program" of a pipeline are its stages; every kind of draw is a rendering command.
TEST_F(FramebufferFoveated, GeometryShadersOfAPipelineAreRefusedByEveryDraw) {
    const Surface s = surface(64, 64);
    const char* vertex = "#version 320 es\nout gl_PerVertex { vec4 gl_Position; }; void main() { gl_Position = vec4(float(gl_VertexID & 1), float(gl_VertexID >> 1), 0, 1); }";
    const char* geometry = "#version 320 es\nlayout(triangles) in; layout(triangle_strip, max_vertices = 3) out; in gl_PerVertex { vec4 gl_Position; } gl_in[]; out gl_PerVertex { vec4 gl_Position; };\n"
                           "void main() { for (int i = 0; i < 3; ++i) { gl_Position = gl_in[i].gl_Position; EmitVertex(); } EndPrimitive(); }";
    const char* fragment = "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }";
    GLuint pipeline = 0;
    glGenProgramPipelines(1, &pipeline);
    glUseProgramStages(pipeline, GL_VERTEX_SHADER_BIT, glCreateShaderProgramv(GL_VERTEX_SHADER, 1, &vertex));
    glUseProgramStages(pipeline, GL_GEOMETRY_SHADER_BIT, glCreateShaderProgramv(GL_GEOMETRY_SHADER, 1, &geometry));
    glUseProgramStages(pipeline, GL_FRAGMENT_SHADER_BIT, glCreateShaderProgramv(GL_FRAGMENT_SHADER, 1, &fragment));
    glUseProgram(0);
    glBindProgramPipeline(pipeline);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_NO_ERROR);  // not foveated yet
    foveate(s);
    const GLubyte indices[3] = {0, 1, 2};
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, indices);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawElementsInstanced(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, indices, 2);
    EXPECT_GL(GL_INVALID_OPERATION);
    glDrawElementsBaseVertex(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, indices, 0);
    EXPECT_GL(GL_INVALID_OPERATION);
    bind_indirect_triangle();
    glDrawArraysIndirect(GL_TRIANGLES, nullptr);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FramebufferFoveated, TessellationShadersAreRefused) {
    const Surface s = surface(64, 64);
    const GLuint p = tessellation_program();
    glUseProgram(p);
    glPatchParameteri(GL_PATCH_VERTICES, 3);
    foveate(s);
    glDrawArrays(GL_PATCHES, 0, 3);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FramebufferFoveated, EveryColorAttachmentHasTheSameQuality) {
    const Surface s = surface(256, 256);
    const GLuint second = texture(256, 256);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, second, 0);
    const GLenum both[2] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(2, both);
    foveate(s);
    const GLuint p = program(
        "#version 300 es\nout highp vec2 at; void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; at = p * 0.5 + 0.5; gl_Position = vec4(p, 0, 1); }",
        "#version 300 es\nprecision highp float; in vec2 at; layout(location = 0) out vec4 a; layout(location = 1) out vec4 b;\n"
        "void main() { a = vec4(dFdx(at.x) * 32.0, dFdy(at.y) * 32.0, 0, 1); b = a; }");
    glUseProgram(p);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    focus(s, 0, 0, 8);
    const Picture first = read(s);
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    EXPECT_EQ(first, read(s));
    EXPECT_EQ(first.at(128, 128).r, 32);
    EXPECT_EQ(first.at(2, 2).r, 128);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, FragCoordIsScaledToTheLevel) {
    const Surface s = surface(256, 256);
    foveate(s);
    const GLuint p = program(
        "#version 300 es\nvoid main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0; gl_Position = vec4(p, 0, 1); }",
        "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(gl_FragCoord.xy / 256.0, 0, 1); }");
    glUseProgram(p);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    focus(s, 0, 0, 8);
    const Picture picture = read(s);
    EXPECT_NEAR(picture.at(128, 128).r, 128, 1);  // level 0: absolute
    EXPECT_NEAR(picture.at(250, 4).r, 250 / 4, 2);  // level 2: a quarter, still proportional
    EXPECT_NEAR(picture.at(250, 250).g, 250 / 4, 2);
}

TEST_F(FramebufferFoveated, DepthTestsWorkAtEveryLevel) {
    const Surface s = surface(256, 256);
    foveate(s);
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});  // behind
    focus(s, 0, 0, 8);
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, (Rgba{0, 255, 0, 255}));
}

TEST_F(FramebufferFoveated, ProgramsErrorsAndTheLayersMergeIntoOneFlag) {
    const Surface s = surface(64, 64);
    glEnable(0x1234);                                     // the driver: INVALID_ENUM
    ext.parameters(s.framebuffer, 0, 0, 0, 0, 4, 4, 0);   // the layer: INVALID_OPERATION
    EXPECT_GL(GL_INVALID_ENUM);                           // the first one stays
    EXPECT_GL(GL_NO_ERROR);
    ext.parameters(s.framebuffer, 0, 0, 0, 0, 4, 4, 0);
    glEnable(0x1234);
    EXPECT_GL(GL_INVALID_OPERATION);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, IllegalDrawsReportAtOnceAndDrawNothing) {
    const Surface s = surface(64, 64);
    foveate(s);
    focus(s, 0, 0, 8);
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_triangle(-1, -1, 0.1f, 0, {1, 1, 1, 1});
    glDrawArrays(0x9999, 0, 3);
    EXPECT_GL(GL_INVALID_ENUM);
    glDrawArrays(GL_TRIANGLES, 0, -1);
    EXPECT_GL(GL_INVALID_VALUE);
    glDrawElements(GL_TRIANGLES, 3, GL_FLOAT, nullptr);
    EXPECT_GL(GL_INVALID_ENUM);
    glClear(0x8);
    EXPECT_GL(GL_INVALID_VALUE);
    const GLfloat black[4] = {};
    glClearBufferfv(GL_COLOR, 99, black);
    EXPECT_GL(GL_INVALID_VALUE);
    EXPECT_EQ(read(s).at(60, 60), (Rgba{0, 0, 255, 255}));
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, StateOfAFramebufferIsNotSharedWithOtherContexts) {
    const Surface s = surface(64, 64);
    foveate(s);
    const EGLContext other = make_context(context);
    use(other);
    focus(s, 0, 0, 4);  // no such framebuffer here, or (drivers that share the names) one that is not configured
    EXPECT_NE(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    use(context);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FramebufferFoveated, ANameGivenAgainIsAFreshFramebuffer) {
    Surface s = surface(64, 64);
    foveate(s);
    glDeleteFramebuffers(1, &s.framebuffer);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_INVALID_VALUE);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);  // the same name, a new object
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    focus(s, 0, 0, 4);
    EXPECT_GL(GL_INVALID_OPERATION);
    foveate(s);
}

}  // namespace fovea::layer_test
