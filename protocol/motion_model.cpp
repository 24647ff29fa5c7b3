#include "protocol/motion_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fovea {
namespace {

constexpr double kPi = std::numbers::pi;

// All horizons are multiples of this, so that the interval that holds a time is one table look-up.
constexpr std::int64_t kStep_ns = 5'000'000;
constexpr auto kIntervals = [] {
    std::array<std::uint8_t, kHorizons_ns.back() / kStep_ns> table{};
    for (std::size_t step = 0; step < table.size(); ++step)
        for (std::size_t i = 0; i + 1 < kHorizons_ns.size(); ++i)
            if (kHorizons_ns[i] <= static_cast<std::int64_t>(step) * kStep_ns) table[step] = static_cast<std::uint8_t>(i);
    return table;
}();
static_assert(std::ranges::all_of(kHorizons_ns, [](auto h) { return h % kStep_ns == 0; }));
constexpr auto kInverseLengths = [] {
    std::array<double, kHorizons_ns.size() - 1> inverse{};
    for (std::size_t i = 0; i < inverse.size(); ++i)
        inverse[i] = 1.0 / static_cast<double>(kHorizons_ns[i + 1] - kHorizons_ns[i]);
    return inverse;
}();

// Models cross a process boundary: any int64 may stand in an Instant, so differences saturate.
Duration age_of(Instant reference, Instant t) noexcept {
    std::int64_t ns = 0;
    if (__builtin_sub_overflow(to_ns(t), to_ns(reference), &ns))
        ns = t > reference ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
    return Duration{ns};
}

std::int64_t clamped_age(Instant reference, Instant t) noexcept {
    return std::clamp<std::int64_t>(age_of(reference, t).count(), 0, kHorizons_ns.back());
}
std::size_t interval_of(std::int64_t dt) noexcept {
    return dt < kHorizons_ns.back() ? kIntervals[static_cast<std::size_t>(dt / kStep_ns)] : kHorizons_ns.size() - 2;
}

// exp_map() without the libm calls that a displacement of a few degrees does not need.
Direction<HeadFrame> displaced(Direction<HeadFrame> from, double u, double v) noexcept {
    const double a2 = u * u + v * v;
    double c, s;   // cos a, sin(a)/a
    if (a2 < 0.01) {
        // Taylor to a^8 and a^9: below 3e-17 of error at 0.1 rad, where most displacements are.
        c = 1 + a2 * (-1.0 / 2 + a2 * (1.0 / 24 + a2 * (-1.0 / 720 + a2 / 40320)));
        s = 1 + a2 * (-1.0 / 6 + a2 * (1.0 / 120 + a2 * (-1.0 / 5040 + a2 / 362880)));
    } else if (a2 < 0.25) {
        // To a^14 and a^15: below 2e-18 of error at half a radian.
        c = 1 + a2 * (-1.0 / 2 + a2 * (1.0 / 24 + a2 * (-1.0 / 720 + a2 * (1.0 / 40320 + a2 * (-1.0 / 3628800 +
            a2 * (1.0 / 479001600 - a2 / 87178291200))))));
        s = 1 + a2 * (-1.0 / 6 + a2 * (1.0 / 120 + a2 * (-1.0 / 5040 + a2 * (1.0 / 362880 + a2 * (-1.0 / 39916800 +
            a2 * (1.0 / 6227020800 - a2 / 1307674368000))))));
    } else {
        const double a = std::sqrt(a2);
        c = std::cos(a);
        s = std::sin(a) / a;
    }
    const TangentBasis<HeadFrame> basis(from);
    const Vec3<HeadFrame> p = c * from.vec() + (s * u) * basis.u + (s * v) * basis.v;
    return {p.x, p.y, p.z};
}

Direction<HeadFrame> unit(Direction<HeadFrame> d) noexcept {
    const double n2 = dot(d.vec(), d.vec());
    if (std::abs(n2 - 1) < 1e-9) return d;
    return Direction<HeadFrame>::from(d.vec()).value_or(Direction<HeadFrame>{});
}

// A radius that means nothing becomes "anywhere".
double radius(double r) noexcept { return r >= 0 ? std::min(r, kPi) : kPi; }

}  // namespace

std::size_t horizon_before(Instant reference, Instant t) noexcept { return interval_of(clamped_age(reference, t)); }

GazeEstimate evaluate(const EyeMotion& motion, Instant t) noexcept {
    GazeEstimate estimate;
    estimate.event = motion.event;
    estimate.tracked = motion.ever_valid ? 1 : 0;

    const std::int64_t dt = clamped_age(motion.reference, t);
    const std::size_t i = interval_of(dt);
    const HorizonPoint &a = motion.horizons[i], &b = motion.horizons[i + 1];
    const double f = static_cast<double>(dt - kHorizons_ns[i]) * kInverseLengths[i];
    const auto mix = [f](float from, float to) {
        return (1 - f) * static_cast<double>(from) + f * static_cast<double>(to);
    };

    double u = mix(a.du_rad, b.du_rad), v = mix(a.dv_rad, b.dv_rad);
    // Also catches NaN: such a displacement is none, and the eye may be anywhere.
    const bool sane = u * u + v * v <= kPi * kPi;
    if (!sane) u = v = 0;
    estimate.gaze_dir_head = displaced(unit(motion.gaze_dir_head), u, v);
    estimate.radius68_rad = sane ? radius(mix(a.radius68_rad, b.radius68_rad)) : kPi;
    estimate.radius95_rad = sane ? radius(mix(a.radius95_rad, b.radius95_rad)) : kPi;
    return estimate;
}

}  // namespace fovea
