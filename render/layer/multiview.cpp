// GL_OVR_multiview on a driver without it: attachments of several layers, and one run of the record per view.
//
// The driver's framebuffer holds the first layer of each attachment, so that it is complete and its queries are true; a
// submission attaches the layers of one view after the other, and sets the uniform that gl_ViewID_OVR became.
#include <algorithm>
#include <string>

#include "render/layer/context.hpp"
#include "render/layer/multiview_source.hpp"

namespace fovea::layer {
namespace {

Context* emulating() {
    Context* c = t_context;
    return c && c->active() && !c->native().multiview ? c : nullptr;
}

std::vector<GLenum> points_of(GLenum attachment) {
    if (attachment == GL_DEPTH_STENCIL_ATTACHMENT) return {GL_DEPTH_ATTACHMENT, GL_STENCIL_ATTACHMENT};
    return {attachment};
}

GLint layers_of(GLuint texture, GLint level) {
    const auto bound = static_cast<GLuint>(get_integer(GL_TEXTURE_BINDING_2D_ARRAY));
    GLint depth = 0;
    gl.BindTexture(GL_TEXTURE_2D_ARRAY, texture);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D_ARRAY, level, GL_TEXTURE_DEPTH, &depth);
    gl.BindTexture(GL_TEXTURE_2D_ARRAY, bound);
    return depth;
}

std::string join(GLsizei count, const GLchar* const* strings, const GLint* lengths) {
    std::string all;
    for (GLsizei i = 0; i < count; ++i)
        if (strings[i]) lengths && lengths[i] >= 0 ? all.append(strings[i], static_cast<std::size_t>(lengths[i])) : all.append(strings[i]);
    return all;
}

}  // namespace

void ProgramSources::set_shader(GLuint shader, std::string original, int num_views) {
    const std::lock_guard lock(mutex_);
    shaders_[shader] = {std::move(original), num_views};
}
void ProgramSources::forget_shader(GLuint shader) {
    const std::lock_guard lock(mutex_);
    shaders_.erase(shader);
}
std::optional<ProgramSources::Shader> ProgramSources::shader(GLuint name) const {
    const std::lock_guard lock(mutex_);
    const auto it = shaders_.find(name);
    return it == shaders_.end() ? std::nullopt : std::optional(it->second);
}

GLuint Context::views_of(GLuint framebuffer) const {
    const auto it = framebuffers_.find(framebuffer);
    if (it == framebuffers_.end() || it->second.views.empty()) return 1;
    return static_cast<GLuint>(it->second.views.begin()->second.views);
}

GLenum Context::view_status(GLenum framebuffer_target) {
    const GLuint name = framebuffer_target == GL_READ_FRAMEBUFFER ? read_framebuffer_ : draw_framebuffer_;
    Framebuffer* f = name ? find_framebuffer(name) : nullptr;
    if (!f || f->views.empty()) return GL_FRAMEBUFFER_COMPLETE;
    make_samples(*f, framebuffer_target == GL_READ_FRAMEBUFFER ? GL_READ_FRAMEBUFFER : GL_DRAW_FRAMEBUFFER);
    const GLint views = f->views.begin()->second.views;
    GLenum status = GL_FRAMEBUFFER_COMPLETE;
    for (const Attachment& a : program_attachments(framebuffer_target)) {
        const auto it = f->views.find(a.point);
        if (it == f->views.end() || it->second.views != views) return GL_FRAMEBUFFER_INCOMPLETE_VIEW_TARGETS_OVR;
        if (a.type == GL_TEXTURE && it->second.base + views > layers_of(a.name, a.level)) status = GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT;
    }
    return status;
}

