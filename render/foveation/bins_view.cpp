#include "render/foveation/bins_view.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <utility>

#include "render/foveation/driver_traits.hpp"

namespace fovea::foveation {

void draw_rectangles(std::uint32_t first, std::uint32_t count) noexcept {
    if (count == 0) return;
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, reinterpret_cast<const void*>(std::uintptr_t{first} * sizeof(gl::Box)));
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
}

Result<BinsView> BinsView::create(const ViewTarget& t, const gl::FramebufferShape& shape, const MethodSettings& settings, bool with_levels) {
    if (!shape.stencil && shape.depth_format == 0)
        return fail("the framebuffer has neither depth nor stencil", "framebuffer " + std::to_string(t.framebuffer), "attach GL_DEPTH24_STENCIL8: the levels are masked by it");
    density::PlanSettings s = settings.plan;
    s.width_px = t.width_px;
    s.height_px = t.height_px;
    auto plan = density::Plan::create(s);
    if (!plan) return std::unexpected(plan.error());
    BinsView v(*std::move(plan));
    v.shape = shape;
    v.clears_numbers = std::ranges::any_of(shape.color, [](const gl::ColorShape& c) { return c.kind == gl::ColorKind::filtered || c.kind == gl::ColorKind::unfiltered; });
    v.depth_mask = !shape.stencil || settings.mask == Mask::depth || (settings.mask == Mask::automatic && shape.depth_format != 0 && driver_traits().depth_mask);
    for (int level = 1; with_levels && level < s.level_count; ++level) {
        auto target = LevelTarget::create(shape, {.width_px = v.plan.level_width_px(level),
                                                  .height_px = v.plan.level_height_px(level),
                                                  .filter = settings.filter,
                                                  .sample_depth = settings.resolve_depth});
        if (!target) return std::unexpected(target.error());
        v.levels[static_cast<std::size_t>(level)] = *std::move(target);
    }
    v.boxes.resize(v.bins() * 2);
    v.rectangles = gl::create_dynamic_buffer(v.bins() * 2 * sizeof(gl::Box));
    v.arrays = gl::create_vertex_array();
    glBindVertexArray(v.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, v.rectangles.name());
    glEnableVertexAttribArray(0);
    glVertexAttribDivisor(0, 1);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    return v;
}

void BinsView::upload() noexcept {
    if (uploaded == plan.generation()) return;
    uploaded = plan.generation();
    const float w = 2.0f / static_cast<float>(plan.settings().width_px), h = 2.0f / static_cast<float>(plan.settings().height_px);
    std::size_t n = 0;
    const auto put = [&](int level, float dilate_x, float dilate_y) {
        for (const density::BinRect& r : plan.rectangles(level)) {
            const density::PixelRect p = plan.pixels(r);
            // Not beyond the image: softpipe would clip the two triangles of a rectangle apart and leave a pinhole between them.
            boxes[n++] = {std::max(-1.0f, static_cast<float>(p.x0) * w - 1 - dilate_x), std::max(-1.0f, static_cast<float>(p.y0) * h - 1 - dilate_y),
                          std::min(1.0f, static_cast<float>(p.x1) * w - 1 + dilate_x), std::min(1.0f, static_cast<float>(p.y1) * h - 1 + dilate_y)};
        }
    };
    for (int level = 0; level < plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        first_exact[i] = static_cast<std::uint32_t>(n);
        count[i] = static_cast<std::uint32_t>(plan.rectangles(level).size());
        put(level, 0, 0);
    }
    first_mask[0] = first_exact[0];
    const float guard = 2.0f * static_cast<float>(plan.settings().guard_texels);
    for (int level = 1; level < plan.settings().level_count; ++level) {
        first_mask[static_cast<std::size_t>(level)] = static_cast<std::uint32_t>(n);
        put(level, guard / static_cast<float>(plan.level_width_px(level)), guard / static_cast<float>(plan.level_height_px(level)));
    }
    gl::update_buffer(rectangles, 0, std::as_bytes(std::span(boxes).first(n)));
}

BinsView::Area BinsView::area(const ViewTarget& t, int level) const noexcept {
    const density::PixelRect p = plan.pixels(plan.bounds(level));
    if (level == 0)
        return {t.framebuffer, t.x_px, t.y_px, t.width_px, t.height_px,
                t.x_px + p.x0, t.y_px + p.y0, t.x_px + p.x1, t.y_px + p.y1};
    const LevelTarget& target = levels[static_cast<std::size_t>(level)];
    const int w = target.width(), h = target.height(), guard = plan.settings().guard_texels;
    const auto scaled = [](int px, int size, int full, int round_up) {
        return static_cast<int>((static_cast<std::int64_t>(px) * size + (round_up ? full - 1 : 0)) / full);
    };
    return {target.framebuffer(), 0, 0, w, h,
            std::max(0, scaled(p.x0, w, t.width_px, 0) - guard), std::max(0, scaled(p.y0, h, t.height_px, 0) - guard),
            std::min(w, scaled(p.x1, w, t.width_px, 1) + guard), std::min(h, scaled(p.y1, h, t.height_px, 1) + guard)};
}

const char* BinsView::obstacle(const ViewTarget& t, const gl::Clear& clear, const MethodSettings& settings) const noexcept {
    if (!clear.keep_color && !clear.keep_depth) return "";
    if (t.framebuffer == 0 || shape.samples > 0) return "a multisampled picture or a surface cannot be made smaller to go on over it";
    if (!shape.stencil) return "without a stencil, the masks are depths and leave none to go on from";
    if (clear.keep_depth && !(settings.resolve_depth && (shape.depth_format == GL_DEPTH24_STENCIL8 || shape.depth_format == GL_DEPTH32F_STENCIL8)))
        return "to go on from its depth, a frame needs resolve_depth and packed depth and stencil";
    return "";
}

void BinsView::load(const ViewTarget& t, const gl::Clear& clear, int level) const noexcept {
    const LevelTarget& target = levels[static_cast<std::size_t>(level)];
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
    GLint read_buffer = GL_COLOR_ATTACHMENT0;
    glGetIntegerv(GL_READ_BUFFER, &read_buffer);
    const auto blit = [&](GLbitfield what, GLenum filter) {
        glBlitFramebuffer(t.x_px, t.y_px, t.x_px + t.width_px, t.y_px + t.height_px, 0, 0, target.width(), target.height(), what, filter);
    };
    for (int i = 0; clear.keep_color && i < shape.colors; ++i) {
        const gl::ColorKind kind = shape.color[static_cast<std::size_t>(i)].kind;
        if (kind == gl::ColorKind::none) continue;
        select_color(i);
        blit(GL_COLOR_BUFFER_BIT, kind == gl::ColorKind::filtered ? GL_LINEAR : GL_NEAREST);
    }
    if (clear.keep_color) restore_draw_buffers(shape);
    if (clear.keep_depth) blit(GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glReadBuffer(static_cast<GLenum>(read_buffer));
}

}  // namespace fovea::foveation
