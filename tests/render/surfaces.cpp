#include "tests/render/surfaces.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace fovea::test {
namespace {

void attach_depth(Surface& s, int edge) {
    if (!s.options.depth) return;
    gl::Name name = 0;
    glGenRenderbuffers(1, &name);
    s.depth = gl::Renderbuffer(name);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, s.options.samples, s.options.stencil ? GL_DEPTH24_STENCIL8 : GL_DEPTH_COMPONENT24, edge, edge);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, s.options.stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, name);
}

}  // namespace

gl::Texture color_texture(int edge, std::uint32_t format) {
    gl::Name name = 0;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexStorage2D(GL_TEXTURE_2D, 1, format, edge, edge);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindTexture(GL_TEXTURE_2D, 0);
    return gl::Texture(name);
}

Surface color_surface(int edge, const SurfaceOptions& o, gl::Name wanted) {
    Surface s;
    s.options = o;
    gl::Name name = wanted;
    if (name == 0) glGenFramebuffers(1, &name);
    s.framebuffer = gl::Framebuffer(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    std::array<GLenum, 8> buffers{};
    for (int i = 0; i < o.colors; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const GLenum point = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i), format = o.formats[k] != 0 ? o.formats[k] : o.format;
        buffers[k] = i == o.off ? GL_NONE : point;
        if (o.renderbuffer || (o.samples > 0 && !o.multisample_texture)) {
            glGenRenderbuffers(1, &name);
            s.color_buffers[k] = gl::Renderbuffer(name);
            glBindRenderbuffer(GL_RENDERBUFFER, name);
            glRenderbufferStorageMultisample(GL_RENDERBUFFER, o.samples, format, edge, edge);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, name);
        } else if (o.samples > 0) {
            glGenTextures(1, &name);
            s.color[k] = gl::Texture(name);
            glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
            glTexStorage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, o.samples, format, edge, edge, GL_TRUE);
            glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, 0);
            glFramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D_MULTISAMPLE, name, 0);
        } else {
            s.color[k] = color_texture(edge, format);
            glFramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D, s.color[k].name(), 0);
        }
    }
    glDrawBuffers(o.colors, buffers.data());
    attach_depth(s, edge);
    s.target = {s.framebuffer.name(), 0, 0, edge, edge};
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    return s;
}

Surface surface_over(const Surface& other) {
    Surface s;
    gl::Name name = 0;
    glGenFramebuffers(1, &name);
    s.framebuffer = gl::Framebuffer(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, other.color[0].name(), 0);
    attach_depth(s, other.target.width_px);
    s.target = other.target;
    s.target.framebuffer = name;
    return s;
}

Pixels read_color(const Surface& s, int attachment) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.framebuffer);
    glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachment));
    Pixels p = read(s.target);
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    return p;
}

Pixels read_resolved(const Surface& s) {
    const int edge = s.target.width_px;
    if (s.options.samples == 0 && s.options.format == GL_RGBA8) return read(s.target);
    if (s.options.samples == 0) {
        std::vector<float> real(static_cast<std::size_t>(edge * edge) * 4);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.framebuffer);
        glFinish();   // as gl::read_pixels
        glReadPixels(0, 0, edge, edge, GL_RGBA, GL_FLOAT, real.data());
        Pixels p(real.size());
        std::ranges::transform(real, p.begin(), [](float v) { return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255)); });
        return p;
    }
    const Surface to = color_surface(edge);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.target.framebuffer);
    glBlitFramebuffer(0, 0, edge, edge, 0, 0, edge, edge, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    return read(to.target);
}

std::unique_ptr<foveation::Method> make_method(const char* name, const Surface& s, const foveation::MethodSettings& settings) {
    auto method = foveation::create_method(name, settings);
    EXPECT_TRUE(method.has_value()) << method.error().message();
    const auto ready = (*method)->prepare({&s.target, 1});
    EXPECT_TRUE(ready.has_value()) << ready.error().message();
    return *std::move(method);
}

foveation::FrameCost submit(foveation::Method& method, const gl::CommandList& list, const Surface& s, const density::FocalPoint& focus) {
    foveation::ViewFocus f;
    f.points[0] = focus;
    f.count = 1;
    return method.submit(list, {&s.target, 1}, {&f, 1});
}

Pixels full_picture(const gl::CommandList& list, const Surface& on) {
    submit(*make_method("full", on), list, on, {});
    return read_resolved(on);
}

}  // namespace fovea::test
