// The ellipse nearest to some points: direct least squares, so that the answer is an ellipse whatever the points.
//
// Source: Fitzgibbon, Pilu and Fisher, "Direct least square fitting of ellipses", PAMI 1999, in the numerically stable
// form of Halir and Flusser, WSCG 1998: a 3x3 eigenproblem, solved in closed form.
// Units: pixels. Cost: about a microsecond for six points. Threads: any. Allocates nothing.
#pragma once

#include <optional>
#include <span>

#include "drivers/camera/pupil_detector.hpp"

namespace fovea::drivers::camera {

struct EdgePoint {
    double x = 0, y = 0;
};

// Absent: fewer than six points, or points that lie on no ellipse of at least half a pixel (a line, all in one place).
[[nodiscard]] std::optional<PupilEllipse> fit_ellipse(std::span<const EdgePoint> points) noexcept;

}  // namespace fovea::drivers::camera
