#include "tests/layer/random_objects.hpp"

#include <array>
#include <cstring>

namespace fovea::layer_test {
namespace {

constexpr GLsizeiptr kVertexBytes = 512, kCapturedBytes = 1024, kPixelBytes = 4096;

const void* offset(int bytes) { return reinterpret_cast<const void*>(static_cast<std::uintptr_t>(bytes)); }

}  // namespace

void RandomObjects::set_up(const Surface& target, GLuint second_color, std::function<void(const std::function<void()>&)> in_other_context) {
    target_ = target;
    second_color_ = second_color;
    in_other_context_ = std::move(in_other_context);
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &uniform_step_);
    glGenVertexArrays(1, &array_);
    glGenQueries(1, &query_);
    const auto buffer = [](GLuint& name, GLsizeiptr bytes, const void* data) {
        glGenBuffers(1, &name);
        glBindBuffer(GL_ARRAY_BUFFER, name);
        glBufferData(GL_ARRAY_BUFFER, bytes, data, GL_DYNAMIC_DRAW);
    };
    std::array<float, kVertexBytes / 4> numbers{};
    for (float& v : numbers) v = real(-1.2f, 1.2f);
    buffer(vertex_, kVertexBytes, numbers.data());
    const GLushort indices[16] = {0, 1, 2, 0xffff, 3, 4, 5, 6, 0xffff, 7, 8, 9, 2, 4, 6, 8};
    buffer(indices_, sizeof indices, indices);
    std::vector<float> places(static_cast<std::size_t>(uniform_step_), 0.1f);  // four blocks
    buffer(uniforms_, uniform_step_ * 4, places.data());
    const std::array<std::uint32_t, kPixelBytes / 4> nothing{};
    buffer(storage_, 64, nothing.data());
    buffer(captured_, kCapturedBytes, nothing.data());
    buffer(pack_, kPixelBytes, nothing.data());
    std::array<std::uint32_t, kPixelBytes / 4> noise;
    for (std::uint32_t& v : noise) v = static_cast<std::uint32_t>(random_());
    buffer(unpack_, kPixelBytes, noise.data());
    const GLuint command[5] = {6, 1, 0, 0, 0};
    buffer(commands_, sizeof command, command);
    glBindBufferRange(GL_UNIFORM_BUFFER, 1, uniforms_, 0, uniform_step_);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, storage_);

    glActiveTexture(GL_TEXTURE3);
    glGenTextures(1, &mipmapped_);
    glBindTexture(GL_TEXTURE_2D, mipmapped_);
    glTexStorage2D(GL_TEXTURE_2D, 4, GL_RGBA8, 8, 8);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 8, 8, GL_RGBA, GL_UNSIGNED_BYTE, noise.data());
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
    glGenTextures(1, &layers_);
    glBindTexture(GL_TEXTURE_2D_ARRAY, layers_);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, 16, 16, 3);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, 16, 16, 3, GL_RGBA, GL_UNSIGNED_BYTE, noise.data());
    glActiveTexture(GL_TEXTURE0);

    glGenRenderbuffers(1, &renderbuffer_);
    glBindRenderbuffer(GL_RENDERBUFFER, renderbuffer_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 24, 24);
    glGenFramebuffers(1, &renderbuffer_framebuffer_);
    glBindFramebuffer(GL_FRAMEBUFFER, renderbuffer_framebuffer_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, renderbuffer_);
    glClear(GL_COLOR_BUFFER_BIT);
    glGenFramebuffers(1, &second_framebuffer_);
    glBindFramebuffer(GL_FRAMEBUFFER, second_framebuffer_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, second_color_, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    glGenProgramPipelines(1, &pipeline_);
    glUseProgramStages(pipeline_, GL_VERTEX_SHADER_BIT, programs_.vertex_stage);
    glUseProgramStages(pipeline_, GL_FRAGMENT_SHADER_BIT, programs_.fragment_stage);
    glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer);
    while (glGetError() != GL_NO_ERROR) {}
}

