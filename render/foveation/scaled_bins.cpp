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

constexpr std::string_view kMaskFragment = "#version 310 es\nprecision mediump float;\nvoid main() {}\n";

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
    if (settings.filter == gl::Filter::cubic) method->settings_.plan.guard_texels = 2;
    auto mask = gl::build_program("level mask", kRectVertex, kMaskFragment);
    if (!mask) return std::unexpected(mask.error());
    method->mask_ = *std::move(mask);
    // The usual resolve, so that a driver which cannot build it says so here.
    gl::FramebufferShape usual;
    usual.color[0].kind = gl::ColorKind::filtered;
    usual.colors = 1;
    if (auto r = method->resolve_programs_.program(usual, settings.filter, true, settings.resolve_depth); !r) return std::unexpected(r.error());
    return std::unique_ptr<Method>(std::move(method));
}

Result<std::unique_ptr<Method>> ScaledBins::create_late(const MethodSettings& settings) {
    auto method = create(settings);
    if (method) static_cast<ScaledBins&>(**method).late_ = true;
    return method;
}

Result<void> ScaledBins::check_rates(const density::RateSettings& r) {
    if (r.tile_px < 4 || r.tile_px > 64 || r.tile_px % 4 != 0) return fail("a shading-rate tile of " + std::to_string(r.tile_px) + " pixels", "shading_rate", "a multiple of 4, 4 to 64");
    if (!(r.inner_radius >= 0 && r.outer_radius >= r.inner_radius && r.outer_radius <= 4) || !(r.lens_radius > 0) || !(r.focus_extent >= 0 && r.focus_extent <= 1))
        return fail("a radius or extent is out of range", "shading_rate", "0 <= inner_radius <= outer_radius <= 4, lens_radius > 0, focus_extent 0 to 1");
    return {};
}

Result<std::unique_ptr<Method>> ScaledBins::create_rates(const MethodSettings& settings) {
    if (auto fine = check_rates(settings.shading_rate); !fine) return std::unexpected(fine.error());
    MethodSettings s = settings;
    s.plan.bin_px = settings.shading_rate.tile_px;
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
    if (view.rate_map) {
        view.rate_map->set_input(input);
        view.rate_map->dispatch(input.columns(), input.rows());
        view.rate_map->read(input.columns(), input.rows(), view.rate_levels);
    } else {
        density::fill_rate_map(input, view.rate_levels);
    }
    for (std::uint8_t& rate : view.rate_levels) rate &= 3;   // 0x0, 0x5, 0xa: level 0, 1, 2
    view.plan.assign_levels(view.rate_levels);
    view.region = {};
    if ((input.flags & density::kRateGaze) != 0)
        view.region = {p->x_ndc, p->y_ndc, 2.0 * input.inner / s.width_px, 2.0 * input.inner / s.height_px};
}

Result<gl::Name> ScaledBins::clearing_program(const gl::FramebufferShape& shape) {
    std::string source = clearing_fragment(shape);
    for (const auto& [known, program] : clearing_)
        if (known == source) return program.name();
    auto program = gl::build_program("clearing level mask", kRectVertex, source);
    if (!program) return std::unexpected(program.error());
    clearing_.emplace_back(std::move(source), *std::move(program));
    return clearing_.back().second.name();
}

