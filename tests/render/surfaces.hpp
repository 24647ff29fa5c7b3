// Framebuffers of every kind for the tests of the foveation methods: renderbuffers, samples, several attachments, layers.
#pragma once

#include <array>
#include <memory>

#include "tests/render/gl_fixture.hpp"

namespace fovea::test {

struct SurfaceOptions {
    bool renderbuffer = false;
    int samples = 0;
    bool multisample_texture = false;
    std::uint32_t format = 0x8058;   // GL_RGBA8
    int colors = 1;
    int off = -1;                    // a colour attachment that is not among the draw buffers
    std::array<std::uint32_t, 8> formats{};   // of single attachments, instead of `format`
    bool depth = true, stencil = true;
};

struct Surface {
    gl::Framebuffer framebuffer;
    std::array<gl::Texture, 8> color;
    std::array<gl::Renderbuffer, 8> color_buffers;
    gl::Renderbuffer depth;
    foveation::ViewTarget target;
    SurfaceOptions options;
};

// name: the framebuffer's, one that no framebuffer has; 0: a new one.
[[nodiscard]] Surface color_surface(int edge_px, const SurfaceOptions& options = {}, gl::Name name = 0);
[[nodiscard]] gl::Texture color_texture(int edge_px, std::uint32_t format);
// Another framebuffer over the same colour texture, with a depth buffer of its own.
[[nodiscard]] Surface surface_over(const Surface& other);

[[nodiscard]] Pixels read_color(const Surface& surface, int attachment);
// Attachment 0, averaged over its samples, as 8 bits.
[[nodiscard]] Pixels read_resolved(const Surface& surface);

[[nodiscard]] std::unique_ptr<foveation::Method> make_method(const char* name, const Surface& surface, const foveation::MethodSettings& settings = {});
foveation::FrameCost submit(foveation::Method& method, const gl::CommandList& list, const Surface& surface, const density::FocalPoint& focus);
[[nodiscard]] Pixels full_picture(const gl::CommandList& list, const Surface& on);

}  // namespace fovea::test