void Context::attach_view(GLint view) {
    Framebuffer* f = find_framebuffer(draw_framebuffer_);
    if (!f || f->views.empty()) return;
    const auto image = [f, view](GLenum point) {
        const std::vector<GLuint>& images = f->samples_of(point).images;
        return images.empty() ? 0 : images[static_cast<std::size_t>(view)];
    };
    for (const auto& [point, a] : f->views) {
        if (const GLuint samples = image(point))
            gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, point, GL_RENDERBUFFER, samples);
        else
            gl.FramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, point, a.texture, a.level, a.base + view);
    }
    for (Attachment& a : attachments_)
        if (const auto it = f->views.find(a.point); it != f->views.end()) {
            if (const GLuint samples = image(a.point)) a.name = samples;
            else a.layer = it->second.base + view;
        }
}

void Context::forget_views(GLenum target, GLenum attachment) {
    Framebuffer* f = find_framebuffer(target == GL_READ_FRAMEBUFFER ? read_framebuffer_ : draw_framebuffer_);
    if (!f || f->views.empty()) return;
    for (const GLenum point : points_of(attachment))
        if (const auto it = f->views.find(point); it != f->views.end()) {
            drop_samples(it->second);
            f->views.erase(it);
        }
    ++attachments_epoch_;
}

GLenum Context::view_error() {
    if (!share_->sources.any_multiview() && (framebuffers_.empty() || views_of(draw_framebuffer_) == 1)) return GL_NO_ERROR;
    const ProgramFacts& facts = program_facts();
    const GLuint views = views_of(draw_framebuffer_);
    if (static_cast<GLuint>(std::max(facts.num_views, 1)) != views) return GL_INVALID_OPERATION;
    return views > 1 && (facts.geometry_or_tessellation || feedback_) ? GL_INVALID_OPERATION : GL_NO_ERROR;
}

// The view of the draw that follows, for the program in use.
void Context::set_view(GLint view) {
    const ProgramFacts& facts = program_facts();
    for (const auto& [program, location] : facts.view_uniforms) gl.ProgramUniform1ui(program, location, static_cast<GLuint>(view));
}

static void attach_views(Context& c, Call call, GLenum target, GLenum attachment, GLuint texture, GLint level, GLint base, GLsizei views, GLsizei samples = 0) {
    c.before_attach(call);
    if (texture != 0) {
        if (views < 1 || views > kMaxViews || base < 0) return c.raise(GL_INVALID_VALUE);
        if (std::int64_t{base} + views > get_integer(GL_MAX_ARRAY_TEXTURE_LAYERS) - 1) return c.raise(GL_INVALID_VALUE);
        Attachment a{.type = GL_TEXTURE, .name = texture};
        c.keep_driver_error();
        if (gl.IsTexture(texture)) find_target(a);
        if (a.target != GL_TEXTURE_2D_ARRAY) return c.raise(GL_INVALID_OPERATION);
        if (samples > 0 && !c.may_have_samples(texture, level, samples)) return c.raise(GL_INVALID_OPERATION);
    }
    c.keep_driver_error();
    gl.FramebufferTextureLayer(target, attachment, texture, level, texture ? base : 0);
    if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) return c.raise(error);
    const GLuint name = target == GL_READ_FRAMEBUFFER ? c.read_framebuffer() : c.draw_framebuffer();
    c.forget_views(target, attachment);
    if (texture != 0) {
        Framebuffer& f = c.framebuffer(name);
        for (const GLenum point : points_of(attachment)) f.views[point] = {.texture = texture, .level = level, .base = base, .views = views, .samples = samples, .images = {}};
        c.make_samples(f, target == GL_READ_FRAMEBUFFER ? GL_READ_FRAMEBUFFER : GL_DRAW_FRAMEBUFFER);
    }
    c.check_configured_attachments();
}

void GL_APIENTRY layer_glFramebufferTextureMultiviewOVR(GLenum target, GLenum attachment, GLuint texture, GLint level,
                                                        GLint base, GLsizei views) {
    Context* c = t_context;
    if (c && c->active() && !c->native().multiview) return attach_views(*c, Call::FramebufferTextureMultiviewOVR, target, attachment, texture, level, base, views);
    if (gl.FramebufferTextureMultiviewOVR) gl.FramebufferTextureMultiviewOVR(target, attachment, texture, level, base, views);
}

