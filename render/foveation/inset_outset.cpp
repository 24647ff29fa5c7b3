#include "render/foveation/inset_outset.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "render/density/inset_outset.hpp"
#include "render/foveation/driver_traits.hpp"
#include "render/foveation/full.hpp"

namespace fovea::foveation {
namespace {

constexpr int kDiscCorners = 256;   // a polygon of so many corners lacks 1e-4 of the circle's area

constexpr double kRim_px = 0.5;         // of the inset's circle, whose samples may be covered in part
constexpr double kFilterReach = 1.42;   // texels, bilinear, along the diagonal
constexpr double kContrastReach = 2.13; // texels, 1.5 along the diagonal

constexpr std::string_view kDiscVertex = R"(#version 310 es
layout(location = 0) uniform vec4 disc;    // middle and radii, NDC
layout(location = 1) uniform float depth;
void main() {
    float a = float(gl_VertexID - 1) * (6.28318530718 / 256.0);
    vec2 p = gl_VertexID == 0 ? vec2(0.0) : vec2(cos(a), sin(a));
    gl_Position = vec4(disc.xy + disc.zw * p, depth, 1.0);
})";
constexpr std::string_view kDiscFragment = "#version 310 es\nprecision mediump float;\nvoid main() {}\n";

// A rectangle of the picture, pixels.
constexpr std::string_view kComposeVertex = R"(#version 310 es
layout(location = 0) uniform vec4 rect;    // x0 y0 x1 y1
layout(location = 1) uniform vec2 size;    // of the picture
out highp vec2 px;
void main() {
    px = vec2((gl_VertexID & 1) == 0 ? rect.x : rect.z, (gl_VertexID & 2) == 0 ? rect.y : rect.w);
    gl_Position = vec4(px / size * 2.0 - 1.0, 0.0, 1.0);
})";

constexpr std::string_view kComposeHead = R"(#version 310 es
precision highp float;
layout(location = 1) uniform vec2 size;
#ifdef LAYERED
layout(location = 6) uniform ivec2 layer;   // of outset and inset
layout(binding = 0) uniform highp sampler2DArray outset;
layout(binding = 1) uniform highp sampler2DArray inset;
vec4 outset_at(vec2 uv) { return texture(outset, vec3(uv, float(layer.x))); }
vec4 inset_at(ivec2 texel) { return texelFetch(inset, ivec3(texel, layer.y), 0); }
#else
layout(binding = 0) uniform highp sampler2D outset;
layout(binding = 1) uniform highp sampler2D inset;
#ifdef PARTS
layout(location = 5) uniform vec4 part;     // the outset's, of the texture: first texel, size; a neighbour never bleeds in
vec4 outset_at(vec2 uv) { return texture(outset, (part.xy + clamp(uv * part.zw, vec2(0.5), part.zw - 0.5)) / vec2(textureSize(outset, 0))); }
#else
vec4 outset_at(vec2 uv) { return texture(outset, uv); }
#endif
vec4 inset_at(ivec2 texel) { return texelFetch(inset, texel, 0); }
#endif
in highp vec2 px;
layout(location = 0) out vec4 color;
)";

// What enlarging took from the contrast is put back: the difference to the neighbourhood, amplified.
constexpr std::string_view kContrast = R"(
layout(location = 2) uniform float contrast;
layout(location = 7) uniform vec2 outset_size;
vec4 far_color(vec2 uv) {
    vec4 c = outset_at(uv);
    vec2 d = 1.5 / outset_size;
    vec4 around = outset_at(uv + vec2(d.x, d.y)) + outset_at(uv + vec2(-d.x, d.y)) + outset_at(uv + vec2(d.x, -d.y)) + outset_at(uv + vec2(-d.x, -d.y));
    return vec4(clamp(c.rgb + contrast * (c.rgb - 0.25 * around.rgb), 0.0, 1.0), c.a);
}
)";
constexpr std::string_view kNoContrast = "vec4 far_color(vec2 uv) { return outset_at(uv); }\n";

