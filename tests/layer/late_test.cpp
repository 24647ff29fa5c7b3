// Recorded calls reach the driver late, with the data they had when they were made, and once where once matters.
#include <cstring>

#include "tests/layer/late_fixture.hpp"

namespace fovea::layer_test {

class Late : public LateFixture {};

TEST_F(Late, ClientArraysAreCopiedWhenTheDrawIsMade) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    float positions[6];
    float colors[12] = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
    std::memcpy(positions, kCover, sizeof positions);
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, positions);
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, 0, colors);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    std::memset(positions, 0, sizeof positions);
    std::memset(colors, 0, sizeof colors);
    const Picture p = read(s);
    EXPECT_EQ(p.at(1, 1), kGreen);
    EXPECT_EQ(p.at(128, 128), kGreen);
    void* pointer = nullptr;
    glGetVertexAttribPointerv(0, GL_VERTEX_ATTRIB_ARRAY_POINTER, &pointer);
    EXPECT_EQ(pointer, positions);  // the program's own, again
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, ClientIndicesAndABufferOfVerticesAreCopied) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    float positions[40] = {};
    std::memcpy(positions + 20, kCover, sizeof kCover);  // vertices 10, 11, 12
    float colors[80];
    for (int i = 0; i < 20; ++i) std::memcpy(colors + 4 * i, std::array{0.0f, 0.0f, 1.0f, 1.0f}.data(), 16);
    GLuint buffer = 0;
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, sizeof colors, colors, GL_STATIC_DRAW);
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    glBindBuffer(GL_ARRAY_BUFFER, 0);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, positions);
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    GLushort indices[3] = {10, 11, 12};
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_SHORT, indices);
    std::memset(indices, 0, sizeof indices);
    std::memset(positions, 0, sizeof positions);
    EXPECT_EQ(read(s).at(1, 1), kBlue);
    // Indices in a buffer, vertices of the client.
    std::memcpy(positions + 20, kCover, sizeof kCover);
    GLuint index_buffer = 0;
    const GLubyte bytes[5] = {0, 0, 10, 11, 12};
    glGenBuffers(1, &index_buffer);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof bytes, bytes, GL_STATIC_DRAW);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, reinterpret_cast<void*>(2));
    std::memset(positions, 0, sizeof positions);
    EXPECT_EQ(read(s).at(1, 1), kBlue);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, InstancedClientAttributesAreCopied) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    float colors[8] = {1, 0, 0, 1, 0, 1, 0, 1};
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, kCover);
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, 0, colors);
    glVertexAttribDivisor(1, 1);
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    glDrawArraysInstanced(GL_TRIANGLES, 0, 3, 2);
    std::memset(colors, 0, sizeof colors);
    EXPECT_EQ(read(s).at(1, 1), kGreen);
}

