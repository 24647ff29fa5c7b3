#include "render/foveation/full.hpp"

#include <epoxy/gl.h>

namespace fovea::foveation {

Result<std::unique_ptr<Method>> Full::create(const MethodSettings& settings) {
    return std::unique_ptr<Method>(new Full(settings));
}

Result<void> Full::prepare(std::span<const ViewTarget>) { return {}; }

void clear_view(const gl::Clear& clear, const ViewTarget& t) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glEnable(GL_SCISSOR_TEST);
    glScissor(t.x_px, t.y_px, t.width_px, t.height_px);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    glClearColor(clear.color[0], clear.color[1], clear.color[2], clear.color[3]);
    glClearDepthf(clear.depth);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void submit_full_view(const gl::CommandList& draws, std::uint32_t view, const ViewTarget& t, bool count,
                      FrameCost& cost) noexcept {
    clear_view(draws.clear(), t);
    cost.pixels_full += static_cast<std::uint64_t>(t.width_px) * static_cast<std::uint64_t>(t.height_px);
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
    counter_.begin();
    for (std::size_t v = 0; v < targets.size(); ++v)
        submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost);
    return cost;
}

}  // namespace fovea::foveation
