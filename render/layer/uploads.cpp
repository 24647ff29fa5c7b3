// Buffer uploads while draws are pending, without submitting. The data of glBufferSubData is copied, and the call put off:
//
//   glBufferSubData --no draw follows--> made once, when the pending draws have run (programs that prepare their next frame)
//                   --a draw follows---> recorded: what the buffer held before is kept in a buffer of the layer, so that each
//                                        level's run begins with it
//
// glBufferData changes what can be asked about the buffer, and is recorded at once.
// Uploads of more than kLargest bytes submit instead: keeping them would cost more than the lateness is worth.
#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

constexpr GLsizeiptr kLargest = GLsizeiptr{1} << 20;

GLint buffer_value(GLenum target, GLenum name) {
    GLint value = 0;
    gl.GetBufferParameteriv(target, name, &value);
    return value;
}

// Copies between buffers by name; the bindings stay.
void copy_buffer(GLuint from, GLintptr from_offset, GLuint to, GLintptr to_offset, GLsizeiptr size) {
    const GLint read = get_integer(GL_COPY_READ_BUFFER_BINDING), write = get_integer(GL_COPY_WRITE_BUFFER_BINDING);
    gl.BindBuffer(GL_COPY_READ_BUFFER, from);
    gl.BindBuffer(GL_COPY_WRITE_BUFFER, to);
    gl.CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, from_offset, to_offset, size);
    gl.BindBuffer(GL_COPY_READ_BUFFER, static_cast<GLuint>(read));
    gl.BindBuffer(GL_COPY_WRITE_BUFFER, static_cast<GLuint>(write));
}

// The buffer bound to the target if this upload can stay late; 0: submit.
GLuint late_buffer(const Context& c, GLenum target, GLsizeiptr size) {
    const GLenum query = buffer_binding_query(target);
    if (query == 0 || c.captures() || size <= 0 || size > kLargest) return 0;
    const auto buffer = static_cast<GLuint>(get_integer(query));
    if (buffer == 0 || buffer_value(target, GL_BUFFER_MAPPED)) return 0;
    return c.buffer_storage() && buffer_value(target, GL_BUFFER_IMMUTABLE_STORAGE_EXT) ? 0 : buffer;
}

// Writes into buffers by name; the binding comes back at the end.
class NamedUploads {
public:
    ~NamedUploads() {
        if (bound_ != before_) gl.BindBuffer(GL_COPY_WRITE_BUFFER, before_);
    }
    NamedUploads() = default;
    NamedUploads(const NamedUploads&) = delete;
    NamedUploads& operator=(const NamedUploads&) = delete;
    void write(const LateUpload& u) {
        if (u.buffer != bound_) gl.BindBuffer(GL_COPY_WRITE_BUFFER, bound_ = u.buffer);
        gl.BufferSubData(GL_COPY_WRITE_BUFFER, u.offset, u.size, u.data);
    }

private:
    GLuint before_ = static_cast<GLuint>(get_integer(GL_COPY_WRITE_BUFFER_BINDING)), bound_ = before_;
};

}  // namespace

GLuint Context::keep_buffer(GLuint buffer, GLintptr offset, GLsizeiptr size) {
    GLuint kept = 0;
    const GLint write = get_integer(GL_COPY_WRITE_BUFFER_BINDING);
    gl.GenBuffers(1, &kept);
    gl.BindBuffer(GL_COPY_WRITE_BUFFER, kept);
    gl.BufferData(GL_COPY_WRITE_BUFFER, size, nullptr, GL_STREAM_COPY);
    gl.BindBuffer(GL_COPY_WRITE_BUFFER, static_cast<GLuint>(write));
    copy_buffer(buffer, offset, kept, 0, size);
    kept_buffers_.push_back(kept);
    return kept;
}

void Context::drop_kept_buffers() {
    if (kept_buffers_.empty()) return;
    gl.DeleteBuffers(static_cast<GLsizei>(kept_buffers_.size()), kept_buffers_.data());
    kept_buffers_.clear();
}

void Context::record_late_uploads() {
    NamedUploads now;
    for (const LateUpload& u : late_uploads_) {
        const GLuint before = keep_buffer(u.buffer, u.offset, u.size);
        undo_.custom([=] { copy_buffer(before, 0, u.buffer, u.offset, u.size); });
        now.write(u);
        log_.add([u](Replay&) { NamedUploads().write(u); });
    }
    late_uploads_.clear();
}

void Context::make_late_uploads() {
    if (late_uploads_.empty()) return;
    NamedUploads now;
    for (const LateUpload& u : late_uploads_) now.write(u);
    late_uploads_.clear();
}

void GL_APIENTRY layer_glBufferSubData(GLenum target, GLintptr offset, GLsizeiptr size, const void* data) {
    Context* c = recording();
    if (!c || !c->has_draws()) return gl.BufferSubData(target, offset, size, data);
    const GLuint buffer = data ? late_buffer(*c, target, size) : 0;
    const bool inside = buffer != 0 && offset >= 0 && offset <= buffer_value(target, GL_BUFFER_SIZE) - size;
    if (!inside) {
        c->before_submit(Call::BufferSubData);
        return gl.BufferSubData(target, offset, size, data);
    }
    c->put_off({buffer, offset, size, c->log().copy(static_cast<const std::byte*>(data), static_cast<std::size_t>(size))});
    c->end();
}

void GL_APIENTRY layer_glBufferData(GLenum target, GLsizeiptr size, const void* data, GLenum usage) {
    Context* c = recording();
    if (!c || !c->has_draws()) return gl.BufferData(target, size, data, usage);
    const GLuint buffer = late_buffer(*c, target, size);
    if (buffer == 0 || buffer_value(target, GL_BUFFER_SIZE) > kLargest) {
        c->before_submit(Call::BufferData);
        return gl.BufferData(target, size, data, usage);
    }
    c->record_late_uploads();  // the new contents come after them
    const auto old_usage = static_cast<GLenum>(buffer_value(target, GL_BUFFER_USAGE));
    const GLsizeiptr old_size = buffer_value(target, GL_BUFFER_SIZE);
    const GLuint before = old_size > 0 ? c->keep_buffer(buffer, 0, old_size) : 0;
    c->keep_driver_error();
    gl.BufferData(target, size, data, usage);
    if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) return c->raise(error);
    c->undo().custom([=] {
        const GLint write = get_integer(GL_COPY_WRITE_BUFFER_BINDING);
        gl.BindBuffer(GL_COPY_WRITE_BUFFER, buffer);
        gl.BufferData(GL_COPY_WRITE_BUFFER, old_size, nullptr, old_usage);
        gl.BindBuffer(GL_COPY_WRITE_BUFFER, static_cast<GLuint>(write));
        if (before) copy_buffer(before, 0, buffer, 0, old_size);
    });
    const auto* copy = c->log().copy(static_cast<const std::byte*>(data), static_cast<std::size_t>(size));
    c->log().add([=](Replay&) { gl.BufferData(target, size, copy, usage); });
    c->end();
}

}  // namespace fovea::layer
