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

// wanted(draw): its program, 0 to leave it out; use(program): after it was made current. views: instances of a draw.
template <class Wanted, class Use>
std::size_t CommandList::issue(std::uint32_t views, Wanted&& wanted, Use&& use) const noexcept {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glCullFace(GL_BACK);
    Name program = 0, vertex_array = 0;
    std::uint32_t object = 0xffffffffu;
    int culling = -1;
    bool blending = false;
    std::array<Name, 2> textures{};
    std::size_t issued = 0;
    for (const Draw& d : draws_) {
        const Name by = wanted(d);
        if (by == 0) continue;
        if (by != program) {
            program = by;
            glUseProgram(program);
            use();
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
        const std::uint32_t instances = d.instances * views;
        if (instances == 1)
            glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(d.index_count), GL_UNSIGNED_INT, first);
        else
            glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(d.index_count), GL_UNSIGNED_INT, first, static_cast<GLsizei>(instances));
        ++issued;
    }
    if (blending) set_blending(false);
    if (textures != std::array<Name, 2>{}) glActiveTexture(GL_TEXTURE0);
    return issued;
}

std::size_t CommandList::submit(const Pass& pass) const noexcept {
    if (draws_.empty()) return 0;
    if (buffers_.view_size != 0)
        glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffers_.view, static_cast<GLintptr>(pass.view) * buffers_.view_stride, buffers_.view_size);
    return issue(
        1,
        [&](const Draw& d) -> Name {
            const Box& bounds = d.bounds[pass.view];
            if (bounds.empty()) return 0;
            if (!pass.only_in.empty() &&
                std::none_of(pass.only_in.begin(), pass.only_in.end(), [&](const Box& b) { return b.overlaps(bounds); }))
                return 0;
            return pass.count_fragments && d.counting_program != 0 ? d.counting_program : d.program;
        },
        [&] { glUniform4fv(0, 1, pass.crop.data()); });
}

bool CommandList::draws_at_once(const ViewsAtOnce& at_once, bool count_fragments) const noexcept {
    return at_once.drawing != ViewDrawing::repeated && at_once == buffers_.at_once && std::ranges::all_of(draws_, [&](const Draw& d) {
        return d.instances == 1 && d.views_program != 0 && (!count_fragments || d.counting_program == 0 || d.views_counting_program != 0);
    });
}

std::size_t CommandList::submit_views(const ViewsPass& pass) const noexcept {
    if (draws_.empty()) return 0;
    const auto n = static_cast<GLsizei>(pass.views.size());
    FOVEA_REQUIRE(n == buffers_.at_once.views && n <= kMostViewsAtOnce);
    std::array<std::array<float, 4>, 3 * kMostViewsAtOnce> uniforms{};
    const std::size_t count = pass.views.size();
    for (std::size_t i = 0; i < count; ++i) {
        uniforms[i] = pass.views[i].crop;
        uniforms[count + i] = pass.views[i].part;
        uniforms[2 * count + i][0] = static_cast<float>(pass.views[i].view);
    }
    const bool instanced = buffers_.at_once.drawing == ViewDrawing::instanced;
    if (buffers_.view_size != 0) glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffers_.view, 0, GLsizeiptr{buffers_.view_stride} * kListViews);
    if (instanced)
        for (GLenum i = 0; i < 4; ++i) glEnable(GL_CLIP_DISTANCE0_EXT + i);
    const std::size_t issued = issue(
        instanced ? static_cast<std::uint32_t>(n) : 1,
        [&](const Draw& d) -> Name {
            const bool seen = std::ranges::any_of(pass.views, [&](const ViewsPass::View& v) { return !d.bounds[v.view].empty() && v.only_in.overlaps(d.bounds[v.view]); });
            if (!seen) return 0;
            return pass.count_fragments && d.views_counting_program != 0 ? d.views_counting_program : d.views_program;
        },
        [&] { glUniform4fv(0, 3 * n, uniforms[0].data()); });
    if (instanced)
        for (GLenum i = 0; i < 4; ++i) glDisable(GL_CLIP_DISTANCE0_EXT + i);
    return issued;
}

std::uint32_t uniform_alignment() noexcept {
    GLint alignment = 256;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    return static_cast<std::uint32_t>(std::max(alignment, 16));
}

}  // namespace fovea::gl
