// Draws and clears: checked at once, recorded, run by the submission.
//
// A draw is checked by asking the driver to draw nothing with the same arguments: every error that does not depend on
// the count is generated then, as it would be by the draw. A draw that is illegal by its count goes to the driver.
#include <algorithm>
#include <cstring>

#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

// Nothing here concerns the layer: the call is the driver's. Tested before anything else is done.
inline bool is_drivers_own() noexcept {
    if (!gl.anything_to_do.load(std::memory_order_relaxed)) [[likely]] return true;
    const Context* c = t_context;
    return !c || !c->watches_draws();
}

// The context, if drawing now concerns the layer.
Context* drawing() {
    Context* c = t_context;
    if (!c || !c->is_engaged()) return nullptr;
    return c->drawing_target().kind == DrawTarget::Kind::plain ? nullptr : c;
}

// Vertex data that lies in the program's memory, and the copy of it that the replay draws from.
struct ClientAttrib {
    GLuint index;
    GLint size, normalized, stride, integer;
    GLenum type;
    const void* original;
    const void* copy;  // such that vertex i is at copy + i * stride
};

struct DrawCall {
    enum Kind { arrays, elements, arrays_indirect, elements_indirect } kind;
    bool ranged = false;
    GLenum mode, type = 0;
    GLint first = 0, base_vertex = 0;
    GLsizei count = 0, instances = -1;  // -1: not an instanced call
    GLuint base_instance = 0, start = 0, end = 0;
    const void* indices = nullptr;      // pointer, or offset into the buffer; or offset of the indirect command
    const ClientAttrib* attribs = nullptr;
    std::size_t attrib_count = 0;
    bool client_indices = false;
    const void* original_indices = nullptr;
};

std::size_t type_size(GLenum type) {
    switch (type) {
        case GL_BYTE: case GL_UNSIGNED_BYTE: return 1;
        case GL_SHORT: case GL_UNSIGNED_SHORT: case GL_HALF_FLOAT: case GL_HALF_FLOAT_OES: return 2;
        default: return 4;
    }
}

void execute(const DrawCall& d) {
    switch (d.kind) {
        case DrawCall::arrays:
            if (d.base_instance != 0)
                gl.DrawArraysInstancedBaseInstanceEXT(d.mode, d.first, d.count, d.instances, d.base_instance);
            else if (d.instances >= 0)
                gl.DrawArraysInstanced(d.mode, d.first, d.count, d.instances);
            else
                gl.DrawArrays(d.mode, d.first, d.count);
            return;
        case DrawCall::elements:
            if (d.base_instance != 0)
                gl.DrawElementsInstancedBaseVertexBaseInstanceEXT(d.mode, d.count, d.type, d.indices, d.instances,
                                                                  d.base_vertex, d.base_instance);
            else if (d.instances >= 0 && d.base_vertex != 0)
                gl.DrawElementsInstancedBaseVertex(d.mode, d.count, d.type, d.indices, d.instances, d.base_vertex);
            else if (d.instances >= 0)
                gl.DrawElementsInstanced(d.mode, d.count, d.type, d.indices, d.instances);
            else if (d.ranged && d.base_vertex != 0)
                gl.DrawRangeElementsBaseVertex(d.mode, d.start, d.end, d.count, d.type, d.indices, d.base_vertex);
            else if (d.ranged)
                gl.DrawRangeElements(d.mode, d.start, d.end, d.count, d.type, d.indices);
            else if (d.base_vertex != 0)
                gl.DrawElementsBaseVertex(d.mode, d.count, d.type, d.indices, d.base_vertex);
            else
                gl.DrawElements(d.mode, d.count, d.type, d.indices);
            return;
        case DrawCall::arrays_indirect: return gl.DrawArraysIndirect(d.mode, d.indices);
        case DrawCall::elements_indirect: return gl.DrawElementsIndirect(d.mode, d.type, d.indices);
    }
}

void set_pointer(const ClientAttrib& a, const void* to) {
    if (a.integer)
        gl.VertexAttribIPointer(a.index, a.size, a.type, a.stride, to);
    else
        gl.VertexAttribPointer(a.index, a.size, a.type, static_cast<GLboolean>(a.normalized), a.stride, to);
}

