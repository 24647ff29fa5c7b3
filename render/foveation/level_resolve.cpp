#include "render/foveation/level_resolve.hpp"

#include <epoxy/gl.h>

#include "render/foveation/driver_traits.hpp"

namespace fovea::foveation {

Result<LevelResolve> LevelResolve::create(const MethodSettings& settings) {
    LevelResolve r;
    r.filter_ = settings.filter;
    r.resolver_ = settings.resolver;
    r.with_depth_ = settings.resolve_depth;
    r.threads_ = settings.resolve_threads;
    gl::FramebufferShape usual;
    usual.color[0].kind = gl::ColorKind::filtered;
    usual.colors = 1;
    if (auto p = r.programs_.program(usual, r.filter_, true, r.with_depth_); !p) return std::unexpected(p.error());
    return r;
}

Result<void> LevelResolve::prepare(BinsView& v, const ViewTarget& t, bool separate_depth) {
    v.on_processor = resolver_ != Resolver::gpu && CpuResolve::can_resolve(t, v.shape, v.plan) && (resolver_ == Resolver::processor || driver_traits().processor_resolve);
    if (v.on_processor) processor_.reserve(v.plan, threads_);
    const bool depth = with_depth_ && v.shape.depth_format != 0;
    const auto color_program = programs_.program(v.shape, filter_, true, depth && !separate_depth);   // else one pass for both
    if (!color_program) return std::unexpected(color_program.error());
    v.resolve_color = *color_program;
    if (!depth) return {};
    const auto depth_program = programs_.program(v.shape, filter_, false, true);
    if (!depth_program) return std::unexpected(depth_program.error());
    v.resolve_depth = *depth_program;
    return {};
}

void LevelResolve::run(const BinsView& view, const BinsView& from, const ViewTarget& t, bool color, bool depth) noexcept {
    depth = depth && view.resolve_depth != 0;
    for (int level = 1; level < view.plan.settings().level_count; ++level)
        if (color && view.shape.samples > 0 && from.uses(level)) {
            const BinsView::Area r = from.area(t, level);
            from.levels[static_cast<std::size_t>(level)].resolve_samples(r.x0, r.y0, r.x1, r.y1);
        }
    if (color && view.on_processor) {
        std::array<CpuResolve::Level, density::kMaxLevels> levels;
        for (int level = 1; level < view.plan.settings().level_count; ++level) {
            const BinsView::Area r = from.area(t, level);
            levels[static_cast<std::size_t>(level)] = {r.framebuffer, r.x0, r.y0, r.x1, r.y1};
        }
        processor_.run(view.plan, t, view.shape, levels, filter_);
        color = false;
    }
    if (color) on_gpu(view, from, t, view.resolve_color, true, depth);
    else if (depth) on_gpu(view, from, t, view.resolve_depth, false, true);
}

void LevelResolve::on_gpu(const BinsView& view, const BinsView& from, const ViewTarget& t, gl::Name program, bool color, bool depth) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    if (depth) {
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_ALWAYS);
    } else {
        glDisable(GL_DEPTH_TEST);
    }
    glDepthMask(depth ? GL_TRUE : GL_FALSE);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    const GLboolean colors = color ? GL_TRUE : GL_FALSE;
    glColorMask(colors, colors, colors, colors);
    glUseProgram(program);
    glUniform1f(1, 0.5f);
    glBindVertexArray(view.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, view.rectangles.name());
    for (int level = 1; level < view.plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        if (!view.uses(level)) continue;
        for (int c = 0; color && c < view.shape.colors; ++c) {
            glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(c));
            glBindTexture(GL_TEXTURE_2D, from.levels[i].color_texture(c));
        }
        if (depth) {
            glActiveTexture(GL_TEXTURE8);
            glBindTexture(GL_TEXTURE_2D, from.levels[i].depth_texture());
        }
        draw_rectangles(view.first_exact[i], view.count[i]);
    }
    glActiveTexture(GL_TEXTURE0);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

}  // namespace fovea::foveation