TEST_F(Late, UniformsHaveTheValueOfTheirDraw) {
    const Surface s = foveated();
    draw_triangle(-1, -1, 1, 0, {1, 0, 0, 1});
    draw_triangle(0, -1, 1, 0, {0, 1, 0, 1});
    draw_triangle(-1, 0, 1, 0, {0, 0, 1, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(1, 1), kRed);
    EXPECT_EQ(p.at(130, 1), kGreen);
    EXPECT_EQ(p.at(1, 130), kBlue);
    EXPECT_EQ(p.at(254, 254), kBlack);
}

TEST_F(Late, UniformsOfAnotherProgramHaveTheValueOfTheirDraw) {
    const Surface s = foveated();
    const GLuint p = program("#version 310 es\nuniform vec4 place; void main() { vec2 v = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)); gl_Position = vec4(place.xy + v * place.z, 0, 1); }",
                             "#version 310 es\nprecision highp float; uniform mat2 tint[2]; out vec4 c; void main() { c = vec4(tint[0][0], tint[1][1]); }");
    const GLint place = glGetUniformLocation(p, "place"), tint = glGetUniformLocation(p, "tint[0]");
    const GLfloat red[8] = {1, 0, 0, 0, 0, 0, 0, 1}, green[8] = {0, 1, 0, 0, 0, 0, 0, 1};
    glProgramUniform4f(p, place, -1, -1, 1, 0);
    glProgramUniformMatrix2fv(p, tint, 2, GL_FALSE, red);
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glUseProgram(0);
    glProgramUniform4f(p, place, 0, -1, 1, 0);
    glProgramUniformMatrix2fv(p, tint, 2, GL_FALSE, green);
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const Picture picture = read(s);
    EXPECT_EQ(picture.at(1, 1), kRed);
    EXPECT_EQ(picture.at(130, 1), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, AUniformArraySetBeyondItsEndIsNoError) {
    const Surface s = foveated();
    const GLuint p = program("#version 300 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                             "#version 300 es\nprecision highp float; uniform vec4 tint[3]; out vec4 c; void main() { c = tint[0] + tint[2]; }");
    glUseProgram(p);
    draw_triangle(-1, -1, 0.1f, 0, {1, 0, 0, 1});
    glUseProgram(p);
    const std::vector<GLfloat> green = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 9, 9, 9, 9, 9, 9, 9, 9};
    glUniform4fv(glGetUniformLocation(p, "tint[0]"), 5, green.data());
    EXPECT_GL(GL_NO_ERROR);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_EQ(read(s).at(128, 128), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, APendingClearComesBeforeAnUploadToItsImage) {
    const Surface s = foveated(false);  // cleared, not submitted
    const std::vector<Rgba> white(16 * 16, Rgba{255, 255, 255, 255});
    glBindTexture(GL_TEXTURE_2D, s.color);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 16, 16, GL_RGBA, GL_UNSIGNED_BYTE, white.data());
    const Picture p = read(s);
    EXPECT_EQ(p.at(3, 3), white[0]);
    EXPECT_EQ(p.at(20, 20), kBlack);
}

TEST_F(Late, StateIsWhatTheProgramSetAfterASubmission) {
    const Surface s = foveated();
    const GLuint t = texture(4, 4);
    GLuint sampler = 0, buffer = 0, array = 0;
    glGenSamplers(1, &sampler);
    glGenBuffers(1, &buffer);
    glGenVertexArrays(1, &array);
    draw_triangle(-1, -1, 1, 0, {1, 0, 0, 1});
    glViewport(3, 4, 50, 60);
    glScissor(1, 2, 33, 44);
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_DST_COLOR);
    glBlendEquation(GL_FUNC_SUBTRACT);
    glBlendColor(0.1f, 0.2f, 0.3f, 0.4f);
    glEnable(GL_STENCIL_TEST);
    glStencilFuncSeparate(GL_BACK, GL_LESS, 3, 0x0f);
    glStencilMask(0x3c);
    glStencilOp(GL_INCR, GL_INVERT, GL_ZERO);
    glDepthFunc(GL_GEQUAL);
    glDepthMask(GL_FALSE);
    glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
    glCullFace(GL_FRONT);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, t);
    glBindSampler(0, sampler);
    glActiveTexture(GL_TEXTURE5);
    glBindVertexArray(array);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    const auto look = [] {
        std::vector<GLint> all;
        for (const GLenum name : {GL_VIEWPORT, GL_SCISSOR_BOX, GL_COLOR_WRITEMASK, GL_BLEND_SRC_RGB, GL_BLEND_DST_ALPHA,
                                  GL_BLEND_EQUATION_ALPHA, GL_STENCIL_FUNC, GL_STENCIL_BACK_FUNC, GL_STENCIL_BACK_REF,
                                  GL_STENCIL_WRITEMASK, GL_STENCIL_FAIL, GL_DEPTH_FUNC, GL_DEPTH_WRITEMASK, GL_CULL_FACE_MODE,
                                  GL_ACTIVE_TEXTURE, GL_TEXTURE_BINDING_2D, GL_VERTEX_ARRAY_BINDING, GL_ARRAY_BUFFER_BINDING,
                                  GL_CURRENT_PROGRAM, GL_DRAW_FRAMEBUFFER_BINDING, GL_READ_FRAMEBUFFER_BINDING}) {
            GLint v[4] = {};
            glGetIntegerv(static_cast<GLenum>(name), v);
            all.insert(all.end(), v, v + 4);
        }
        for (const GLenum cap : {GL_SCISSOR_TEST, GL_BLEND, GL_STENCIL_TEST, GL_DEPTH_TEST, GL_CULL_FACE, GL_DITHER})
            all.push_back(glIsEnabled(cap));
        return all;
    };
    const std::vector<GLint> before = look();
    glFlush();
    EXPECT_EQ(look(), before);
    glFinish();
    EXPECT_EQ(look(), before);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(read(s).at(1, 1), kRed);
}

