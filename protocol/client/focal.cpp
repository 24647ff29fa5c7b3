#include "protocol/client/focal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fovea::client {
namespace {

struct ImagePoint {
    double tx = 0, ty = 0;   // tangents
};

// The point of the view's edge at the smallest angle to d. On an edge p = (x, y, -1) with y fixed the cosine is
// (x dx + y dy - dz) / sqrt(x^2 + y^2 + 1); its only maximum is at x = dx (y^2 + 1) / (y dy - dz), if that divisor is
// positive; otherwise it falls towards both ends. So the corners and the clamped maxima are all there is to try.
// A gaze behind the view counts as one at 90 degrees the same way round, so that it leaves the view where it would.
ImagePoint nearest_edge_point(const FieldOfView& fov, Direction<ViewFrame> d) noexcept {
    d.z = std::min(d.z, 0.0);
    ImagePoint best;
    double best_cosine = -std::numeric_limits<double>::infinity();
    const auto consider = [&](double tx, double ty) {
        const double cosine = (tx * d.x + ty * d.y - d.z) / std::sqrt(tx * tx + ty * ty + 1);
        if (cosine > best_cosine) best = {tx, ty}, best_cosine = cosine;
    };
    for (const double ty : {fov.tan_down, fov.tan_up}) {
        consider(fov.tan_left, ty);
        consider(fov.tan_right, ty);
        const double divisor = ty * d.y - d.z;
        if (divisor > 0) consider(std::clamp(d.x * (ty * ty + 1) / divisor, fov.tan_left, fov.tan_right), ty);
    }
    for (const double tx : {fov.tan_left, fov.tan_right}) {
        const double divisor = tx * d.x - d.z;
        if (divisor > 0) consider(tx, std::clamp(d.y * (tx * tx + 1) / divisor, fov.tan_down, fov.tan_up));
    }
    return best;
}

}  // namespace

std::optional<View> view_of(const fovea_view& view) noexcept {
    View v;
    if (view.eye > FOVEA_EYE_RIGHT) return std::nullopt;
    v.eye = static_cast<Eye>(view.eye);
    v.fov = {view.tan_left, view.tan_right, view.tan_up, view.tan_down};
    if (!v.fov.valid()) return std::nullopt;   // a NaN fails every comparison in it
    const double w = view.head_from_view[0], x = view.head_from_view[1], y = view.head_from_view[2],
                 z = view.head_from_view[3];
    const double n2 = w * w + x * x + y * y + z * z;
    if (!(n2 >= 0.25 && n2 <= 4)) return std::nullopt;
    v.ndc_per_tan_x = 2 / (v.fov.tan_right - v.fov.tan_left);
    v.ndc_per_tan_y = 2 / (v.fov.tan_up - v.fov.tan_down);
    const double s = 1 / std::sqrt(n2);
    v.head_from_view = {s * w, s * x, s * y, s * z};
    return v;
}

Focal focal_of(const View& view, Direction<HeadFrame> gaze) noexcept {
    Focal focal;
    const Direction<ViewFrame> d = view.head_from_view.inverse() * gaze;
    const FieldOfView& fov = view.fov;
    focal.gaze_dir_view = d;
    const auto to_ndc = [&](ImagePoint p) {
        return NdcPoint{(p.tx - fov.tan_left) * view.ndc_per_tan_x - 1, (p.ty - fov.tan_down) * view.ndc_per_tan_y - 1};
    };
    // d(tangent)/d(angle) where the gaze moves along x: (1 + tx^2 + ty^2) / sqrt(1 + ty^2), the inverse length of the
    // derivative of the unit vector; with tx = -dx/dz and so on that is 1 / (|dz| sqrt(dy^2 + dz^2)). Along y alike.
    if (d.z < -1e-6) {   // in front of the view, as in project()
        const double reciprocal = -1 / d.z;
        focal.point = to_ndc({d.x * reciprocal, d.y * reciprocal});
        if (std::abs(focal.point.x) <= 1 && std::abs(focal.point.y) <= 1) [[likely]] {   // a NaN is outside
            // In float, as fovea_focal has it: half the time of roots and divisions.
            const auto x2 = static_cast<float>(d.x * d.x), y2 = static_cast<float>(d.y * d.y),
                       z2 = static_cast<float>(d.z * d.z), r = static_cast<float>(reciprocal);
            focal.ndc_per_rad_x = static_cast<float>(view.ndc_per_tan_x) * r / std::sqrt(y2 + z2);
            focal.ndc_per_rad_y = static_cast<float>(view.ndc_per_tan_y) * r / std::sqrt(x2 + z2);
            return focal;
        }
    }
    focal.outside = true;
    const ImagePoint p = nearest_edge_point(fov, d);
    const NdcPoint edge = to_ndc(p);
    focal.point = {std::clamp(edge.x, -1.0, 1.0), std::clamp(edge.y, -1.0, 1.0)};
    const double x2 = p.tx * p.tx, y2 = p.ty * p.ty;
    focal.ndc_per_rad_x = static_cast<float>(view.ndc_per_tan_x * (1 + x2 + y2) / std::sqrt(1 + y2));
    focal.ndc_per_rad_y = static_cast<float>(view.ndc_per_tan_y * (1 + x2 + y2) / std::sqrt(1 + x2));
    return focal;
}

}  // namespace fovea::client
