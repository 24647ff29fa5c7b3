#include "render/foveation/full.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace fovea::foveation {

Result<std::unique_ptr<Method>> Full::create(const MethodSettings& settings) {
    return std::unique_ptr<Method>(new Full(settings));
}

Result<void> Full::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    return *same ? Result<void>{} : prepared_.settle({});
}

void clear_bound(const gl::Clear& clear, const gl::FramebufferShape* shape, bool color, bool stencil) noexcept {
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    GLbitfield bits = clear.keep_depth ? 0 : GL_DEPTH_BUFFER_BIT;
    if (stencil) {
        glStencilMask(0xff);
        glClearStencil(0);
        bits |= GL_STENCIL_BUFFER_BIT;
    }
    glClearDepthf(clear.depth);
    const auto integer = [](const gl::ColorShape& c) { return c.kind == gl::ColorKind::whole || c.kind == gl::ColorKind::natural; };
    if (color && !clear.keep_color && shape != nullptr && std::ranges::any_of(shape->color, integer)) {
        constexpr GLint kZero[4] = {0, 0, 0, 0};
        constexpr GLuint kNone[4] = {0, 0, 0, 0};
        for (GLint i = 0; i < shape->colors; ++i) switch (shape->color[static_cast<std::size_t>(i)].kind) {
                case gl::ColorKind::none: break;
                case gl::ColorKind::whole: glClearBufferiv(GL_COLOR, i, kZero); break;
                case gl::ColorKind::natural: glClearBufferuiv(GL_COLOR, i, kNone); break;
                default: glClearBufferfv(GL_COLOR, i, clear.color.data());
            }
    } else if (color && !clear.keep_color) {
        glClearColor(clear.color[0], clear.color[1], clear.color[2], clear.color[3]);
        bits |= GL_COLOR_BUFFER_BIT;
    }
    if (bits != 0) glClear(bits);
}

void clear_view(const gl::Clear& clear, const ViewTarget& t, const gl::FramebufferShape* shape) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glEnable(GL_SCISSOR_TEST);
    glScissor(t.x_px, t.y_px, t.width_px, t.height_px);
    clear_bound(clear, shape, true, false);
}

void submit_full_view(const gl::CommandList& draws, std::uint32_t view, const ViewTarget& t, bool count, FrameCost& cost,
                      const gl::FramebufferShape* shape) noexcept {
    cost.pixels_full += static_cast<std::uint64_t>(t.width_px) * static_cast<std::uint64_t>(t.height_px);
    if (draws.empty() && draws.clear().keep_color && draws.clear().keep_depth) return;   // nothing at all
    clear_view(draws.clear(), t, shape);
    cost.executor = "full";
    if (draws.empty()) return;
    glDisable(GL_STENCIL_TEST);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    cost.draws += static_cast<std::uint32_t>(draws.submit({.view = view, .count_fragments = count}));
    ++cost.submissions;
    cost.pixels_shaded += static_cast<std::uint64_t>(t.width_px) * static_cast<std::uint64_t>(t.height_px);
}

FrameCost Full::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                       std::span<const ViewFocus>) noexcept {
    FrameCost cost;
    cost.why = "the method";
    counter_.begin();
    const bool ready = prepared_.ready(targets);
    for (std::size_t v = 0; v < targets.size(); ++v)
        submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost, ready ? &prepared_.shape(v) : nullptr);
    return cost;
}

}  // namespace fovea::foveation
