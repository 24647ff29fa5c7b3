// State and object calls that need more than a policy of calls.txt.
#include <algorithm>

#include "render/layer/context.hpp"

namespace fovea::layer {

// Scissor test and stencil test belong to the level during a replay.
[[gnu::noinline]] static void set_enabled(Context* c, GLenum cap, bool on) {
    c->undo().cap(cap);
    on ? gl.Enable(cap) : gl.Disable(cap);
    c->log().add([cap, on](Replay& replay) { replay.set_enabled(cap, on); });
}

[[gnu::hot]] void GL_APIENTRY layer_glEnable(GLenum cap) {
    if (Context* c = recording()) [[unlikely]] return set_enabled(c, cap, true);
    gl.Enable(cap);
}
[[gnu::hot]] void GL_APIENTRY layer_glDisable(GLenum cap) {
    if (Context* c = recording()) [[unlikely]] return set_enabled(c, cap, false);
    gl.Disable(cap);
}

[[gnu::hot]] void GL_APIENTRY layer_glViewport(GLint x, GLint y, GLsizei w, GLsizei h) {
    Context* c = recording();
    if (!c) [[likely]] return gl.Viewport(x, y, w, h);
    c->undo().viewport();
    gl.Viewport(x, y, w, h);
    c->log().add([=](Replay& replay) { replay.viewport(x, y, w, h); });
}

[[gnu::hot]] void GL_APIENTRY layer_glScissor(GLint x, GLint y, GLsizei w, GLsizei h) {
    Context* c = recording();
    if (!c) [[likely]] return gl.Scissor(x, y, w, h);
    c->undo().scissor();
    gl.Scissor(x, y, w, h);
    c->log().add([=](Replay& replay) { replay.scissor(x, y, w, h); });
}

// Recorded as calls to the replay: at a lower level the mask has a bit of the stencil buffer.
template <class DriverCall, class ReplayCall>
static void stencil(DriverCall driver, ReplayCall replayed) {
    Context* c = recording();
    if (!c) [[likely]] return driver();
    c->undo().stencil();
    driver();
    c->log().add(replayed);
}

void GL_APIENTRY layer_glStencilFunc(GLenum func, GLint ref, GLuint mask) {
    stencil([=] { gl.StencilFunc(func, ref, mask); }, [=](Replay& r) { r.stencil_func(GL_FRONT_AND_BACK, func, ref, mask); });
}
void GL_APIENTRY layer_glStencilFuncSeparate(GLenum face, GLenum func, GLint ref, GLuint mask) {
    stencil([=] { gl.StencilFuncSeparate(face, func, ref, mask); }, [=](Replay& r) { r.stencil_func(face, func, ref, mask); });
}
void GL_APIENTRY layer_glStencilMask(GLuint mask) {
    stencil([=] { gl.StencilMask(mask); }, [=](Replay& r) { r.stencil_mask(GL_FRONT_AND_BACK, mask); });
}
void GL_APIENTRY layer_glStencilMaskSeparate(GLenum face, GLuint mask) {
    stencil([=] { gl.StencilMaskSeparate(face, mask); }, [=](Replay& r) { r.stencil_mask(face, mask); });
}
void GL_APIENTRY layer_glStencilOp(GLenum fail, GLenum zfail, GLenum zpass) {
    stencil([=] { gl.StencilOp(fail, zfail, zpass); }, [=](Replay& r) { r.stencil_op(GL_FRONT_AND_BACK, fail, zfail, zpass); });
}
void GL_APIENTRY layer_glStencilOpSeparate(GLenum face, GLenum fail, GLenum zfail, GLenum zpass) {
    stencil([=] { gl.StencilOpSeparate(face, fail, zfail, zpass); }, [=](Replay& r) { r.stencil_op(face, fail, zfail, zpass); });
}

template <class BindCall>
static void bind_indexed(GLenum target, GLuint index, Call name, BindCall call) {
    Context* c = recording();
    if (!c) return call();
    if (target == GL_TRANSFORM_FEEDBACK_BUFFER) {
        c->before_submit(name);
        return call();
    }
    c->undo().indexed_buffer(target, index);
    call();
    c->log().add([call](Replay&) { call(); });
}

void GL_APIENTRY layer_glBindBufferBase(GLenum target, GLuint index, GLuint buffer) {
    bind_indexed(target, index, Call::BindBufferBase, [=] { gl.BindBufferBase(target, index, buffer); });
}
void GL_APIENTRY layer_glBindBufferRange(GLenum target, GLuint index, GLuint buffer, GLintptr offset, GLsizeiptr size) {
    bind_indexed(target, index, Call::BindBufferRange, [=] { gl.BindBufferRange(target, index, buffer, offset, size); });
}

GLenum GL_APIENTRY layer_glGetError() {
    Context* c = t_context;
    return c && (c->active() || c->extrapolates() || c->has_error()) ? c->take_error() : gl.GetError();
}

void GL_APIENTRY layer_glBindFramebuffer(GLenum target, GLuint framebuffer) {
    Context* c = t_context;
    if (!c || !c->active()) return gl.BindFramebuffer(target, framebuffer);
    const bool draws = target == GL_FRAMEBUFFER || target == GL_DRAW_FRAMEBUFFER;
    if (c->is_engaged() && ((draws && framebuffer != c->draw_framebuffer()) ||
                            (target == GL_READ_FRAMEBUFFER && framebuffer == c->draw_framebuffer())))
        c->before_finish(Call::BindFramebuffer);
    gl.BindFramebuffer(target, framebuffer);
    if (!draws && target != GL_READ_FRAMEBUFFER) return;
    // The driver says whether the name was accepted.
    const auto bound = static_cast<GLuint>(get_integer(draws ? GL_DRAW_FRAMEBUFFER_BINDING : GL_READ_FRAMEBUFFER_BINDING));
    if (bound == framebuffer) c->bound_framebuffer(target, framebuffer);
}

GLenum GL_APIENTRY layer_glCheckFramebufferStatus(GLenum target) {
    const GLenum status = gl.CheckFramebufferStatus(target);
    Context* c = engaged();
    if (!c || !c->active() || status != GL_FRAMEBUFFER_COMPLETE) return status;
    if (const GLenum views = c->view_status(target == GL_READ_FRAMEBUFFER ? GL_READ_FRAMEBUFFER : GL_DRAW_FRAMEBUFFER); views != GL_FRAMEBUFFER_COMPLETE)
        return views;
    return c->foveation_status(target == GL_READ_FRAMEBUFFER ? GL_READ_FRAMEBUFFER : GL_DRAW_FRAMEBUFFER);
}

void GL_APIENTRY layer_glDeleteFramebuffers(GLsizei n, const GLuint* framebuffers) {
    Context* c = engaged();
    if (c && n > 0 && framebuffers && std::find(framebuffers, framebuffers + n, c->draw_framebuffer()) != framebuffers + n)
        c->before_finish(Call::DeleteFramebuffers);
    gl.DeleteFramebuffers(n, framebuffers);
    if (Context* current = t_context; current && current->active() && framebuffers)
        for (GLsizei i = 0; i < n; ++i) current->removed_framebuffer(framebuffers[i]);
}

void GL_APIENTRY layer_glDeleteTextures(GLsizei n, const GLuint* textures) {
    Context* c = engaged();
    if (!c) return gl.DeleteTextures(n, textures);
    c->before_finish(Call::DeleteTextures);
    const AttachmentWatch watch;
    for (GLsizei i = 0; textures && i < n; ++i) {
        c->image_written(textures[i]);
        c->forget_drawn_texture(textures[i]);
        if (textures[i] != 0) c->textures().forget(textures[i]), c->forget_deleted_views(textures[i]);
    }
    gl.DeleteTextures(n, textures);
}

void GL_APIENTRY layer_glCopyImageSubData(GLuint source, GLenum source_target, GLint source_level, GLint sx, GLint sy, GLint sz, GLuint to,
                                          GLenum to_target, GLint to_level, GLint x, GLint y, GLint z, GLsizei w, GLsizei h, GLsizei d) {
    if (Context* c = engaged()) {
        c->before_finish(Call::CopyImageSubData);
        c->image_written(to);
    }
    gl.CopyImageSubData(source, source_target, source_level, sx, sy, sz, to, to_target, to_level, x, y, z, w, h, d);
}

void GL_APIENTRY layer_glGenerateMipmap(GLenum target) {
    if (Context* c = engaged()) {
        c->before_finish(Call::GenerateMipmap);
        c->mipmaps_written(target);
    }
    gl.GenerateMipmap(target);
}

// The framebuffer that is read has pending draws, or is incomplete by the rules of the extensions.
static Context* before_read(Call call, bool* allowed) {
    Context* c = engaged();
    *allowed = true;
    if (!c || !c->active()) return nullptr;
    c->before_finish(call);
    if (const GLenum error = c->read_error(); error != GL_NO_ERROR) {
        c->raise(error);
        *allowed = false;
    }
    return c;
}

// Reads go to the layer of a view while this lives, if the framebuffer has one with samples.
class ResolvedRead {
public:
    explicit ResolvedRead(Context* c) : context_(c && c->read_from_layer() ? c : nullptr) {}
    ~ResolvedRead() {
        if (context_) context_->read_from_program();
    }
    ResolvedRead(const ResolvedRead&) = delete;
    ResolvedRead& operator=(const ResolvedRead&) = delete;

private:
    Context* context_;
};

void GL_APIENTRY layer_glReadPixels(GLint x, GLint y, GLsizei w, GLsizei h, GLenum format, GLenum type, void* pixels) {
    bool allowed;
    const ResolvedRead from(before_read(Call::ReadPixels, &allowed));
    if (allowed) gl.ReadPixels(x, y, w, h, format, type, pixels);
}
void GL_APIENTRY layer_glReadnPixels(GLint x, GLint y, GLsizei w, GLsizei h, GLenum format, GLenum type, GLsizei size, void* data) {
    bool allowed;
    const ResolvedRead from(before_read(Call::ReadnPixels, &allowed));
    if (allowed) gl.ReadnPixels(x, y, w, h, format, type, size, data);
}
void GL_APIENTRY layer_glCopyTexImage2D(GLenum target, GLint level, GLenum format, GLint x, GLint y, GLsizei w, GLsizei h, GLint border) {
    bool allowed;
    Context* c = before_read(Call::CopyTexImage2D, &allowed);
    if (c) c->before_upload(Call::CopyTexImage2D, target);
    const ResolvedRead from(c);
    if (allowed) gl.CopyTexImage2D(target, level, format, x, y, w, h, border);
}
void GL_APIENTRY layer_glCopyTexSubImage2D(GLenum target, GLint level, GLint xo, GLint yo, GLint x, GLint y, GLsizei w, GLsizei h) {
    bool allowed;
    Context* c = before_read(Call::CopyTexSubImage2D, &allowed);
    if (c) c->before_upload(Call::CopyTexSubImage2D, target);
    const ResolvedRead from(c);
    if (allowed) gl.CopyTexSubImage2D(target, level, xo, yo, x, y, w, h);
}
void GL_APIENTRY layer_glCopyTexSubImage3D(GLenum target, GLint level, GLint xo, GLint yo, GLint zo, GLint x, GLint y, GLsizei w, GLsizei h) {
    bool allowed;
    Context* c = before_read(Call::CopyTexSubImage3D, &allowed);
    if (c) c->before_upload(Call::CopyTexSubImage3D, target);
    const ResolvedRead from(c);
    if (allowed) gl.CopyTexSubImage3D(target, level, xo, yo, zo, x, y, w, h);
}

void GL_APIENTRY layer_glBlitFramebuffer(GLint sx0, GLint sy0, GLint sx1, GLint sy1, GLint dx0, GLint dy0, GLint dx1,
                                         GLint dy1, GLbitfield mask, GLenum filter) {
    bool allowed;
    Context* c = before_read(Call::BlitFramebuffer, &allowed);
    if (!allowed) return;
    if (c) {
        if (const GLenum error = c->write_error(); error != GL_NO_ERROR) return c->raise(error);
        if (c->drawing_target().kind != DrawTarget::Kind::plain) c->leave_levels(Call::BlitFramebuffer);
    }
    const ResolvedRead from(mask & ~static_cast<GLbitfield>(GL_COLOR_BUFFER_BIT) ? nullptr : c);
    gl.BlitFramebuffer(sx0, sy0, sx1, sy1, dx0, dy0, dx1, dy1, mask, filter);
}

void GL_APIENTRY layer_glBeginQuery(GLenum target, GLuint id) {
    if (Context* c = engaged()) c->begin_query(target, Call::BeginQuery);
    gl.BeginQuery(target, id);
}
void GL_APIENTRY layer_glEndQuery(GLenum target) {
    if (Context* c = engaged()) c->end_query(target, Call::EndQuery);
    gl.EndQuery(target);
}
void GL_APIENTRY layer_glBeginTransformFeedback(GLenum mode) {
    Context* c = t_context;
    if (!c || !c->active()) return gl.BeginTransformFeedback(mode);
    c->before_forget(Call::BeginTransformFeedback);  // what is replayed inside must not change the program that captures
    gl.BeginTransformFeedback(mode);
    if (get_integer(GL_TRANSFORM_FEEDBACK_ACTIVE)) c->begin_feedback();
}
void GL_APIENTRY layer_glEndTransformFeedback() {
    Context* c = t_context;
    if (!c || !c->active()) return gl.EndTransformFeedback();
    c->before_submit(Call::EndTransformFeedback);
    gl.EndTransformFeedback();
    if (!get_integer(GL_TRANSFORM_FEEDBACK_ACTIVE)) c->end_feedback();
}

void GL_APIENTRY layer_glLinkProgram(GLuint program) {
    if (Context* c = engaged()) {
        if (c->may_use_program(program)) c->before_submit(Call::LinkProgram);
        c->forget_program(program);
    }
    gl.LinkProgram(program);
    if (Context* c = t_context; c && c->active()) c->note_link(program);
}
void GL_APIENTRY layer_glProgramBinary(GLuint program, GLenum format, const void* binary, GLsizei length) {
    if (Context* c = engaged()) {
        if (c->may_use_program(program)) c->before_submit(Call::ProgramBinary);
        c->forget_program(program);
    }
    gl.ProgramBinary(program, format, binary, length);
}
void GL_APIENTRY layer_glDeleteProgram(GLuint program) {
    Context* c = engaged();
    if (!c) return gl.DeleteProgram(program);
    c->before_forget(Call::DeleteProgram);
    c->forget_program(program);
    if (!c->put_off_deletion(program)) gl.DeleteProgram(program);
}

}  // namespace fovea::layer
