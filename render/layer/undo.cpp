#include "render/layer/undo.hpp"

#include <array>

#include "render/layer/context.hpp"

namespace fovea::layer {

bool KeySet::insert(std::uint64_t key) {
    if (count_ * 2 >= slots_.size()) grow();
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t i = (key * 0x9e3779b97f4a7c15u) >> 32 & mask;; i = (i + 1) & mask) {
        if (slots_[i].epoch != epoch_) {
            slots_[i] = {key, epoch_};
            ++count_;
            return true;
        }
        if (slots_[i].key == key) return false;
    }
}

void KeySet::grow() {
    std::vector<Slot> old(slots_.empty() ? 256 : slots_.size() * 2);
    old.swap(slots_);
    count_ = 0;
    const std::uint32_t epoch = epoch_++;
    for (const Slot& s : old)
        if (s.epoch == epoch) insert(s.key);
}

void drop_errors() noexcept {
    for (int i = 0; i < 32 && gl.GetError() != GL_NO_ERROR; ++i) {}
}

GLint get_integer(GLenum name) noexcept {
    GLint value = 0;
    gl.GetIntegerv(name, &value);
    return value;
}

namespace {

GLuint get_name(GLenum name) { return static_cast<GLuint>(get_integer(name)); }

void set_enabled(GLenum capability, bool on) { on ? gl.Enable(capability) : gl.Disable(capability); }

}  // namespace

GLenum texture_binding_query(GLenum target) noexcept {
    switch (target) {
        case GL_TEXTURE_2D: return GL_TEXTURE_BINDING_2D;
        case GL_TEXTURE_3D: return GL_TEXTURE_BINDING_3D;
        case GL_TEXTURE_CUBE_MAP: return GL_TEXTURE_BINDING_CUBE_MAP;
        case GL_TEXTURE_2D_ARRAY: return GL_TEXTURE_BINDING_2D_ARRAY;
        case GL_TEXTURE_2D_MULTISAMPLE: return GL_TEXTURE_BINDING_2D_MULTISAMPLE;
        case GL_TEXTURE_2D_MULTISAMPLE_ARRAY: return GL_TEXTURE_BINDING_2D_MULTISAMPLE_ARRAY;
        case GL_TEXTURE_CUBE_MAP_ARRAY: return GL_TEXTURE_BINDING_CUBE_MAP_ARRAY;
        case GL_TEXTURE_BUFFER: return GL_TEXTURE_BINDING_BUFFER;
        case GL_TEXTURE_EXTERNAL_OES: return GL_TEXTURE_BINDING_EXTERNAL_OES;
        default: return 0;
    }
}

GLenum buffer_binding_query(GLenum target) noexcept {
    switch (target) {
        case GL_ARRAY_BUFFER: return GL_ARRAY_BUFFER_BINDING;
        case GL_ELEMENT_ARRAY_BUFFER: return GL_ELEMENT_ARRAY_BUFFER_BINDING;
        case GL_UNIFORM_BUFFER: return GL_UNIFORM_BUFFER_BINDING;
        case GL_SHADER_STORAGE_BUFFER: return GL_SHADER_STORAGE_BUFFER_BINDING;
        case GL_ATOMIC_COUNTER_BUFFER: return GL_ATOMIC_COUNTER_BUFFER_BINDING;
        case GL_COPY_READ_BUFFER: return GL_COPY_READ_BUFFER_BINDING;
        case GL_COPY_WRITE_BUFFER: return GL_COPY_WRITE_BUFFER_BINDING;
        case GL_PIXEL_PACK_BUFFER: return GL_PIXEL_PACK_BUFFER_BINDING;
        case GL_PIXEL_UNPACK_BUFFER: return GL_PIXEL_UNPACK_BUFFER_BINDING;
        case GL_TRANSFORM_FEEDBACK_BUFFER: return GL_TRANSFORM_FEEDBACK_BUFFER_BINDING;
        case GL_DRAW_INDIRECT_BUFFER: return GL_DRAW_INDIRECT_BUFFER_BINDING;
        case GL_DISPATCH_INDIRECT_BUFFER: return GL_DISPATCH_INDIRECT_BUFFER_BINDING;
        case GL_TEXTURE_BUFFER: return GL_TEXTURE_BUFFER_BINDING;
        default: return 0;
    }
}