TEST_F(Late, DepthOfAPassSurvivesAFlushInside) {
    const Surface s = foveated();
    glEnable(GL_DEPTH_TEST);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    glFlush();
    draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});
    const Picture p = read(s);
    for (const Rgba& pixel : p.pixels) ASSERT_EQ(pixel, kGreen);
}

TEST_F(Late, DepthOfAPassSurvivesAClearOfTheColorsAlone) {
    const Surface s = surface(256, 256);
    glClear(GL_DEPTH_BUFFER_BIT);  // the program's own depth buffer: everything would be in front of it
    glFinish();
    foveate(s);
    focus(s, 0, 0, 8);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    glFlush();
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glFlush();
    draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});  // behind what was drawn before
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kBlue);
}

TEST_F(Late, AVisitToAnotherFramebufferKeepsThePass) {
    const Surface s = foveated(), shadow = surface(64, 64);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    glViewport(0, 0, 256, 256);
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    glBindFramebuffer(GL_FRAMEBUFFER, shadow.framebuffer);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
    focus(s, 0.3f, 0.3f, 6);  // moves in between
    draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kGreen);
}

TEST_F(Late, DrawingWithoutAClearAddsToThePicture) {
    const Surface s = foveated(false);
    draw_triangle(-1, -1, 1, 0, {1, 0, 0, 1});
    glFinish();
    focus(s, 0.5f, 0.5f, 8);
    draw_triangle(0, 0, 1, 0, {0, 1, 0, 1});
    glFinish();
    focus(s, -0.5f, -0.5f, 8);
    draw_triangle(-1, 0.5f, 0.4f, 0, {0, 0, 1, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(10, 10), kRed);
    EXPECT_EQ(p.at(140, 140), kGreen);
    EXPECT_EQ(p.at(5, 200), kBlue);
    EXPECT_EQ(p.at(250, 5), kBlack);
}

TEST_F(Late, StencilOfTheProgramWorksAtEveryLevel) {
    const Surface s = foveated();
    glClear(GL_STENCIL_BUFFER_BIT);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_ALWAYS, 0x81, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    draw_triangle(-1, -1, 2, 0, {1, 0, 0, 1});
    glStencilFunc(GL_NOTEQUAL, 0x81, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    draw_triangle(-1, -1, 4, 0, {0, 0, 1, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(2, 2), kRed);
    EXPECT_EQ(p.at(120, 120), kRed);
    EXPECT_EQ(p.at(254, 254), kBlue);
    EXPECT_EQ(p.at(150, 150), kBlue);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, ScissoredDrawsAndClearsKeepTheirBoxes) {
    const Surface s = foveated();
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, 64, 256);
    glClearColor(1, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glScissor(128, 0, 128, 128);
    draw_triangle(-1, -1, 4, 0, {0, 1, 0, 1});
    const Picture p = read(s);
    EXPECT_EQ(p.at(30, 128), kRed);
    EXPECT_EQ(p.at(30, 3), kRed);
    EXPECT_EQ(p.at(96, 128), kBlack);
    EXPECT_EQ(p.at(200, 40), kGreen);
    EXPECT_EQ(p.at(200, 200), kBlack);
}

TEST_F(Late, BlendingHappensOncePerPixel) {
    const Surface s = foveated();
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    for (int i = 0; i < 4; ++i) draw_triangle(-1, -1, 4, 0, {0.2f, 0, 0, 0});
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel.r, 204);
}

TEST_F(Late, AtomicCountersCountEachFragmentOnce) {
    GLuint buffer = 0;
    const GLuint zero = 0;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, buffer);
    const GLuint p = program(
        "#version 310 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
        "#version 310 es\nprecision highp float; layout(binding = 0) uniform atomic_uint n; out vec4 c;\n"
        "void main() { atomicCounterIncrement(n); c = vec4(0, 1, 0, 1); }");
    const Surface s = foveated();
    for (const bool flush_before : {false, true}) {
        glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_triangle(-1, -1, 1, 0, {1, 0, 0, 1});
        if (flush_before) glFlush();  // then the pass is drawn in levels already
        glUseProgram(p);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        const Picture picture = read(s);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        const auto* n = static_cast<const GLuint*>(glMapBufferRange(GL_ATOMIC_COUNTER_BUFFER, 0, 4, GL_MAP_READ_BIT));
        ASSERT_NE(n, nullptr);
        EXPECT_EQ(*n, 256u * 256u) << flush_before;
        glUnmapBuffer(GL_ATOMIC_COUNTER_BUFFER);
        EXPECT_EQ(picture.at(1, 1), kGreen);
        EXPECT_EQ(picture.at(254, 254), kGreen);
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, DepthSurvivesTheWayBackToFullDensity) {
    GLuint buffer = 0;
    const GLuint zero = 0;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, buffer);
    glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
    const GLuint p = program(
        "#version 310 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.5, 1); }",
        "#version 310 es\nprecision highp float; layout(binding = 0) uniform atomic_uint n; out vec4 c;\n"
        "void main() { atomicCounterIncrement(n); c = vec4(1, 0, 0, 1); }");
    const Surface s = surface(256, 256);
    glClear(GL_DEPTH_BUFFER_BIT);  // the program's own depth buffer: everything would be in front of it
    glFinish();
    foveate(s);
    focus(s, 0, 0, 8);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    glFlush();
    glUseProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);  // behind, and with a side effect
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kGreen);
}

