// GL_OVR_multiview_multisampled_render_to_texture: an attachment of several views that is drawn with several samples per pixel.
//
//   the program's attachment: layers base to base + views - 1 of an array
//   the driver's attachment:  a multisampled renderbuffer of the layer's, one per view
//                             --- when the image is read, flushed, or its framebuffer left ---> blitted into the view's layer
//                             <-- before a draw, when the array was written by other means ---- drawn into every sample
//
// Samples stay beyond a resolve (the extension lets an implementation drop them). No driver can do this with
// GL_EXT_multisampled_render_to_texture, which attaches no layer of an array.
#include <algorithm>
#include <utility>

#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

struct LevelImage {
    GLenum format = 0;
    GLint width = 0, height = 0;
};

LevelImage image_of(GLuint texture, GLint level) {
    const auto bound = static_cast<GLuint>(get_integer(GL_TEXTURE_BINDING_2D_ARRAY));
    LevelImage image;
    GLint format = 0;
    if (bound != texture) gl.BindTexture(GL_TEXTURE_2D_ARRAY, texture);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D_ARRAY, level, GL_TEXTURE_WIDTH, &image.width);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D_ARRAY, level, GL_TEXTURE_HEIGHT, &image.height);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D_ARRAY, level, GL_TEXTURE_INTERNAL_FORMAT, &format);
    if (bound != texture) gl.BindTexture(GL_TEXTURE_2D_ARRAY, bound);
    image.format = static_cast<GLenum>(format);
    if (image.format == GL_RGBA) image.format = GL_RGBA8;  // of an image that was given without a size
    if (image.format == GL_RGB) image.format = GL_RGB8;
    if (image.format == GL_DEPTH_COMPONENT) image.format = GL_DEPTH_COMPONENT24;
    if (image.format == GL_DEPTH_STENCIL) image.format = GL_DEPTH24_STENCIL8;
    return image;
}

GLbitfield buffer_of(GLenum point) {
    return point == GL_DEPTH_ATTACHMENT ? GL_DEPTH_BUFFER_BIT : point == GL_STENCIL_ATTACHMENT ? GL_STENCIL_BUFFER_BIT : GL_COLOR_BUFFER_BIT;
}

}  // namespace

// Depth and stencil of one image have one set of renderbuffers: a framebuffer with two would not be complete.
ViewAttachment& Framebuffer::samples_of(GLenum point) {
    ViewAttachment& own = views.at(point);
    const auto depth = point == GL_STENCIL_ATTACHMENT ? views.find(GL_DEPTH_ATTACHMENT) : views.end();
    return depth != views.end() && depth->second.same_as(own) ? depth->second : own;
}

bool Framebuffer::has_samples() const noexcept {
    return std::any_of(views.begin(), views.end(), [](const auto& v) { return v.second.samples > 0; });
}

bool Context::may_have_samples(GLuint texture, GLint level, GLsizei samples) {
    const LevelImage image = image_of(texture, level);
    GLint count = 0, most = 0;
    if (image.width == 0) return true;  // what it will be is not known yet
    gl.GetInternalformativ(GL_RENDERBUFFER, image.format, GL_NUM_SAMPLE_COUNTS, 1, &count);
    if (count > 0) gl.GetInternalformativ(GL_RENDERBUFFER, image.format, GL_SAMPLES, 1, &most);  // the largest comes first
    drop_errors();
    return samples <= most;
}

void Context::drop_samples(ViewAttachment& a) {
    gl.DeleteRenderbuffers(static_cast<GLsizei>(a.images.size()), a.images.data());
    a.images.clear();
}

std::uint64_t Context::sample_bytes() const {
    std::uint64_t all = 0;
    if (!made_samples_) return all;
    for (const auto& [name, f] : framebuffers_)
        for (const auto& [point, a] : f.views)
            all += a.images.size() * static_cast<std::uint64_t>(a.width) * static_cast<std::uint64_t>(a.height) *
                   static_cast<std::uint64_t>(std::max(a.actual_samples, 1)) * bytes_of(a.format);
    return all;
}

// The images that the attachments need now: those of before, unless an array was given another size or format.
void Context::make_samples(Framebuffer& f, GLenum target) {
    if (!f.has_samples()) return;
    made_samples_ = true;
    keep_driver_error();
    const GLint bound = get_integer(GL_RENDERBUFFER_BINDING);
    for (auto& [point, attached] : f.views) {
        if (attached.samples == 0) continue;
        ViewAttachment& a = f.samples_of(point);
        if (&a == &attached) {
            const LevelImage image = image_of(a.texture, a.level);
            if (!a.images.empty() && a.format == image.format && a.width == image.width && a.height == image.height) continue;
            drop_samples(a);
            a.format = image.format, a.width = image.width, a.height = image.height;
            if (image.width > 0) {
                a.images.resize(static_cast<std::size_t>(a.views));
                gl.GenRenderbuffers(a.views, a.images.data());
                for (const GLuint name : a.images) {
                    gl.BindRenderbuffer(GL_RENDERBUFFER, name);
                    gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, a.samples, a.format, a.width, a.height);
                }
                gl.GetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_SAMPLES, &a.actual_samples);
                if (gl.GetError() != GL_NO_ERROR) drop_samples(a);  // not renderable: the driver says so of the array itself
            }
            a.stale = true;
        }
        if (a.images.empty())
            gl.FramebufferTextureLayer(target, point, attached.texture, attached.level, attached.base);
        else
            gl.FramebufferRenderbuffer(target, point, GL_RENDERBUFFER, a.images.front());
        ++attachments_epoch_;
    }
    gl.BindRenderbuffer(GL_RENDERBUFFER, static_cast<GLuint>(bound));
    drop_errors();
}

