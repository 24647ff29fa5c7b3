// Uploads into buffers while draws are pending: each draw has the data of its time, and the buffer holds the last.
#include <cstring>
#include <vector>

#include "tests/layer/late_fixture.hpp"

namespace fovea::layer_test {

class Uploads : public LateFixture {
protected:
    static constexpr float kCorner[6] = {-1, -1, 0, -1, -1, 0};
    // A buffer bound to GL_ARRAY_BUFFER that attribute 0 is read from; it begins with a triangle over everything.
    GLuint covering_buffer(GLsizeiptr bytes = sizeof kCover) {
        GLuint buffer = 0;
        glGenBuffers(1, &buffer);
        glBindBuffer(GL_ARRAY_BUFFER, buffer);
        std::vector<std::byte> data(static_cast<std::size_t>(bytes));
        std::memcpy(data.data(), kCover, sizeof kCover);
        glBufferData(GL_ARRAY_BUFFER, bytes, data.data(), GL_DYNAMIC_DRAW);
        glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
        glEnableVertexAttribArray(0);
        glUseProgram(attribute_program());
        return buffer;
    }
    static void draw_in(float r, float g, float b) {
        glVertexAttrib4f(1, r, g, b, 1);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    static void expect_corner(GLenum target, GLintptr at = 0) {
        const auto* now = static_cast<const float*>(glMapBufferRange(target, at, sizeof kCorner, GL_MAP_READ_BIT));
        ASSERT_NE(now, nullptr);
        EXPECT_EQ(std::memcmp(now, kCorner, sizeof kCorner), 0);
        glUnmapBuffer(target);
    }
};

TEST_F(Uploads, BetweenDrawsKeepEachDrawsDataAndStayLate) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    GLuint buffers[2];
    glGenBuffers(2, buffers);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCover, kCover, GL_STREAM_DRAW);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glVertexAttrib4f(1, 1, 0, 0, 1);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    const float corner[6] = {-1, -1, 0, -1, -1, 0}, other[8] = {1, 1, 0, 1, 1, 0, 9, 9};
    glBufferSubData(GL_ARRAY_BUFFER, 0, sizeof corner, corner);
    glVertexAttrib4f(1, 0, 1, 0, 1);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBufferData(GL_ARRAY_BUFFER, sizeof other, other, GL_DYNAMIC_DRAW);  // another size
    glVertexAttrib4f(1, 0, 0, 1, 1);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    focus(s, 0.9f, 0.9f, 8);  // after all of them
    const Picture p = read(s);
    EXPECT_EQ(p.at(2, 2), kGreen);
    EXPECT_EQ(p.at(128, 128), kRed);
    EXPECT_EQ(p.at(3, 252), kRed);
    EXPECT_EQ(p.at(254, 254), kBlue);
    GLint size = 0, usage = 0;
    glGetBufferParameteriv(GL_ARRAY_BUFFER, GL_BUFFER_SIZE, &size);
    glGetBufferParameteriv(GL_ARRAY_BUFFER, GL_BUFFER_USAGE, &usage);
    EXPECT_EQ(size, 32);
    EXPECT_EQ(usage, GL_DYNAMIC_DRAW);
    const auto* now = static_cast<const float*>(glMapBufferRange(GL_ARRAY_BUFFER, 0, 32, GL_MAP_READ_BIT));
    ASSERT_NE(now, nullptr);
    EXPECT_EQ(now[6], 9.0f);
    glUnmapBuffer(GL_ARRAY_BUFFER);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Uploads, OfUniformBuffersPerDrawStayLate) {
    const Surface s = foveated();
    const GLuint p = program("#version 300 es\nlayout(std140) uniform Place { vec4 place; vec4 tint; }; out vec4 v;\n"
                             "void main() { vec2 q = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)); v = tint; gl_Position = vec4(place.xy + q * place.z, 0, 1); }",
                             "#version 300 es\nprecision highp float; in vec4 v; out vec4 c; void main() { c = v; }");
    GLuint buffer = 0;
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer);
    glBufferData(GL_UNIFORM_BUFFER, 32, nullptr, GL_DYNAMIC_DRAW);
    glUseProgram(p);
    const GLfloat values[3][8] = {{-1, -1, 1, 0, 1, 0, 0, 1}, {0, -1, 1, 0, 0, 1, 0, 1}, {-1, 0, 1, 0, 0, 0, 1, 1}};
    for (const auto& v : values) {
        glBufferSubData(GL_UNIFORM_BUFFER, 0, 32, v);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    glBufferSubData(GL_UNIFORM_BUFFER, 16, 32, values);  // beyond the end
    EXPECT_GL(GL_INVALID_VALUE);
    const Picture picture = read(s);
    EXPECT_EQ(picture.at(1, 1), kRed);
    EXPECT_EQ(picture.at(130, 1), kGreen);
    EXPECT_EQ(picture.at(1, 130), kBlue);
}