Result<ScaledBins::View> ScaledBins::make_view(const ViewTarget& t, const gl::FramebufferShape& shape, bool with_levels) {
    if (!shape.stencil && shape.depth_format == 0)
        return fail("the framebuffer has neither depth nor stencil", "framebuffer " + std::to_string(t.framebuffer), "attach GL_DEPTH24_STENCIL8: the levels are masked by it");
    density::PlanSettings s = settings_.plan;
    s.width_px = t.width_px;
    s.height_px = t.height_px;
    auto plan = density::Plan::create(s);
    if (!plan) return std::unexpected(plan.error());
    View v(*std::move(plan));
    v.shape = shape;
    v.clears_numbers = std::ranges::any_of(shape.color, [](const gl::ColorShape& c) { return c.kind == gl::ColorKind::filtered || c.kind == gl::ColorKind::unfiltered; });
    v.depth_mask = !shape.stencil || settings_.mask == Mask::depth || (settings_.mask == Mask::automatic && shape.depth_format != 0 && driver_traits().depth_mask);
    for (int level = 1; with_levels && level < s.level_count; ++level) {
        auto target = LevelTarget::create(shape, {.width_px = v.plan.level_width_px(level),
                                                  .height_px = v.plan.level_height_px(level),
                                                  .filter = settings_.filter,
                                                  .sample_depth = settings_.resolve_depth});
        if (!target) return std::unexpected(target.error());
        v.levels[static_cast<std::size_t>(level)] = *std::move(target);
    }
    const auto bins = static_cast<std::size_t>(v.plan.columns()) * static_cast<std::size_t>(v.plan.rows());
    if (staging_.size() < bins * 2) staging_.resize(bins * 2);
    v.boxes.resize(bins * 2);
    v.rate_levels.resize(rates_ ? bins : 0);
    if (rates_ && (settings_.rate_maker == RateMaker::gpu || (settings_.rate_maker == RateMaker::automatic && driver_traits().gpu_rate_map))) {
        auto map = RateMap::create(bins);
        if (!map) return std::unexpected(map.error());
        v.rate_map.emplace(*std::move(map));
    }
    v.on_processor = settings_.resolver != Resolver::gpu && CpuResolve::can_resolve(t, shape, v.plan) &&
                     (settings_.resolver == Resolver::processor || driver_traits().processor_resolve);
    if (v.on_processor) cpu_resolve_.reserve(v.plan, settings_.resolve_threads);
    const bool depth = settings_.resolve_depth && shape.depth_format != 0;
    // One pass for both where the GPU resolves the colour; not for a late fovea, whose depth comes last.
    const auto color_program = resolve_programs_.program(shape, settings_.filter, true, depth && !late_);
    if (!color_program) return std::unexpected(color_program.error());
    v.resolve_color = *color_program;
    if (depth) {
        const auto depth_program = resolve_programs_.program(shape, settings_.filter, false, true);
        if (!depth_program) return std::unexpected(depth_program.error());
        v.resolve_depth = *depth_program;
    }
    if (late_) {
        const auto clearing = clearing_program(shape);
        if (!clearing) return std::unexpected(clearing.error());
        v.clearing = *clearing;
    }
    v.rectangles = gl::create_dynamic_buffer(bins * 2 * sizeof(std::array<float, 4>));
    v.arrays = gl::create_vertex_array();
    glBindVertexArray(v.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, v.rectangles.name());
    glEnableVertexAttribArray(0);
    glVertexAttribDivisor(0, 1);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    return v;
}

Result<void> ScaledBins::make_views(std::span<const ViewTarget> targets) {
    views_.clear();
    early_.clear();
    rest_.clear();
    std::vector<View> views, early, rest;
    for (std::size_t i = 0; i < targets.size(); ++i) {
        auto view = make_view(targets[i], prepared_.shape(i), !late_);
        if (!view) return std::unexpected(view.error());
        views.push_back(*std::move(view));
        if (!late_) continue;
        auto before = make_view(targets[i], prepared_.shape(i), true);
        if (!before) return std::unexpected(before.error());
        early.push_back(*std::move(before));
        if (!settings_.resolve_depth) continue;
        auto last = make_view(targets[i], prepared_.shape(i), false);
        if (!last) return std::unexpected(last.error());
        const auto bins = static_cast<std::size_t>(last->plan.columns()) * static_cast<std::size_t>(last->plan.rows());
        rest_levels_.resize(std::max(rest_levels_.size(), bins));
        rest.push_back(*std::move(last));
    }
    rest_ = std::move(rest);
    views_ = std::move(views);
    early_ = std::move(early);
    early_boxes_.assign(targets.size(), {});
    return {};
}

