// GL_OVR_multiview, corner by corner: what it forbids, and that every kind of draw, query and dispatch reaches each view.
#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class Views : public LayerTest {
protected:
    static constexpr int kViews = 4, kSize = 32;
    static constexpr const char* kFragment = "#version 310 es\nprecision highp float; in vec4 v; out vec4 c; void main() { c = v; }";
    // One pixel column per view and instance: where it lies, and its colour, say which.
    static constexpr const char* kVertex =
        "#version 310 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 4) in; layout(location = 0) in vec2 p; out vec4 v;\n"
        "void main() { v = vec4(float(gl_ViewID_OVR + 1u) * 0.2, float(gl_InstanceID + 1) * 0.4, 0, 1); gl_Position = vec4(p.x + float(gl_InstanceID), p.y, 0, 1); }";
    static constexpr float kLeftHalf[12] = {-1, -1, 0, -1, -1, 1, 0, -1, 0, 1, -1, 1};

    void SetUp() override {
        LayerTest::SetUp();
        attach = reinterpret_cast<PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC>(eglGetProcAddress("glFramebufferTextureMultiviewOVR"));
        ASSERT_TRUE(attach);
        array = make_array();
        glGenFramebuffers(1, &framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 0, kViews);
        glViewport(0, 0, kSize, kSize);
        glClearColor(0, 0, 1, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        EXPECT_GL(GL_NO_ERROR);
    }
    GLuint make_array() {
        GLuint t = 0;
        glGenTextures(1, &t);
        glBindTexture(GL_TEXTURE_2D_ARRAY, t);
        glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, kSize, kSize, kViews);
        return t;
    }
    Picture read_view(int view) {
        Surface s{.framebuffer = 0, .color = array, .depth = 0, .width = kSize, .height = kSize};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, s.framebuffer);
        glFramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, view);
        return read(s);
    }
    static Rgba color(int view, int instance) {
        return {static_cast<std::uint8_t>(51 * (view + 1)), static_cast<std::uint8_t>(102 * (instance + 1)), 0, 255};
    }
    static constexpr Rgba kCleared{0, 0, 255, 255};
    void expect_views(bool second_instance) {
        for (int view = 0; view < kViews; ++view) {
            const Picture p = read_view(view);
            EXPECT_EQ(p.at(3, 3), color(view, 0)) << view;
            EXPECT_EQ(p.at(kSize - 3, 3), second_instance ? color(view, 1) : kCleared) << view;
        }
        EXPECT_GL(GL_NO_ERROR);
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    void expect_untouched() {
        for (int view = 0; view < kViews; ++view)
            for (const Rgba& pixel : read_view(view).pixels) ASSERT_EQ(pixel, kCleared);
    }

    PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC attach = nullptr;
    GLuint array = 0, framebuffer = 0;
};

TEST_F(Views, EveryKindOfDrawReachesEachView) {
    glUseProgram(program(kVertex, kFragment));
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, kLeftHalf);
    glDrawArrays(GL_TRIANGLES, 0, 6);
    expect_views(false);
    glDrawArraysInstanced(GL_TRIANGLES, 0, 6, 2);
    expect_views(true);
    const GLubyte indices[6] = {0, 1, 2, 3, 4, 5};
    glDrawElementsInstanced(GL_TRIANGLES, 6, GL_UNSIGNED_BYTE, indices, 2);
    expect_views(true);
    glDrawRangeElements(GL_TRIANGLES, 0, 5, 6, GL_UNSIGNED_BYTE, indices);
    expect_views(false);
    GLuint vertices = 0, vertex_array = 0, command = 0, elements = 0;
    glGenVertexArrays(1, &vertex_array);
    glBindVertexArray(vertex_array);
    glGenBuffers(1, &vertices);
    glBindBuffer(GL_ARRAY_BUFFER, vertices);
    glBufferData(GL_ARRAY_BUFFER, sizeof kLeftHalf, kLeftHalf, GL_STATIC_DRAW);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glGenBuffers(1, &elements);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, elements);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof indices, indices, GL_STATIC_DRAW);
    glGenBuffers(1, &command);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, command);
    const GLuint arrays[4] = {6, 2, 0, 0}, indexed[5] = {6, 2, 0, 0, 0};
    glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof arrays, arrays, GL_STATIC_DRAW);
    glDrawArraysIndirect(GL_TRIANGLES, nullptr);
    expect_views(true);
    glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof indexed, indexed, GL_STATIC_DRAW);
    glDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_BYTE, nullptr);
    expect_views(true);
    glDrawArraysIndirect(GL_TRIANGLES, reinterpret_cast<void*>(2));
    EXPECT_GL(GL_INVALID_VALUE);
}

