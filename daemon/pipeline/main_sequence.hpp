// The main sequence: how long and how fast a saccade of a given amplitude is.
//
// Source: fitted to 227 hand-labelled saccades of 0.5 to 30 degrees, EyeLink 1000 Hz (docs/pipeline.md); the forms are
// Carpenter 1988 (duration) and Baloh 1975 (peak speed). Input/Output: degrees, degrees per second, seconds.
#pragma once

#include <cmath>

namespace fovea::pipeline {

struct MainSequence {
    static constexpr double kPeak_deg_s = 530, kPeakScale_deg = 5.59;
    static constexpr double kDurationPerDegree_s = 2.43e-3, kDurationAtZero_s = 12.8e-3;
    static constexpr double kLargest_deg = 40;  // larger gaze shifts are made with the head

    [[nodiscard]] static double duration_s(double amplitude_deg) noexcept {
        return kDurationAtZero_s + kDurationPerDegree_s * amplitude_deg;
    }
    [[nodiscard]] static double peak_deg_s(double amplitude_deg) noexcept {
        return kPeak_deg_s * (1 - std::exp(-amplitude_deg / kPeakScale_deg));
    }
    // The amplitude that goes with a peak speed; kLargest_deg from the speed on at which the curve is flat.
    [[nodiscard]] static double amplitude_deg(double peak) noexcept {
        const double rest = 1 - peak / kPeak_deg_s;
        const double floor = std::exp(-kLargest_deg / kPeakScale_deg);
        return rest > floor ? -kPeakScale_deg * std::log(rest) : kLargest_deg;
    }
};

}  // namespace fovea::pipeline
