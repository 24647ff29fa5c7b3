// The geometry of dynamic viewports: where views lie in an atlas, and which part of the field of view the focus view shows.
//
// Source: Varjo foveated rendering API, dynamic viewports (calculateFoveatedViewports: two views a row).
// Threads: pure functions. noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "protocol/frames.hpp"

namespace fovea::density {

struct ViewportSize {
    int width = 0, height = 0;
};
struct Viewport {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const Viewport&) const = default;
};

// Two views a row, each row as high as its second view, as in Varjo's example. out: as many as sizes.
void layout_viewports(std::span<const ViewportSize> sizes, std::span<Viewport> out) noexcept;

// The tangents of a focus view that shows `extent` (0 to 1) of the full view's width and height around the gaze (NDC of the
// full view); moved inward where it would leave the full view. A gaze that is no number: around the middle.
[[nodiscard]] FieldOfView focus_tangents(const FieldOfView& full, NdcPoint gaze, double extent) noexcept;

// Scale and offset (x, y, x, y) that turn clip coordinates of `full` into those of `part`: x' = x s + w o.
[[nodiscard]] std::array<float, 4> crop_between(const FieldOfView& full, const FieldOfView& part) noexcept;

}  // namespace fovea::density
