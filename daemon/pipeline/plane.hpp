// The tangent plane at one gaze, kept with its basis, so that what happens several times per sample is worked out once; and the
// maps of sphere.hpp as the steady loop needs them.
//
// Up to kSmall_rad, a gaze's way between two samples in all but saccades, they need no trigonometric function: the series are
// exact to a few units in the last place, and run once in milliseconds a call into the mathematics library costs more than
// the arithmetic (docs/input_latency.md). Beyond, they are those of sphere.hpp.
//
// Threads: pure functions and plain data; noexcept, no allocation.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "protocol/frames.hpp"
#include "protocol/sphere.hpp"

namespace fovea::pipeline {

inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

struct Plane {
    Direction<HeadFrame> at;
    TangentBasis<HeadFrame> basis{at};

    Plane() noexcept = default;
    explicit Plane(Direction<HeadFrame> gaze) noexcept : at{gaze} {}
};

// Without care for values whose squares overflow or vanish: what the pipeline measures lies between.
[[nodiscard]] inline double norm(Tangent t) noexcept { return std::sqrt(t.u * t.u + t.v * t.v); }

// The rare cases of what follows, kept out of the way.
namespace far {
[[gnu::noinline, gnu::cold]] std::optional<Direction<HeadFrame>> unit(Vec3<HeadFrame> v) noexcept;
[[gnu::noinline, gnu::cold]] Tangent way_to(const Plane& from, Direction<HeadFrame> to) noexcept;
[[gnu::noinline, gnu::cold]] Direction<HeadFrame> reached(const Plane& from, Tangent t) noexcept;
[[gnu::noinline, gnu::cold]] Tangent nearby(Tangent chord) noexcept;   // beyond a right angle: at the rim
}  // namespace far

// Direction::from(), whose own length cares for all values there are.
[[nodiscard]] inline std::optional<Direction<HeadFrame>> unit(Vec3<HeadFrame> v) noexcept {
    const double squared = dot(v, v);
    if (!(squared > 1e-280 && squared < 1e280)) [[unlikely]] return far::unit(v);
    const double n = std::sqrt(squared);
    return Direction<HeadFrame>{v.x / n, v.y / n, v.z / n};
}

inline constexpr double kSmall_rad = 0.1;

// log_map() and exp_map() from a plane.
[[nodiscard]] inline Tangent way_to(const Plane& from, Direction<HeadFrame> to) noexcept {
    const double u = dot(from.basis.u, to.vec()), v = dot(from.basis.v, to.vec());
    const double s2 = u * u + v * v;   // sin^2 of the angle
    if (!(s2 < kSmall_rad * kSmall_rad && dot(from.at.vec(), to.vec()) > 0)) [[unlikely]] return far::way_to(from, to);
    const double k = 1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * (945.0 / 42240 + s2 * (10395.0 / 599040))))));
    return {k * u, k * v};
}
[[nodiscard]] inline Direction<HeadFrame> reached(const Plane& from, Tangent t) noexcept {
    const double x = t.u * t.u + t.v * t.v;   // angle^2
    if (!(x < kSmall_rad * kSmall_rad)) [[unlikely]] return far::reached(from, t);
    const double s = 1 + x * (-1.0 / 6 + x * (1.0 / 120 + x * (-1.0 / 5040 + x * (1.0 / 362880))));   // sin(angle) / angle
    const double c = 1 + x * (-1.0 / 2 + x * (1.0 / 24 + x * (-1.0 / 720 + x * (1.0 / 40320))));
    return unit(c * from.at.vec() + (s * t.u) * from.basis.u + (s * t.v) * from.basis.v).value_or(from.at);
}

// Where `d` lies as seen from `at`, in the plane that `basis` (the basis at `at`) spans. Within 1e-4 of log_map() up
// to 40 degrees and much cheaper; beyond 90 degrees it is pulled to the rim, so it stays finite and bounded by pi/2.
[[nodiscard]] inline Tangent nearby(const TangentBasis<HeadFrame>& basis, Direction<HeadFrame> at, Direction<HeadFrame> d) noexcept {
    const Tangent chord{dot(basis.u, d.vec()), dot(basis.v, d.vec())};
    const double s2 = chord.u * chord.u + chord.v * chord.v;  // sin^2 of the angle
    if (!(dot(at.vec(), d.vec()) > 0)) [[unlikely]] return far::nearby(chord);
    // asin(s)/s as a series; within half a degree, where a fixation stays, three terms leave 5e-14 of the angle.
    if (s2 < 1e-4) return (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40))) * chord;
    // At 40 degrees (s2 = 0.41) the next term is 2e-4 of the angle.
    const double k = 1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * 0.0224))));
    return k * chord;
}
[[nodiscard]] inline Tangent nearby(const Plane& plane, Direction<HeadFrame> d) noexcept { return nearby(plane.basis, plane.at, d); }

// transport() of sphere.hpp between two planes that are known.
[[nodiscard]] inline Tangent carried(const Plane& from, const Plane& to, Tangent t) noexcept {
    const Vec3<HeadFrame> p = t.u * from.basis.u + t.v * from.basis.v;
    const double c = 1.0 + dot(from.at.vec(), to.at.vec());
    const Vec3<HeadFrame> q = c > 1e-12 ? p - (dot(p, to.at.vec()) / c) * (from.at.vec() + to.at.vec()) : p;
    return {dot(q, to.basis.u), dot(q, to.basis.v)};
}

}  // namespace fovea::pipeline