TEST_F(Late, TransformFeedbackCapturesOnce) {
    const GLuint p = link({{GL_VERTEX_SHADER, "#version 300 es\nout float v; void main() { v = float(gl_VertexID) + 1.0; gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }"},
                           {GL_FRAGMENT_SHADER, "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(0, 1, 0, 1); }"}},
                          "v");
    GLuint buffer = 0, query = 0;
    glGenBuffers(1, &buffer);
    glGenQueries(1, &query);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    const std::vector<float> empty(64, 0.0f);
    // The pass may be drawn in levels before, or begin with the capture: then the masks are drawn while it is active.
    for (const bool drawn_before : {true, false}) {
        const Surface s = foveated();
        glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, 256, empty.data(), GL_STATIC_READ);
        if (drawn_before) draw_triangle(-1, -1, 1, 0, {1, 0, 0, 1});
        glUseProgram(p);
        glBeginTransformFeedback(GL_TRIANGLES);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glEndTransformFeedback();
        const Picture picture = read(s);
        EXPECT_EQ(picture.at(1, 1), kGreen);
        EXPECT_EQ(picture.at(128, 128), kGreen);
        const auto* values = static_cast<const float*>(glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 256, GL_MAP_READ_BIT));
        ASSERT_NE(values, nullptr);
        const float wanted[8] = {1, 2, 3, 1, 2, 3, 0, 0};
        for (int i = 0; i < 8; ++i) EXPECT_EQ(values[i], wanted[i]) << i << ' ' << drawn_before;
        glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
        EXPECT_GL(GL_NO_ERROR);
    }
}