void GL_APIENTRY layer_glFramebufferTextureMultisampleMultiviewOVR(GLenum target, GLenum attachment, GLuint texture, GLint level,
                                                                   GLsizei samples, GLint base, GLsizei views) {
    Context* c = t_context;
    if (gl.FramebufferTextureMultisampleMultiviewOVR && (!c || !c->active() || c->native().multiview)) {
        const AttachmentWatch watch;
        if (Context* e = engaged()) e->before_attach(Call::FramebufferTextureMultisampleMultiviewOVR);
        return gl.FramebufferTextureMultisampleMultiviewOVR(target, attachment, texture, level, samples, base, views);
    }
    if (!c || !c->active()) return;
    if (samples < 0 || samples > get_integer(GL_MAX_SAMPLES)) return c->raise(GL_INVALID_VALUE);
    attach_views(*c, Call::FramebufferTextureMultisampleMultiviewOVR, target, attachment, texture, level, base, views, samples);
}

// What the driver has in place of a multisampled view is the layer's affair.
static bool answer_for_samples(const ViewAttachment& a, GLenum name, GLint* value) {
    switch (name) {
        case GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE: *value = GL_TEXTURE; return true;
        case GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME: *value = static_cast<GLint>(a.texture); return true;
        case GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL: *value = a.level; return true;
        case GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER: *value = a.base; return true;
        case GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_CUBE_MAP_FACE: case GL_FRAMEBUFFER_ATTACHMENT_LAYERED: *value = 0; return true;
        case GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR: *value = a.views; return true;
        case GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_BASE_VIEW_INDEX_OVR: *value = a.base; return true;
        default: return false;
    }
}

void GL_APIENTRY layer_glGetFramebufferAttachmentParameteriv(GLenum target, GLenum attachment, GLenum name, GLint* values) {
    Context* c = emulating();
    if (c && values && c->is_engaged() && (target == GL_FRAMEBUFFER || target == GL_DRAW_FRAMEBUFFER || target == GL_READ_FRAMEBUFFER)) {
        Framebuffer* bound = c->find_framebuffer(target == GL_READ_FRAMEBUFFER ? c->read_framebuffer() : c->draw_framebuffer());
        const auto it = bound ? bound->views.find(points_of(attachment).front()) : std::map<GLenum, ViewAttachment>::iterator{};
        if (bound && it != bound->views.end()) {
            if (name == GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_SAMPLES_EXT) {
                *values = it->second.samples > 0 ? bound->samples_of(it->first).actual_samples : 0;
                return;
            }
            const bool apart = attachment == GL_DEPTH_STENCIL_ATTACHMENT && (!bound->views.contains(GL_STENCIL_ATTACHMENT) || !bound->views.at(GL_STENCIL_ATTACHMENT).same_as(it->second));
            if (it->second.samples > 0 && !apart && answer_for_samples(it->second, name, values)) return;
        }
    }
    const bool ours = name == GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR || name == GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_BASE_VIEW_INDEX_OVR;
    if (!c || !ours || !values) return gl.GetFramebufferAttachmentParameteriv(target, attachment, name, values);
    // Errors are those of another value of a texture.
    c->keep_driver_error();
    GLint level = 0;
    gl.GetFramebufferAttachmentParameteriv(target, attachment, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL, &level);
    if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) return c->raise(error);
    *values = 0;
    const Framebuffer* f = c->find_framebuffer(target == GL_READ_FRAMEBUFFER ? c->read_framebuffer() : c->draw_framebuffer());
    if (!f) return;
    if (const auto it = f->views.find(points_of(attachment).front()); it != f->views.end())
        *values = name == GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR ? it->second.views : it->second.base;
}