Result<void> ScaledBins::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    if (*same) return {};
    early_done_ = false;
    return prepared_.settle(make_views(targets));
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
            // Not beyond the image: softpipe would clip the two triangles of a rectangle apart and leave a pinhole between them.
            staging_[n++] = {std::max(-1.0f, static_cast<float>(p.x0) * w - 1 - dilate_x), std::max(-1.0f, static_cast<float>(p.y0) * h - 1 - dilate_y),
                             std::min(1.0f, static_cast<float>(p.x1) * w - 1 + dilate_x), std::min(1.0f, static_cast<float>(p.y1) * h - 1 + dilate_y)};
        }
    };
    for (int level = 0; level < plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        view.first_exact[i] = static_cast<std::uint32_t>(n);
        view.count[i] = static_cast<std::uint32_t>(plan.rectangles(level).size());
        put(level, 0, 0);
    }
    view.first_mask[0] = view.first_exact[0];
    const float guard = 2.0f * static_cast<float>(plan.settings().guard_texels);
    for (int level = 1; level < plan.settings().level_count; ++level) {
        view.first_mask[static_cast<std::size_t>(level)] = static_cast<std::uint32_t>(n);
        put(level, guard / static_cast<float>(plan.level_width_px(level)), guard / static_cast<float>(plan.level_height_px(level)));
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
    const LevelTarget& target = view.levels[static_cast<std::size_t>(level)];
    const int w = target.width(), h = target.height(), guard = plan.settings().guard_texels;
    const auto scaled = [](int px, int size, int full, int round_up) {
        return static_cast<int>((static_cast<std::int64_t>(px) * size + (round_up ? full - 1 : 0)) / full);
    };
    return {target.framebuffer(), 0, 0, w, h,
            std::max(0, scaled(p.x0, w, t.width_px, 0) - guard), std::max(0, scaled(p.y0, h, t.height_px, 0) - guard),
            std::min(w, scaled(p.x1, w, t.width_px, 1) + guard), std::min(h, scaled(p.y1, h, t.height_px, 1) + guard)};
}

const char* ScaledBins::obstacle(const View& view, const ViewTarget& t, const gl::Clear& clear) const noexcept {
    if (!clear.keep_color && !clear.keep_depth) return "";
    if (late_) return "a late fovea cannot go on over a picture";
    if (t.framebuffer == 0 || view.shape.samples > 0) return "a multisampled picture or a surface cannot be made smaller to go on over it";
    if (!view.shape.stencil) return "without a stencil, the masks are depths and leave none to go on from";
    if (clear.keep_depth && !(settings_.resolve_depth && (view.shape.depth_format == GL_DEPTH24_STENCIL8 || view.shape.depth_format == GL_DEPTH32F_STENCIL8)))
        return "to go on from its depth, a frame needs resolve_depth and packed depth and stencil";
    return "";
}