using VertexFormats = Uploads;

// Programs that prepare the next frame before they swap.
TEST_F(Uploads, AfterTheLastDrawAreMadeOnceItHasRun) {
    for (const float gain : {0.0f, 8.0f}) {
        const Surface s = foveated();
        focus(s, 0, 0, gain);
        covering_buffer();
        draw_in(1, 0, 0);
        float data[6];
        std::memcpy(data, kCorner, sizeof data);
        glBufferSubData(GL_ARRAY_BUFFER, 0, 12, data);
        glBufferSubData(GL_ARRAY_BUFFER, 12, 12, data + 3);
        std::memset(data, 0, sizeof data);
        focus(s, 0.2f, 0.2f, gain);
        const Picture p = read(s);
        for (const Rgba& pixel : p.pixels) ASSERT_EQ(pixel, kRed) << gain;
        expect_corner(GL_ARRAY_BUFFER);
        draw_in(0, 1, 0);
        const Picture next = read(s);
        EXPECT_EQ(next.at(2, 2), kGreen);
        EXPECT_EQ(next.at(200, 200), kRed);
        EXPECT_GL(GL_NO_ERROR);
    }
}

TEST_F(Uploads, PutOffAreSeenByWhatReadsTheBufferNext) {
    const Surface s = foveated();
    const GLuint buffer = covering_buffer();
    draw_in(1, 0, 0);
    glBufferSubData(GL_ARRAY_BUFFER, 0, sizeof kCorner, kCorner);
    GLuint copy = 0;
    glGenBuffers(1, &copy);
    glBindBuffer(GL_COPY_WRITE_BUFFER, copy);
    glBufferData(GL_COPY_WRITE_BUFFER, sizeof kCover, kCover, GL_STATIC_DRAW);
    glCopyBufferSubData(GL_ARRAY_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, sizeof kCorner);
    expect_corner(GL_COPY_WRITE_BUFFER);
    GLint bound = 0;
    glGetIntegerv(GL_COPY_WRITE_BUFFER_BINDING, &bound);
    EXPECT_EQ(static_cast<GLuint>(bound), copy);
    // New contents that are larger come after what was put off.
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferSubData(GL_ARRAY_BUFFER, 0, sizeof kCover, kCover);
    draw_in(0, 0, 1);
    const float far_away[2] = {5, 5};
    glBufferSubData(GL_ARRAY_BUFFER, 0, sizeof far_away, far_away);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCorner, kCorner, GL_STREAM_DRAW);
    draw_in(0, 1, 0);
    const Picture p = read(s);
    EXPECT_EQ(p.at(200, 200), kBlue);
    EXPECT_EQ(p.at(2, 2), kGreen);
    expect_corner(GL_ARRAY_BUFFER);
    EXPECT_GL(GL_NO_ERROR);
}