void replay_draw(const DrawCall& d, const Replay& replay) {
    if (replay.view().clears_only) return;
    if (replay.view().view >= 0) t_context->set_view(replay.view().view);
    if (d.attrib_count == 0) return execute(d);
    const GLint bound = get_integer(GL_ARRAY_BUFFER_BINDING);
    gl.BindBuffer(GL_ARRAY_BUFFER, 0);
    for (std::size_t i = 0; i < d.attrib_count; ++i) set_pointer(d.attribs[i], d.attribs[i].copy);
    execute(d);
    for (std::size_t i = 0; i < d.attrib_count; ++i) set_pointer(d.attribs[i], d.attribs[i].original);
    gl.BindBuffer(GL_ARRAY_BUFFER, static_cast<GLuint>(bound));
}

struct IndexRange {
    std::uint32_t low = UINT32_MAX, high = 0;
    [[nodiscard]] bool empty() const { return low > high; }
};

template <class Index>
IndexRange range_of(const void* indices, GLsizei count, bool restart) {
    IndexRange range;
    for (GLsizei i = 0; i < count; ++i) {
        Index index;
        std::memcpy(&index, static_cast<const char*>(indices) + static_cast<std::size_t>(i) * sizeof index, sizeof index);
        if (restart && index == static_cast<Index>(-1)) continue;
        range.low = std::min(range.low, static_cast<std::uint32_t>(index));
        range.high = std::max(range.high, static_cast<std::uint32_t>(index));
    }
    return range;
}

IndexRange index_range(const DrawCall& d) {
    const std::size_t bytes = static_cast<std::size_t>(d.count) * type_size(d.type);
    const void* data = d.indices;
    if (!d.client_indices)
        data = gl.MapBufferRange(GL_ELEMENT_ARRAY_BUFFER, reinterpret_cast<GLintptr>(d.indices),
                                 static_cast<GLsizeiptr>(bytes), GL_MAP_READ_BIT);
    if (!data) return {};
    const bool restart = gl.IsEnabled(GL_PRIMITIVE_RESTART_FIXED_INDEX) == GL_TRUE;
    const IndexRange range = d.type == GL_UNSIGNED_BYTE    ? range_of<std::uint8_t>(data, d.count, restart)
                             : d.type == GL_UNSIGNED_SHORT ? range_of<std::uint16_t>(data, d.count, restart)
                                                           : range_of<std::uint32_t>(data, d.count, restart);
    if (!d.client_indices) gl.UnmapBuffer(GL_ELEMENT_ARRAY_BUFFER);
    return range;
}