TEST_F(Views, AnIndirectDrawThatCountsCountsOncePerView) {
    GLuint buffers[2], vertex_array = 0;
    const GLuint zero = 0, command[4] = {3, 1, 0, 0};
    glUseProgram(program("#version 310 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 4) in;\n"
                         "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, float(gl_ViewID_OVR) * 0.0 + 1.0); }",
                         "#version 310 es\nprecision highp float; layout(binding = 0) uniform atomic_uint n; out vec4 c; void main() { atomicCounterIncrement(n); c = vec4(1); }"));
    glGenBuffers(2, buffers);
    glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, buffers[0]);
    glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
    glGenVertexArrays(1, &vertex_array);
    glBindVertexArray(vertex_array);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, buffers[1]);
    glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof command, command, GL_STATIC_DRAW);
    glDrawArraysIndirect(GL_TRIANGLES, nullptr);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    const auto* n = static_cast<const GLuint*>(glMapBufferRange(GL_ATOMIC_COUNTER_BUFFER, 0, 4, GL_MAP_READ_BIT));
    ASSERT_TRUE(n);
    EXPECT_EQ(*n, static_cast<GLuint>(kViews * kSize * kSize));
    glUnmapBuffer(GL_ATOMIC_COUNTER_BUFFER);
    for (int view = 0; view < kViews; ++view) EXPECT_EQ(read_view(view).at(5, 5), (Rgba{255, 255, 255, 255})) << view;
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Views, NoTransformFeedback) {
    const GLuint p = link({{GL_VERTEX_SHADER, "#version 310 es\n#extension GL_OVR_multiview : require\nlayout(num_views = 4) in; out float v;\n"
                                                "void main() { v = 1.0; gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }"},
                             {GL_FRAGMENT_SHADER, "#version 310 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }"}},
                            "v");
    GLuint buffer = 0;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, 256, nullptr, GL_STATIC_READ);
    glUseProgram(p);
    glBeginTransformFeedback(GL_TRIANGLES);
    EXPECT_GL(GL_NO_ERROR);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_INVALID_OPERATION);
    glPauseTransformFeedback();  // active all the same
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_INVALID_OPERATION);
    glResumeTransformFeedback();
    glEndTransformFeedback();
    EXPECT_GL(GL_NO_ERROR);
    expect_untouched();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(read_view(kViews - 1).at(1, 1).r, 255);
}

TEST_F(Views, NoGeometryAndNoTessellationShaders) {
    const char* vertex = "#version 320 es\n#extension GL_OVR_multiview : require\nlayout(num_views = 4) in; void main() { gl_Position = vec4(0, 0, 0, 1); }";
    const char* fragment = "#version 320 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }";
    glUseProgram(link({{GL_VERTEX_SHADER, vertex},
                         {GL_GEOMETRY_SHADER, "#version 320 es\nlayout(points) in; layout(points, max_vertices = 1) out; void main() { gl_Position = gl_in[0].gl_Position; EmitVertex(); }"},
                         {GL_FRAGMENT_SHADER, fragment}}));
    glDrawArrays(GL_POINTS, 0, 1);
    EXPECT_GL(GL_INVALID_OPERATION);
    glUseProgram(link({{GL_VERTEX_SHADER, vertex},
                         {GL_TESS_CONTROL_SHADER, "#version 320 es\nlayout(vertices = 1) out; void main() { gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position; gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = gl_TessLevelInner[0] = 1.0; }"},
                         {GL_TESS_EVALUATION_SHADER, "#version 320 es\nlayout(triangles) in; void main() { gl_Position = gl_in[0].gl_Position; }"},
                         {GL_FRAGMENT_SHADER, fragment}}));
    glPatchParameteri(GL_PATCH_VERTICES, 1);
    glDrawArrays(GL_PATCHES, 0, 1);
    EXPECT_GL(GL_INVALID_OPERATION);
    expect_untouched();
}

