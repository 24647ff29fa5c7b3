#include "render/density/acuity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "protocol/sphere.hpp"

namespace fovea::density {
namespace {

constexpr int kDirections = 24, kRings = 128;
constexpr double kInnermost = 0.004, kRingRatio = 1.0526;   // NDC; the last ring reaches 2.83, across any view
constexpr double kSlack = 0.95;     // of the squared gain: for what lies between two directions
constexpr std::array kAreas{0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0};   // the cheapest of these is taken

// One cell of the fit: no place in it is nearer to the gaze than `inverse_need` allows for, nor further than `distance2`.
struct Cell {
    double distance2 = 0;      // dx^2 + (ratio dy)^2 at its outer edge
    double inverse_need = 1;   // 1 / needed density at its inner edge
};

}  // namespace

double needed_scale(const AcuitySettings& s, double eccentricity, double margin, double pixel) noexcept {
    const double mar = s.mar_slope * std::max(0.0, eccentricity - margin) + s.mar0_rad;
    return std::min(1.0, pixel / mar);
}

FocalPoint acuity_focal_point(const AcuitySettings& s, const FieldOfView& view, int width, int height, NdcPoint gaze,
                              double radius95) noexcept {
    if (!view.valid() || !std::isfinite(gaze.x) || !std::isfinite(gaze.y) || !(radius95 >= 0) || !std::isfinite(radius95) ||
        !(s.mar_slope > 0) || !(s.mar0_rad > 0) || width < 1 || height < 1)
        return {};
    const double margin = s.uncertainty_gain * radius95;
    // Tangents per NDC; a pixel is largest, in angle, at the middle of the view.
    const double tx = 0.5 * (view.tan_right - view.tan_left), ty = 0.5 * (view.tan_up - view.tan_down);
    const double pixel = std::max(2 * tx / width, 2 * ty / height);
    const double ratio = ty / tx;   // equal angles: as many tangents along y
    const Direction<ViewFrame> eye = unproject(view, gaze);

    std::array<Cell, static_cast<std::size_t>(kDirections) * kRings> cells;
    std::size_t count = 0;
    // The view is most oblique along the line from its middle through the gaze: one direction runs along it.
    const double first = std::atan2(eye.y, eye.x);
    for (int k = 0; k < kDirections; ++k) {
        const double a = first + 6.283185307179586 * k / kDirections, cx = std::cos(a) * std::max(ratio, 1.0), cy = std::sin(a) * std::max(1 / ratio, 1.0);
        const double across = cx * cx + ratio * ratio * cy * cy;
        double inner = 0;
        for (int i = 0; i < kRings; ++i) {
            const NdcPoint start{gaze.x + inner * cx, gaze.y + inner * cy};
            const bool inside = std::abs(gaze.x) <= 1 && std::abs(gaze.y) <= 1;
            // Half a step between directions beyond the edge: this ray also stands for its neighbourhood.
            const double edge = 1.001 + 0.15 * inner * std::max(ratio, 1 / ratio);
            const bool in_view = std::abs(start.x) <= edge && std::abs(start.y) <= edge;
            if (inside && !in_view) break;   // has left the view for good
            const double outer = i == 0 ? kInnermost : inner * kRingRatio;
            if (in_view) {
                const double scale = needed_scale(s, angle_between(eye, unproject(view, start)), margin, pixel);
                const double need = s.reading == Reading::area ? scale * scale : scale;
                if (need > s.coarsest_density) cells[count++] = {outer * outer * across, 1 / need};
                else if (inside) break;      // and it only falls from here on
            }
            inner = outer;
        }
    }
    if (count == 0) return {};
    const std::span used(cells.data(), count);
    double best_cost = std::numeric_limits<double>::infinity(), best_gain = 0, best_area = 0;
    for (const double area : kAreas) {
        double gain2 = std::numeric_limits<double>::infinity();
        for (const Cell& c : used) gain2 = std::min(gain2, (c.inverse_need + area) / c.distance2);
        gain2 *= kSlack;
        double cost = 0;   // pixels of the cells, as rendered; a cell's part of the view grows with its distance squared
        for (const Cell& c : used) {
            const double density = 1 / std::max(gain2 * c.distance2 - area, 1.0);
            cost += (s.reading == Reading::area ? density : density * density) * c.distance2;
        }
        if (cost < best_cost) {
            best_cost = cost;
            best_gain = std::sqrt(gain2);
            best_area = area;
        }
    }
    return {static_cast<float>(gaze.x), static_cast<float>(gaze.y), static_cast<float>(best_gain),
            static_cast<float>(best_gain * ratio), static_cast<float>(best_area)};
}

}  // namespace fovea::density
