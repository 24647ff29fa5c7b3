#include "render/foveation/dynamic_viewports.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

#include "render/foveation/full.hpp"

namespace fovea::foveation {
namespace {

constexpr std::string_view kVertex = R"(#version 310 es
layout(location = 0) uniform vec4 rect;    // x0 y0 x1 y1 of the picture, pixels
layout(location = 1) uniform vec2 size;    // of the picture
out highp vec2 px;
void main() {
    px = vec2((gl_VertexID & 1) == 0 ? rect.x : rect.z, (gl_VertexID & 2) == 0 ? rect.y : rect.w);
    gl_Position = vec4(px / size * 2.0 - 1.0, 0.0, 1.0);
})";
constexpr std::string_view kFragment = R"(#version 310 es
precision highp float;
layout(location = 2) uniform vec4 from;    // texels per pixel, texel of the picture's origin
layout(location = 3) uniform vec4 inside;  // middles of the outermost texels: a neighbour in the atlas never bleeds in
layout(binding = 0) uniform highp sampler2D image;
in highp vec2 px;
layout(location = 0) out vec4 color;
void main() { color = texture(image, clamp(px * from.xy + from.zw, inside.xy, inside.zw) / vec2(textureSize(image, 0))); }
)";

bool has_gaze(const ViewFocus& f) noexcept {
    return f.count > 0 && !std::isnan(f.points[0].x_ndc) && !std::isnan(f.points[0].y_ndc);
}

}  // namespace

Result<std::unique_ptr<Method>> DynamicViewports::create(const MethodSettings& settings) {
    const DynamicViewportSettings& s = settings.dynamic_viewports;
    if (!(s.context_scale > 0 && s.context_scale <= 1 && s.focus_extent > 0 && s.focus_extent <= 1))
        return fail("context_scale or focus_extent is outside (0, 1]", "dynamic_viewports", "0.4 each make a third of the pixels");
    if (!s.separate_targets && s.context_scale + s.focus_extent > 1)
        return fail("context and focus do not fit into the atlas of the normal views", "dynamic_viewports",
                    "context_scale + focus_extent must be at most 1, or use separate_targets");
    std::unique_ptr<DynamicViewports> m(new DynamicViewports(settings));
    auto program = gl::build_program("compose viewports", kVertex, kFragment);
    if (!program) return std::unexpected(program.error());
    m->compose_ = *std::move(program);
    m->arrays_ = gl::create_vertex_array();
    return std::unique_ptr<Method>(std::move(m));
}

Result<void> DynamicViewports::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    return *same ? Result<void>{} : prepared_.settle(make_places(targets));
}

Result<void> DynamicViewports::make_places(std::span<const ViewTarget> targets) {
    own_.clear();
    const DynamicViewportSettings& s = settings_.dynamic_viewports;
    const std::size_t n = targets.size();
    if (n == 0) return {};
    // The API's texture sizes: contexts of all views, then focuses; and the normal ones.
    std::vector<density::ViewportSize> foveated(2 * n), plain(n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto scaled = [](int px, double k) { return std::max(1, static_cast<int>(std::floor(px * k))); };
        foveated[i] = {scaled(targets[i].width_px, s.context_scale), scaled(targets[i].height_px, s.context_scale)};
        foveated[n + i] = {scaled(targets[i].width_px, s.focus_extent), scaled(targets[i].height_px, s.focus_extent)};
        plain[i] = {targets[i].width_px, targets[i].height_px};
    }
    std::vector<density::Viewport> foveated_at(2 * n), plain_at(n);
    density::layout_viewports(foveated, foveated_at);
    density::layout_viewports(plain, plain_at);
    const auto make = [&](int width, int height) {
        return gl::RenderTarget::create({.width_px = width, .height_px = height, .format = settings_.format});
    };
    normal_.assign(n, {});
    context_.assign(n, {});
    focus_.assign(n, {});
    if (s.separate_targets) {
        own_.reserve(3 * n);
        for (const auto* sizes : {&foveated, &plain})
            for (const density::ViewportSize& size : *sizes) {
                auto target = make(size.width, size.height);
                if (!target) return std::unexpected(target.error());
                own_.push_back(*std::move(target));
            }
    } else {
        int width = 0, height = 0;
        for (const auto* at : {&foveated_at, &plain_at})
            for (const density::Viewport& v : *at) {
                width = std::max(width, v.x + v.width);
                height = std::max(height, v.y + v.height);
            }
        auto atlas = make(width, height);
        if (!atlas) return std::unexpected(atlas.error());
        atlas_ = *std::move(atlas);
    }
    for (std::size_t i = 0; i < n; ++i) {
        const auto place = [&](std::size_t index, const density::Viewport& at) {
            return s.separate_targets ? Place{&own_[index], {0, 0, at.width, at.height}} : Place{&atlas_, at};
        };
        context_[i] = place(i, foveated_at[i]);
        focus_[i] = place(n + i, foveated_at[n + i]);
        normal_[i] = place(2 * n + i, plain_at[i]);
    }
    regions_.assign(n, {});
    return {};
}

void DynamicViewports::draw(const Place& p, const gl::CommandList& draws, std::uint32_t view, const std::array<float, 4>& crop,
                            const gl::Box& box, FrameCost& cost) noexcept {
    const density::Viewport& v = p.viewport;
    clear_view(draws.clear(), {p.target->framebuffer(), v.x, v.y, v.width, v.height});   // leaves the scissor on the viewport
    glDisable(GL_STENCIL_TEST);
    glViewport(v.x, v.y, v.width, v.height);
    cost.draws += static_cast<std::uint32_t>(draws.submit({.view = view, .crop = crop, .only_in = {&box, 1}, .count_fragments = counter_.enabled()}));
    ++cost.submissions;
    cost.pixels_shaded += static_cast<std::uint64_t>(v.width) * static_cast<std::uint64_t>(v.height);
}