void RandomObjects::vertices() {
    glBindVertexArray(array_);
    glBindBuffer(GL_ARRAY_BUFFER, vertex_);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, pick(2) ? 0 : 16, offset(8 * pick(3)));
    glEnableVertexAttribArray(0);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
}

void RandomObjects::draw_something(GLenum mode) {
    vertices();
    pick(2) ? glDrawArrays(mode, pick(5), pick(12)) : glDrawElements(mode, pick(16), GL_UNSIGNED_SHORT, offset(0));
}

void RandomObjects::answer_buffer(GLuint buffer, GLsizeiptr bytes) {
    glBindBuffer(GL_COPY_READ_BUFFER, buffer);
    const auto* data = static_cast<const std::uint32_t*>(glMapBufferRange(GL_COPY_READ_BUFFER, 0, bytes, GL_MAP_READ_BIT));
    if (data) answers.insert(answers.end(), data, data + bytes / 4);
    glUnmapBuffer(GL_COPY_READ_BUFFER);
}

void RandomObjects::answer_pixels(GLuint framebuffer, int x, int y, int w, int h) {
    if (!pixels_) return;
    GLint bound = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &bound);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    std::vector<std::uint32_t> pixels(static_cast<std::size_t>(w * h));
    glReadPixels(x, y, w, h, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    answers.insert(answers.end(), pixels.begin(), pixels.end());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(bound));
}

std::string RandomObjects::step(GLenum mode) {
    const int kind = pick(9);
    switch (pick(5)) {
        case 4: deleted_buffers(mode, kind); return "deleted buffers " + std::to_string(kind);
        case 0: draws(mode, kind); return "draws " + std::to_string(kind);
        case 1: buffers(mode, kind); return "buffers " + std::to_string(kind);
        case 2: images(mode, kind); return "images " + std::to_string(kind);
        default: others(mode, kind); return "others " + std::to_string(kind);
    }
}

// Each begins with the array bound that may hold buffers without names, and ends with another.
void RandomObjects::deleted_buffers(GLenum mode, int kind) {
    if (holding_array_ == 0) glGenVertexArrays(1, &holding_array_);
    if (kind < 3) {  // a new buffer, in the array and then without its name
        std::array<float, 32> v;
        for (float& x : v) x = real(-1.2f, 1.2f);
        glBindVertexArray(holding_array_);
        glGenBuffers(1, &doomed_);
        glBindBuffer(GL_ARRAY_BUFFER, doomed_);
        glBufferData(GL_ARRAY_BUFFER, sizeof v, v.data(), GL_STATIC_DRAW);
        if (kind == 2) {
            glVertexAttribFormat(0, 2, GL_FLOAT, GL_FALSE, 8);
            glVertexAttribBinding(0, 0);
            glBindVertexBuffer(0, doomed_, 8 * pick(3), 8);
        } else {
            glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, pick(2) ? 0 : 16, offset(8 * pick(2)));
        }
        glEnableVertexAttribArray(0);
        const GLushort order[6] = {5, 3, 4, 0, 1, 2};
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, kind == 1 ? doomed_ : indices_);
        if (kind == 1) glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, 64, sizeof order, order);
        if (pick(2)) glDrawArrays(mode, 0, 3 + pick(4));
        glBindVertexArray(pick(2) ? array_ : 0);
        glDeleteBuffers(1, &doomed_);
    }
    glBindVertexArray(holding_array_);
    GLint there = 0;
    glGetVertexAttribiv(0, GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING, &there);
    if (there == 0) {  // deleted while it was bound: client memory that nobody has
        glBindVertexArray(array_);
        return;
    }
    const auto draw = [&] { pick(2) ? glDrawArrays(mode, pick(2), 3 + pick(4)) : glDrawElements(mode, 6, GL_UNSIGNED_SHORT, offset(kind == 1 ? 64 : 0)); };
    glVertexAttrib4f(1, real(0, 1), real(0, 1), real(0, 1), 1);
    draw();
    switch (kind) {
        case 3: glVertexAttribDivisor(0, 0); break;
        case 4: glDisableVertexAttribArray(0), glEnableVertexAttribArray(0); break;
        case 5: glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_); break;
        case 6: glBindVertexBuffer(0, vertex_, 8 * pick(3), 8); break;
        case 7: {
            glBindBuffer(GL_ARRAY_BUFFER, vertex_);
            glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, offset(8 * pick(3)));
            break;
        }
        default: break;
    }
    draw();
    if (kind == 8 && pick(2)) glFlush();
    glBindVertexArray(array_);
}

