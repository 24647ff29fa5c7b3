#include "render/viewer/in_between.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "render/gl/context.hpp"

namespace fovea::viewer {

namespace extrapolation = render::extrapolation;

double camera_motion_px(const scene::Pose& from, const scene::Pose& to, const FieldOfView& fov, int width_px) noexcept {
    constexpr int kGrid = 5;
    constexpr double kAway_m = 3;   // the scenes' halls and boards lie 1 to 8 m away
    const scene::Mat4 before = scene::view_from_world(from, 0), now = scene::view_from_world(to, 0);
    const double px_per_tan = width_px / (fov.tan_right - fov.tan_left);
    std::array<double, kGrid * kGrid> moved{};
    for (int j = 0; j < kGrid; ++j)
        for (int i = 0; i < kGrid; ++i) {
            const double tx = fov.tan_left + (fov.tan_right - fov.tan_left) * (i + 0.5) / kGrid, ty = fov.tan_down + (fov.tan_up - fov.tan_down) * (j + 0.5) / kGrid;
            const double v[3] = {tx * kAway_m, ty * kAway_m, -kAway_m};
            // The view is a rotation and a shift: its inverse on a point is R^T (v - t).
            double world[3], seen[3];
            for (std::size_t k = 0; k < 3; ++k) {
                world[k] = 0;
                for (std::size_t r = 0; r < 3; ++r) world[k] += before[k * 4 + r] * (v[r] - before[12 + r]);
            }
            for (std::size_t r = 0; r < 3; ++r) seen[r] = now[r] * world[0] + now[4 + r] * world[1] + now[8 + r] * world[2] + now[12 + r];
            const double depth = std::max(-seen[2], 1e-3);
            moved[static_cast<std::size_t>(j * kGrid + i)] = std::hypot(seen[0] / depth - tx, seen[1] / depth - ty) * px_per_tan;
        }
    std::nth_element(moved.begin(), moved.begin() + moved.size() / 2, moved.end());
    return moved[moved.size() / 2];
}

bool InBetween::called_for(const effects::Needs& needs, Duration frame_cost, Duration budget, std::optional<bool> declared) const noexcept {
    if (mode_ != Extrapolate::automatic) return mode_ == Extrapolate::on;
    return effects::extrapolation_called_for(needs, 1e3 * to_seconds(frame_cost), 1e3 * to_seconds(budget), declared);
}

std::string InBetween::backend() const {
    if (extrapolator_ == nullptr) return {};
    return std::string(extrapolation::backend_name(extrapolator_->backend())) + " (" + extrapolator_->reason() + ")";
}

Result<bool> InBetween::follow(std::size_t eye, const gl::RenderTarget& newest, const foveation::Method::Region& region, float factor,
                               const extrapolation::KnownMotion* motion) {
    if (extrapolator_ == nullptr) {
        const int threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
        auto made = extrapolation::GlExtrapolator::create(gl::driver_function, {.preset = preset_, .threads = threads, .backend = {}});
        if (!made) return std::unexpected(made.error());
        extrapolator_ = std::make_unique<extrapolation::GlExtrapolator>(*std::move(made));
    }
    if (last_[eye].width() != newest.width() || last_[eye].height() != newest.height()) {
        for (gl::RenderTarget* t : {&last_[eye], &made_[eye]}) {
            auto made = gl::RenderTarget::create({.width_px = newest.width(), .height_px = newest.height(), .format = newest.settings().format, .depth_stencil = false});
            if (!made) return std::unexpected(made.error());
            *t = *std::move(made);
        }
        known_[eye] = false;
    }
    const bool had_one = std::exchange(known_[eye], true);
    if (had_one) {
        const auto w = static_cast<float>(newest.width()), h = static_cast<float>(newest.height());
        const auto radius = 0.5f * std::max(w * static_cast<float>(region.half_width_ndc), h * static_cast<float>(region.half_height_ndc));
        const extrapolation::Gaze gaze{.x_px = (0.5f + 0.5f * static_cast<float>(region.x_ndc)) * w, .y_px = (0.5f + 0.5f * static_cast<float>(region.y_ndc)) * h,
                                       .full_radius_px = radius, .coarse_radius_px = 3 * radius};
        static_cast<void>(gl::pending_error());   // an older error is not the extrapolation's
        const GLenum error = extrapolator_->extrapolate(last_[eye].color_texture(), newest.color_texture(), made_[eye].color_texture(), factor, {.motion = motion, .gaze = &gaze});
        if (error != GL_NO_ERROR) return fail("the driver refused to extrapolate a frame (GL error " + std::to_string(error) + ")", backend(), "use --extrapolate off");
    }
    gl::copy_color(newest, last_[eye]);
    return had_one;
}

}  // namespace fovea::viewer
