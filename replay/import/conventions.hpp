// Conversions that several importers share: other people's axes and angles into ours, and two eyes into one.
//
// Threads: pure functions.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "protocol/gaze_sample.hpp"

namespace fovea::replay {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;

// A vector of +x left, +y up, +z forward (SRanipal, Tobii Glasses) in ours (+x right, +y up, -z forward). Nothing for
// a vector without length or with a NaN.
[[nodiscard]] inline std::optional<Direction<HeadFrame>> from_left_up_forward(double x, double y, double z) {
    return Direction<HeadFrame>::from({-x, y, -z});
}
// A vector of +x right, +y up, +z forward (Unity).
[[nodiscard]] inline std::optional<Direction<HeadFrame>> from_right_up_forward(double x, double y, double z) {
    return Direction<HeadFrame>::from({x, y, -z});
}
// A vector of +x right, +y down, +z forward (camera images).
[[nodiscard]] inline std::optional<Direction<HeadFrame>> from_right_down_forward(double x, double y, double z) {
    return Direction<HeadFrame>::from({x, -y, -z});
}

// A point on a flat screen seen from `distance` in front of its centre: x to the right, y DOWN, all in one unit.
[[nodiscard]] inline std::optional<Direction<HeadFrame>> from_screen(double x, double y_down, double distance) {
    return Direction<HeadFrame>::from({x, -y_down, -distance});
}

inline void set_gaze(EyeState& eye, const std::optional<Direction<HeadFrame>>& direction) {
    eye.valid = direction.has_value();
    if (direction) eye.gaze_dir_head = *direction;
}

// Unity's Euler angles (degrees; applied z, then x, then y; left-handed, +z forward) as a rotation in our axes:
// mirroring z turns a rotation (w, x, y, z) into (w, -x, -y, z). Invalid for angles that are not finite.
[[nodiscard]] inline HeadPose head_from_unity_euler(double x_deg, double y_deg, double z_deg) {
    HeadPose head;
    if (!std::isfinite(x_deg) || !std::isfinite(y_deg) || !std::isfinite(z_deg)) return head;
    const auto half = [](double deg) { return std::remainder(deg, 360.0) * kRadPerDeg / 2; };
    const double cx = std::cos(half(x_deg)), sx = std::sin(half(x_deg));
    const double cy = std::cos(half(y_deg)), sy = std::sin(half(y_deg));
    const double cz = std::cos(half(z_deg)), sz = std::sin(half(z_deg));
    // q = q_y * q_x * q_z
    const double w = cy * cx * cz + sy * sx * sz;
    const double x = cy * sx * cz + sy * cx * sz;
    const double y = sy * cx * cz - cy * sx * sz;
    const double z = cy * cx * sz - sy * sx * cz;
    head.world_from_head = {w, -x, -y, z};
    head.valid = true;
    return head;
}

// The cyclopean gaze of a file that has only eyes: the middle of both, or the one that is valid.
inline void combine_eyes(GazeSample& sample) {
    const EyeState &left = sample.eye(Eye::left), &right = sample.eye(Eye::right);
    EyeState& combined = sample.eye(Eye::combined);
    combined = {};
    if (left.valid && right.valid) {
        const auto middle = Direction<HeadFrame>::from(left.gaze_dir_head.vec() + right.gaze_dir_head.vec());
        combined.valid = middle.has_value();
        if (middle) combined.gaze_dir_head = *middle;
    } else if (left.valid || right.valid) {
        combined.valid = true;
        combined.gaze_dir_head = left.valid ? left.gaze_dir_head : right.gaze_dir_head;
    }
    const auto mean = [](double a, double b) { return std::isnan(a) ? b : std::isnan(b) ? a : (a + b) / 2; };
    combined.openness = mean(left.openness, right.openness);
    combined.pupil_mm = mean(left.pupil_mm, right.pupil_mm);
    combined.confidence = mean(left.confidence, right.confidence);
}

}  // namespace fovea::replay