void RandomObjects::draws(GLenum mode, int kind) {
    switch (kind) {
        case 0: case 1: draw_something(mode); break;
        case 2: {  // indices of the program's memory
            vertices();
            glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
            GLubyte indices[10];
            for (GLubyte& i : indices) i = pick(5) ? static_cast<GLubyte>(pick(12)) : GLubyte{0xff};
            const bool restart = glIsEnabled(GL_PRIMITIVE_RESTART_FIXED_INDEX) == GL_TRUE;
            for (GLubyte& i : indices)
                if (!restart && i == 0xff) i = 0;
            pick(2) ? glDrawElementsInstanced(mode, pick(11), GL_UNSIGNED_BYTE, indices, pick(3))
                    : glDrawRangeElements(mode, 0, 20, pick(11), GL_UNSIGNED_BYTE, indices);
            std::memset(indices, 1, sizeof indices);
            break;
        }
        case 3: pick(2) ? glEnable(GL_PRIMITIVE_RESTART_FIXED_INDEX) : glDisable(GL_PRIMITIVE_RESTART_FIXED_INDEX); break;
        case 4: {
            vertices();
            glVertexAttribDivisor(0, static_cast<GLuint>(pick(3)));
            glDrawElementsInstancedBaseVertex(mode, pick(8), GL_UNSIGNED_SHORT, offset(2 * 9), pick(4), pick(4));
            glVertexAttribDivisor(0, 0);
            break;
        }
        case 5: {
            vertices();
            glBindBuffer(GL_DRAW_INDIRECT_BUFFER, pick(8) ? commands_ : 0);
            const GLuint command[5] = {static_cast<GLuint>(pick(8)), static_cast<GLuint>(pick(3)), static_cast<GLuint>(pick(4)), static_cast<GLuint>(pick(4)), 0};
            if (pick(2)) glBufferSubData(GL_DRAW_INDIRECT_BUFFER, 0, sizeof command, command);
            pick(2) ? glDrawElementsIndirect(mode, GL_UNSIGNED_SHORT, offset(pick(8) ? 0 : 4)) : glDrawArraysIndirect(mode, offset(0));
            break;
        }
        case 6: {  // attributes by format and binding
            glBindVertexArray(array_);
            glVertexAttribFormat(0, 2, GL_FLOAT, GL_FALSE, static_cast<GLuint>(8 * pick(2)));
            glVertexAttribBinding(0, static_cast<GLuint>(pick(2)));
            glBindVertexBuffer(0, vertex_, 8 * pick(3), 8 * (1 + pick(2)));
            glBindVertexBuffer(1, vertex_, 0, 16);
            glEnableVertexAttribArray(0);
            glDrawArrays(mode, 0, pick(9));
            glVertexAttribBinding(0, 0);
            break;
        }
        case 7: {
            GLint used = 0;
            glGetIntegerv(GL_CURRENT_PROGRAM, &used);
            glUseProgram(0);
            glBindProgramPipeline(pick(6) ? pipeline_ : 0);
            glProgramUniform4f(programs_.fragment_stage, glGetUniformLocation(programs_.fragment_stage, "tint"), real(0, 1), real(0, 1), real(0, 1), 1);
            draw_something(mode);
            glBindProgramPipeline(0);
            glUseProgram(static_cast<GLuint>(used));
            break;
        }
        case 8: glUseProgram(programs_.plain); break;
    }
}

