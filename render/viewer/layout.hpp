// Where the pictures of both eyes lie in a window: side by side, as large as fits, of the shape asked for.
//
// Pixels from the lower left corner, as GL counts them. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "render/viewer/frame.hpp"

namespace fovea::viewer {

struct Place {
    int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
    bool operator==(const Place&) const = default;
};

// Left eye, right eye; both of one size, at least 16 x 16 (a smaller window shows a part of it).
// aspect: width by height of one eye, > 0.
[[nodiscard]] std::array<Place, kEyes> layout(int width_px, int height_px, double aspect) noexcept;

// What a point of the window shows. x from its left, y from its top edge.
struct PointedAt {
    std::size_t eye = 0;
    double x_ndc = 0, y_ndc = 0;   // [-1, 1], +y up
};
// The nearest point of the nearest picture: there is always one.
[[nodiscard]] PointedAt pointed_at(const std::array<Place, kEyes>& places, int height_px, double x_px, double y_px) noexcept;

}  // namespace fovea::viewer
