#include "drivers/camera/ellipse_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fovea::drivers::camera {

namespace {

constexpr double kLeastAxis = 0.5;   // pixels
using Row = std::array<double, 3>;
using Matrix = std::array<Row, 3>;

Row cross(const Row& a, const Row& b) noexcept {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Row& a, const Row& b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The real roots of x^3 - t x^2 + s x - d; how many.
int roots(double t, double s, double d, Row& out) noexcept {
    const double p = s - t * t / 3, q = -2 * t * t * t / 27 + t * s / 3 - d, third = t / 3;   // x = y + t/3: y^3 + p y + q
    const double half = q / 2, discriminant = half * half + p * p * p / 27;
    if (discriminant > 0) {
        const double root = std::sqrt(discriminant), u = std::cbrt(-half + (half > 0 ? -root : root));
        out[0] = (u != 0 ? u - p / (3 * u) : 0) + third;
        return 1;
    }
    const double size = 2 * std::sqrt(std::max(0.0, -p / 3)), cosine = size > 0 ? std::clamp(3 * q / (p * size), -1.0, 1.0) : 1;
    const double turn = std::acos(cosine) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
        double x = size * std::cos(turn - 2 * std::numbers::pi * static_cast<double>(k) / 3) + third;
        // Where two roots are close the arc cosine knows them to eight digits only.
        if (const double slope = (3 * x - 2 * t) * x + s; slope != 0) x -= (((x - t) * x + s) * x - d) / slope;
        out[k] = x;
    }
    return 3;
}

// What `m` takes to nothing: the longest product of two of its rows.
Row kernel(const Matrix& m) noexcept {
    Row best{};
    double most = -1;
    for (const auto& v : {cross(m[0], m[1]), cross(m[0], m[2]), cross(m[1], m[2])})
        if (const double n = dot(v, v); n > most) { most = n; best = v; }
    return best;
}

}  // namespace

std::optional<PupilEllipse> fit_ellipse(std::span<const EdgePoint> points) noexcept {
    if (points.size() < 6) return std::nullopt;
    const auto n = static_cast<double>(points.size());
    double mx = 0, my = 0, spread = 0;
    for (const EdgePoint& p : points) mx += p.x, my += p.y;
    mx /= n, my /= n;
    for (const EdgePoint& p : points) spread += (p.x - mx) * (p.x - mx) + (p.y - my) * (p.y - my);
    const double unit = std::sqrt(spread / n);
    if (!(unit > 1e-6)) return std::nullopt;
    // Sums of x^i y^j; those of x and y are nothing by the choice of the origin.
    double x2 = 0, xy = 0, y2 = 0, x3 = 0, x2y = 0, xy2 = 0, y3 = 0, x4 = 0, x3y = 0, x2y2 = 0, xy3 = 0, y4 = 0;
    const double scale = 1 / unit;
    for (const EdgePoint& p : points) {
        const double x = (p.x - mx) * scale, y = (p.y - my) * scale, xx = x * x, xp = x * y, yy = y * y;
        x2 += xx, xy += xp, y2 += yy;
        x3 += xx * x, x2y += xx * y, xy2 += x * yy, y3 += yy * y;
        x4 += xx * xx, x3y += xx * xp, x2y2 += xx * yy, xy3 += xp * yy, y4 += yy * yy;
    }
    const double det = x2 * y2 - xy * xy;
    if (!(det > 1e-12 * n * n)) return std::nullopt;   // on a line
    // The linear part that goes with each quadratic one: T = -S3^-1 S2^T.
    const Matrix s2 = {{{x3, x2y, x2}, {x2y, xy2, xy}, {xy2, y3, y2}}};
    Matrix t;
    for (std::size_t k = 0; k < 3; ++k)
        t[k] = {-(y2 * s2[k][0] - xy * s2[k][1]) / det, -(x2 * s2[k][1] - xy * s2[k][0]) / det, -s2[k][2] / n};
    const Matrix s1 = {{{x4, x3y, x2y2}, {x3y, x2y2, xy3}, {x2y2, xy3, y4}}};
    Matrix reduced;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) reduced[i][k] = s1[i][k] + dot(s2[i], t[k]);
    // With the constraint 4ac - b^2 = 1.
    Matrix m;
    for (std::size_t k = 0; k < 3; ++k) m[0][k] = reduced[2][k] / 2, m[1][k] = -reduced[1][k], m[2][k] = reduced[0][k] / 2;
    const double trace = m[0][0] + m[1][1] + m[2][2];
    const double minors = m[0][0] * m[1][1] - m[0][1] * m[1][0] + m[0][0] * m[2][2] - m[0][2] * m[2][0] + m[1][1] * m[2][2] - m[1][2] * m[2][1];
    Row lambda{};
    const int found = roots(trace, minors, dot(m[0], cross(m[1], m[2])), lambda);
    Row q{};
    double most = 0;
    for (int k = 0; k < found; ++k) {
        Matrix shifted = m;
        for (std::size_t i = 0; i < 3; ++i) shifted[i][i] -= lambda[static_cast<std::size_t>(k)];
        const Row v = kernel(shifted);
        // One of them alone is an ellipse.
        if (const double size = dot(v, v), ellipse = size > 0 ? (4 * v[0] * v[2] - v[1] * v[1]) / size : 0; ellipse > most) { most = ellipse; q = v; }
    }
    if (!(most > 1e-12)) return std::nullopt;
    const double a = q[0], b = q[1], c = q[2];
    const double d = a * t[0][0] + b * t[1][0] + c * t[2][0], e = a * t[0][1] + b * t[1][1] + c * t[2][1], f = a * t[0][2] + b * t[1][2] + c * t[2][2];
    const double below = b * b - 4 * a * c, x0 = (2 * c * d - b * e) / below, y0 = (2 * a * e - b * d) / below;
    const double level = -(f + (d * x0 + e * y0) / 2);   // of the quadratic form, along the ellipse
    const double mean = (a + c) / 2 / level, half = std::hypot((a - c) / 2, b / 2) / std::abs(level);
    if (!(mean - half > 0)) return std::nullopt;
    const double sign = level > 0 ? 1 : -1;
    const PupilEllipse out = {mx + x0 * unit, my + y0 * unit, unit / std::sqrt(mean - half), unit / std::sqrt(mean + half),
                              half > 1e-12 * mean ? 0.5 * std::atan2(-sign * b, sign * (c - a)) : 0};
    if (!std::isfinite(out.x) || !std::isfinite(out.y) || !std::isfinite(out.a) || !(out.b > kLeastAxis)) return std::nullopt;
    return out;
}

}  // namespace fovea::drivers::camera
