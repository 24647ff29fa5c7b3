// Matrices of the scenes: column-major 4x4 as GL takes them, and the stereo camera.
//
// Frames: world and view as in protocol/frames.hpp: right-handed, +y up, -z forward, metres.
#pragma once

#include <array>
#include <cmath>

#include "protocol/frames.hpp"
#include "render/gl/command_list.hpp"

namespace fovea::scene {

using Mat4 = std::array<double, 16>;   // column-major

[[nodiscard]] inline Mat4 multiply(const Mat4& a, const Mat4& b) noexcept {
    Mat4 r{};
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t i = 0; i < 4; ++i) r[c * 4 + i] += a[k * 4 + i] * b[c * 4 + k];
    return r;
}

// Clip space from view space for four tangents; near and far in metres.
[[nodiscard]] inline Mat4 projection(const FieldOfView& f, double near_m, double far_m) noexcept {
    const double w = f.tan_right - f.tan_left, h = f.tan_up - f.tan_down;
    return {2 / w, 0, 0, 0,
            0, 2 / h, 0, 0,
            (f.tan_right + f.tan_left) / w, (f.tan_up + f.tan_down) / h, -(far_m + near_m) / (far_m - near_m), -1,
            0, 0, -2 * far_m * near_m / (far_m - near_m), 0};
}

struct Pose {
    double x_m = 0, y_m = 0, z_m = 0;
    double yaw_rad = 0;     // 0 looks along -z, positive turns left
    double pitch_rad = 0;   // positive looks up
};

// View space of an eye that sits `right_m` to the right of the pose.
[[nodiscard]] inline Mat4 view_from_world(const Pose& p, double right_m) noexcept {
    const double cy = std::cos(p.yaw_rad), sy = std::sin(p.yaw_rad), cp = std::cos(p.pitch_rad), sp = std::sin(p.pitch_rad);
    // Rows: right, up, backward.
    const double r[3] = {cy, 0, -sy}, u[3] = {sy * sp, cp, cy * sp}, b[3] = {sy * cp, -sp, cy * cp};
    const double e[3] = {p.x_m + right_m * r[0], p.y_m, p.z_m + right_m * r[2]};
    const auto dot = [&](const double* v) { return v[0] * e[0] + v[1] * e[1] + v[2] * e[2]; };
    return {r[0], u[0], b[0], 0, r[1], u[1], b[1], 0, r[2], u[2], b[2], 0, -dot(r), -dot(u), -dot(b), 1};
}

// Axis-aligned, metres.
struct Aabb {
    std::array<float, 3> low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
};

// Where a box can appear in the view, NDC, rounded outward by what the vertex shader's floats may be off; the whole view when
// it reaches the plane of the eye (or is not finite), empty when it lies wholly outside one plane of the view.
// Any matrix. Conservative: whatever of the box is seen lies within (a property test).
[[nodiscard]] gl::Box project_bounds(const Mat4& clip_from_world, const Aabb& box) noexcept;

}  // namespace fovea::scene