// One view's samples and its layer, each in a framebuffer object of the layer's. Draw and read bindings: the caller's to restore.
void Context::bind_view_samples(GLenum samples_target, GLenum layer_target, GLenum point, ViewAttachment& a, GLint view) {
    if (sample_framebuffers_[0] == 0) gl.GenFramebuffers(2, sample_framebuffers_.data());
    const GLenum to = point < GL_DEPTH_ATTACHMENT ? GL_COLOR_ATTACHMENT0 : point;
    gl.BindFramebuffer(samples_target, sample_framebuffers_[0]);
    gl.FramebufferRenderbuffer(samples_target, to, GL_RENDERBUFFER, a.images[static_cast<std::size_t>(view)]);
    gl.BindFramebuffer(layer_target, sample_framebuffers_[1]);
    gl.FramebufferTextureLayer(layer_target, to, a.texture, a.level, a.base + view);
}
void Context::unbind_view_samples(GLenum samples_target, GLenum layer_target, GLenum point) {
    const GLenum to = point < GL_DEPTH_ATTACHMENT ? GL_COLOR_ATTACHMENT0 : point;
    gl.FramebufferRenderbuffer(samples_target, to, GL_RENDERBUFFER, 0);
    gl.FramebufferRenderbuffer(layer_target, to, GL_RENDERBUFFER, 0);
}

void Context::resolve_samples(Framebuffer& f) {
    if (!f.samples_dirty) return;
    f.samples_dirty = false;
    keep_driver_error();
    Undo own;
    own.framebuffers();
    own.cap(GL_SCISSOR_TEST);
    gl.Disable(GL_SCISSOR_TEST);
    for (auto& [point, attached] : f.views) {
        ViewAttachment& a = f.samples_of(point);
        if (attached.samples == 0 || a.images.empty()) continue;
        for (GLint view = 0; view < a.views; ++view) {
            bind_view_samples(GL_READ_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER, point, a, view);
            gl.BlitFramebuffer(0, 0, a.width, a.height, 0, 0, a.width, a.height, buffer_of(point), GL_NEAREST);
            unbind_view_samples(GL_READ_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER, point);
        }
    }
    own.restore();
    drop_errors();
}

// What the pending draws go on with.
void Context::load_samples(Framebuffer& f) {
    bool ready = false;
    Undo own;
    // Depth, which comes first, may have the same images.
    const bool stale_stencil = f.views.contains(GL_STENCIL_ATTACHMENT) && f.samples_of(GL_STENCIL_ATTACHMENT).stale;
    for (auto& [point, attached] : f.views) {
        ViewAttachment& a = f.samples_of(point);
        const GLbitfield buffer = buffer_of(point);
        const bool cleared = buffer == GL_COLOR_BUFFER_BIT ? batch_.color_cleared : buffer == GL_DEPTH_BUFFER_BIT ? batch_.depth_cleared : batch_.stencil_cleared;
        const bool stale = std::exchange(a.stale, false) || (buffer == GL_STENCIL_BUFFER_BIT && stale_stencil);
        if (!stale || cleared || a.images.empty()) continue;
        if (!ready) {
            keep_driver_error();
            if (!own_.ready()) return;
            ready = true;
            save_for_own_drawing(own);
            set_for_own_drawing();
        }
        load_samples(point, a);
    }
    if (!ready) return;
    own.restore();
    drop_errors();
}