// Copies vertices and indices that the program may overwrite as soon as its call returns.
void copy_client_memory(Context& c, DrawCall& d) {
    if (d.kind == DrawCall::arrays_indirect || d.kind == DrawCall::elements_indirect) return;
    if (d.kind == DrawCall::elements && get_integer(GL_ELEMENT_ARRAY_BUFFER_BINDING) == 0) {
        d.client_indices = true;
        d.indices = c.log().copy(static_cast<const char*>(d.indices), static_cast<std::size_t>(d.count) * type_size(d.type));
    }
    if (get_integer(GL_VERTEX_ARRAY_BINDING) != 0) return;  // client arrays exist in the default vertex array only
    ClientAttrib found[32];
    std::size_t n = 0;
    IndexRange range;
    const auto attribs = static_cast<GLuint>(std::min(get_integer(GL_MAX_VERTEX_ATTRIBS), 32));
    const auto& read = c.program_facts().attributes;
    const GLuint candidates = read ? static_cast<GLuint>(read->size()) : attribs;
    for (GLuint k = 0; k < candidates && n < std::size(found); ++k) {
        const GLuint i = read ? (*read)[k] : k;
        if (i >= attribs) continue;
        const auto get = [i](GLenum name) {
            GLint v = 0;
            gl.GetVertexAttribiv(i, name, &v);
            return v;
        };
        if (!get(GL_VERTEX_ATTRIB_ARRAY_ENABLED) || get(GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING) != 0) continue;
        void* pointer = nullptr;
        gl.GetVertexAttribPointerv(i, GL_VERTEX_ATTRIB_ARRAY_POINTER, &pointer);
        if (!pointer) continue;
        ClientAttrib a{.index = i, .size = get(GL_VERTEX_ATTRIB_ARRAY_SIZE), .normalized = get(GL_VERTEX_ATTRIB_ARRAY_NORMALIZED),
                       .stride = get(GL_VERTEX_ATTRIB_ARRAY_STRIDE), .integer = get(GL_VERTEX_ATTRIB_ARRAY_INTEGER),
                       .type = static_cast<GLenum>(get(GL_VERTEX_ATTRIB_ARRAY_TYPE)), .original = pointer, .copy = nullptr};
        const bool packed = a.type == GL_INT_2_10_10_10_REV || a.type == GL_UNSIGNED_INT_2_10_10_10_REV;
        const std::size_t element = packed ? 4 : static_cast<std::size_t>(a.size) * type_size(a.type);
        const std::size_t stride = a.stride ? static_cast<std::size_t>(a.stride) : element;
        std::size_t low = 0, count = 0;
        const auto divisor = static_cast<std::size_t>(get(GL_VERTEX_ATTRIB_ARRAY_DIVISOR));
        if (divisor != 0) {
            low = d.base_instance;
            count = (static_cast<std::size_t>(std::max(d.instances, 1)) + divisor - 1) / divisor;
        } else if (d.kind == DrawCall::arrays) {
            if (d.first < 0) continue;  // drivers that let it pass read from before the array
            low = static_cast<std::size_t>(d.first);
            count = static_cast<std::size_t>(d.count);
        } else {
            if (range.empty()) range = index_range(d);
            if (range.empty()) continue;
            const std::int64_t from = std::int64_t{range.low} + d.base_vertex;
            if (from < 0) continue;
            low = static_cast<std::size_t>(from);
            count = static_cast<std::size_t>(range.high - range.low) + 1;
        }
        if (count == 0) continue;
        const char* from = static_cast<const char*>(pointer) + low * stride;
        const char* copied = c.log().copy(from, (count - 1) * stride + element);
        // Vertex `low` is the first that is copied: the base lies before the copy, and only numbers know that place.
        a.copy = reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(copied) - low * stride);
        found[n++] = a;
    }
    d.attribs = n ? c.log().copy(found, n) : nullptr;
    d.attrib_count = n;
}

void record(Context& c, DrawCall d) {
    if (d.kind != DrawCall::arrays_indirect && d.kind != DrawCall::elements_indirect && (d.count == 0 || d.instances == 0)) return;
    copy_client_memory(c, d);
    c.log().add([d](Replay& replay) { replay_draw(d, replay); });
    c.end();
}

bool may_draw(Context& c, DrawCall d) {
    const GLsizei vertices = d.count;
    d.count = 0;
    return c.begin(Context::Op::draw, [&d] { execute(d); }, d.mode, vertices);
}

// A program of several views draws to a framebuffer of as many only.
void draw_plain(const DrawCall& d) {
    Context* c = t_context;
    if (c && c->active() && c->view_error() != GL_NO_ERROR) return c->raise(GL_INVALID_OPERATION);
    if (c) c->before_stores(), c->note_straight_draw(d.mode, d.count);
    execute(d);
}

[[gnu::noinline]] void draw(const DrawCall& d) {
    Context* c = d.count < 0 || d.instances < -1 || (d.ranged && d.end < d.start) ? nullptr : drawing();
    if (!c) return draw_plain(d);
    if (may_draw(*c, d)) record(*c, d);
}

}  // namespace

