#include "render/foveation/scaled_bins.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "render/foveation/driver_traits.hpp"
#include "render/foveation/full.hpp"

namespace fovea::foveation {
namespace {

constexpr int kMaskBit = 1;   // stencil value of a level's bins

// One instance per rectangle, as a strip of four corners.
constexpr std::string_view kRectVertex = R"(#version 310 es
layout(location = 0) in vec4 rect;   // x0 y0 x1 y1, NDC
out highp vec2 uv;
void main() {
    vec2 p = vec2((gl_VertexID & 1) == 0 ? rect.x : rect.z, (gl_VertexID & 2) == 0 ? rect.y : rect.w);
    uv = p * 0.5 + 0.5;
    gl_Position = vec4(p, 1.0, 1.0);   // as far as can be: the depth mask opens here
})";

constexpr std::string_view kMaskFragment = R"(#version 310 es
precision mediump float;
void main() {}
)";

constexpr std::string_view kClearingMaskFragment = R"(#version 310 es
precision highp float;
layout(location = 0) uniform vec4 clear_color;
layout(location = 0) out vec4 color;
void main() { color = clear_color; }
)";

constexpr std::string_view kResolveFragment = R"(#version 310 es
precision highp float;
layout(binding = 0) uniform highp sampler2D level;
in highp vec2 uv;
layout(location = 0) out vec4 color;
void main() { color = texture(level, uv); }
)";

void draw_rectangles(std::uint32_t first, std::uint32_t count) noexcept {
    if (count == 0) return;
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, reinterpret_cast<const void*>(std::uintptr_t{first} * 16));
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
}

}  // namespace

Result<std::unique_ptr<Method>> ScaledBins::create(const MethodSettings& settings) {
    const auto checked = density::Plan::create(settings.plan);
    if (!checked) return std::unexpected(checked.error());
    std::unique_ptr<ScaledBins> method(new ScaledBins(settings));
    auto mask = gl::build_program("level mask", kRectVertex, kMaskFragment);
    if (!mask) return std::unexpected(mask.error());
    auto resolve = gl::build_program("level resolve", kRectVertex, kResolveFragment);
    if (!resolve) return std::unexpected(resolve.error());
    method->depth_mask_ = settings.mask == Mask::depth || (settings.mask == Mask::automatic && driver_traits().depth_mask);
    method->mask_ = *std::move(mask);
    method->resolve_ = *std::move(resolve);
    auto clearing = gl::build_program("clearing level mask", kRectVertex, kClearingMaskFragment);
    if (!clearing) return std::unexpected(clearing.error());
    method->clearing_mask_ = *std::move(clearing);
    return std::unique_ptr<Method>(std::move(method));
}

Result<std::unique_ptr<Method>> ScaledBins::create_late(const MethodSettings& settings) {
    auto method = create(settings);
    if (method) static_cast<ScaledBins&>(**method).late_ = true;
    return method;
}

Result<std::unique_ptr<Method>> ScaledBins::create_rates(const MethodSettings& settings) {
    const density::RateSettings& r = settings.shading_rate;
    if (r.tile_px < 4 || r.tile_px > 64 || r.tile_px % 4 != 0) return fail("a shading-rate tile of " + std::to_string(r.tile_px) + " pixels", "shading_rate", "a multiple of 4, 4 to 64");
    if (!(r.inner_radius >= 0 && r.outer_radius >= r.inner_radius && r.outer_radius <= 4) || !(r.lens_radius > 0) || !(r.focus_extent >= 0 && r.focus_extent <= 1))
        return fail("a radius or extent is out of range", "shading_rate", "0 <= inner_radius <= outer_radius <= 4, lens_radius > 0, focus_extent 0 to 1");
    MethodSettings s = settings;
    s.plan.bin_px = r.tile_px;
    s.plan.levels = density::standard_levels();
    s.plan.level_count = 3;   // 1x1, 2x2, 4x4
    auto method = create(s);
    if (method) static_cast<ScaledBins&>(**method).rates_ = true;
    return method;
}