void DynamicViewports::compose(const Place& context, const Place& focus, const ViewTarget& t, int fx, int fy) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    glUseProgram(compose_.name());
    glBindVertexArray(arrays_.name());
    glActiveTexture(GL_TEXTURE0);
    const auto f = [](auto v) { return static_cast<float>(v); };
    glUniform2f(1, f(t.width_px), f(t.height_px));
    const auto source = [&](const Place& p, float sx, float sy, float ox, float oy) {
        const density::Viewport& v = p.viewport;
        glBindTexture(GL_TEXTURE_2D, p.target->color_texture());
        glUniform4f(2, sx, sy, f(v.x) + ox, f(v.y) + oy);
        glUniform4f(3, f(v.x) + 0.5f, f(v.y) + 0.5f, f(v.x + v.width) - 0.5f, f(v.y + v.height) - 0.5f);
    };
    const auto rectangle = [&](int x0, int y0, int x1, int y1) {
        if (x0 >= x1 || y0 >= y1) return;
        glUniform4f(0, f(x0), f(y0), f(x1), f(y1));
        glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    };
    const int w = t.width_px, h = t.height_px, fw = focus.viewport.width, fh = focus.viewport.height;
    source(context, f(context.viewport.width) / f(w), f(context.viewport.height) / f(h), 0, 0);
    rectangle(0, 0, w, fy);
    rectangle(0, fy + fh, w, h);
    rectangle(0, fy, fx, fy + fh);
    rectangle(fx + fw, fy, w, fy + fh);
    source(focus, 1, 1, f(-fx), f(-fy));
    rectangle(fx, fy, fx + fw, fy + fh);
}

FrameCost DynamicViewports::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                                   std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    counter_.begin();
    // The status is that of the tracker, not of one view: all views are normal, or all are foveated.
    const bool foveated = std::all_of(focus.begin(), focus.begin() + static_cast<std::ptrdiff_t>(targets.size()), has_gaze);
    const auto composed = [&](std::size_t i) { return !draws.empty() && *prepared_.obstacle(targets, i, draws.clear()) == 0; };
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        const auto index = static_cast<std::uint32_t>(i);
        // A blit cannot put the atlas into a multisampled framebuffer: the normal views are drawn there at once.
        if (!composed(i) || (!foveated && prepared_.shape(i).samples > 0)) {
            submit_full_view(draws, index, t, counter_.enabled(), cost, prepared_.ready(targets) ? &prepared_.shape(i) : nullptr);
            if (prepared_.ready(targets)) regions_[i] = {};
            if (draws.empty() || composed(i)) continue;
            cost.fell_back = true;
            cost.note = prepared_.obstacle(targets, i, draws.clear());
            continue;
        }
        cost.pixels_full += static_cast<std::uint64_t>(t.width_px) * static_cast<std::uint64_t>(t.height_px);
        if (!foveated) {
            draw(normal_[i], draws, index, {1, 1, 0, 0}, {}, cost);
            regions_[i] = {};
            continue;
        }
        draw(context_[i], draws, index, {1, 1, 0, 0}, {}, cost);
        // On whole pixels. Tangents in units of the view: the full view is -1 to 1, as the contract of `crop` wants it.
        const double w = t.width_px, h = t.height_px, fw = focus_[i].viewport.width, fh = focus_[i].viewport.height;
        const FieldOfView unit{-1, 1, 1, -1};
        const FieldOfView around = density::focus_tangents(unit, {focus[i].points[0].x_ndc, focus[i].points[0].y_ndc}, settings_.dynamic_viewports.focus_extent);
        const double x = std::clamp(std::round((around.tan_left + 1) / 2 * w), 0.0, w - fw), y = std::clamp(std::round((around.tan_down + 1) / 2 * h), 0.0, h - fh);
        const FieldOfView part{2 * x / w - 1, 2 * (x + fw) / w - 1, 2 * (y + fh) / h - 1, 2 * y / h - 1};
        const gl::Box box{static_cast<float>(part.tan_left), static_cast<float>(part.tan_down), static_cast<float>(part.tan_right), static_cast<float>(part.tan_up)};
        // Narrower tangents around the gaze, made anew for every frame.
        draw(focus_[i], draws, index, density::crop_between(unit, part), box, cost);
        regions_[i] = {(part.tan_left + part.tan_right) / 2, (part.tan_up + part.tan_down) / 2, fw / w, fh / h};
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        if (!composed(i) || (!foveated && prepared_.shape(i).samples > 0)) continue;
        if (foveated) {
            const Region& r = regions_[i];
            compose(context_[i], focus_[i], t, static_cast<int>(std::lround((r.x_ndc - r.half_width_ndc + 1) / 2 * t.width_px)),
                    static_cast<int>(std::lround((r.y_ndc - r.half_height_ndc + 1) / 2 * t.height_px)));
            continue;
        }
        const density::Viewport& v = normal_[i].viewport;
        glDisable(GL_SCISSOR_TEST);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, normal_[i].target->framebuffer());
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, t.framebuffer);
        glBlitFramebuffer(v.x, v.y, v.x + v.width, v.y + v.height, t.x_px, t.y_px, t.x_px + t.width_px, t.y_px + t.height_px, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
    return cost;
}

}  // namespace fovea::foveation