[[gnu::hot]] void GL_APIENTRY layer_glDrawArrays(GLenum mode, GLint first, GLsizei count) {
    if (is_drivers_own()) [[likely]] return gl.DrawArrays(mode, first, count);
    draw({.kind = DrawCall::arrays, .mode = mode, .first = first, .count = count});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawArraysInstanced(GLenum mode, GLint first, GLsizei count, GLsizei instances) {
    if (is_drivers_own()) [[likely]] return gl.DrawArraysInstanced(mode, first, count, instances);
    if (count < 0 || instances < 0) return gl.DrawArraysInstanced(mode, first, count, instances);
    draw({.kind = DrawCall::arrays, .mode = mode, .first = first, .count = count, .instances = instances});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElements(GLenum mode, GLsizei count, GLenum type, const void* indices) {
    if (is_drivers_own()) [[likely]] return gl.DrawElements(mode, count, type, indices);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .count = count, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawRangeElements(GLenum mode, GLuint start, GLuint end, GLsizei count, GLenum type, const void* indices) {
    if (is_drivers_own()) [[likely]] return gl.DrawRangeElements(mode, start, end, count, type, indices);
    draw({.kind = DrawCall::elements, .ranged = true, .mode = mode, .type = type, .count = count, .start = start,
          .end = end, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsInstanced(GLenum mode, GLsizei count, GLenum type, const void* indices, GLsizei instances) {
    if (is_drivers_own()) [[likely]] return gl.DrawElementsInstanced(mode, count, type, indices, instances);
    if (count < 0 || instances < 0) return gl.DrawElementsInstanced(mode, count, type, indices, instances);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .count = count, .instances = instances, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsBaseVertex(GLenum mode, GLsizei count, GLenum type, const void* indices, GLint base_vertex) {
    if (is_drivers_own()) [[likely]] return gl.DrawElementsBaseVertex(mode, count, type, indices, base_vertex);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .base_vertex = base_vertex, .count = count, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawRangeElementsBaseVertex(GLenum mode, GLuint start, GLuint end, GLsizei count, GLenum type,
                                                     const void* indices, GLint base_vertex) {
    if (is_drivers_own()) [[likely]] return gl.DrawRangeElementsBaseVertex(mode, start, end, count, type, indices, base_vertex);
    draw({.kind = DrawCall::elements, .ranged = true, .mode = mode, .type = type, .base_vertex = base_vertex,
          .count = count, .start = start, .end = end, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsInstancedBaseVertex(GLenum mode, GLsizei count, GLenum type, const void* indices,
                                                         GLsizei instances, GLint base_vertex) {
    if (is_drivers_own()) [[likely]] return gl.DrawElementsInstancedBaseVertex(mode, count, type, indices, instances, base_vertex);
    if (count < 0 || instances < 0)
        return gl.DrawElementsInstancedBaseVertex(mode, count, type, indices, instances, base_vertex);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .base_vertex = base_vertex, .count = count,
          .instances = instances, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawArraysInstancedBaseInstanceEXT(GLenum mode, GLint first, GLsizei count, GLsizei instances, GLuint base_instance) {
    if (is_drivers_own()) [[likely]] return gl.DrawArraysInstancedBaseInstanceEXT(mode, first, count, instances, base_instance);
    if (count < 0 || instances < 0)
        return gl.DrawArraysInstancedBaseInstanceEXT(mode, first, count, instances, base_instance);
    draw({.kind = DrawCall::arrays, .mode = mode, .first = first, .count = count, .instances = instances,
          .base_instance = base_instance});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsInstancedBaseInstanceEXT(GLenum mode, GLsizei count, GLenum type, const void* indices,
                                                              GLsizei instances, GLuint base_instance) {
    if (is_drivers_own()) [[likely]] return gl.DrawElementsInstancedBaseInstanceEXT(mode, count, type, indices, instances, base_instance);
    if (count < 0 || instances < 0)
        return gl.DrawElementsInstancedBaseInstanceEXT(mode, count, type, indices, instances, base_instance);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .count = count, .instances = instances,
          .base_instance = base_instance, .indices = indices});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsInstancedBaseVertexBaseInstanceEXT(GLenum mode, GLsizei count, GLenum type,
                                                                        const void* indices, GLsizei instances,
                                                                        GLint base_vertex, GLuint base_instance) {
    if (is_drivers_own()) [[likely]] return gl.DrawElementsInstancedBaseVertexBaseInstanceEXT(mode, count, type, indices, instances, base_vertex, base_instance);
    if (count < 0 || instances < 0)
        return gl.DrawElementsInstancedBaseVertexBaseInstanceEXT(mode, count, type, indices, instances, base_vertex, base_instance);
    draw({.kind = DrawCall::elements, .mode = mode, .type = type, .base_vertex = base_vertex, .count = count,
          .instances = instances, .base_instance = base_instance, .indices = indices});
}

// The arguments of an indirect draw are in a buffer, and its errors are about that buffer: the driver is asked by a draw
// into nothing, with the rasterizer off.
static void draw_indirect(DrawCall d) {
    Context* c = drawing();
    if (!c) return draw_plain(d);
    const auto probe = [&d] {
        const bool off = gl.IsEnabled(GL_RASTERIZER_DISCARD) == GL_TRUE;
        gl.Enable(GL_RASTERIZER_DISCARD);
        execute(d);
        if (!off) gl.Disable(GL_RASTERIZER_DISCARD);
    };
    if (c->captures() || c->program_facts().side_effects) {
        // The question would have the side effects of the draw.
        if (!c->allowed(Context::Op::draw)) return;
        c->leave_levels(d.kind == DrawCall::arrays_indirect ? Call::DrawArraysIndirect : Call::DrawElementsIndirect);
        c->before_stores();
        return c->for_each_view([&d] { execute(d); });
    }
    if (c->begin(Context::Op::draw, probe, d.mode)) record(*c, d);
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawArraysIndirect(GLenum mode, const void* indirect) {
    draw_indirect({.kind = DrawCall::arrays_indirect, .mode = mode, .indices = indirect});
}

[[gnu::hot]] void GL_APIENTRY layer_glDrawElementsIndirect(GLenum mode, GLenum type, const void* indirect) {
    draw_indirect({.kind = DrawCall::elements_indirect, .mode = mode, .type = type, .indices = indirect});
}

void GL_APIENTRY layer_glMultiDrawArraysEXT(GLenum mode, const GLint* first, const GLsizei* count, GLsizei draws) {
    if (draws < 0 || !drawing() || std::any_of(count, count + draws, [](GLsizei n) { return n < 0; }))
        return gl.MultiDrawArraysEXT(mode, first, count, draws);
    for (GLsizei i = 0; i < draws; ++i) layer_glDrawArrays(mode, first[i], count[i]);
}

void GL_APIENTRY layer_glMultiDrawElementsEXT(GLenum mode, const GLsizei* count, GLenum type, const void* const* indices, GLsizei draws) {
    if (draws < 0 || !drawing() || std::any_of(count, count + draws, [](GLsizei n) { return n < 0; }))
        return gl.MultiDrawElementsEXT(mode, count, type, indices, draws);
    for (GLsizei i = 0; i < draws; ++i) layer_glDrawElements(mode, count[i], type, indices[i]);
}

void GL_APIENTRY layer_glMultiDrawElementsBaseVertexEXT(GLenum mode, const GLsizei* count, GLenum type, const void* const* indices,
                                                        GLsizei draws, const GLint* base_vertex) {
    if (draws < 0 || !drawing() || std::any_of(count, count + draws, [](GLsizei n) { return n < 0; }))
        return gl.MultiDrawElementsBaseVertexEXT(mode, count, type, indices, draws, base_vertex);
    for (GLsizei i = 0; i < draws; ++i) layer_glDrawElementsBaseVertex(mode, count[i], type, indices[i], base_vertex[i]);
}

void GL_APIENTRY layer_glMultiDrawArraysIndirectEXT(GLenum mode, const void* indirect, GLsizei draws, GLsizei stride) {
    if (draws <= 0 || stride < 0 || !drawing()) return gl.MultiDrawArraysIndirectEXT(mode, indirect, draws, stride);
    const std::size_t step = stride ? static_cast<std::size_t>(stride) : 16;
    for (GLsizei i = 0; i < draws; ++i)
        layer_glDrawArraysIndirect(mode, static_cast<const char*>(indirect) + static_cast<std::size_t>(i) * step);
}

void GL_APIENTRY layer_glMultiDrawElementsIndirectEXT(GLenum mode, GLenum type, const void* indirect, GLsizei draws, GLsizei stride) {
    if (draws <= 0 || stride < 0 || !drawing()) return gl.MultiDrawElementsIndirectEXT(mode, type, indirect, draws, stride);
    const std::size_t step = stride ? static_cast<std::size_t>(stride) : 20;
    for (GLsizei i = 0; i < draws; ++i)
        layer_glDrawElementsIndirect(mode, type, static_cast<const char*>(indirect) + static_cast<std::size_t>(i) * step);
}

[[gnu::hot]] void GL_APIENTRY layer_glClear(GLbitfield mask) {
    if (is_drivers_own()) [[likely]] return gl.Clear(mask);
    constexpr GLbitfield kAll = GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT;
    Context* c = (mask & ~kAll) == 0 ? drawing() : nullptr;
    if (!c) return gl.Clear(mask);
    if (!c->begin(Context::Op::clear, [] { gl.Clear(0); }) || mask == 0) return;
    c->note_clear(mask, -1, true);
    c->log().add([mask](Replay&) { gl.Clear(mask); });
    c->end();
}

// The driver is asked about a buffer cleared with nothing to clear: the scissor box is empty.
template <class Clear>
static void clear_buffer(GLenum buffer, GLint index, Clear clear) {
    Context* c = drawing();
    if (!c) return clear();
    const auto probe = [&clear] {
        Undo state;
        state.cap(GL_SCISSOR_TEST);
        state.scissor();
        gl.Enable(GL_SCISSOR_TEST);
        gl.Scissor(0, 0, 0, 0);
        clear();
        state.restore();
    };
    if (!c->begin(Context::Op::clear, probe)) return;
    const GLbitfield bits = buffer == GL_COLOR ? 0u : buffer == GL_DEPTH ? GL_DEPTH_BUFFER_BIT : buffer == GL_STENCIL
                            ? GL_STENCIL_BUFFER_BIT : GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT;
    c->note_clear(bits, buffer == GL_COLOR ? index : -1);
    c->log().add([clear](Replay&) { clear(); });
    c->end();
}

void GL_APIENTRY layer_glClearBufferfv(GLenum buffer, GLint drawbuffer, const GLfloat* value) {
    if (!drawing() || !value) return gl.ClearBufferfv(buffer, drawbuffer, value);
    std::array<GLfloat, 4> v{};
    std::copy_n(value, buffer == GL_COLOR ? 4 : 1, v.begin());
    clear_buffer(buffer, drawbuffer, [=] { gl.ClearBufferfv(buffer, drawbuffer, v.data()); });
}

void GL_APIENTRY layer_glClearBufferiv(GLenum buffer, GLint drawbuffer, const GLint* value) {
    if (!drawing() || !value) return gl.ClearBufferiv(buffer, drawbuffer, value);
    std::array<GLint, 4> v{};
    std::copy_n(value, buffer == GL_COLOR ? 4 : 1, v.begin());
    clear_buffer(buffer, drawbuffer, [=] { gl.ClearBufferiv(buffer, drawbuffer, v.data()); });
}

void GL_APIENTRY layer_glClearBufferuiv(GLenum buffer, GLint drawbuffer, const GLuint* value) {
    if (!drawing() || !value) return gl.ClearBufferuiv(buffer, drawbuffer, value);
    std::array<GLuint, 4> v{};
    std::copy_n(value, buffer == GL_COLOR ? 4 : 1, v.begin());
    clear_buffer(buffer, drawbuffer, [=] { gl.ClearBufferuiv(buffer, drawbuffer, v.data()); });
}

void GL_APIENTRY layer_glClearBufferfi(GLenum buffer, GLint drawbuffer, GLfloat depth, GLint stencil) {
    if (!drawing()) return gl.ClearBufferfi(buffer, drawbuffer, depth, stencil);
    clear_buffer(buffer, drawbuffer, [=] { gl.ClearBufferfi(buffer, drawbuffer, depth, stencil); });
}

}  // namespace fovea::layer