void Undo::restore() const {
    for (auto piece = pieces_.rbegin(); piece != pieces_.rend(); ++piece) (*piece)();
}

void Undo::clear() noexcept {
    seen_.clear();
    pieces_.clear();
}

void Undo::save_blend() {
    std::array<GLfloat, 4> color{};
    gl.GetFloatv(GL_BLEND_COLOR, color.data());
    pieces_.emplace_back([color] { gl.BlendColor(color[0], color[1], color[2], color[3]); });
    static constexpr GLenum kNames[6] = {GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB, GL_BLEND_SRC_ALPHA,
                                         GL_BLEND_DST_ALPHA, GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA};
    if (!per_draw_buffer_) {
        std::array<GLenum, 6> v{};
        for (std::size_t i = 0; i < 6; ++i) v[i] = get_name(kNames[i]);
        pieces_.emplace_back([v] {
            gl.BlendFuncSeparate(v[0], v[1], v[2], v[3]);
            gl.BlendEquationSeparate(v[4], v[5]);
        });
        return;
    }
    for (GLuint buffer = 0; buffer < static_cast<GLuint>(get_integer(GL_MAX_DRAW_BUFFERS)); ++buffer) {
        std::array<GLint, 6> v{};
        for (std::size_t i = 0; i < 6; ++i) gl.GetIntegeri_v(kNames[i], buffer, &v[i]);
        pieces_.emplace_back([v, buffer] {
            const auto e = [&v](std::size_t i) { return static_cast<GLenum>(v[i]); };
            gl.BlendFuncSeparatei(buffer, e(0), e(1), e(2), e(3));
            gl.BlendEquationSeparatei(buffer, e(4), e(5));
        });
    }
}

void Undo::save_color_mask() {
    if (!per_draw_buffer_) {
        std::array<GLboolean, 4> m{};
        gl.GetBooleanv(GL_COLOR_WRITEMASK, m.data());
        pieces_.emplace_back([m] { gl.ColorMask(m[0], m[1], m[2], m[3]); });
        return;
    }
    for (GLuint buffer = 0; buffer < static_cast<GLuint>(get_integer(GL_MAX_DRAW_BUFFERS)); ++buffer) {
        std::array<GLboolean, 4> m{};
        gl.GetBooleani_v(GL_COLOR_WRITEMASK, buffer, m.data());
        pieces_.emplace_back([m, buffer] { gl.ColorMaski(buffer, m[0], m[1], m[2], m[3]); });
    }
}

void Undo::save_depth() {
    const GLenum func = get_name(GL_DEPTH_FUNC);
    GLboolean mask = GL_TRUE;
    gl.GetBooleanv(GL_DEPTH_WRITEMASK, &mask);
    std::array<GLfloat, 2> range{};
    gl.GetFloatv(GL_DEPTH_RANGE, range.data());
    pieces_.emplace_back([=] {
        gl.DepthFunc(func);
        gl.DepthMask(mask);
        gl.DepthRangef(range[0], range[1]);
    });
}

void Undo::save_raster() {
    const GLenum cull = get_name(GL_CULL_FACE_MODE), front = get_name(GL_FRONT_FACE);
    GLfloat width = 1, factor = 0, units = 0, coverage = 1, shading = 0;
    gl.GetFloatv(GL_LINE_WIDTH, &width);
    gl.GetFloatv(GL_POLYGON_OFFSET_FACTOR, &factor);
    gl.GetFloatv(GL_POLYGON_OFFSET_UNITS, &units);
    gl.GetFloatv(GL_SAMPLE_COVERAGE_VALUE, &coverage);
    GLboolean invert = GL_FALSE;
    gl.GetBooleanv(GL_SAMPLE_COVERAGE_INVERT, &invert);
    const bool sample_shading = gl.MinSampleShading && get_integer(GL_MAJOR_VERSION) * 10 + get_integer(GL_MINOR_VERSION) >= 32;
    if (sample_shading) gl.GetFloatv(GL_MIN_SAMPLE_SHADING_VALUE, &shading);
    pieces_.emplace_back([=] {
        gl.CullFace(cull);
        gl.FrontFace(front);
        gl.LineWidth(width);
        gl.PolygonOffset(factor, units);
        gl.SampleCoverage(coverage, invert);
        if (sample_shading) gl.MinSampleShading(shading);
    });
}