void RandomObjects::buffers(GLenum mode, int kind) {
    switch (kind) {
        case 0: {
            glBindBufferRange(GL_UNIFORM_BUFFER, 1, uniforms_, uniform_step_ * pick(4), pick(9) ? uniform_step_ : -1);
            break;
        }
        case 1: {
            const float v[4] = {real(-1, 1), real(-1, 1), real(-1, 1), real(-1, 1)};
            glBindBuffer(GL_UNIFORM_BUFFER, uniforms_);
            glBufferSubData(GL_UNIFORM_BUFFER, uniform_step_ * pick(4), pick(8) ? 16 : uniform_step_ * 5, v);
            break;
        }
        case 2: {  // a part mapped, written and flushed
            glBindBuffer(GL_ARRAY_BUFFER, vertex_);
            const GLbitfield more = pick(2) ? GL_MAP_FLUSH_EXPLICIT_BIT : GL_MAP_INVALIDATE_RANGE_BIT;
            const GLintptr from = 16 * pick(20);
            auto* to = static_cast<float*>(glMapBufferRange(GL_ARRAY_BUFFER, from, 32, GL_MAP_WRITE_BIT | more));
            for (int i = 0; to && i < 8; ++i) to[i] = real(-1.2f, 1.2f);
            if (pick(3) == 0) draw_something(mode);  // from a mapped buffer: an error
            glBindBuffer(GL_ARRAY_BUFFER, vertex_);
            glFlushMappedBufferRange(GL_ARRAY_BUFFER, 0, 32);
            if (pick(6) == 0) glBufferSubData(GL_ARRAY_BUFFER, 0, 4, &kind);  // an error too
            glUnmapBuffer(GL_ARRAY_BUFFER);
            break;
        }
        case 3: {
            glBindBuffer(GL_COPY_READ_BUFFER, vertex_);
            glBindBuffer(GL_COPY_WRITE_BUFFER, vertex_);
            glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 8 * pick(8), 256 + 8 * pick(8), pick(8) ? 64 : 300);
            break;
        }
        case 4: {
            std::array<float, kVertexBytes / 4> v;
            for (float& x : v) x = real(-1.2f, 1.2f);
            glBindBuffer(GL_ARRAY_BUFFER, vertex_);
            pick(2) ? glBufferData(GL_ARRAY_BUFFER, kVertexBytes, v.data(), pick(2) ? GL_STREAM_DRAW : GL_STATIC_DRAW)
                    : glBufferSubData(GL_ARRAY_BUFFER, 0, kVertexBytes, v.data());
            break;
        }
        case 5: {
            GLushort i = static_cast<GLushort>(pick(12));
            glBindBuffer(GL_COPY_WRITE_BUFFER, indices_);
            glBufferSubData(GL_COPY_WRITE_BUFFER, 2 * pick(16), 2, &i);
            break;
        }
        case 6: answer_buffer(vertex_, kVertexBytes); break;
        case 7: {
            GLint size = 0, mapped = 0;
            glBindBuffer(GL_ARRAY_BUFFER, pick(2) ? vertex_ : commands_);
            glGetBufferParameteriv(GL_ARRAY_BUFFER, GL_BUFFER_SIZE, &size);
            glGetBufferParameteriv(GL_ARRAY_BUFFER, GL_BUFFER_MAPPED, &mapped);
            answers.insert(answers.end(), {static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(mapped)});
            break;
        }
        case 8: {  // storage that draws write
            glUseProgram(programs_.storing);
            draw_something(mode);
            glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
            if (pick(2) && pixels_) answer_buffer(storage_, 16);
            if (pick(2)) glUseProgram(programs_.plain);
            break;
        }
    }
}