constexpr std::string_view kFar = "void main() { color = far_color(px / size); }\n";
constexpr std::string_view kNearHead = R"(
layout(location = 3) uniform vec4 circle;   // middle of the inset, its radius, width of the blend; pixels
layout(location = 4) uniform vec2 image;    // lower left of the inset's texture; one texel is one pixel
)";
constexpr std::string_view kBlend = "float share_of_inset(float r) { return 1.0 - smoothstep(circle.z - circle.w, circle.z, r); }\n";
constexpr std::string_view kNoBlend = "float share_of_inset(float r) { return r < circle.z ? 1.0 : 0.0; }\n";
constexpr std::string_view kNear = R"(
void main() {
    float near = share_of_inset(distance(px, circle.xy));
    color = mix(far_color(px / size), inset_at(ivec2(px - image)), near);
}
)";

}  // namespace

Result<std::unique_ptr<Method>> InsetOutset::create(const MethodSettings& settings) {
    const InsetOutsetSettings& s = settings.inset_outset;
    const auto bad = [](const char* what, const char* way_out) { return fail(what, "inset_outset", way_out); };
    if (!(s.ratio > 0 && s.ratio <= 1)) return bad("the ratio is outside (0, 1]", "0.35 to 0.7 are usual");
    if (s.inset_px < 0 || !(s.blend_px >= 0) || !(s.contrast >= 0 && s.contrast <= 4) || s.samples < 0 || !(s.hidden_radius >= 0))
        return bad("a setting is negative or no number", "see InsetOutsetSettings");
    std::unique_ptr<InsetOutset> m(new InsetOutset(settings));
    const ViewImages::Settings images{settings.format, s.samples, s.drawing};
    const gl::ViewDrawing drawing = ViewImages::drawing_for(images);
    m->images_wanted_ = images;
    std::string head(kComposeHead);
    if (drawing != gl::ViewDrawing::repeated) head.insert(head.find('\n') + 1, drawing == gl::ViewDrawing::multiview2 ? "#define LAYERED\n" : "#define PARTS\n");
    head += std::string(s.contrast > 0 ? kContrast : kNoContrast);
    struct Wanted {
        gl::Program* program;
        const char* name;
        std::string_view vertex;
        std::string fragment;
    };
    for (const Wanted& w : {Wanted{&m->disc_, "mask disc", kDiscVertex, std::string(kDiscFragment)},
                            Wanted{&m->far_, "compose outset", kComposeVertex, head + std::string(kFar)},
                            Wanted{&m->near_, "compose inset", kComposeVertex, head + std::string(kNearHead) + std::string(s.blend_px > 0 ? kBlend : kNoBlend) + std::string(kNear)}}) {
        if (w.program == &m->disc_ && !s.masks) continue;
        auto p = gl::build_program(w.name, w.vertex, w.fragment);
        if (!p) return std::unexpected(p.error());
        *w.program = *std::move(p);
    }
    m->arrays_ = gl::create_vertex_array();
    m->depth_mask_ = settings.mask == Mask::depth || (settings.mask == Mask::automatic && driver_traits().depth_mask);
    return std::unique_ptr<Method>(std::move(m));
}

Result<void> InsetOutset::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    return *same ? Result<void>{} : prepared_.settle(make_views(targets));
}

Result<void> InsetOutset::make_views(std::span<const ViewTarget> targets) {
    views_.clear();
    images_ = {};
    const InsetOutsetSettings& s = settings_.inset_outset;
    std::vector<ViewImages::Size> sizes(2 * targets.size());   // outsets, insets
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        const auto scaled = [&](int px) { return std::max(1, static_cast<int>(std::lround(px * s.ratio))); };
        const int side = std::min({s.inset_px > 0 ? s.inset_px : std::max(scaled(t.width_px), scaled(t.height_px)), t.width_px, t.height_px});
        sizes[i] = {scaled(t.width_px), scaled(t.height_px)};
        sizes[targets.size() + i] = {side, side};
    }
    if (targets.empty()) return {};
    auto images = ViewImages::create(sizes, images_wanted_);
    if (!images) return std::unexpected(images.error());
    images_ = *std::move(images);
    samples_ = gl::samples_for(images_wanted_.format, images_wanted_.samples);
    std::vector<View> views(targets.size());
    for (std::size_t i = 0; i < targets.size(); ++i) {
        View& v = views[i];
        v.outset = images_[i];
        v.inset = images_[targets.size() + i];
        v.enlarging = enlarging_plan(v, targets[i], prepared_.shape(i));
        if (v.enlarging) cpu_resolve_.reserve(*v.enlarging, settings_.resolve_threads);
    }
    draw_.assign(sizes.size(), {});
    views_ = std::move(views);
    return {};
}