void Undo::save_clear_values() {
    std::array<GLfloat, 4> color{};
    GLfloat depth = 1;
    gl.GetFloatv(GL_COLOR_CLEAR_VALUE, color.data());
    gl.GetFloatv(GL_DEPTH_CLEAR_VALUE, &depth);
    const GLint stencil = get_integer(GL_STENCIL_CLEAR_VALUE);
    pieces_.emplace_back([=] {
        gl.ClearColor(color[0], color[1], color[2], color[3]);
        gl.ClearDepthf(depth);
        gl.ClearStencil(stencil);
    });
}

void Undo::save_program() {
    const GLuint program = get_name(GL_CURRENT_PROGRAM);
    const bool pipelines = get_integer(GL_MAJOR_VERSION) * 10 + get_integer(GL_MINOR_VERSION) >= 31;
    const GLuint pipeline = pipelines ? get_name(GL_PROGRAM_PIPELINE_BINDING) : 0;
    pieces_.emplace_back([=] {
        gl.UseProgram(program);
        if (pipelines) gl.BindProgramPipeline(pipeline);
    });
}

void Undo::save_active_texture() {
    if (!first(kActiveTexture)) return;
    const GLenum unit = get_name(GL_ACTIVE_TEXTURE);
    pieces_.emplace_back([unit] { gl.ActiveTexture(unit); });
}

void Undo::save_texture(GLenum target) {
    const GLenum query = texture_binding_query(target);
    if (!query) return;
    const GLenum unit = get_name(GL_ACTIVE_TEXTURE);
    if (!first(kTexture, unit, target)) return;
    const GLuint name = get_name(query);
    pieces_.emplace_back([=] {
        const GLenum active = get_name(GL_ACTIVE_TEXTURE);
        gl.ActiveTexture(unit);
        gl.BindTexture(target, name);
        gl.ActiveTexture(active);
    });
}

void Undo::save_sampler(GLuint unit) {
    const GLenum active = get_name(GL_ACTIVE_TEXTURE);
    gl.ActiveTexture(GL_TEXTURE0 + unit);
    const GLuint name = get_name(GL_SAMPLER_BINDING);
    gl.ActiveTexture(active);
    pieces_.emplace_back([=] { gl.BindSampler(unit, name); });
}

void Undo::save_buffer(GLenum target) {
    const GLenum query = buffer_binding_query(target);
    if (!query) return;
    if (target == GL_ELEMENT_ARRAY_BUFFER) {
        const GLuint array = get_name(GL_VERTEX_ARRAY_BINDING);
        if (t_context && t_context->keeps_deleted_indices()) return t_context->before_submit(Call::DeleteBuffers);
        if (!first(kElementBuffer, array)) return;
        const GLuint name = get_name(query);
        pieces_.emplace_back([=] {
            const GLuint bound = get_name(GL_VERTEX_ARRAY_BINDING);
            gl.BindVertexArray(array);
            gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, name);
            gl.BindVertexArray(bound);
        });
        return;
    }
    if (!first(kBuffer, target)) return;
    const GLuint name = get_name(query);
    pieces_.emplace_back([=] { gl.BindBuffer(target, name); });
}

void Undo::indexed_buffer(GLenum target, GLuint index) {
    save_buffer(target);  // binding an indexed point binds the target too
    GLenum binding = 0, start = 0, size = 0;
    switch (target) {
        case GL_UNIFORM_BUFFER:
            binding = GL_UNIFORM_BUFFER_BINDING, start = GL_UNIFORM_BUFFER_START, size = GL_UNIFORM_BUFFER_SIZE;
            break;
        case GL_SHADER_STORAGE_BUFFER:
            binding = GL_SHADER_STORAGE_BUFFER_BINDING, start = GL_SHADER_STORAGE_BUFFER_START;
            size = GL_SHADER_STORAGE_BUFFER_SIZE;
            break;
        case GL_ATOMIC_COUNTER_BUFFER:
            binding = GL_ATOMIC_COUNTER_BUFFER_BINDING, start = GL_ATOMIC_COUNTER_BUFFER_START;
            size = GL_ATOMIC_COUNTER_BUFFER_SIZE;
            break;
        default: return;
    }
    if (!first(kIndexedBuffer, target, index)) return;
    GLint name = 0;
    GLint64 from = 0, length = 0;
    gl.GetIntegeri_v(binding, index, &name);
    gl.GetInteger64i_v(start, index, &from);
    gl.GetInteger64i_v(size, index, &length);
    // Runs before the piece of the generic binding, which was saved earlier.
    pieces_.emplace_back([=] {
        if (length > 0)
            gl.BindBufferRange(target, index, static_cast<GLuint>(name), static_cast<GLintptr>(from),
                               static_cast<GLsizeiptr>(length));
        else
            gl.BindBufferBase(target, index, static_cast<GLuint>(name));
    });
}