void ScaledBins::plan_view(View& view, const ViewFocus& focus, std::span<const density::BinRect> drawn) noexcept {
    const density::PlanSettings& s = view.plan.settings();
    const density::FocalPoint* p = focus.count > 0 ? &focus.points[0] : nullptr;
    if (!rates_) {
        view.plan.update(focus.all(), drawn);
        view.region = {};
        if (p != nullptr)
            view.region = {p->x_ndc, p->y_ndc, std::min(density::full_radius_ndc(*p, 0), view.region.half_width_ndc),
                           std::min(density::full_radius_ndc(*p, 1), view.region.half_height_ndc)};
        return;
    }
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const density::RateInput input = density::rate_input(settings_.shading_rate, s.width_px, s.height_px,
                                                         p != nullptr ? NdcPoint{p->x_ndc, p->y_ndc} : NdcPoint{kNone, kNone});
    if (input == view.rate_input) return;
    view.rate_input = input;
    density::fill_rate_map(input, view.rate_levels);
    for (std::uint8_t& rate : view.rate_levels) rate &= 3;   // 0x0, 0x5, 0xa: level 0, 1, 2
    view.plan.assign_levels(view.rate_levels);
    view.region = {};
    if ((input.flags & density::kRateGaze) != 0)
        view.region = {p->x_ndc, p->y_ndc, 2.0 * input.inner / s.width_px, 2.0 * input.inner / s.height_px};
}

Result<ScaledBins::View> ScaledBins::make_view(const ViewTarget& t, bool with_levels) {
    density::PlanSettings s = settings_.plan;
    s.width_px = t.width_px;
    s.height_px = t.height_px;
    auto plan = density::Plan::create(s);
    if (!plan) return std::unexpected(plan.error());
    View v(*std::move(plan));
    for (int level = 1; with_levels && level < s.level_count; ++level) {
        auto target = gl::RenderTarget::create({.width_px = v.plan.level_width_px(level),
                                                .height_px = v.plan.level_height_px(level),
                                                .format = settings_.format,
                                                .filter = settings_.filter});
        if (!target) return std::unexpected(target.error());
        v.levels[static_cast<std::size_t>(level)] = *std::move(target);
    }
    const auto bins = static_cast<std::size_t>(v.plan.columns()) * static_cast<std::size_t>(v.plan.rows());
    if (staging_.size() < bins * 2) staging_.resize(bins * 2);
    v.boxes.resize(bins * 2);
    v.rate_levels.resize(rates_ ? bins : 0);
    v.on_processor = settings_.resolver != Resolver::gpu && settings_.filter == gl::Filter::linear &&
                     CpuResolve::can_resolve(t, v.plan) &&
                     (settings_.resolver == Resolver::processor || driver_traits().processor_resolve);
    if (v.on_processor) cpu_resolve_.reserve(v.plan);
    v.rectangles = gl::create_dynamic_buffer(bins * 2 * sizeof(std::array<float, 4>));
    v.arrays = gl::create_vertex_array();
    glBindVertexArray(v.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, v.rectangles.name());
    glEnableVertexAttribArray(0);
    glVertexAttribDivisor(0, 1);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    return v;
}

Result<void> ScaledBins::prepare(std::span<const ViewTarget> targets) {
    if (std::equal(targets.begin(), targets.end(), prepared_.begin(), prepared_.end())) return {};
    prepared_.clear();
    views_.clear();
    early_.clear();
    std::vector<View> views, early;
    for (const ViewTarget& t : targets) {
        auto view = make_view(t, !late_);
        if (!view) return std::unexpected(view.error());
        views.push_back(*std::move(view));
        if (!late_) continue;
        auto before = make_view(t, true);
        if (!before) return std::unexpected(before.error());
        early.push_back(*std::move(before));
    }
    views_ = std::move(views);
    early_ = std::move(early);
    early_boxes_.assign(targets.size(), {});
    early_done_ = false;
    prepared_.assign(targets.begin(), targets.end());
    return {};
}

void ScaledBins::upload(View& view) noexcept {
    const density::Plan& plan = view.plan;
    if (view.uploaded == plan.generation()) return;
    view.uploaded = plan.generation();
    const float w = 2.0f / static_cast<float>(plan.settings().width_px), h = 2.0f / static_cast<float>(plan.settings().height_px);
    std::size_t n = 0;
    const auto put = [&](int level, float dilate_x, float dilate_y) {
        for (const density::BinRect& r : plan.rectangles(level)) {
            const density::PixelRect p = plan.pixels(r);
            staging_[n++] = {static_cast<float>(p.x0) * w - 1 - dilate_x, static_cast<float>(p.y0) * h - 1 - dilate_y,
                             static_cast<float>(p.x1) * w - 1 + dilate_x, static_cast<float>(p.y1) * h - 1 + dilate_y};
        }
    };
    for (int level = 0; level < plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        view.first_exact[i] = static_cast<std::uint32_t>(n);
        view.count[i] = static_cast<std::uint32_t>(plan.rectangles(level).size());
        put(level, 0, 0);
    }
    view.first_mask[0] = view.first_exact[0];
    for (int level = 1; level < plan.settings().level_count; ++level) {
        view.first_mask[static_cast<std::size_t>(level)] = static_cast<std::uint32_t>(n);
        put(level, 2.0f / static_cast<float>(plan.level_width_px(level)), 2.0f / static_cast<float>(plan.level_height_px(level)));
    }
    for (std::size_t i = 0; i < n; ++i) view.boxes[i] = {staging_[i][0], staging_[i][1], staging_[i][2], staging_[i][3]};
    gl::update_buffer(view.rectangles, 0, std::as_bytes(std::span(staging_).first(n)));
}