// The processor enlarges by whole powers of two, unfiltered, from one sample a texel: then, and where the probe found it
// cheaper, the outset goes that way.
std::optional<density::Plan> InsetOutset::enlarging_plan(const View& v, const ViewTarget& t, const gl::FramebufferShape& shape) const {
    const bool wanted = settings_.resolver == Resolver::processor || (settings_.resolver == Resolver::automatic && driver_traits().processor_resolve);
    if (!wanted || settings_.inset_outset.contrast > 0) return std::nullopt;
    for (std::uint8_t shift = 1; shift <= 3; ++shift) {
        if (v.outset.width_px << shift != t.width_px || v.outset.height_px << shift != t.height_px) continue;
        density::PlanSettings s{.width_px = t.width_px, .height_px = t.height_px, .level_count = 2};
        s.levels[1] = {shift, shift};
        auto plan = density::Plan::create(s);
        if (!plan || !CpuResolve::can_resolve(t, shape, *plan)) return std::nullopt;
        plan->assign(std::array<density::BinRect, 2>{});   // everything at level 1: the outset
        return *std::move(plan);
    }
    return std::nullopt;
}

Method::Region InsetOutset::full_region(std::size_t view) const noexcept { return view < views_.size() ? views_[view].region : Region{}; }

void InsetOutset::place(View& v, const ViewTarget& t, const ViewFocus& focus) const noexcept {
    const density::FocalPoint p = focus.count > 0 ? focus.points[0] : density::FocalPoint{};
    const auto clamped = [](float ndc) { return std::isnan(ndc) ? 0.0 : std::clamp(static_cast<double>(ndc), -1.0, 1.0); };
    const int side = v.inset.width_px;
    // On whole pixels, so that the inset's pixels are the picture's.
    v.left_px = static_cast<int>(std::lround((clamped(p.x_ndc) + 1) / 2 * t.width_px - side / 2.0));
    v.bottom_px = static_cast<int>(std::lround((clamped(p.y_ndc) + 1) / 2 * t.height_px - side / 2.0));
    v.x_px = v.left_px + side / 2.0;
    v.y_px = v.bottom_px + side / 2.0;
    const double sharp = std::max(0.0, side / 2.0 - kRim_px - settings_.inset_outset.blend_px);   // nothing of the outset is mixed in
    v.region = {2 * v.x_px / t.width_px - 1, 2 * v.y_px / t.height_px - 1, 2 * sharp / t.width_px, 2 * sharp / t.height_px};
}

