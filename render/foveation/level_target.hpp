// The target of one level: a small framebuffer that matches the app's, attachment by attachment, and can be sampled.
//
//   app's framebuffer (shape)        drawn                    sampled
//   color 0..7, samples, depth  ->   the same, smaller   ->   the same images, or single-sampled copies of them
//
// Threads: the context's. Errors: create() says what the driver refused.
#pragma once

#include <array>

#include "render/gl/framebuffer_shape.hpp"

namespace fovea::foveation {

class LevelTarget {
public:
    struct Settings {
        int width_px = 0, height_px = 0;
        gl::Filter filter = gl::Filter::linear;
        bool sample_depth = false;   // depth_texture() is wanted
    };
    LevelTarget() noexcept = default;
    // Depth and stencil are always there: 24 and 8 bits, or what the app's has.
    [[nodiscard]] static Result<LevelTarget> create(const gl::FramebufferShape& shape, const Settings& settings);

    [[nodiscard]] gl::Name framebuffer() const noexcept { return drawn_.framebuffer.name(); }
    // Where sampled colours are: framebuffer() without multisampling.
    [[nodiscard]] gl::Name sampled_framebuffer() const noexcept { return samples_ > 0 ? copy_.framebuffer.name() : framebuffer(); }
    [[nodiscard]] int width() const noexcept { return width_px_; }
    [[nodiscard]] int height() const noexcept { return height_px_; }
    [[nodiscard]] gl::Name color_texture(int draw_buffer) const noexcept {
        return (samples_ > 0 ? copy_ : drawn_).color[static_cast<std::size_t>(draw_buffer)].name();
    }
    [[nodiscard]] gl::Name depth_texture() const noexcept { return (samples_ > 0 ? copy_ : drawn_).depth_texture.name(); }
    // Multisampled: makes the copies of this part, half-open texels. Leaves both framebuffer bindings and the scissor changed.
    void resolve_samples(int x0, int y0, int x1, int y1) const noexcept;

private:
    struct Images {
        gl::Framebuffer framebuffer;
        std::array<gl::Texture, gl::kMaxColors> color;
        std::array<gl::Renderbuffer, gl::kMaxColors> color_samples;
        gl::Texture depth_texture;
        gl::Renderbuffer depth_stencil;
    };
    [[nodiscard]] Result<void> make(Images& images, const gl::FramebufferShape& shape, const Settings& settings, int samples, bool depth) const;

    int width_px_ = 0, height_px_ = 0, samples_ = 0, colors_ = 0;
    bool sample_depth_ = false;
    Images drawn_, copy_;
};

// Limits a blit to one draw buffer of each of the framebuffers that are bound for reading and drawing: a blit reads one image
// and writes all. restore_draw_buffers() undoes the second half.
void select_color(int draw_buffer) noexcept;
void restore_draw_buffers(const gl::FramebufferShape& shape) noexcept;

}  // namespace fovea::foveation
