// How far a point is from an ellipse, how far the ellipse reaches, and the directions that rays take from its middle: sines and
// cosines once for each ellipse or table, for each ray and point only sums and products.
//
// Units: pixels, radians. Threads: any.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/camera/pupil_detector.hpp"

namespace fovea::drivers::camera {

// Distances in pixels from an ellipse, to first order; the turn is worked out once.
class EllipseRuler {
public:
    explicit EllipseRuler(const PupilEllipse& e) noexcept : e_{e}, c_{std::cos(e.angle_rad)}, s_{std::sin(e.angle_rad)} {}
    [[nodiscard]] double distance(double x, double y) const noexcept {
        const double u = ((x - e_.x) * c_ + (y - e_.y) * s_) / e_.a, v = (-(x - e_.x) * s_ + (y - e_.y) * c_) / e_.b;
        const double r2 = u * u + v * v, g2 = u * u / (e_.a * e_.a) + v * v / (e_.b * e_.b);
        if (r2 < 1e-12) return e_.b;
        // |r - 1| r / |gradient|, with r - 1 = (r^2 - 1) / (r + 1)
        const double r = std::sqrt(r2);
        return std::abs(r2 - 1) / (r + 1) * r / std::sqrt(g2);
    }

private:
    PupilEllipse e_;
    double c_, s_;
};

// The ellipse's radius in a direction from its centre.
class RadiusOf {
public:
    explicit RadiusOf(const PupilEllipse& e) noexcept : c_{std::cos(e.angle_rad)}, s_{std::sin(e.angle_rad)}, a_{e.a}, b_{e.b} {}
    [[nodiscard]] double towards(double ca, double sa) const noexcept {
        const double u = (ca * c_ + sa * s_) / a_, v = (sa * c_ - ca * s_) / b_;
        return 1 / std::sqrt(u * u + v * v);
    }

private:
    double c_, s_, a_, b_;
};

struct Turn {
    double cosine = 1, sine = 0;
};
// n directions, evenly round the circle, the first `phase` parts on from +x.
inline std::vector<Turn> turns_of(int n, double phase = 0) {
    std::vector<Turn> all;
    for (int k = 0; k < n; ++k) {
        const double angle = 2 * std::numbers::pi * (k + phase) / n;
        all.push_back({std::cos(angle), std::sin(angle)});
    }
    return all;
}

}  // namespace fovea::drivers::camera