// Every sample of a pixel gets what the layer holds.
void Context::load_samples(GLenum point, ViewAttachment& a) {
    const bool depth = point == GL_DEPTH_ATTACHMENT, stencil = point == GL_STENCIL_ATTACHMENT;
    const char kind = depth ? 'd' : stencil ? 's' : fetch_kind(a.format);
    GLuint copy = 0;  // shaders of the layer's read textures without layers
    gl.GenTextures(1, &copy);
    gl.BindTexture(GL_TEXTURE_2D, copy);
    gl.TexStorage2D(GL_TEXTURE_2D, 1, a.format, a.width, a.height);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    if (depth) {
        gl.Enable(GL_DEPTH_TEST);
        gl.DepthFunc(GL_ALWAYS);
        gl.DepthMask(GL_TRUE);
    }
    if (stencil) {
        if (a.format != GL_STENCIL_INDEX8) gl.TexParameteri(GL_TEXTURE_2D, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
        gl.Enable(GL_STENCIL_TEST);
        gl.StencilFunc(GL_ALWAYS, 0xff, 0xff);
        gl.StencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
        gl.ClearStencil(0);
    }
    for (GLint view = 0; view < a.views; ++view) {
        bind_view_samples(GL_DRAW_FRAMEBUFFER, GL_READ_FRAMEBUFFER, point, a, view);
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, own_.copy_framebuffer());
        const GLenum to = depth || stencil ? point : GL_COLOR_ATTACHMENT0;
        gl.StencilMask(0xff);
        gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, to, GL_TEXTURE_2D, copy, 0);
        gl.BlitFramebuffer(0, 0, a.width, a.height, 0, 0, a.width, a.height, buffer_of(point), GL_NEAREST);
        gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, to, GL_RENDERBUFFER, 0);
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, sample_framebuffers_[0]);
        gl.Viewport(0, 0, a.width, a.height);
        if (stencil) {
            gl.Clear(GL_STENCIL_BUFFER_BIT);
            for (GLuint bit = 1; bit < 0x100; bit <<= 1) {  // no shader of OpenGL ES writes stencil values
                gl.StencilMask(bit);
                own_.draw_copy(copy, kind, a.width, a.height, bit);
            }
        } else {
            own_.draw_copy(copy, kind, a.width, a.height);
        }
        unbind_view_samples(GL_DRAW_FRAMEBUFFER, GL_READ_FRAMEBUFFER, point);
    }
    if (depth) gl.Disable(GL_DEPTH_TEST);
    if (stencil) gl.Disable(GL_STENCIL_TEST);
    gl.DeleteTextures(1, &copy);
}

// The array was written by other means than drawing to this framebuffer.
void Context::samples_overwritten(GLuint texture, GLuint by_framebuffer, const MipLevels& levels) {
    for (auto& [name, f] : framebuffers_) {
        if (by_framebuffer != 0 && name == by_framebuffer) continue;
        const auto written = [&](const ViewAttachment& a) { return a.texture == texture && levels.has(a.level); };
        if (std::none_of(f.views.begin(), f.views.end(), [&](const auto& v) { return v.second.samples > 0 && written(v.second); })) continue;
        f.each_pass([this](Pass& p) { resolve(p), p.mode = Pass::Mode::none; });
        resolve_samples(f);
        for (auto& [point, a] : f.views)
            if (written(a)) f.samples_of(point).stale = true;
    }
}

void Context::note_shared_samples() {
    if (draw_framebuffer_ == 0) return;
    if (std::none_of(framebuffers_.begin(), framebuffers_.end(), [this](const auto& f) { return f.first != draw_framebuffer_ && f.second.has_samples(); })) return;
    for (const Attachment& a : program_attachments(GL_DRAW_FRAMEBUFFER))
        if (a.type == GL_TEXTURE) samples_overwritten(a.name, draw_framebuffer_);
}

// A deleted texture leaves the framebuffers that are bound; in their place stand images that the driver knows nothing of.
void Context::forget_deleted_views(GLuint texture) {
    for (const auto& [target, name] : {std::pair{GL_DRAW_FRAMEBUFFER, draw_framebuffer_}, std::pair{GL_READ_FRAMEBUFFER, read_framebuffer_}}) {
        Framebuffer* f = name ? find_framebuffer(name) : nullptr;
        for (auto v = f ? f->views.begin() : std::map<GLenum, ViewAttachment>::iterator{}; f && v != f->views.end();) {
            if (v->second.texture != texture) {
                ++v;
                continue;
            }
            gl.FramebufferRenderbuffer(target, v->first, GL_RENDERBUFFER, 0);
            drop_samples(v->second);
            v = f->views.erase(v);
            ++attachments_epoch_;
        }
    }
}

std::vector<Attachment> Context::program_attachments(GLenum framebuffer_target, GLuint bound) const {
    std::vector<Attachment> list = read_attachments(framebuffer_target);
    const auto f = framebuffers_.find(bound);
    if (f == framebuffers_.end() || !f->second.has_samples()) return list;
    for (Attachment& a : list)
        if (const auto it = f->second.views.find(a.point); it != f->second.views.end() && it->second.samples > 0)
            a = {.point = a.point, .type = GL_TEXTURE, .name = it->second.texture, .level = it->second.level, .layer = it->second.base};
    return list;
}

// A framebuffer of one view can be read, samples or not: what is read is the layer.
bool Context::read_from_layer() {
    Framebuffer* f = find_framebuffer(read_framebuffer_);
    if (!f || !f->has_samples()) return false;
    const auto it = f->views.find(static_cast<GLenum>(get_integer(GL_READ_BUFFER)));
    if (it == f->views.end() || it->second.samples == 0 || it->second.images.empty()) return false;
    if (sample_framebuffers_[0] == 0) gl.GenFramebuffers(2, sample_framebuffers_.data());
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, sample_framebuffers_[1]);
    gl.FramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, it->second.texture, it->second.level, it->second.base);
    return true;
}
void Context::read_from_program() {
    gl.FramebufferRenderbuffer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, 0);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, read_framebuffer_);
}

}  // namespace fovea::layer