void Undo::save_vertex_array() {
    if (!first(kVertexArray)) return;
    const GLuint array = get_name(GL_VERTEX_ARRAY_BINDING);
    pieces_.emplace_back([array] { gl.BindVertexArray(array); });
}

// Bytes from one vertex to the next that a stride of 0 stands for.
static GLint packed_size(GLenum type, GLint components) {
    switch (type) {
        case GL_BYTE: case GL_UNSIGNED_BYTE: return components;
        case GL_SHORT: case GL_UNSIGNED_SHORT: case GL_HALF_FLOAT: return 2 * components;
        case GL_INT_2_10_10_10_REV: case GL_UNSIGNED_INT_2_10_10_10_REV: return 4;
        default: return 4 * components;
    }
}

// An attribute and the binding point of the same number: glVertexAttribPointer sets both.
void Undo::save_attrib(GLuint index) {
    const GLuint array = get_name(GL_VERTEX_ARRAY_BINDING);
    if (index > 255) return;
    // Nothing puts back what has no name. No draw of the record is left that the change could reach.
    if (t_context && t_context->keeps_deleted(index)) return t_context->before_submit(Call::DeleteBuffers);
    if (!first(kAttrib, array, index)) return;
    struct Saved {
        GLint enabled, size, type, normalized, stride, integer, divisor, buffer;
        void* pointer;
        // Differ from the above in an array object only, where formats and bindings were set by themselves.
        bool apart;
        GLuint relative_offset, binding, bound;
        GLint64 offset;
        GLint bound_stride, bound_divisor;
    } s{};
    const auto get = [index](GLenum name) {
        GLint v = 0;
        gl.GetVertexAttribiv(index, name, &v);
        return v;
    };
    const auto get_binding = [index](GLenum name) {
        GLint v = 0;
        gl.GetIntegeri_v(name, index, &v);
        return v;
    };
    s = {get(GL_VERTEX_ATTRIB_ARRAY_ENABLED), get(GL_VERTEX_ATTRIB_ARRAY_SIZE), get(GL_VERTEX_ATTRIB_ARRAY_TYPE),
         get(GL_VERTEX_ATTRIB_ARRAY_NORMALIZED), get(GL_VERTEX_ATTRIB_ARRAY_STRIDE),
         get(GL_VERTEX_ATTRIB_ARRAY_INTEGER), get(GL_VERTEX_ATTRIB_ARRAY_DIVISOR),
         get(GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING), nullptr, false, 0, index, 0, 0, 0, 0};
    gl.GetVertexAttribPointerv(index, GL_VERTEX_ATTRIB_ARRAY_POINTER, &s.pointer);
    if (array != 0) {
        s.relative_offset = static_cast<GLuint>(get(GL_VERTEX_ATTRIB_RELATIVE_OFFSET));
        s.binding = static_cast<GLuint>(get(GL_VERTEX_ATTRIB_BINDING));
        s.bound = static_cast<GLuint>(get_binding(GL_VERTEX_BINDING_BUFFER));
        gl.GetInteger64i_v(GL_VERTEX_BINDING_OFFSET, index, &s.offset);
        s.bound_stride = get_binding(GL_VERTEX_BINDING_STRIDE);
        s.bound_divisor = get_binding(GL_VERTEX_BINDING_DIVISOR);
        s.apart = s.relative_offset != 0 || s.binding != index || s.bound != static_cast<GLuint>(s.buffer) ||
                  s.offset != static_cast<GLint64>(reinterpret_cast<std::uintptr_t>(s.pointer)) ||
                  s.bound_stride != (s.stride != 0 ? s.stride : packed_size(static_cast<GLenum>(s.type), s.size));
    }
    pieces_.emplace_back([=] {
        const GLuint bound_array = get_name(GL_VERTEX_ARRAY_BINDING), bound = get_name(GL_ARRAY_BUFFER_BINDING);
        gl.BindVertexArray(array);
        gl.BindBuffer(GL_ARRAY_BUFFER, static_cast<GLuint>(s.buffer));
        if (s.buffer || array == 0 || !s.pointer) {
            if (s.integer)
                gl.VertexAttribIPointer(index, s.size, static_cast<GLenum>(s.type), s.stride, s.pointer);
            else
                gl.VertexAttribPointer(index, s.size, static_cast<GLenum>(s.type), static_cast<GLboolean>(s.normalized),
                                       s.stride, s.pointer);
        }
        gl.VertexAttribDivisor(index, static_cast<GLuint>(s.divisor));
        if (s.apart) {
            if (s.integer)
                gl.VertexAttribIFormat(index, s.size, static_cast<GLenum>(s.type), s.relative_offset);
            else
                gl.VertexAttribFormat(index, s.size, static_cast<GLenum>(s.type), static_cast<GLboolean>(s.normalized), s.relative_offset);
            gl.VertexAttribBinding(index, s.binding);
            gl.BindVertexBuffer(index, s.bound, static_cast<GLintptr>(s.offset), s.bound_stride);
            gl.VertexBindingDivisor(index, static_cast<GLuint>(s.bound_divisor));
        }
        s.enabled ? gl.EnableVertexAttribArray(index) : gl.DisableVertexAttribArray(index);
        gl.BindBuffer(GL_ARRAY_BUFFER, bound);
        gl.BindVertexArray(bound_array);
    });
}

