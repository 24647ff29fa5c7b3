#include "render/foveation/level_masks.hpp"

#include <epoxy/gl.h>

#include <string_view>

#include "render/foveation/bin_resolve.hpp"
#include "render/foveation/full.hpp"

namespace fovea::foveation {
namespace {

constexpr int kMaskBit = 1;   // stencil value of a level's bins

constexpr std::string_view kMaskFragment = "#version 310 es\nprecision mediump float;\nvoid main() {}\n";

}  // namespace

Result<LevelMasks> LevelMasks::create() {
    LevelMasks m;
    auto mask = gl::build_program("level mask", kRectVertex, kMaskFragment);
    if (!mask) return std::unexpected(mask.error());
    m.mask_ = *std::move(mask);
    return m;
}

Result<void> LevelMasks::prepare_clearing(BinsView& view) {
    std::string source = clearing_fragment(view.shape);
    for (const auto& [known, program] : clearing_)
        if (known == source) {
            view.clearing = program.name();
            return {};
        }
    auto program = gl::build_program("clearing level mask", kRectVertex, source);
    if (!program) return std::unexpected(program.error());
    view.clearing = program->name();
    clearing_.emplace_back(std::move(source), *std::move(program));
    return {};
}

void LevelMasks::draw(const BinsView& view, std::uint32_t index, const ViewTarget& t, const gl::CommandList& draws, int level, bool over_finished,
                      bool count_fragments, FrameCost& cost) const noexcept {
    const auto i = static_cast<std::size_t>(level);
    const BinsView::Area r = view.area(t, level);
    const gl::Clear& clear = draws.clear();
    const bool goes_on = clear.keep_color || clear.keep_depth;
    if (level > 0 && goes_on) {
        glDisable(GL_SCISSOR_TEST);
        view.load(t, clear, level);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, r.framebuffer);
    glViewport(r.x, r.y, r.width, r.height);
    glEnable(GL_SCISSOR_TEST);
    glScissor(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0);
    const bool masked = view.count[i] > 1;   // a single rectangle is the scissor
    const bool by_depth = masked && view.depth_mask && !goes_on, by_stencil = masked && !by_depth;
    const bool clear_in_mask = masked && over_finished;
    gl::Clear first = clear;
    if (by_depth) first.depth = 0;
    clear_bound(first, &view.shape, !clear_in_mask, by_stencil);
    glDisable(GL_STENCIL_TEST);
    if (masked) {
        glUseProgram(clear_in_mask ? view.clearing : mask_.name());
        if (clear_in_mask && view.clears_numbers) glUniform4fv(0, 1, clear.color.data());
        glUniform1f(1, clear.depth);   // the depth mask opens here
        glDisable(GL_BLEND);
        glBindVertexArray(view.arrays.name());
        glBindBuffer(GL_ARRAY_BUFFER, view.rectangles.name());
        glDisable(GL_CULL_FACE);
        if (!clear_in_mask) glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        if (by_stencil) {
            glDisable(GL_DEPTH_TEST);
            glEnable(GL_STENCIL_TEST);
            glStencilFunc(GL_ALWAYS, kMaskBit, 0xff);
            glStencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
        } else {
            glEnable(GL_DEPTH_TEST);
            glDepthFunc(GL_ALWAYS);
        }
        draw_rectangles(view.first_mask[i], view.count[i]);
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        if (by_stencil) {
            glStencilFunc(GL_EQUAL, kMaskBit, 0xff);
            glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
        }
    }
    // Draws that touch none of the level's rectangles can be left out: their bounds are conservative.
    cost.draws += static_cast<std::uint32_t>(
        draws.submit({.view = index, .only_in = view.mask_boxes(level), .count_fragments = count_fragments}));
    ++cost.submissions;
    cost.pixels_shaded += view.plan.texels(level) + view.plan.guard_texels(level);
}

}  // namespace fovea::foveation