ScaledBins::DrawArea ScaledBins::area(const View& view, const ViewTarget& t, int level) noexcept {
    const density::Plan& plan = view.plan;
    const density::PixelRect p = plan.pixels(plan.bounds(level));
    if (level == 0)
        return {t.framebuffer, t.x_px, t.y_px, t.width_px, t.height_px,
                t.x_px + p.x0, t.y_px + p.y0, t.x_px + p.x1, t.y_px + p.y1};
    const gl::RenderTarget& target = view.levels[static_cast<std::size_t>(level)];
    const int w = target.width(), h = target.height();
    const auto scaled = [](int px, int size, int full, int round_up) {
        return static_cast<int>((static_cast<std::int64_t>(px) * size + (round_up ? full - 1 : 0)) / full);
    };
    return {target.framebuffer(), 0, 0, w, h,
            std::max(0, scaled(p.x0, w, t.width_px, 0) - 1), std::max(0, scaled(p.y0, h, t.height_px, 0) - 1),
            std::min(w, scaled(p.x1, w, t.width_px, 1) + 1), std::min(h, scaled(p.y1, h, t.height_px, 1) + 1)};
}

void ScaledBins::draw_level(View& view, std::uint32_t index, const ViewTarget& t, const gl::CommandList& draws, int level,
                            bool keep_color, FrameCost& cost) noexcept {
    const auto i = static_cast<std::size_t>(level);
    const DrawArea r = area(view, t, level);
    glBindFramebuffer(GL_FRAMEBUFFER, r.framebuffer);
    glViewport(r.x, r.y, r.width, r.height);
    glEnable(GL_SCISSOR_TEST);
    glScissor(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0);
    glDepthMask(GL_TRUE);
    glStencilMask(0xff);
    const gl::Clear& clear = draws.clear();
    const bool masked = view.count[i] > 1;   // a single rectangle is the scissor
    const bool by_depth = masked && depth_mask_, by_stencil = masked && !depth_mask_;
    glClearColor(clear.color[0], clear.color[1], clear.color[2], clear.color[3]);
    glClearDepthf(by_depth ? 0.0f : clear.depth);
    glClearStencil(0);
    const bool clear_in_mask = masked && keep_color;   // the box holds finished pixels outside the mask
    glClear(static_cast<GLbitfield>((clear_in_mask ? 0 : GL_COLOR_BUFFER_BIT) | GL_DEPTH_BUFFER_BIT | (by_stencil ? GL_STENCIL_BUFFER_BIT : 0)));
    glDisable(GL_STENCIL_TEST);
    if (masked) {
        glUseProgram(clear_in_mask ? clearing_mask_.name() : mask_.name());
        if (clear_in_mask) glUniform4fv(0, 1, clear.color.data());
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
    const std::span<const gl::Box> boxes = std::span(view.boxes).subspan(view.first_mask[i], view.count[i]);
    cost.draws += static_cast<std::uint32_t>(
        draws.submit({.view = index, .only_in = boxes, .count_fragments = counter_.enabled()}));
    ++cost.submissions;
    cost.pixels_shaded += view.plan.texels(level) + view.plan.guard_texels(level);
}

void ScaledBins::resolve(View& view, const ViewTarget& t) noexcept {
    if (view.on_processor) {
        std::array<CpuResolve::Level, density::kMaxLevels> levels;
        for (int level = 1; level < view.plan.settings().level_count; ++level) {
            const DrawArea r = area(view, t, level);
            levels[static_cast<std::size_t>(level)] = {r.framebuffer, r.x0, r.y0, r.x1, r.y1};
        }
        cpu_resolve_.run(view.plan, t, levels);
        return;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_DEPTH_TEST);
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    glUseProgram(resolve_.name());
    glBindVertexArray(view.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, view.rectangles.name());
    glActiveTexture(GL_TEXTURE0);
    for (int level = 1; level < view.plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        if (view.count[i] == 0) continue;
        glBindTexture(GL_TEXTURE_2D, view.levels[i].color_texture());
        draw_rectangles(view.first_exact[i], view.count[i]);
    }
}

void ScaledBins::submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                              std::span<const ViewFocus> focus) noexcept {
    early_done_ = false;
    if (!late_ || draws.empty() || !std::equal(targets.begin(), targets.end(), prepared_.begin(), prepared_.end())) return;
    early_cost_ = {};
    counter_.begin();
    const int levels = settings_.plan.level_count;
    for (std::size_t v = 0; v < targets.size(); ++v) {
        density::Plan& plan = views_[v].plan;
        plan_view(views_[v], focus[v], {});
        // Level n is drawn where the finer ones would be, and a margin further: the gaze may move until the latch.
        const int margin = std::max(2, plan.columns() / 16);
        density::BinRect box;
        for (int level = 0; level < levels; ++level) {
            const density::BinRect b = plan.bounds(level);
            if (!b.empty())
                box = box.empty() ? b : density::BinRect{std::min(box.x0, b.x0), std::min(box.y0, b.y0), std::max(box.x1, b.x1), std::max(box.y1, b.y1)};
            if (level == 0) continue;
            early_boxes_[v][static_cast<std::size_t>(level)] = {
                static_cast<std::uint16_t>(std::max(0, box.x0 - margin)), static_cast<std::uint16_t>(std::max(0, box.y0 - margin)),
                static_cast<std::uint16_t>(std::min(plan.columns(), box.x1 + margin)),
                static_cast<std::uint16_t>(std::min(plan.rows(), box.y1 + margin))};
        }
        early_boxes_[v][static_cast<std::size_t>(levels - 1)] = {0, 0, static_cast<std::uint16_t>(plan.columns()), static_cast<std::uint16_t>(plan.rows())};
        early_[v].plan.assign(early_boxes_[v]);
        upload(early_[v]);
        for (int level = levels - 1; level >= 1; --level)
            if (early_[v].count[static_cast<std::size_t>(level)] != 0)
                draw_level(early_[v], static_cast<std::uint32_t>(v), targets[v], draws, level, false, early_cost_);
    }
    for (std::size_t v = 0; v < targets.size(); ++v) resolve(early_[v], targets[v]);
    early_done_ = levels > 1;
}

