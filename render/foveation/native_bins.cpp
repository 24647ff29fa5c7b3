#include "render/foveation/native_bins.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <string>

#include "render/foveation/full.hpp"
#include "render/gl/context.hpp"

namespace fovea::foveation {
namespace {

constexpr std::uint32_t kFeatures = GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;

}  // namespace

Result<std::unique_ptr<Method>> NativeBins::create(const MethodSettings& settings, const NativeCalls& calls) {
    FOVEA_REQUIRE(calls.framebuffer_foveated || calls.texture_foveated);
    const auto checked = density::Plan::create(settings.plan);
    if (!checked) return std::unexpected(checked.error());
    return std::unique_ptr<Method>(new NativeBins(settings, calls));
}

// Foveation of a texture cannot be switched off; full density can be asked for.
NativeBins::~NativeBins() {
    for (const View& v : views_)
        for (std::uint32_t p = 0; p < kPointsPerView; ++p) set_point(v, v.first_point + p, {});
}

std::string_view NativeBins::native_extension() const noexcept {
    const bool texture = views_.empty() ? calls_.texture_foveated : views_.front().by_texture;
    return texture ? "GL_QCOM_texture_foveated" : "GL_QCOM_framebuffer_foveated";
}

Result<void> NativeBins::enable_texture(const View& v, const gl::ColorShape& shape, std::uint32_t points) {
    const std::string where = "texture " + std::to_string(v.object);
    GLint supported = 0, most = 0;
    glBindTexture(shape.texture_target, v.object);
    calls_.get_texture_integer(shape.texture_target, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM, &supported);
    calls_.get_texture_integer(shape.texture_target, GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM, &most);
    const auto features = static_cast<std::uint32_t>(supported) & kFeatures;
    if ((features & GL_FOVEATION_ENABLE_BIT_QCOM) == 0 || static_cast<std::uint32_t>(most) < points) {
        glBindTexture(shape.texture_target, 0);
        return fail("the driver does not foveate this texture with " + std::to_string(points) + " focal points", where, "set `emulate` to foveate without the driver");
    }
    calls_.texture_integer(shape.texture_target, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, static_cast<GLint>(features));
    calls_.texture_real(shape.texture_target, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, static_cast<float>(settings_.plan.min_density));
    glBindTexture(shape.texture_target, 0);
    const std::string error = gl::pending_error();
    return error.empty() ? Result<void>{} : fail("the driver refuses to foveate the texture (" + error + ")", where, "set `emulate` to foveate without the driver");
}

Result<void> NativeBins::enable_framebuffer(const View& v, std::uint32_t points) {
    std::uint32_t provided = 0;
    calls_.framebuffer_config(v.object, 1, points, kFeatures, &provided);
    // A framebuffer can be configured once: one that another method had before answers with an error, and stays as it is.
    if (!gl::pending_error().empty() || (provided & GL_FOVEATION_ENABLE_BIT_QCOM) != 0) return {};
    return fail("the driver does not foveate this framebuffer", "framebuffer " + std::to_string(v.object), "set `emulate` to foveate without the driver");
}

Result<void> NativeBins::make_views(std::span<const ViewTarget> targets) {
    views_.clear();
    static_cast<void>(gl::pending_error());
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        const gl::FramebufferShape& shape = prepared_.shape(i);
        if (t.framebuffer == 0) return fail("the surface itself cannot be foveated", "framebuffer 0", "draw into a framebuffer object, or set `emulate`");
        density::PlanSettings s = settings_.plan;
        s.width_px = t.width_px;
        s.height_px = t.height_px;
        auto plan = density::Plan::create(s);
        if (!plan) return std::unexpected(plan.error());
        View v(*std::move(plan));
        const gl::ColorShape& color = shape.color[0];
        v.by_texture = calls_.texture_foveated && (color.texture_target == GL_TEXTURE_2D || color.texture_target == GL_TEXTURE_2D_ARRAY);
        if (!v.by_texture && !calls_.framebuffer_foveated)
            return fail("the driver foveates textures only", "framebuffer " + std::to_string(t.framebuffer), "attach a texture, or set `emulate`");
        glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
        v.object = v.by_texture ? gl::attached_object(0) : t.framebuffer;
        v.layer = v.by_texture ? static_cast<std::uint32_t>(color.layer) : 0;
        v.width_px = static_cast<float>(shape.width_px);
        v.height_px = static_cast<float>(shape.height_px);
        for (const View& before : views_)
            if (before.object == v.object && before.layer == v.layer) v.first_point += kPointsPerView;
        views_.push_back(std::move(v));
    }
    for (std::size_t i = 0; i < views_.size(); ++i) {
        const View& v = views_[i];
        // Of views with one image, the last is told of all their points.
        const bool last = std::none_of(views_.begin() + static_cast<std::ptrdiff_t>(i) + 1, views_.end(),
                                       [&](const View& later) { return later.object == v.object && later.layer == v.layer; });
        if (!last) continue;
        const std::uint32_t points = v.first_point + kPointsPerView;
        auto enabled = v.by_texture ? enable_texture(v, prepared_.shape(i).color[0], points) : enable_framebuffer(v, points);
        if (!enabled) {
            views_.clear();
            return enabled;
        }
    }
    return {};
}

