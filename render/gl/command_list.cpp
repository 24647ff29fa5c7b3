#include "render/gl/command_list.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace fovea::gl {

void CommandList::begin(const Clear& clear, const Buffers& buffers) noexcept {
    clear_ = clear;
    buffers_ = buffers;
    draws_.clear();
}

std::uint64_t CommandList::triangles() const noexcept {
    std::uint64_t n = 0;
    for (const Draw& d : draws_) n += std::uint64_t{d.index_count} / 3 * d.instances;
    return n;
}

namespace {

void set_blending(bool on) noexcept {
    if (on) {
        glEnable(GL_BLEND);
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    } else {
        glDisable(GL_BLEND);
    }
    glDepthMask(on ? GL_FALSE : GL_TRUE);
}

}  // namespace

std::size_t CommandList::submit(const Pass& pass) const noexcept {
    if (draws_.empty()) return 0;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glCullFace(GL_BACK);
    if (buffers_.view_size != 0)
        glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffers_.view, static_cast<GLintptr>(pass.view) * buffers_.view_stride, buffers_.view_size);
    Name program = 0, vertex_array = 0;
    std::uint32_t object = 0xffffffffu;
    int culling = -1;
    bool blending = false;
    std::array<Name, 2> textures{};
    std::size_t issued = 0;
    for (const Draw& d : draws_) {
        const Box& bounds = d.bounds[pass.view];
        if (bounds.empty()) continue;
        if (!pass.only_in.empty() &&
            std::none_of(pass.only_in.begin(), pass.only_in.end(), [&](const Box& b) { return b.overlaps(bounds); }))
            continue;
        const Name wanted = pass.count_fragments && d.counting_program != 0 ? d.counting_program : d.program;
        if (wanted != program) {
            program = wanted;
            glUseProgram(program);
            glUniform4fv(0, 1, pass.crop.data());
        }
        if (d.vertex_array != vertex_array) {
            vertex_array = d.vertex_array;
            glBindVertexArray(vertex_array);
        }
        if (buffers_.object_size != 0 && d.object_offset != object) {
            object = d.object_offset;
            glBindBufferRange(GL_UNIFORM_BUFFER, 1, buffers_.object, object, buffers_.object_size);
        }
        if (static_cast<int>(d.cull_back) != culling) {
            culling = d.cull_back;
            if (d.cull_back) glEnable(GL_CULL_FACE);
            else glDisable(GL_CULL_FACE);
        }
        for (std::uint32_t i = 0; i < 2; ++i) {
            if (d.textures[i] == 0 || d.textures[i] == textures[i]) continue;
            textures[i] = d.textures[i];
            glActiveTexture(GL_TEXTURE0 + kTextureUnit + i);
            glBindTexture(GL_TEXTURE_2D, textures[i]);
        }
        if (d.blend != blending) set_blending(blending = d.blend);
        const auto* first = reinterpret_cast<const void*>(static_cast<std::uintptr_t>(d.first_index) * sizeof(std::uint32_t));
        if (d.instances == 1)
            glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(d.index_count), GL_UNSIGNED_INT, first);
        else
            glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(d.index_count), GL_UNSIGNED_INT, first, static_cast<GLsizei>(d.instances));
        ++issued;
    }
    if (blending) set_blending(false);
    if (textures != std::array<Name, 2>{}) glActiveTexture(GL_TEXTURE0);
    return issued;
}

std::uint32_t uniform_alignment() noexcept {
    GLint alignment = 256;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    return static_cast<std::uint32_t>(std::max(alignment, 16));
}

}  // namespace fovea::gl
