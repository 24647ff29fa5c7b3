// How a saccade covers its way: a velocity profile with a given peak and a given moment of the peak.
//
// Shape: velocity ~ u^a (1-u)^b on [0, 1], the beta density. It begins and ends at rest, its peak over its mean fixes
// a + b, the moment of its peak fixes a / (a + b). Peak over mean 1.5 is a parabola, 1.875 minimum jerk.
// Source: the ratio and its constancy: Harwood, Mezey and Harris, J. Neurosci. 19(20), 1999; skewness that grows with
// duration: Van Opstal and Van Gisbergen, Vision Res. 27(5), 1987.
// Cost: 130 powers to make, 10 ns to ask. Threads: plain data; no allocation.
#pragma once

#include <array>

namespace fovea::drivers::synthetic {

class SaccadeProfile {
public:
    SaccadeProfile() noexcept : SaccadeProfile(1.65, 0.5) {}
    // peak_ratio in [1.2, 3]: peak over mean speed; peak_at in [0.2, 0.8]: its moment over the duration.
    SaccadeProfile(double peak_ratio, double peak_at) noexcept;

    // The share of the way after the share u of the time: 0 before 0, 1 after 1, rising.
    [[nodiscard]] double at(double u) const noexcept;

private:
    static constexpr std::size_t kPieces = 64;
    std::array<double, kPieces + 1> way_{}, speed_{};
};

}  // namespace fovea::drivers::synthetic