Result<void> NativeBins::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    // Another texture of the same kind has to be told as well.
    const bool attached = *same && std::ranges::all_of(views_, [&, i = std::size_t{0}](const View& v) mutable {
        glBindFramebuffer(GL_FRAMEBUFFER, targets[i++].framebuffer);
        return !v.by_texture || gl::attached_object(0) == v.object;
    });
    return attached ? Result<void>{} : prepared_.settle(make_views(targets));
}

void NativeBins::set_point(const View& v, std::uint32_t point, const density::FocalPoint& p) const noexcept {
    (v.by_texture ? calls_.texture_parameters : calls_.framebuffer_parameters)(v.object, v.layer, point, p.x_ndc, p.y_ndc, p.gain_x, p.gain_y, p.fovea_area);
}

FrameCost NativeBins::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    counter_.begin();
    const bool ready = prepared_.ready(targets);
    for (std::size_t i = 0; ready && i < targets.size(); ++i) {
        View& v = views_[i];
        const ViewTarget& t = targets[i];
        const auto w = static_cast<float>(t.width_px), h = static_cast<float>(t.height_px);
        const std::span<const density::FocalPoint> points = focus[i].all();
        const bool fits = !points.empty() && points.size() <= kPointsPerView;
        for (std::uint32_t k = 0; k < kPointsPerView; ++k) {
            density::FocalPoint p;   // full density
            if (fits) {
                p = points[std::min<std::size_t>(k, points.size() - 1)];
                p.x_ndc = (2 * static_cast<float>(t.x_px) + (p.x_ndc + 1) * w) / v.width_px - 1;
                p.y_ndc = (2 * static_cast<float>(t.y_px) + (p.y_ndc + 1) * h) / v.height_px - 1;
                p.gain_x *= v.width_px / w;
                p.gain_y *= v.height_px / h;
            }
            set_point(v, v.first_point + k, p);
        }
        const density::FocalPoint everywhere;
        v.plan.update(fits ? points : std::span(&everywhere, 1));
        v.region = {};
        if (fits)
            v.region = {points[0].x_ndc, points[0].y_ndc, std::min(density::full_radius_ndc(points[0], 0), v.region.half_width_ndc),
                        std::min(density::full_radius_ndc(points[0], 1), v.region.half_height_ndc)};
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
        FrameCost one;
        submit_full_view(draws, static_cast<std::uint32_t>(i), targets[i], counter_.enabled(), one, ready ? &prepared_.shape(i) : nullptr);
        cost.draws += one.draws;
        cost.submissions += one.submissions;
        cost.pixels_full += one.pixels_full;
        if (ready && !focus[i].all().empty() && one.pixels_shaded > 0)
            for (int level = 0; level < views_[i].plan.settings().level_count; ++level) cost.pixels_shaded += views_[i].plan.texels(level);
        else
            cost.pixels_shaded += one.pixels_shaded;
    }
    if (!ready && !draws.empty()) {
        cost.fell_back = true;
        cost.note = prepared_.note();
    }
    return cost;
}

}  // namespace fovea::foveation
