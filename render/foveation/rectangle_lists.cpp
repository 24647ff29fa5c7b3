#include "render/foveation/rectangle_lists.hpp"

#include <epoxy/gl.h>

#include "render/foveation/full.hpp"

namespace fovea::foveation {
namespace {

constexpr float kRounding = 1e-6f;   // NDC, of the float arithmetic of boxes

}  // namespace

void RectangleLists::prepare(std::size_t views, double texels_per_rectangle) {
    views_ = std::vector<View>(views);
    texels_per_rectangle_ = texels_per_rectangle;
}

void RectangleLists::update(const BinsView& view, std::size_t index) noexcept {
    View& v = views_[index];
    if (v.made_for == view.plan.generation()) return;
    v.made_for = view.plan.generation();
    for (int level = 0; level < view.plan.settings().level_count; ++level)
        v.possible[static_cast<std::size_t>(level)] = v.covers[static_cast<std::size_t>(level)].update(view.plan, level, texels_per_rectangle_);
}

bool RectangleLists::draw(const BinsView& view, std::uint32_t index, const ViewTarget& t, const gl::CommandList& draws, int level, bool count_fragments,
                          FrameCost& cost) const noexcept {
    const View& v = views_[index];
    if (!v.possible[static_cast<std::size_t>(level)]) return false;
    const density::RectangleCover& cover = v.covers[static_cast<std::size_t>(level)];
    const BinsView::Area r = view.area(t, level);
    const gl::Clear& clear = draws.clear();
    if (level > 0 && (clear.keep_color || clear.keep_depth)) {
        glDisable(GL_SCISSOR_TEST);
        view.load(t, clear, level);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, r.framebuffer);
    glViewport(r.x, r.y, r.width, r.height);
    glEnable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glScissor(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0);
    clear_bound(clear, &view.shape, true, false);
    const float x = 2.0f / static_cast<float>(r.width), y = 2.0f / static_cast<float>(r.height);
    for (const density::PixelRect& p : cover.rectangles()) {
        const gl::Box ndc{static_cast<float>(p.x0) * x - 1 - kRounding, static_cast<float>(p.y0) * y - 1 - kRounding,
                          static_cast<float>(p.x1) * x - 1 + kRounding, static_cast<float>(p.y1) * y - 1 + kRounding};
        glScissor(r.x + p.x0, r.y + p.y0, p.x1 - p.x0, p.y1 - p.y0);
        cost.draws += static_cast<std::uint32_t>(draws.submit({.view = index, .only_in = {&ndc, 1}, .count_fragments = count_fragments}));
        ++cost.submissions;
    }
    cost.pixels_shaded += cover.texels();
    return true;
}

}  // namespace fovea::foveation