void ScaledBins::submit_late(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                             std::span<const ViewFocus> focus, FrameCost& cost) noexcept {
    cost = early_cost_;
    early_done_ = false;
    for (std::size_t v = 0; v < targets.size(); ++v) {
        View& view = views_[v];
        plan_view(view, focus[v], early_boxes_[v]);
        if (drawn_whole(view)) {
            submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost);
            continue;
        }
        cost.pixels_full += view.plan.pixels_full();
        upload(view);
        if (view.count[0] != 0) draw_level(view, static_cast<std::uint32_t>(v), targets[v], draws, 0, true, cost);
    }
}

FrameCost ScaledBins::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                             std::span<const ViewFocus> focus) noexcept {
    FrameCost cost;
    if (late_ && !early_done_) submit_early(draws, targets, focus);
    if (early_done_) {
        submit_late(draws, targets, focus, cost);
        return cost;
    }
    counter_.begin();
    const bool ready = !late_ && std::equal(targets.begin(), targets.end(), prepared_.begin(), prepared_.end());
    for (std::size_t v = 0; v < targets.size(); ++v) {
        if (ready) plan_view(views_[v], focus[v], {});
        if (!ready || draws.empty() || drawn_whole(views_[v])) {
            submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost);
            cost.fell_back = cost.fell_back || (!ready && !draws.empty());
            continue;
        }
        cost.pixels_full += views_[v].plan.pixels_full();
        upload(views_[v]);
        // Coarse to fine: while the driver still draws level 0 of one view, the other's is being recorded.
        for (int level = views_[v].plan.settings().level_count - 1; level >= 0; --level)
            if (views_[v].count[static_cast<std::size_t>(level)] != 0)
                draw_level(views_[v], static_cast<std::uint32_t>(v), targets[v], draws, level, false, cost);
    }
    if (!ready || draws.empty()) return cost;
    for (std::size_t v = 0; v < targets.size(); ++v)
        if (!drawn_whole(views_[v])) resolve(views_[v], targets[v]);
    return cost;
}

}  // namespace fovea::foveation