// The layer reads the indices of a draw from client memory to know which vertices to copy.
TEST_F(Uploads, PutOffIndicesChooseTheVerticesThatAreCopied) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    const GLushort first[3] = {0, 1, 2}, second[3] = {3, 4, 5};
    GLuint indices = 0;
    glGenBuffers(1, &indices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof first, first, GL_DYNAMIC_DRAW);
    float vertices[12];
    std::memcpy(vertices, kCover, sizeof kCover);
    std::memcpy(vertices + 6, kCorner, sizeof kCorner);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, vertices);
    glEnableVertexAttribArray(0);
    glVertexAttrib4f(1, 1, 0, 0, 1);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_SHORT, nullptr);
    glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, 0, sizeof second, second);
    glVertexAttrib4f(1, 0, 1, 0, 1);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_SHORT, nullptr);
    std::memset(vertices, 0, sizeof vertices);
    const Picture p = read(s);
    EXPECT_EQ(p.at(2, 2), kGreen);
    EXPECT_EQ(p.at(200, 200), kRed);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(Uploads, ThatAreErrorsAreErrorsAtOnce) {
    const Surface s = foveated();
    covering_buffer();
    draw_in(1, 0, 0);
    glBufferSubData(GL_ARRAY_BUFFER, 8, sizeof kCorner, kCorner);  // beyond the end
    EXPECT_GL(GL_INVALID_VALUE);
    draw_in(1, 0, 0);
    glBufferSubData(GL_ARRAY_BUFFER, -4, 4, kCorner);
    EXPECT_GL(GL_INVALID_VALUE);
    draw_in(1, 0, 0);
    glBindBuffer(GL_ARRAY_BUFFER, 0);
    glBufferSubData(GL_ARRAY_BUFFER, 0, 4, kCorner);
    EXPECT_GL(GL_INVALID_OPERATION);
    const auto storage = reinterpret_cast<PFNGLBUFFERSTORAGEEXTPROC>(eglGetProcAddress("glBufferStorageEXT"));
    if (storage) {
        GLuint fixed = 0;
        glGenBuffers(1, &fixed);
        glBindBuffer(GL_ARRAY_BUFFER, fixed);
        storage(GL_ARRAY_BUFFER, sizeof kCover, kCover, 0);
        draw_in(1, 0, 0);
        glBufferSubData(GL_ARRAY_BUFFER, 0, sizeof kCorner, kCorner);
        EXPECT_GL(GL_INVALID_OPERATION);
    }
    EXPECT_EQ(read(s).at(2, 2), kRed);
}

// Formats and binding points set by themselves. Found by random calls (seed 10074).
TEST_F(VertexFormats, AndBindingsBelongToTheirDraw) {
    const Surface s = foveated();
    glUseProgram(attribute_program());
    GLuint array = 0, buffer = 0;
    glGenVertexArrays(1, &array);
    glGenBuffers(1, &buffer);
    glBindVertexArray(array);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    float data[16] = {0, 0};
    std::memcpy(data + 2, kCover, sizeof kCover);
    std::memcpy(data + 8, kCorner, sizeof kCorner);
    glBufferData(GL_ARRAY_BUFFER, sizeof data, data, GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribFormat(0, 2, GL_FLOAT, GL_FALSE, 8);  // before anything is recorded: the two floats in front are left out
    glVertexAttribBinding(0, 3);
    glBindVertexBuffer(3, buffer, 0, 8);
    glFlush();
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDisableVertexAttribArray(0);
    glEnableVertexAttribArray(0);
    draw_in(1, 0, 0);
    glVertexAttribFormat(0, 2, GL_FLOAT, GL_FALSE, 0);
    glVertexAttribBinding(0, 5);
    glBindVertexBuffer(5, buffer, 32, 8);
    draw_in(0, 1, 0);
    for (int again = 0; again < 2; ++again) {
        const Picture p = read(s);
        EXPECT_EQ(p.at(200, 200), kRed);
        EXPECT_EQ(p.at(2, 2), kGreen);
        GLint binding = 0, offset = 9;
        glGetVertexAttribiv(0, GL_VERTEX_ATTRIB_BINDING, &binding);
        glGetVertexAttribiv(0, GL_VERTEX_ATTRIB_RELATIVE_OFFSET, &offset);
        EXPECT_EQ(binding, 5);
        EXPECT_EQ(offset, 0);
        draw_in(0, 1, 0);
    }
    // A pending clear, and a format set before the first draw.
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnableVertexAttribArray(0);
    glVertexAttribBinding(0, 3);
    glVertexAttribFormat(0, 2, GL_FLOAT, GL_FALSE, 8);
    draw_in(0, 0, 1);
    EXPECT_EQ(read(s).at(200, 200), kBlue);
    EXPECT_GL(GL_NO_ERROR);
}

// A stride of 0 with the pointer, another with the binding. Found by random calls (seed 344 of those about objects).
TEST_F(VertexFormats, AStrideOfTheBindingStaysWithItsDraw) {
    const Surface s = foveated();
    GLuint array = 0, buffer = 0;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    (void)covering_buffer();
    float spread[12] = {};
    for (int i = 0; i < 3; ++i) spread[4 * i] = kCover[2 * i], spread[4 * i + 1] = kCover[2 * i + 1];
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, sizeof spread, spread, GL_STATIC_DRAW);
    glBindVertexBuffer(0, buffer, 0, 16);
    glFlush();  // set before anything is recorded
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_in(1, 0, 0);
    glVertexAttribBinding(0, 0);
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kRed);
    EXPECT_GL(GL_NO_ERROR);
}