void Undo::save_generic_attrib(GLuint index) {
    std::array<GLfloat, 4> v{};
    gl.GetVertexAttribfv(index, GL_CURRENT_VERTEX_ATTRIB, v.data());
    pieces_.emplace_back([v, index] { gl.VertexAttrib4f(index, v[0], v[1], v[2], v[3]); });
}

void Undo::save_viewport() {
    std::array<GLint, 4> v{};
    gl.GetIntegerv(GL_VIEWPORT, v.data());
    pieces_.emplace_back([v] { gl.Viewport(v[0], v[1], v[2], v[3]); });
}

void Undo::save_scissor() {
    std::array<GLint, 4> v{};
    gl.GetIntegerv(GL_SCISSOR_BOX, v.data());
    pieces_.emplace_back([v] { gl.Scissor(v[0], v[1], v[2], v[3]); });
}

void Undo::save_stencil() {
    static constexpr GLenum kNames[2][7] = {
        {GL_STENCIL_FUNC, GL_STENCIL_REF, GL_STENCIL_VALUE_MASK, GL_STENCIL_FAIL, GL_STENCIL_PASS_DEPTH_FAIL,
         GL_STENCIL_PASS_DEPTH_PASS, GL_STENCIL_WRITEMASK},
        {GL_STENCIL_BACK_FUNC, GL_STENCIL_BACK_REF, GL_STENCIL_BACK_VALUE_MASK, GL_STENCIL_BACK_FAIL,
         GL_STENCIL_BACK_PASS_DEPTH_FAIL, GL_STENCIL_BACK_PASS_DEPTH_PASS, GL_STENCIL_BACK_WRITEMASK}};
    for (std::size_t side = 0; side < 2; ++side) {
        std::array<GLuint, 7> v{};
        for (std::size_t i = 0; i < 7; ++i) v[i] = get_name(kNames[side][i]);
        const GLenum face = side == 0 ? GL_FRONT : GL_BACK;
        pieces_.emplace_back([v, face] {
            gl.StencilFuncSeparate(face, v[0], static_cast<GLint>(v[1]), v[2]);
            gl.StencilOpSeparate(face, v[3], v[4], v[5]);
            gl.StencilMaskSeparate(face, v[6]);
        });
    }
}

void Undo::framebuffers() {
    const GLuint draw = get_name(GL_DRAW_FRAMEBUFFER_BINDING), read = get_name(GL_READ_FRAMEBUFFER_BINDING);
    pieces_.emplace_back([=] {
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, draw);
        gl.BindFramebuffer(GL_READ_FRAMEBUFFER, read);
    });
}

void Undo::save_cap(GLenum capability) {
    if (capability == GL_BLEND && per_draw_buffer_) {
        for (GLuint buffer = 0; buffer < static_cast<GLuint>(get_integer(GL_MAX_DRAW_BUFFERS)); ++buffer) {
            const bool on = gl.IsEnabledi(GL_BLEND, buffer) == GL_TRUE;
            pieces_.emplace_back([=] { on ? gl.Enablei(GL_BLEND, buffer) : gl.Disablei(GL_BLEND, buffer); });
        }
        return;
    }
    const bool on = gl.IsEnabled(capability) == GL_TRUE;
    pieces_.emplace_back([=] { set_enabled(capability, on); });
}