TEST_F(Views, AnOcclusionQueryIsTrueWhenAnyViewPasses) {
    const GLuint p = program("#version 310 es\n#extension GL_OVR_multiview : require\nlayout(num_views = 4) in; uniform uint which;\n"
                             "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0 + (gl_ViewID_OVR == which ? 0.0 : 9.0), float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                             "#version 310 es\nprecision highp float; out vec4 c; void main() { c = vec4(1); }");
    glUseProgram(p);
    for (const GLuint which : {0u, 3u, 7u}) {
        GLuint query = 0, passed = 9;
        glGenQueries(1, &query);
        glUniform1ui(glGetUniformLocation(p, "which"), which);
        glBeginQuery(GL_ANY_SAMPLES_PASSED, query);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glEndQuery(GL_ANY_SAMPLES_PASSED);
        glGetQueryObjectuiv(query, GL_QUERY_RESULT, &passed);
        EXPECT_EQ(passed, which < 4u ? 1u : 0u) << which;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Views, ABlitWritesTheFirstViewOnlyAndReadsNone) {
    const Surface source = surface(kSize, kSize, false);
    glClearColor(1, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, source.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(read_view(0).at(9, 9), (Rgba{255, 0, 0, 255}));
    EXPECT_EQ(read_view(1).at(9, 9), kCleared);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, source.framebuffer);
    glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    glBindTexture(GL_TEXTURE_2D, texture(kSize, kSize));
    glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 0, 0, 4, 4);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
}

TEST_F(Views, ADispatchIsMadeOncePerView) {
    const GLuint p = link({{GL_COMPUTE_SHADER, "#version 310 es\n#extension GL_OVR_multiview2 : require\nlayout(local_size_x = 1) in;\n"
                                                 "layout(std430, binding = 0) buffer Seen { uint seen[8]; }; void main() { atomicAdd(seen[gl_ViewID_OVR], 1u); }"}});
    GLuint buffers[2];
    const GLuint zero[8] = {}, one[3] = {1, 1, 1};
    glGenBuffers(2, buffers);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffers[0]);
    glUseProgram(p);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffers[1]);
    glBufferData(GL_DISPATCH_INDIRECT_BUFFER, sizeof one, one, GL_STATIC_DRAW);
    for (const bool indirect : {false, true}) {
        glBufferData(GL_SHADER_STORAGE_BUFFER, sizeof zero, zero, GL_DYNAMIC_COPY);
        indirect ? glDispatchComputeIndirect(0) : glDispatchCompute(1, 1, 1);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        const auto* seen = static_cast<const GLuint*>(glMapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, sizeof zero, GL_MAP_READ_BIT));
        ASSERT_TRUE(seen);
        for (int i = 0; i < 8; ++i) EXPECT_EQ(seen[i], i < kViews ? 1u : 0u) << i << ' ' << indirect;
        glUnmapBuffer(GL_SHADER_STORAGE_BUFFER);
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Views, ErrorsOfTheAttachmentAreThoseOfFramebufferTextureLayerAndItsOwn) {
    GLint most = 0, base = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most);
    const auto fails = [this](GLenum error, GLenum target, GLenum point, GLuint name, GLint level, GLint first, GLsizei views) {
        attach(target, point, name, level, first, views);
        EXPECT_EQ(glGetError(), error) << std::hex << target << ' ' << point << std::dec << ' ' << level << ' ' << first << ' ' << views;
    };
    fails(GL_INVALID_VALUE, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, most - 2, 2);
    fails(GL_INVALID_VALUE, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 0, 17);
    fails(GL_INVALID_VALUE, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, -1, 0, 2);
    fails(GL_INVALID_VALUE, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 99, 0, 2);
    fails(GL_INVALID_ENUM, GL_TEXTURE_2D, GL_COLOR_ATTACHMENT0, array, 0, 0, 2);
    fails(GL_INVALID_OPERATION, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, 4711, 0, 0, 2);
    fails(GL_NO_ERROR, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, most - 3, 2);  // legal, and incomplete
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT));
    glClear(GL_COLOR_BUFFER_BIT);
    EXPECT_GL(GL_INVALID_FRAMEBUFFER_OPERATION);
    fails(GL_NO_ERROR, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 1, 3);
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER, &base);
    EXPECT_EQ(base, 1);
    fails(GL_NO_ERROR, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, 0, 0, -5, -5);  // detaches, whatever the rest says
    GLint type = -1;
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE, &type);
    EXPECT_EQ(type, GL_NONE);
    GLint views = 0;
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 2);
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR, &views);
    EXPECT_EQ(views, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    fails(GL_INVALID_OPERATION, GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 0, 2);
}

}  // namespace fovea::layer_test