// OpenGL ES 3.2, 5.1.3: what an array object that is not bound refers to stays when its name is deleted. Draws from it that wait
// for their submission read it, whatever the attribute becomes after them, and whoever has the name then.
class DeletedBuffers : public Uploads {
protected:
    // An array object, not bound any more, with a triangle over everything in a buffer that has no name any more.
    GLuint array_with_deleted_buffer() {
        GLuint array = 0;
        glGenVertexArrays(1, &array);
        glBindVertexArray(array);
        deleted = covering_buffer();
        glBindVertexArray(0);
        glDeleteBuffers(1, &deleted);
        return array;
    }
    GLuint deleted = 0;
};

TEST_F(DeletedBuffers, FeedTheDrawsBeforeTheirAttributeIsSetAnew) {
    const Surface s = foveated();
    glBindVertexArray(array_with_deleted_buffer());
    GLint kept = 0;
    glGetVertexAttribiv(0, GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING, &kept);
    EXPECT_EQ(static_cast<GLuint>(kept), deleted);
    GLuint other = 0;  // of the same name, if it is given again
    for (int i = 0; i < 8 && other != deleted; ++i) glGenBuffers(1, &other);
    glBindBuffer(GL_ARRAY_BUFFER, other);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCorner, kCorner, GL_STATIC_DRAW);
    for (int frame = 0; frame < 3; ++frame) {
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_in(1, 0, 0);
        if (frame > 0) glDisableVertexAttribArray(0), glEnableVertexAttribArray(0), draw_in(0, 0, 1);
        if (frame == 2) {
            glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
            draw_in(0, 1, 0);
        }
        const Picture p = read(s);
        for (const auto& [x, y] : {std::pair{128, 128}, {250, 250}, {250, 3}, {120, 140}}) EXPECT_EQ(p.at(x, y), frame > 0 ? kBlue : kRed) << frame << " at " << x << ' ' << y;
        EXPECT_EQ(p.at(3, 3), frame == 2 ? kGreen : frame == 1 ? kBlue : kRed) << frame;
    }
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(DeletedBuffers, HoldIndicesToo) {
    const Surface s = foveated();
    const GLubyte all[3] = {0, 1, 2}, none[3] = {0, 0, 0};
    GLuint array = 0, indices = 0, other = 0;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    (void)covering_buffer();
    glGenBuffers(1, &indices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof all, all, GL_STATIC_DRAW);
    glBindVertexArray(0);
    glDeleteBuffers(1, &indices);
    glGenBuffers(1, &other);
    glBindVertexArray(array);
    glVertexAttrib4f(1, 1, 0, 0, 1);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, nullptr);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, other);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof none, none, GL_STATIC_DRAW);
    glVertexAttrib4f(1, 0, 1, 0, 1);
    glDrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_BYTE, nullptr);
    for (const Rgba& pixel : read(s).pixels) ASSERT_EQ(pixel, kRed);
    EXPECT_GL(GL_NO_ERROR);
}

// Another context of the share group deletes the name; and the array object without a name is one as well.
TEST_F(DeletedBuffers, ByAnotherContextAndOfTheDefaultArray) {
    const Surface s = foveated();
    const EGLContext second = make_context(context);
    GLuint array = 0;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    const GLuint buffer = covering_buffer();
    glFinish();
    use(second);
    glDeleteBuffers(1, &buffer);
    use(context);
    GLuint other = 0;
    glGenBuffers(1, &other);
    glBindBuffer(GL_ARRAY_BUFFER, other);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCorner, kCorner, GL_STATIC_DRAW);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_in(1, 0, 0);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    draw_in(0, 1, 0);
    Picture p = read(s);
    EXPECT_EQ(p.at(200, 200), kRed);
    EXPECT_EQ(p.at(3, 3), kGreen);

    glBindVertexArray(0);
    const GLuint of_default = covering_buffer();
    glBindVertexArray(array);
    glDeleteBuffers(1, &of_default);
    glBindVertexArray(0);
    glGenBuffers(1, &other);
    glBindBuffer(GL_ARRAY_BUFFER, other);
    glBufferData(GL_ARRAY_BUFFER, sizeof kCorner, kCorner, GL_STATIC_DRAW);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_in(1, 0, 0);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    draw_in(0, 1, 0);
    p = read(s);
    EXPECT_EQ(p.at(200, 200), kRed);
    EXPECT_EQ(p.at(3, 3), kGreen);
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