namespace {

// Sets a uniform of any program with the call of its shape; the program in use stays.
void set_uniform(GLuint program, GLint location, UniformShape shape, const GLfloat* f, const GLint* i, const GLuint* u) {
    const GLuint used = get_name(GL_CURRENT_PROGRAM);
    if (used != program) gl.UseProgram(program);
    switch (shape.columns * 100 + shape.components * 10 + (shape.kind == 'f' ? 0 : shape.kind == 'i' ? 1 : 2)) {
        case 10: gl.Uniform1fv(location, 1, f); break;
        case 20: gl.Uniform2fv(location, 1, f); break;
        case 30: gl.Uniform3fv(location, 1, f); break;
        case 40: gl.Uniform4fv(location, 1, f); break;
        case 11: gl.Uniform1iv(location, 1, i); break;
        case 21: gl.Uniform2iv(location, 1, i); break;
        case 31: gl.Uniform3iv(location, 1, i); break;
        case 41: gl.Uniform4iv(location, 1, i); break;
        case 12: gl.Uniform1uiv(location, 1, u); break;
        case 22: gl.Uniform2uiv(location, 1, u); break;
        case 32: gl.Uniform3uiv(location, 1, u); break;
        case 42: gl.Uniform4uiv(location, 1, u); break;
        case 220: gl.UniformMatrix2fv(location, 1, GL_FALSE, f); break;
        case 230: gl.UniformMatrix2x3fv(location, 1, GL_FALSE, f); break;
        case 240: gl.UniformMatrix2x4fv(location, 1, GL_FALSE, f); break;
        case 320: gl.UniformMatrix3x2fv(location, 1, GL_FALSE, f); break;
        case 330: gl.UniformMatrix3fv(location, 1, GL_FALSE, f); break;
        case 340: gl.UniformMatrix3x4fv(location, 1, GL_FALSE, f); break;
        case 420: gl.UniformMatrix4x2fv(location, 1, GL_FALSE, f); break;
        case 430: gl.UniformMatrix4x3fv(location, 1, GL_FALSE, f); break;
        case 440: gl.UniformMatrix4fv(location, 1, GL_FALSE, f); break;
        default: break;
    }
    if (used != program) gl.UseProgram(used);
}

}  // namespace

// The elements of an array have consecutive locations. An array may be set beyond its end, where a location belongs to
// another uniform or to none; the driver's error about that is not the program's.
void Undo::uniform(GLint location, GLsizei count, UniformShape shape) {
    program_uniform(get_name(GL_CURRENT_PROGRAM), location, count, shape);
}

void Undo::program_uniform(GLuint program, GLint location, GLsizei count, UniformShape shape) {
    if (location < 0 || program == 0) return;
    if (count > 1 && t_context) t_context->keep_driver_error();
    for (GLint at = location; at < location + count; ++at) {
        // The shape is part of the key: an array set beyond its end must not pass for a save of its neighbour.
        const int code = (shape.kind == 'f' ? 0 : shape.kind == 'i' ? 1 : 2) * 32 + shape.columns * 5 + shape.components - 1;
        if (!first(kUniform, program, static_cast<std::uint64_t>(at) | static_cast<std::uint64_t>(code) << 18)) continue;
        if (shape.kind == 'f') {
            std::array<GLfloat, 16> v{};
            gl.GetUniformfv(program, at, v.data());
            pieces_.emplace_back([=] { set_uniform(program, at, shape, v.data(), nullptr, nullptr); });
        } else if (shape.kind == 'i') {
            std::array<GLint, 16> v{};
            gl.GetUniformiv(program, at, v.data());
            pieces_.emplace_back([=] { set_uniform(program, at, shape, nullptr, v.data(), nullptr); });
        } else {
            std::array<GLuint, 16> v{};
            gl.GetUniformuiv(program, at, v.data());
            pieces_.emplace_back([=] { set_uniform(program, at, shape, nullptr, nullptr, v.data()); });
        }
    }
    if (count > 1) drop_errors();
}

}  // namespace fovea::layer
