#include "render/effects/lens.hpp"

#include <cmath>

namespace fovea::effects {
namespace {

constexpr double kCorner = 1.5;   // NDC: beyond the corner of a square view

double radial(const Lens& l, double r2) noexcept { return 1 + r2 * (l.k1 + r2 * (l.k2 + r2 * l.k3)); }
double slope(const Lens& l, double r2) noexcept { return 1 + r2 * (3 * l.k1 + r2 * (5 * l.k2 + r2 * 7 * l.k3)); }
double magnified(const Lens& l, Channel c) noexcept { return c == Channel::red ? l.red : c == Channel::blue ? l.blue : 1; }

}  // namespace

bool Lens::distorts() const noexcept { return k1 != 0 || k2 != 0 || k3 != 0 || p1 != 0 || p2 != 0 || red != 1 || blue != 1; }

const std::array<LensEntry, 9>& lens_entries() noexcept {
    static constexpr std::array<LensEntry, 9> kEntries{{
        {"k1", "radial, of r^2", &Lens::k1, -1, 2},
        {"k2", "radial, of r^4", &Lens::k2, -1, 2},
        {"k3", "radial, of r^6", &Lens::k3, -1, 2},
        {"p1", "tangential", &Lens::p1, -0.1, 0.1},
        {"p2", "tangential", &Lens::p2, -0.1, 0.1},
        {"x", "middle of the left eye's lens, NDC", &Lens::x, -0.5, 0.5},
        {"y", "middle of the lens, NDC", &Lens::y, -0.5, 0.5},
        {"red", "magnification of red against green", &Lens::red, 0.9, 1.1},
        {"blue", "magnification of blue against green", &Lens::blue, 0.9, 1.1},
    }};
    return kEntries;
}

Result<void> check_lens(const Lens& lens, const std::string& where) {
    for (const LensEntry& e : lens_entries())
        if (!(lens.*e.value >= e.least && lens.*e.value <= e.most))
            return fail("'lens." + std::string(e.name) + "' is out of range", where, "a number from " + std::to_string(e.least) + " to " + std::to_string(e.most));
    for (double r = 0; r < kCorner; r += 0.01)
        if (!(slope(lens, r * r) > 0.05)) return fail("the lens folds the picture over itself " + std::to_string(r) + " NDC from its middle", where, "use larger coefficients");
    return {};
}

Lens mirrored(const Lens& lens) noexcept {
    Lens l = lens;
    l.x = -l.x;
    l.p2 = -l.p2;
    return l;
}

NdcPoint rendered_of(const Lens& l, NdcPoint panel, double aspect, Channel channel) noexcept {
    const double x = (panel.x - l.x) * aspect, y = panel.y - l.y, r2 = x * x + y * y, k = radial(l, r2), m = magnified(l, channel);
    const double dx = 2 * l.p1 * x * y + l.p2 * (r2 + 2 * x * x), dy = l.p1 * (r2 + 2 * y * y) + 2 * l.p2 * x * y;
    return {l.x + m * (x * k + dx) / aspect, l.y + m * (y * k + dy)};
}

std::optional<NdcPoint> panel_of(const Lens& l, NdcPoint rendered, double aspect, Channel channel) noexcept {
    // Newton's method from the middle outward; the derivatives by differences.
    NdcPoint p{l.x + (rendered.x - l.x) * 0.7, l.y + (rendered.y - l.y) * 0.7};
    constexpr double kStep = 1e-7;
    for (int i = 0; i < 60; ++i) {
        const NdcPoint f = rendered_of(l, p, aspect, channel);
        const double ex = f.x - rendered.x, ey = f.y - rendered.y;
        if (!(std::abs(ex) < 1e9 && std::abs(ey) < 1e9)) return std::nullopt;
        if (std::hypot(ex, ey) < 1e-12) return p;
        const NdcPoint fx = rendered_of(l, {p.x + kStep, p.y}, aspect, channel), fy = rendered_of(l, {p.x, p.y + kStep}, aspect, channel);
        const double a = (fx.x - f.x) / kStep, b = (fy.x - f.x) / kStep, c = (fx.y - f.y) / kStep, d = (fy.y - f.y) / kStep, det = a * d - b * c;
        if (!(std::abs(det) > 1e-9)) return std::nullopt;
        double sx = (d * ex - b * ey) / det, sy = (a * ey - c * ex) / det;
        const double length = std::hypot(sx, sy);
        if (length > 0.5) sx *= 0.5 / length, sy *= 0.5 / length;
        p.x -= sx;
        p.y -= sy;
    }
    const NdcPoint f = rendered_of(l, p, aspect, channel);
    if (std::hypot(f.x - rendered.x, f.y - rendered.y) < 1e-9) return p;
    return std::nullopt;
}

}  // namespace fovea::effects