// A clear is pending when the capture begins; the program in use changed since. Found by random calls (seed 1).
TEST_F(Late, TransformFeedbackOfAProgramChosenAfterAPendingClear) {
    const GLuint p = link({{GL_VERTEX_SHADER, "#version 300 es\nout float v; void main() { v = float(gl_VertexID) + 1.0; gl_Position = vec4(0, 0, 0, 1); }"},
                           {GL_FRAGMENT_SHADER, "#version 300 es\nprecision highp float; out vec4 c; void main() { c = vec4(0, 1, 0, 1); }"}},
                          "v");
    const Surface s = foveated();
    draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
    GLint other = 0;
    glGetIntegerv(GL_CURRENT_PROGRAM, &other);
    GLuint buffer = 0;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    const std::vector<float> empty(64, 0.0f);
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, 256, empty.data(), GL_STATIC_READ);
    glFlush();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(p);
    glBeginTransformFeedback(GL_TRIANGLES);
    EXPECT_GL(GL_NO_ERROR);
    glClear(GL_DEPTH_BUFFER_BIT);
    glPauseTransformFeedback();
    glUseProgram(static_cast<GLuint>(other));
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glUseProgram(p);
    glResumeTransformFeedback();
    EXPECT_GL(GL_NO_ERROR);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glPauseTransformFeedback();
    EXPECT_GL(GL_NO_ERROR);
    glResumeTransformFeedback();
    glEndTransformFeedback();
    EXPECT_EQ(read(s).at(128, 128), kRed);
    const auto* values = static_cast<const float*>(glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 256, GL_MAP_READ_BIT));
    ASSERT_NE(values, nullptr);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(values[i], i < 3 ? static_cast<float>(i + 1) : 0.0f) << i;
    glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, OcclusionQueriesAnswerForTheProgramsDrawsOnly) {
    const Surface s = foveated();
    GLuint queries[2];
    glGenQueries(2, queries);
    glEnable(GL_DEPTH_TEST);
    draw_triangle(-1, -1, 4, -0.5f, {0, 1, 0, 1});
    glFlush();
    glBeginQuery(GL_ANY_SAMPLES_PASSED, queries[0]);
    draw_triangle(-1, -1, 4, 0.5f, {1, 0, 0, 1});  // hidden
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    glBeginQuery(GL_ANY_SAMPLES_PASSED, queries[1]);
    draw_triangle(0.9f, 0.9f, 0.01f, -0.9f, {0, 0, 1, 1});  // one pixel in the periphery
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    GLuint hidden = 9, visible = 9;
    glGetQueryObjectuiv(queries[0], GL_QUERY_RESULT, &hidden);
    glGetQueryObjectuiv(queries[1], GL_QUERY_RESULT, &visible);
    EXPECT_EQ(hidden, 0u);
    EXPECT_EQ(visible, 1u);
    EXPECT_EQ(read(s).at(1, 1), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, ADeletedProgramInUseStillDraws) {
    const Surface s = foveated();
    const GLuint p = attribute_program();
    glUseProgram(p);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, kCover);
    glEnableVertexAttribArray(0);
    glVertexAttrib4f(1, 0, 1, 0, 1);
    glDeleteProgram(p);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_EQ(read(s).at(128, 128), kGreen);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_EQ(read(s).at(1, 1), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Late, IndirectDrawsAreRecorded) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    GLuint array = 0, buffers[2];
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenBuffers(2, buffers);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCover, kCover, GL_STATIC_DRAW);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glVertexAttrib4f(1, 0, 1, 0, 1);
    const GLuint command[4] = {3, 1, 0, 0};
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, buffers[1]);
    glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof command, command, GL_STATIC_DRAW);
    glDrawArraysIndirect(GL_TRIANGLES, nullptr);
    EXPECT_GL(GL_NO_ERROR);
    glDrawArraysIndirect(GL_TRIANGLES, reinterpret_cast<void*>(1));
    EXPECT_GL(GL_INVALID_VALUE);
    const Picture p = read(s);
    EXPECT_EQ(p.at(1, 1), kGreen);
    EXPECT_EQ(p.at(128, 128), kGreen);
}

