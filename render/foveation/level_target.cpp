#include "render/foveation/level_target.hpp"

#include <epoxy/gl.h>

#include <string>

#include "render/gl/context.hpp"

namespace fovea::foveation {
namespace {

void draw_buffers(const std::array<bool, gl::kMaxColors>& on, int count) noexcept {
    std::array<GLenum, gl::kMaxColors> buffers{};
    for (std::size_t i = 0; i < buffers.size(); ++i) buffers[i] = on[i] ? GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i) : GL_NONE;
    glDrawBuffers(count, buffers.data());
}

}  // namespace

void select_color(int draw_buffer) noexcept {
    glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(draw_buffer));
    std::array<bool, gl::kMaxColors> on{};
    on[static_cast<std::size_t>(draw_buffer)] = true;
    draw_buffers(on, draw_buffer + 1);
}

void restore_draw_buffers(const gl::FramebufferShape& shape) noexcept {
    std::array<bool, gl::kMaxColors> on{};
    for (std::size_t i = 0; i < on.size(); ++i) on[i] = shape.color[i].kind != gl::ColorKind::none;
    draw_buffers(on, shape.colors);
}

Result<LevelTarget> LevelTarget::create(const gl::FramebufferShape& shape, const Settings& s) {
    LevelTarget t;
    t.width_px_ = s.width_px;
    t.height_px_ = s.height_px;
    t.samples_ = shape.samples;
    t.colors_ = shape.colors;
    t.sample_depth_ = s.sample_depth;
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (s.width_px < 1 || s.height_px < 1 || s.width_px > limit || s.height_px > limit)
        return fail("a level of " + std::to_string(s.width_px) + "x" + std::to_string(s.height_px) + " pixels is not possible", "OpenGL ES",
                    "each edge must be 1 to " + std::to_string(limit));
    if (auto made = t.make(t.drawn_, shape, s, shape.samples, true); !made) return std::unexpected(made.error());
    if (shape.samples > 0)
        if (auto made = t.make(t.copy_, shape, s, 0, s.sample_depth); !made) return std::unexpected(made.error());
    return t;
}

Result<void> LevelTarget::make(Images& images, const gl::FramebufferShape& shape, const Settings& s, int samples, bool depth) const {
    static_cast<void>(gl::pending_error());
    gl::Name name = 0;
    glGenFramebuffers(1, &name);
    images.framebuffer = gl::Framebuffer(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    const auto texture = [&](GLenum format, GLint filter) {
        glGenTextures(1, &name);
        glBindTexture(GL_TEXTURE_2D, name);
        glTexStorage2D(GL_TEXTURE_2D, 1, format, s.width_px, s.height_px);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        return gl::Texture(name);
    };
    const auto renderbuffer = [&](GLenum format) {
        glGenRenderbuffers(1, &name);
        glBindRenderbuffer(GL_RENDERBUFFER, name);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, s.width_px, s.height_px);
        return gl::Renderbuffer(name);
    };
    for (std::size_t i = 0; i < images.color.size(); ++i) {
        const gl::ColorShape& c = shape.color[i];
        if (c.kind == gl::ColorKind::none) continue;
        const GLenum point = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
        if (samples > 0) {
            images.color_samples[i] = renderbuffer(c.format);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, images.color_samples[i].name());
        } else {
            const bool smooth = c.kind == gl::ColorKind::filtered && s.filter != gl::Filter::nearest;
            images.color[i] = texture(c.format, smooth ? GL_LINEAR : GL_NEAREST);
            glFramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D, images.color[i].name(), 0);
        }
    }
    if (depth) {
        // Depth of the app's own format where it is packed with the stencil of the mask, so that one can be blitted to the other.
        const GLenum format = shape.depth_format == GL_DEPTH32F_STENCIL8 ? GL_DEPTH32F_STENCIL8 : GL_DEPTH24_STENCIL8;
        if (samples == 0 && s.sample_depth) {
            images.depth_texture = texture(format, GL_NEAREST);
            glTexParameteri(GL_TEXTURE_2D, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_DEPTH_COMPONENT);
            glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_TEXTURE_2D, images.depth_texture.name(), 0);
        } else {
            images.depth_stencil = renderbuffer(format);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, images.depth_stencil.name());
        }
    }
    restore_draw_buffers(shape);
    glBindTexture(GL_TEXTURE_2D, 0);
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    const std::string error = gl::pending_error();
    if (error.empty() && status == GL_FRAMEBUFFER_COMPLETE) return {};
    return fail("a level of " + std::to_string(s.width_px) + "x" + std::to_string(s.height_px) + " pixels with " + std::to_string(shape.colors) +
                    " colour images and " + std::to_string(samples) + " samples cannot be created" + (error.empty() ? "" : " (" + error + ")"),
                "OpenGL ES", "use a smaller size, fewer samples or formats that can be drawn to");
}

void LevelTarget::resolve_samples(int x0, int y0, int x1, int y1) const noexcept {
    if (samples_ == 0) return;
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, drawn_.framebuffer.name());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, copy_.framebuffer.name());
    for (int i = 0; i < colors_; ++i) {
        if (!copy_.color[static_cast<std::size_t>(i)]) continue;
        select_color(i);
        glBlitFramebuffer(x0, y0, x1, y1, x0, y0, x1, y1, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
    if (sample_depth_) glBlitFramebuffer(x0, y0, x1, y1, x0, y0, x1, y1, GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

}  // namespace fovea::foveation
