// Geometry of gaze directions: tangent planes, rotation vectors, angles and views.
//
// Filtering and prediction work on the tangent plane of the current gaze (radians), never on yaw and pitch, whose
// scale breaks down near their poles.
//
// Source: exponential and logarithm map of the unit sphere; the branch-free basis is Duff et al., "Building an
// Orthonormal Basis, Revisited", JCGT 6(1), 2017.
// Threads: pure functions.
#pragma once

#include "protocol/frames.hpp"

namespace fovea {

// A vector in a tangent plane, radians; u and v are the two axes of TangentBasis.
struct Tangent {
    double u = 0, v = 0;
    friend constexpr Tangent operator+(Tangent a, Tangent b) noexcept { return {a.u + b.u, a.v + b.v}; }
    friend constexpr Tangent operator-(Tangent a, Tangent b) noexcept { return {a.u - b.u, a.v - b.v}; }
    friend constexpr Tangent operator*(double s, Tangent a) noexcept { return {s * a.u, s * a.v}; }
    bool operator==(const Tangent&) const = default;
};
[[nodiscard]] inline double length(Tangent t) noexcept { return std::hypot(t.u, t.v); }

// Two unit vectors that span the tangent plane at a direction. Straight ahead they are +x (u) and +y (v).
// A function of the direction alone, so that two processes agree on it bit for bit.
template <class Frame>
struct TangentBasis {
    Vec3<Frame> u, v;

    explicit TangentBasis(Direction<Frame> d) noexcept {
        // Duff et al. about n = -d, so that the seam of the basis lies at the sides (d.z = 0), not straight ahead.
        const double nx = -d.x, ny = -d.y, nz = -d.z;
        const double sign = std::copysign(1.0, nz);
        const double a = -1.0 / (sign + nz);
        const double b = nx * ny * a;
        u = {1.0 + sign * nx * nx * a, sign * b, -sign * nx};
        v = {b, sign + ny * ny * a, -ny};
    }
};

// Great-circle angle in radians, [0, pi]; exact to rounding for tiny and for opposite directions.
template <class Frame>
[[nodiscard]] double angle_between(Direction<Frame> a, Direction<Frame> b) noexcept {
    return std::atan2(length(cross(a.vec(), b.vec())), dot(a.vec(), b.vec()));
}

// The tangent vector at `from` that leads to `to` along the great circle: its length is the angle between them.
// For opposite directions, where every way is a shortest one, it leads along +u.
template <class Frame>
[[nodiscard]] Tangent log_map(Direction<Frame> from, Direction<Frame> to) noexcept {
    const TangentBasis<Frame> basis(from);
    const double u = dot(basis.u, to.vec()), v = dot(basis.v, to.vec());
    const double s = std::hypot(u, v), angle = std::atan2(s, dot(from.vec(), to.vec()));
    if (s < 1e-300) return {angle, 0};
    return {u / s * angle, v / s * angle};
}

// The direction reached from `from` along tangent vector t. Renormalised, so that a billion steps stay unit vectors.
template <class Frame>
[[nodiscard]] Direction<Frame> exp_map(Direction<Frame> from, Tangent t) noexcept {
    const double angle = length(t);
    if (angle < 1e-300) return from;
    const TangentBasis<Frame> basis(from);
    const double s = std::sin(angle) / angle;
    const Vec3<Frame> p = std::cos(angle) * from.vec() + (s * t.u) * basis.u + (s * t.v) * basis.v;
    return Direction<Frame>::from(p).value_or(from);
}

// A tangent vector at `from` carried along the great circle to `to` (parallel transport): how a velocity estimated at
// one gaze is used at the next.
template <class Frame>
[[nodiscard]] Tangent transport(Direction<Frame> from, Direction<Frame> to, Tangent t) noexcept {
    const TangentBasis<Frame> a(from), b(to);
    const Vec3<Frame> p = t.u * a.u + t.v * a.v;
    const double c = 1.0 + dot(from.vec(), to.vec());
    // Rotating p by the rotation that takes from to to: p - (p.to)/(1 + from.to) (from + to), for p perpendicular to from.
    const Vec3<Frame> q = c > 1e-12 ? p - (dot(p, to.vec()) / c) * (from.vec() + to.vec()) : p;
    return {dot(q, b.u), dot(q, b.v)};
}

// A constant fraction of the way from a (0) to b (1) along the great circle.
template <class Frame>
[[nodiscard]] Direction<Frame> slerp(Direction<Frame> a, Direction<Frame> b, double fraction) noexcept {
    return exp_map(a, fraction * log_map(a, b));
}

// Azimuth (+ right) and elevation (+ up), radians: for files, print-outs and plots only.
struct AzimuthElevation {
    double azimuth_rad = 0, elevation_rad = 0;
};
template <class Frame>
[[nodiscard]] AzimuthElevation to_azimuth_elevation(Direction<Frame> d) noexcept {
    return {std::atan2(d.x, -d.z), std::atan2(d.y, std::hypot(d.x, d.z))};
}
template <class Frame>
[[nodiscard]] Direction<Frame> from_azimuth_elevation(AzimuthElevation a) noexcept {
    const double c = std::cos(a.elevation_rad);
    return {c * std::sin(a.azimuth_rad), std::sin(a.elevation_rad), -c * std::cos(a.azimuth_rad)};
}

// Where a direction meets the view's image. Nothing when it lies behind the view or within 1e-6 of its plane: such a
// gaze is outside, never a mirrored focal point. The result may lie outside [-1, 1].
[[nodiscard]] inline std::optional<NdcPoint> project(const FieldOfView& fov, Direction<ViewFrame> d) noexcept {
    if (!(d.z < -1e-6)) return std::nullopt;
    const double tx = d.x / -d.z, ty = d.y / -d.z;
    return NdcPoint{(2 * tx - (fov.tan_right + fov.tan_left)) / (fov.tan_right - fov.tan_left),
                    (2 * ty - (fov.tan_up + fov.tan_down)) / (fov.tan_up - fov.tan_down)};
}

// The inverse of project().
[[nodiscard]] inline Direction<ViewFrame> unproject(const FieldOfView& fov, NdcPoint p) noexcept {
    const double tx = 0.5 * ((fov.tan_right - fov.tan_left) * p.x + fov.tan_right + fov.tan_left);
    const double ty = 0.5 * ((fov.tan_up - fov.tan_down) * p.y + fov.tan_up + fov.tan_down);
    return Direction<ViewFrame>::from({tx, ty, -1}).value_or(Direction<ViewFrame>{});
}

}  // namespace fovea