// closed: everything is masked until a disc opens it. Leaves the scissor on the image.
void InsetOutset::begin_image(const Image& image, const gl::Clear& clear, bool closed) const noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, image.framebuffer);
    glViewport(image.x_px, image.y_px, image.width_px, image.height_px);
    glEnable(GL_SCISSOR_TEST);
    glScissor(image.x_px, image.y_px, image.width_px, image.height_px);
    glDepthMask(GL_TRUE);
    glStencilMask(0xff);
    glClearColor(clear.color[0], clear.color[1], clear.color[2], clear.color[3]);
    glClearDepthf(depth_mask_ && closed ? 0.0f : clear.depth);
    glClearStencil(closed ? 1 : 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

void InsetOutset::mask_disc(const Image& image, double x, double y, double rx, double ry, bool open) const noexcept {
    glUseProgram(disc_.name());
    glBindVertexArray(arrays_.name());
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDisable(GL_CULL_FACE);
    if (depth_mask_) {
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_ALWAYS);
        glDisable(GL_STENCIL_TEST);
    } else {
        glDisable(GL_DEPTH_TEST);
        glEnable(GL_STENCIL_TEST);
        glStencilFunc(GL_ALWAYS, open ? 0 : 1, 0xff);
        glStencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
    }
    const double w = image.width_px, h = image.height_px;
    glUniform4f(0, static_cast<float>(2 * x / w - 1), static_cast<float>(2 * y / h - 1), static_cast<float>(2 * rx / w), static_cast<float>(2 * ry / h));
    glUniform1f(1, open ? 1.0f : -1.0f);
    glDrawArrays(GL_TRIANGLE_FAN, 0, kDiscCorners + 2);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void InsetOutset::end_masks() const noexcept {
    if (depth_mask_ || !settings_.inset_outset.masks) {
        glDisable(GL_STENCIL_TEST);
        return;
    }
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_EQUAL, 0, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
}

// Clears and masks the wide image of an eye; the texels left to shade.
std::uint64_t InsetOutset::begin_outset(const View& v, const ViewTarget& t, const gl::Clear& clear) const noexcept {
    const InsetOutsetSettings& s = settings_.inset_outset;
    const int w = v.outset.width_px, h = v.outset.height_px;
    const double kx = static_cast<double>(w) / t.width_px, ky = static_cast<double>(h) / t.height_px;
    const bool hidden = s.masks && s.hidden_radius > 0;
    begin_image(v.outset, clear, hidden);
    std::uint64_t texels = static_cast<std::uint64_t>(w) * static_cast<std::uint64_t>(h);
    if (!s.masks) return texels;
    if (hidden) {
        mask_disc(v.outset, w / 2.0, h / 2.0, s.hidden_radius * w / 2, s.hidden_radius * h / 2, true);
        if (w == h) texels = density::pixels_in_circle(w, h, w / 2.0, h / 2.0, s.hidden_radius * w / 2);
    }
    // The hole ends where the blend begins, and before that as far as the filters reach.
    const double reach = kFilterReach + (s.contrast > 0 ? kContrastReach : 0);
    const double hole = std::max(0.0, (v.inset.width_px / 2.0 - kRim_px - s.blend_px) * std::min(kx, ky) - reach);
    if (hole > 0) {
        mask_disc(v.outset, v.x_px * kx, v.y_px * ky, hole, hole, false);
        texels -= std::min(texels, density::pixels_in_circle(w, h, v.x_px * kx, v.y_px * ky, hole));
    }
    return texels;
}

// The same for the narrow image; `view` is how it is drawn.
std::uint64_t InsetOutset::begin_inset(const View& v, const ViewTarget& t, const gl::Clear& clear, ViewImages::View& view) const noexcept {
    const Image& image = v.inset;
    const int side = image.width_px;
    // The part of the image that lies inside the view.
    const int x0 = std::max(0, -v.left_px), y0 = std::max(0, -v.bottom_px);
    const int x1 = std::min(side, t.width_px - v.left_px), y1 = std::min(side, t.height_px - v.bottom_px);
    const double sx = static_cast<double>(t.width_px) / side, sy = static_cast<double>(t.height_px) / side;
    const double cx = 2 * v.x_px / t.width_px - 1, cy = 2 * v.y_px / t.height_px - 1;
    view.crop = {static_cast<float>(sx), static_cast<float>(sy), static_cast<float>(-cx * sx), static_cast<float>(-cy * sy)};
    view.only_in = {static_cast<float>(cx - 1 / sx), static_cast<float>(cy - 1 / sy), static_cast<float>(cx + 1 / sx), static_cast<float>(cy + 1 / sy)};
    const bool masks = settings_.inset_outset.masks;
    begin_image(image, clear, masks);
    if (!masks) return static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side);
    glScissor(image.x_px + x0, image.y_px + y0, x1 - x0, y1 - y0);   // what is outside stays closed
    mask_disc(image, side / 2.0, side / 2.0, side / 2.0, side / 2.0, true);
    return density::pixels_in_circle(x1 - x0, y1 - y0, side / 2.0 - x0, side / 2.0 - y0, side / 2.0);
}