void GL_APIENTRY layer_glShaderSource(GLuint shader, GLsizei count, const GLchar* const* strings, const GLint* lengths) {
    Context* c = emulating();
    if (!c || count <= 0 || !strings) return gl.ShaderSource(shader, count, strings, lengths);
    std::string source = join(count, strings, lengths);
    if (const auto multiview = rewrite_multiview(source)) {
        const GLchar* text = multiview->text.c_str();
        c->keep_driver_error();
        gl.ShaderSource(shader, 1, &text, nullptr);
        if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) return c->raise(error);
        return c->sources().set_shader(shader, std::move(source), multiview->num_views);
    }
    c->sources().forget_shader(shader);
    gl.ShaderSource(shader, count, strings, lengths);
}

// Programs get back what they gave.
void GL_APIENTRY layer_glGetShaderSource(GLuint shader, GLsizei size, GLsizei* length, GLchar* source) {
    Context* c = emulating();
    const auto known = c && size > 0 && source ? c->sources().shader(shader) : std::nullopt;
    if (!known) return gl.GetShaderSource(shader, size, length, source);
    const std::size_t copied = std::min(known->original.size(), static_cast<std::size_t>(size) - 1);
    known->original.copy(source, copied);
    source[copied] = '\0';
    if (length) *length = static_cast<GLsizei>(copied);
}

void GL_APIENTRY layer_glGetShaderiv(GLuint shader, GLenum name, GLint* values) {
    gl.GetShaderiv(shader, name, values);
    if (name != GL_SHADER_SOURCE_LENGTH || !values) return;
    if (Context* c = emulating())
        if (const auto known = c->sources().shader(shader)) *values = static_cast<GLint>(known->original.size()) + 1;
}

GLuint GL_APIENTRY layer_glCreateShaderProgramv(GLenum type, GLsizei count, const GLchar* const* strings) {
    Context* c = emulating();
    if (!c || count <= 0 || !strings) return gl.CreateShaderProgramv(type, count, strings);
    const std::string source = join(count, strings, nullptr);
    const auto multiview = rewrite_multiview(source);
    const GLchar* text = multiview ? multiview->text.c_str() : source.c_str();
    const GLuint program = gl.CreateShaderProgramv(type, 1, &text);
    if (program) c->sources().linked(program, source_facts(type, source), multiview && type == GL_VERTEX_SHADER ? multiview->num_views : 0);
    return program;
}

// Dispatches are broadcast to every view as draws are.
void GL_APIENTRY layer_glDispatchCompute(GLuint x, GLuint y, GLuint z) {
    Context* c = engaged();
    if (!c) return gl.DispatchCompute(x, y, z);
    c->before_finish(Call::DispatchCompute);
    c->storing_images();
    c->for_each_view([=] { gl.DispatchCompute(x, y, z); });
}
void GL_APIENTRY layer_glDispatchComputeIndirect(GLintptr indirect) {
    Context* c = engaged();
    if (!c) return gl.DispatchComputeIndirect(indirect);
    c->before_finish(Call::DispatchComputeIndirect);
    c->storing_images();
    c->for_each_view([=] { gl.DispatchComputeIndirect(indirect); });
}

// What the attached shaders say, once they are linked.
void Context::note_link(GLuint program) {
    GLint count = 0, views = 0;
    keep_driver_error();
    gl.GetProgramiv(program, GL_ATTACHED_SHADERS, &count);
    if (!auto_ && !share_->sources.any_multiview_shader()) return drop_errors();
    std::vector<GLuint> shaders(static_cast<std::size_t>(std::max(count, 0)));
    if (count > 0) gl.GetAttachedShaders(program, count, nullptr, shaders.data());
    for (const GLuint shader : shaders)
        if (const auto known = share_->sources.shader(shader)) views = std::max(views, known->num_views);
    share_->sources.linked(program, read_source_facts(program), views);
    drop_errors();
}

}  // namespace fovea::layer