void RandomObjects::images(GLenum mode, int kind) {
    glActiveTexture(GL_TEXTURE3);
    switch (kind) {
        case 0: {  // from a pixel buffer
            glBindBuffer(GL_PIXEL_UNPACK_BUFFER, unpack_);
            glPixelStorei(GL_UNPACK_ROW_LENGTH, pick(2) ? 0 : 12);
            glTexSubImage2D(GL_TEXTURE_2D, 0, pick(4), pick(4), 4, 4, GL_RGBA, GL_UNSIGNED_BYTE, offset(4 * pick(64)));
            glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
            glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
            break;
        }
        case 1: {  // into a pixel buffer
            glBindBuffer(GL_PIXEL_PACK_BUFFER, pack_);
            glReadPixels(pick(80), pick(80), 8, 8, GL_RGBA, GL_UNSIGNED_BYTE, reinterpret_cast<void*>(static_cast<std::uintptr_t>(pick(8) ? 256 : 4000)));
            glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
            if (pixels_) answer_buffer(pack_, 1024);
            break;
        }
        case 2: glGenerateMipmap(GL_TEXTURE_2D); break;
        case 3: glCopyTexSubImage2D(GL_TEXTURE_2D, pick(2), pick(3), 0, pick(80), pick(80), 4, 4); break;
        case 4: glCopyTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, pick(8), 0, pick(4), pick(80), pick(80), 8, 8); break;
        case 5: {
            const int x = pick(80), y = pick(80);
            pick(2) ? glCopyImageSubData(target_.color, GL_TEXTURE_2D, 0, x, y, 0, layers_, GL_TEXTURE_2D_ARRAY, 0, 0, 0, pick(4), 8, 8, 1)
                    : glCopyImageSubData(layers_, GL_TEXTURE_2D_ARRAY, 0, 0, 0, pick(3), target_.color, GL_TEXTURE_2D, 0, x, y, 0, 8, 8, 1);
            break;
        }
        case 6: {  // by way of a renderbuffer
            glBindFramebuffer(GL_FRAMEBUFFER, renderbuffer_framebuffer_);
            if (pick(3) == 0) glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 24 + pick(3), 24), glBindRenderbuffer(GL_RENDERBUFFER, renderbuffer_);
            glClear(GL_COLOR_BUFFER_BIT);
            glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target_.framebuffer);
            glBlitFramebuffer(0, 0, 20, 20, pick(70), pick(70), 60 + pick(30), 60 + pick(30), GL_COLOR_BUFFER_BIT, GL_NEAREST);
            glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer);
            break;
        }
        case 7: {  // what was drawn is sampled in the same frame
            glBindFramebuffer(GL_FRAMEBUFFER, second_framebuffer_);
            answer_pixels(second_framebuffer_, pick(80), pick(80), 4, 4);
            glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer);
            break;
        }
        case 8: {
            const GLint samplers[] = {0, 3};
            GLint used = 0;
            glGetIntegerv(GL_CURRENT_PROGRAM, &used);
            glUniform1i(glGetUniformLocation(static_cast<GLuint>(used), "image"), samplers[pick(2)]);
            draw_something(mode);
            break;
        }
    }
    glActiveTexture(GL_TEXTURE0);
}

