#include <algorithm>
#include <cmath>
#include <limits>

#include "render/scene/camera.hpp"

namespace fovea::scene {
namespace {

constexpr gl::Box kNowhere{0, 0, 0, 0};
// Of the float arithmetic in the vertex shader, four products and sums a coordinate, and of the subpixel grid.
constexpr double kRounding = 8 * static_cast<double>(std::numeric_limits<float>::epsilon());
constexpr double kSlack = 1e-4;

struct Row {
    double value = 0, error = 0;   // of a clip coordinate, and how far the shader's may be from it
};

}  // namespace

gl::Box project_bounds(const Mat4& m, const Aabb& box) noexcept {
    double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;
    // Half-spaces outside the view: a box that lies wholly in one of them is not seen, wherever else its corners are.
    std::array<int, 6> outside{};
    std::array<double, 3> error{};   // of x, y and w, the largest
    double nearest = 1e300;          // the least w
    bool open = false;   // reaches the plane of the eye: its projection has no end
    for (unsigned corner = 0; corner < 8; ++corner) {
        const double p[3] = {(corner & 1) != 0 ? box.high[0] : box.low[0], (corner & 2) != 0 ? box.high[1] : box.low[1],
                             (corner & 4) != 0 ? box.high[2] : box.low[2]};
        const auto row = [&](std::size_t i) {
            const double a = m[i] * p[0], b = m[4 + i] * p[1], c = m[8 + i] * p[2], d = m[12 + i];
            return Row{a + b + c + d, kRounding * (std::abs(a) + std::abs(b) + std::abs(c) + std::abs(d))};
        };
        const Row x = row(0), y = row(1), z = row(2), w = row(3);
        if (!std::isfinite(x.value + x.error + y.value + y.error + z.value + z.error + w.value + w.error)) return {};
        std::size_t plane = 0;
        for (const Row& r : {x, y, z})
            for (const double sign : {1.0, -1.0}) outside[plane++] += sign * r.value - w.value > r.error + w.error;
        if (!(w.value > 2 * w.error)) {
            open = true;
            continue;
        }
        x0 = std::min(x0, x.value / w.value);
        x1 = std::max(x1, x.value / w.value);
        y0 = std::min(y0, y.value / w.value);
        y1 = std::max(y1, y.value / w.value);
        error = {std::max(error[0], x.error), std::max(error[1], y.error), std::max(error[2], w.error)};
        nearest = std::min(nearest, w.value);
    }
    for (const int n : outside)
        if (n == 8) return kNowhere;
    if (open || !(nearest > 2 * error[2])) return {};
    // |x / w - x' / w'| where x' and w' are the shader's, anywhere in the box: the worst of each over its corners.
    const double away = nearest - error[2];
    const double sx = kSlack + (error[0] + std::max(std::abs(x0), std::abs(x1)) * error[2]) / away;
    const double sy = kSlack + (error[1] + std::max(std::abs(y0), std::abs(y1)) * error[2]) / away;
    const gl::Box b{static_cast<float>(std::clamp(x0 - sx, -1.0, 1.0)), static_cast<float>(std::clamp(y0 - sy, -1.0, 1.0)),
                    static_cast<float>(std::clamp(x1 + sx, -1.0, 1.0)), static_cast<float>(std::clamp(y1 + sy, -1.0, 1.0))};
    return b.empty() ? kNowhere : b;
}

}  // namespace fovea::scene