TEST_F(Late, MakingAnotherContextCurrentSubmits) {
    const Surface s = foveated();
    draw_triangle(-1, -1, 4, 0, {0, 1, 0, 1});
    const EGLContext other = make_context(context);
    use(other);
    GLuint framebuffer = 0;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color, 0);
    std::array<std::uint8_t, 4> pixel{};
    glReadPixels(1, 1, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
    EXPECT_EQ(pixel, (std::array<std::uint8_t, 4>{0, 255, 0, 255}));
}

TEST_F(Late, ContextsDestroyedWithPendingWorkDoNoHarm) {
    for (int i = 0; i < 5; ++i) {
        const EGLContext c = make_context();
        use(c);
        const Surface s = surface(64, 64);
        foveate(s);
        focus(s, 0, 0, 8);
        glClear(GL_COLOR_BUFFER_BIT);
        glFinish();
        glClear(GL_COLOR_BUFFER_BIT);
        EXPECT_TRUE(eglDestroyContext(display, c));  // current: lives on until it no longer is
        glClear(GL_DEPTH_BUFFER_BIT);
        EXPECT_GL(GL_NO_ERROR);
        contexts.pop_back();
        use(context);
    }
    EXPECT_EQ(read(surface(8, 8)).width, 8);
}

TEST_F(Late, AThousandFramebuffers) {
    std::vector<Surface> all;
    for (int i = 0; i < 1000; ++i) {
        all.push_back(surface(32, 32, i % 2 == 0));
        foveate(all.back());
        focus(all.back(), 0, 0, 20);
        glClearColor(static_cast<float>(i % 250) / 255, 0, 0, 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_triangle(-1, -1, 0.4f, 0, {0, 1, 0, 1});
    }
    for (int i = 0; i < 1000; i += 37) {
        const Picture p = read(all[static_cast<std::size_t>(i)]);
        EXPECT_NEAR(p.at(31, 31).r, i % 250, 1);
        EXPECT_EQ(p.at(1, 1), kGreen);
    }
    EXPECT_GL(GL_NO_ERROR);
}

// What is written into the image by other means than drawing stays, though the levels of the pass know nothing of it.
TEST_F(Late, CopiesAndStoresIntoTheImageOfAPassStay) {
    const GLuint store = link({{GL_COMPUTE_SHADER, "#version 310 es\nlayout(local_size_x = 8, local_size_y = 8) in; layout(rgba8, binding = 0) writeonly uniform highp image2D image;\n"
                                                  "void main() { imageStore(image, ivec2(gl_GlobalInvocationID.xy), vec4(0, 1, 0, 1)); }"}});
    const GLuint green = texture(256, 256);
    const std::vector<Rgba> pixels(256 * 256, kGreen);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 256, 256, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    for (const bool by_copy : {true, false}) {
        const Surface s = foveated();
        focus(s, 0, 0, 12);
        draw_triangle(-1, -1, 4, 0, {1, 0, 0, 1});
        glFlush();
        if (by_copy) {
            glCopyImageSubData(green, GL_TEXTURE_2D, 0, 0, 0, 0, s.color, GL_TEXTURE_2D, 0, 0, 0, 0, 256, 256, 1);
        } else {
            glUseProgram(store);
            glBindImageTexture(0, s.color, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA8);
            glDispatchCompute(32, 32, 1);
            glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT);
        }
        draw_triangle(-0.2f, -0.2f, 0.6f, 0, {0, 0, 1, 1});
        const Picture p = read(s);
        EXPECT_EQ(p.at(3, 3), kGreen) << by_copy;
        EXPECT_EQ(p.at(250, 250), kGreen) << by_copy;
        EXPECT_EQ(p.at(128, 128), kBlue) << by_copy;
        EXPECT_GL(GL_NO_ERROR);
    }
}

}  // namespace fovea::layer_test