// A level starts with what the app's framebuffer holds, made smaller. The scissor must be off.
void ScaledBins::load_level(const View& view, const ViewTarget& t, const gl::Clear& clear, int level) noexcept {
    const LevelTarget& target = view.levels[static_cast<std::size_t>(level)];
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
    GLint read_buffer = GL_COLOR_ATTACHMENT0;
    glGetIntegerv(GL_READ_BUFFER, &read_buffer);
    const auto blit = [&](GLbitfield what, GLenum filter) {
        glBlitFramebuffer(t.x_px, t.y_px, t.x_px + t.width_px, t.y_px + t.height_px, 0, 0, target.width(), target.height(), what, filter);
    };
    for (int i = 0; clear.keep_color && i < view.shape.colors; ++i) {
        const gl::ColorKind kind = view.shape.color[static_cast<std::size_t>(i)].kind;
        if (kind == gl::ColorKind::none) continue;
        select_color(i);
        blit(GL_COLOR_BUFFER_BIT, kind == gl::ColorKind::filtered ? GL_LINEAR : GL_NEAREST);
    }
    if (clear.keep_color) restore_draw_buffers(view.shape);
    if (clear.keep_depth) blit(GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glReadBuffer(static_cast<GLenum>(read_buffer));
}

void ScaledBins::draw_level(View& view, std::uint32_t index, const ViewTarget& t, const gl::CommandList& draws, int level,
                            bool over_finished, FrameCost& cost) noexcept {
    const auto i = static_cast<std::size_t>(level);
    const DrawArea r = area(view, t, level);
    const gl::Clear& clear = draws.clear();
    const bool goes_on = clear.keep_color || clear.keep_depth;
    if (level > 0 && goes_on) {
        glDisable(GL_SCISSOR_TEST);
        load_level(view, t, clear, level);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, r.framebuffer);
    glViewport(r.x, r.y, r.width, r.height);
    glEnable(GL_SCISSOR_TEST);
    glScissor(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0);
    const bool masked = view.count[i] > 1;   // a single rectangle is the scissor
    const bool by_depth = masked && view.depth_mask && !goes_on, by_stencil = masked && !by_depth;
    const bool clear_in_mask = masked && over_finished;   // the box holds finished pixels outside the mask
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
    const std::span<const gl::Box> boxes = std::span(view.boxes).subspan(view.first_mask[i], view.count[i]);
    cost.draws += static_cast<std::uint32_t>(
        draws.submit({.view = index, .only_in = boxes, .count_fragments = counter_.enabled()}));
    ++cost.submissions;
    cost.pixels_shaded += view.plan.texels(level) + view.plan.guard_texels(level);
}

void ScaledBins::resolve(View& view, const View& from, const ViewTarget& t, bool color, bool depth) noexcept {
    depth = depth && view.resolve_depth != 0;
    for (int level = 1; level < view.plan.settings().level_count; ++level)
        if (color && view.shape.samples > 0 && from.count[static_cast<std::size_t>(level)] != 0) {
            const DrawArea r = area(from, t, level);
            from.levels[static_cast<std::size_t>(level)].resolve_samples(r.x0, r.y0, r.x1, r.y1);
        }
    if (color && view.on_processor) {
        std::array<CpuResolve::Level, density::kMaxLevels> levels;
        for (int level = 1; level < view.plan.settings().level_count; ++level) {
            const DrawArea r = area(from, t, level);
            levels[static_cast<std::size_t>(level)] = {r.framebuffer, r.x0, r.y0, r.x1, r.y1};
        }
        cpu_resolve_.run(view.plan, t, view.shape, levels, settings_.filter);
        color = false;
    }
    if (color) resolve_on_gpu(view, from, t, view.resolve_color, true, depth);
    else if (depth) resolve_on_gpu(view, from, t, view.resolve_depth, false, true);
}

void ScaledBins::resolve_on_gpu(const View& view, const View& from, const ViewTarget& t, gl::Name program, bool color, bool depth) noexcept {
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
        if (view.count[i] == 0) continue;
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

void ScaledBins::submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                              std::span<const ViewFocus> focus) noexcept {
    early_done_ = false;
    if (!late_ || draws.empty() || !prepared_.ready(targets) || draws.clear().keep_color || draws.clear().keep_depth) return;
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
    for (std::size_t v = 0; v < targets.size(); ++v) resolve(early_[v], early_[v], targets[v], true, false);
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
            submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost, &view.shape);
            continue;
        }
        cost.pixels_full += view.plan.pixels_full();
        upload(view);
        if (view.count[0] != 0) draw_level(view, static_cast<std::uint32_t>(v), targets[v], draws, 0, true, cost);
        if (!rest_.empty()) resolve_late_depth(v, targets[v]);   // last: the mask of level 0 has used the app's depth
    }
}

void ScaledBins::resolve_late_depth(std::size_t v, const ViewTarget& t) noexcept {
    const density::Plan &late = views_[v].plan, &early = early_[v].plan;
    std::size_t bin = 0;
    for (int r = 0; r < late.rows(); ++r)
        for (int c = 0; c < late.columns(); ++c) rest_levels_[bin++] = static_cast<std::uint8_t>(late.level_at(c, r) == 0 ? 0 : early.level_at(c, r));
    rest_[v].plan.assign_levels(rest_levels_);
    upload(rest_[v]);
    resolve(rest_[v], early_[v], t, false, true);
}

FrameCost ScaledBins::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                             std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    if (late_ && !early_done_) submit_early(draws, targets, focus);
    if (early_done_) {
        submit_late(draws, targets, focus, cost);
        return cost;
    }
    counter_.begin();
    const bool ready = prepared_.ready(targets);
    for (std::size_t v = 0; v < targets.size(); ++v) {
        const char* why = ready ? obstacle(views_[v], targets[v], draws.clear()) : prepared_.note();
        if (*why == 0) plan_view(views_[v], focus[v], {});
        if (*why != 0 || draws.empty() || drawn_whole(views_[v])) {
            submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], counter_.enabled(), cost, ready ? &views_[v].shape : nullptr);
            if (*why != 0 && !draws.empty()) {
                cost.fell_back = true;
                cost.note = why;
            }
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
        if (*obstacle(views_[v], targets[v], draws.clear()) == 0 && !drawn_whole(views_[v])) resolve(views_[v], views_[v], targets[v], true, true);
    return cost;
}

}  // namespace fovea::foveation
