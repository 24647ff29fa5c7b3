#include "drivers/synthetic/saccade_profile.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::drivers::synthetic {
namespace {

double speed_of(double u, double a, double b) noexcept { return u <= 0 || u >= 1 ? 0 : std::pow(u, a) * std::pow(1 - u, b); }

// The peak of the density u^a (1-u)^b over its mean, for a = m n and b = (1 - m) n; rises with n.
double peak_over_mean(double n, double m) noexcept {
    const double a = m * n, b = n - a;
    return speed_of(m, a, b) * std::tgamma(n + 2) / (std::tgamma(a + 1) * std::tgamma(b + 1));
}

}  // namespace

SaccadeProfile::SaccadeProfile(double peak_ratio, double peak_at) noexcept {
    const double m = std::clamp(peak_at, 0.2, 0.8), wanted = std::clamp(peak_ratio, 1.2, 3.0);
    double least = 0.1, most = 30;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (least + most);
        (peak_over_mean(middle, m) < wanted ? least : most) = middle;
    }
    const double a = m * least, b = least - a, step = 1.0 / kPieces;
    for (std::size_t i = 0; i <= kPieces; ++i) {
        const double u = static_cast<double>(i) * step;
        speed_[i] = speed_of(u, a, b);
        if (i == 0) continue;
        way_[i] = way_[i - 1] + step / 6 * (speed_[i - 1] + 4 * speed_of(u - step / 2, a, b) + speed_[i]);
    }
    const double whole = way_[kPieces];
    for (double& w : way_) w /= whole;
    for (double& v : speed_) v /= whole;
}

double SaccadeProfile::at(double u) const noexcept {
    if (!(u > 0)) return 0;
    if (u >= 1) return 1;
    const double x = u * kPieces;
    const auto i = static_cast<std::size_t>(x);
    const double f = x - static_cast<double>(i), g = 1 - f, step = 1.0 / kPieces;
    // Cubic through both ends with the true speeds there.
    return way_[i] * (1 + 2 * f) * g * g + way_[i + 1] * f * f * (3 - 2 * f) +
           step * (speed_[i] * f * g * g - speed_[i + 1] * f * f * g);
}

}  // namespace fovea::drivers::synthetic
