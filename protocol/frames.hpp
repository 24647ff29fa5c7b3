// The table of coordinate frames and one vector type per frame, so that mixing frames does not compile.
//
// | frame     | origin, axes                                                                            | unit |
// |-----------|-----------------------------------------------------------------------------------------|------|
// | WorldFrame| the tracking origin of the runtime; +y up against gravity                               | m    |
// | HeadFrame | between the eyes, fixed to the headset (or to the screen's centre for a remote tracker) | m    |
// | EyeLeftFrame, EyeRightFrame | the eye's centre of rotation, axes parallel to HeadFrame at primary gaze | m    |
// | ViewFrame | one rendered view (its projection centre), -z through its optical axis                  | m    |
// | ndc       | per view, [-1, 1] in x and y, +y up (NdcPoint)                                          | 1    |
//
// All are right-handed: +x right, +y up, -z forward. Angles are radians. A transform reads right to left:
// gaze_dir_view = view_from_head * gaze_dir_head.
//
// Source: OpenXR 1.0, section 2.16 (coordinate system) for axes and signs.
#pragma once

#include <cmath>
#include <optional>

namespace fovea {

struct WorldFrame;
struct HeadFrame;
struct EyeLeftFrame;
struct EyeRightFrame;
struct ViewFrame;

template <class Frame>
struct Vec3 {
    double x = 0, y = 0, z = 0;

    friend constexpr Vec3 operator+(Vec3 a, Vec3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend constexpr Vec3 operator-(Vec3 a, Vec3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend constexpr Vec3 operator*(double s, Vec3 a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
    bool operator==(const Vec3&) const = default;
};

template <class Frame>
[[nodiscard]] constexpr double dot(Vec3<Frame> a, Vec3<Frame> b) noexcept {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Frame>
[[nodiscard]] constexpr Vec3<Frame> cross(Vec3<Frame> a, Vec3<Frame> b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// Does not overflow or underflow for any finite vector.
template <class Frame>
[[nodiscard]] double length(Vec3<Frame> a) noexcept {
    return std::hypot(a.x, a.y, a.z);
}

// A unit vector. Default: straight ahead.
template <class Frame>
struct Direction {
    double x = 0, y = 0, z = -1;

    [[nodiscard]] constexpr Vec3<Frame> vec() const noexcept { return {x, y, z}; }
    bool operator==(const Direction&) const = default;

    // Nothing when v has a NaN, an infinity, or is too short to have a direction (length below 1e-150).
    [[nodiscard]] static std::optional<Direction> from(Vec3<Frame> v) noexcept {
        const double n = length(v);
        if (!(n > 1e-150) || !std::isfinite(n)) return std::nullopt;
        return Direction{v.x / n, v.y / n, v.z / n};
    }
};

// A unit quaternion that takes vectors of frame From to frame To. Default: identity.
template <class To, class From>
struct Rotation {
    double w = 1, x = 0, y = 0, z = 0;

    bool operator==(const Rotation&) const = default;
    [[nodiscard]] constexpr Rotation<From, To> inverse() const noexcept { return {w, -x, -y, -z}; }

    friend constexpr Vec3<To> operator*(const Rotation& q, Vec3<From> v) noexcept {
        // v + 2w(u x v) + 2 u x (u x v)
        const double tx = 2 * (q.y * v.z - q.z * v.y);
        const double ty = 2 * (q.z * v.x - q.x * v.z);
        const double tz = 2 * (q.x * v.y - q.y * v.x);
        return {v.x + q.w * tx + (q.y * tz - q.z * ty), v.y + q.w * ty + (q.z * tx - q.x * tz),
                v.z + q.w * tz + (q.x * ty - q.y * tx)};
    }
    friend constexpr Direction<To> operator*(const Rotation& q, Direction<From> d) noexcept {
        const Vec3<To> v = q * d.vec();
        return {v.x, v.y, v.z};
    }
};

// Normalised device coordinates of one view: [-1, 1], +x right, +y up.
struct NdcPoint {
    double x = 0, y = 0;
    bool operator==(const NdcPoint&) const = default;
};

// The four signed tangents of a view frustum: tan_left < tan_right and tan_down < tan_up (left and down are usually
// negative, as the angles of XrFovf are).
struct FieldOfView {
    double tan_left = -1, tan_right = 1, tan_up = 1, tan_down = -1;
    [[nodiscard]] constexpr bool valid() const noexcept {
        return tan_right - tan_left > 1e-6 && tan_up - tan_down > 1e-6 && tan_left > -1e3 && tan_right < 1e3 &&
               tan_down > -1e3 && tan_up < 1e3;
    }
};

}  // namespace fovea