void RandomObjects::others(GLenum mode, int kind) {
    switch (kind) {
        case 0: {
            glUseProgram(programs_.capturing);
            glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, captured_);
            vertices();
            glBeginTransformFeedback(GL_TRIANGLES);
            for (int i = pick(3); i >= 0; --i) {
                glDrawArrays(pick(6) ? GL_TRIANGLES : mode, 0, 3 * pick(4));
                if (pick(3) == 0) glPauseTransformFeedback(), glDrawArrays(GL_TRIANGLES, 3, 3), glResumeTransformFeedback();
                if (pick(4) == 0) glClear(GL_DEPTH_BUFFER_BIT);
            }
            glEndTransformFeedback();
            if (pick(2)) answer_buffer(captured_, kCapturedBytes);
            glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
            if (pick(2)) glUseProgram(programs_.plain);
            break;
        }
        case 1: {
            GLuint result = 0;
            glBeginQuery(GL_ANY_SAMPLES_PASSED_CONSERVATIVE, query_);
            draw_something(mode);
            if (pick(2)) glClear(GL_COLOR_BUFFER_BIT);
            glEndQuery(GL_ANY_SAMPLES_PASSED_CONSERVATIVE);
            glGetQueryObjectuiv(query_, GL_QUERY_RESULT, &result);
            answers.push_back(result);
            break;
        }
        case 2: {
            const GLsync sync = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
            glWaitSync(sync, 0, GL_TIMEOUT_IGNORED);
            answers.push_back(glClientWaitSync(sync, GL_SYNC_FLUSH_COMMANDS_BIT, 5'000'000'000u) == GL_TIMEOUT_EXPIRED);
            glDeleteSync(sync);
            break;
        }
        case 3: {  // the other context of the share group writes what this one draws from
            const float v[2] = {real(-1, 1), real(-1, 1)};
            const int at = 8 * pick(32), what = pick(3);
            in_other_context_([&] {
                if (what < 2) {
                    glBindBuffer(GL_ARRAY_BUFFER, vertex_);
                    glBufferSubData(GL_ARRAY_BUFFER, at, sizeof v, v);
                } else {
                    glBindTexture(GL_TEXTURE_2D, mipmapped_);
                    glTexSubImage2D(GL_TEXTURE_2D, 0, 2, 2, 1, 2, GL_RGBA, GL_UNSIGNED_BYTE, v);
                }
                glFinish();
            });
            break;
        }
        case 4: {
            static constexpr GLenum kDepth[] = {GL_DEPTH_ATTACHMENT, GL_STENCIL_ATTACHMENT};
            glInvalidateFramebuffer(GL_FRAMEBUFFER, pick(2) + 1, kDepth);
            glClear(GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
            break;
        }
        case 5: {
            static constexpr GLenum kSets[4][2] = {{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1}, {GL_NONE, GL_COLOR_ATTACHMENT1}, {GL_COLOR_ATTACHMENT0, GL_NONE}, {GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT0}};
            glDrawBuffers(2, kSets[pick(4)]);  // the last is an error
            break;
        }
        case 6: {
            const GLfloat v[4] = {real(0, 1), real(0, 1), real(0, 1), real(0, 1)};
            glClearBufferfv(GL_COLOR, pick(4), v);
            break;
        }
        case 7: {
            const auto buffer = static_cast<GLuint>(pick(2));
            switch (pick(4)) {
                case 0: pick(2) ? glEnablei(GL_BLEND, buffer) : glDisablei(GL_BLEND, buffer); break;
                case 1: glColorMaski(buffer, pick(2) == 0, true, pick(2) == 0, true); break;
                case 2: glBlendFunci(buffer, GL_ONE, pick(2) ? GL_ONE : GL_SRC_COLOR); break;
                case 3: glBlendEquationi(buffer, pick(2) ? GL_FUNC_ADD : GL_MAX); break;
            }
            break;
        }
        case 8: {
            GLint used = 0;
            glGetIntegerv(GL_CURRENT_PROGRAM, &used);
            glUseProgram(programs_.computing);
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, pick(2) ? vertex_ : storage_);
            glDispatchCompute(1, 1, 1);
            glMemoryBarrier(GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, storage_);
            glUseProgram(static_cast<GLuint>(used));
            break;
        }
    }
}

void RandomObjects::end() {
    answer_buffer(vertex_, kVertexBytes);
    answer_buffer(uniforms_, uniform_step_ * 4);
    answer_buffer(indices_, 32);
    answer_buffer(captured_, kCapturedBytes);
    answer_pixels(second_framebuffer_, 0, 0, target_.width, target_.height);
    answer_pixels(target_.framebuffer, 0, 0, target_.width, target_.height);
}

}  // namespace fovea::layer_test