void InsetOutset::compose(const View& v, const ViewTarget& t, const gl::FramebufferShape& shape) noexcept {
    const InsetOutsetSettings& s = settings_.inset_outset;
    const float w = static_cast<float>(t.width_px), h = static_cast<float>(t.height_px);
    const float side = static_cast<float>(v.inset.width_px);
    if (v.enlarging) {
        const Image& o = v.outset;
        const std::array<CpuResolve::Level, 2> levels{{{}, {o.picture, 0, 0, o.width_px, o.height_px, o.x_px, o.y_px}}};
        cpu_resolve_.run(*v.enlarging, t, shape, levels, gl::Filter::linear);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    glBindVertexArray(arrays_.name());
    const GLenum kind = images_.layered() ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D;
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(kind, v.inset.texture);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(kind, v.outset.texture);
    // The inset's square, inside the picture, and the four rectangles around it.
    const float x0 = std::max(0.0f, static_cast<float>(v.left_px)), y0 = std::max(0.0f, static_cast<float>(v.bottom_px));
    const float x1 = std::min(w, static_cast<float>(v.left_px) + side), y1 = std::min(h, static_cast<float>(v.bottom_px) + side);
    const auto rectangle = [](float left, float bottom, float right, float top) {
        if (!(left < right && bottom < top)) return;
        glUniform4f(0, left, bottom, right, top);
        glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    };
    for (const gl::Program* p : {&far_, &near_}) {
        glUseProgram(p->name());
        glUniform2f(1, w, h);
        const auto f = [](int px) { return static_cast<float>(px); };
        if (s.contrast > 0) {
            glUniform1f(2, static_cast<float>(s.contrast));
            glUniform2f(7, f(v.outset.width_px), f(v.outset.height_px));
        }
        if (images_.layered()) glUniform2i(6, v.outset.layer, v.inset.layer);
        else if (images_.parted()) glUniform4f(5, f(v.outset.x_px), f(v.outset.y_px), f(v.outset.width_px), f(v.outset.height_px));
        if (p == &far_) {
            if (v.enlarging) continue;
            rectangle(0, 0, w, y0);
            rectangle(0, y1, w, h);
            rectangle(0, y0, x0, y1);
            rectangle(x1, y0, w, y1);
        } else {
            glUniform4f(3, static_cast<float>(v.x_px), static_cast<float>(v.y_px), side / 2 - static_cast<float>(kRim_px),
                        static_cast<float>(std::max(s.blend_px, 1e-3)));
            glUniform2f(4, static_cast<float>(v.left_px - v.inset.x_px), static_cast<float>(v.bottom_px - v.inset.y_px));
            rectangle(x0, y0, x1, y1);
        }
    }
}

FrameCost InsetOutset::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                              std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    counter_.begin();
    const auto foveated = [&](std::size_t i) { return !draws.empty() && *prepared_.obstacle(targets, i, draws.clear()) == 0; };
    std::size_t foveated_views = 0;
    glDisable(GL_STENCIL_TEST);
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const auto index = static_cast<std::uint32_t>(i);
        if (!foveated(i)) {
            if (2 * i < draw_.size()) draw_[i].only_in = draw_[draw_.size() / 2 + i].only_in = {0, 0, 0, 0};   // left out
            submit_full_view(draws, index, targets[i], counter_.enabled(), cost, prepared_.ready(targets) ? &prepared_.shape(i) : nullptr);
            if (draws.empty()) continue;
            cost.fell_back = true;
            cost.note = prepared_.obstacle(targets, i, draws.clear());
            continue;
        }
        cost.pixels_full += static_cast<std::uint64_t>(targets[i].width_px) * static_cast<std::uint64_t>(targets[i].height_px);
        ++foveated_views;
        ViewImages::View &wide = draw_[i], &narrow = draw_[targets.size() + i];
        wide = narrow = {.view = index};
        place(views_[i], targets[i], focus[i]);
        cost.pixels_shaded += begin_outset(views_[i], targets[i], draws.clear());
        cost.pixels_shaded += begin_inset(views_[i], targets[i], draws.clear(), narrow);
    }
    if (foveated_views == 0) return cost;
    end_masks();
    images_.draw(draws, draw_, counter_.enabled(), cost);
    images_.resolve();
    cost.samples = samples_;
    for (std::size_t i = 0; i < targets.size(); ++i)
        if (foveated(i)) compose(views_[i], targets[i], prepared_.shape(i));
    return cost;
}

}  // namespace fovea::foveation
