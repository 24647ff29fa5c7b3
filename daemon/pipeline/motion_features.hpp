// The recent motion of one eye as a few numbers that do not depend on where it looks, which way it moves, or how fast
// the tracker samples: how far it came along its present direction within each of several lags.
//
// Input: the raw history. Output: degrees. Lag: none. Cost: about 200 ns; noexcept, no allocation.
#pragma once

#include <array>

#include "daemon/pipeline/history.hpp"

namespace fovea::pipeline {

inline constexpr std::array<std::int64_t, 10> kLags_ns = {2'000'000,  4'000'000,  7'000'000,  11'000'000, 16'000'000,
                                                          24'000'000, 36'000'000, 54'000'000, 80'000'000, 110'000'000};

struct MotionFeatures {
    bool usable = false;   // at least two samples
    Tangent along;         // unit vector: where the eye heads, tangent plane of the newest raw gaze
    double speed_deg_s = 0;
    double interval_ms = 0;  // between the last samples, mean
    std::array<double, kLags_ns.size()> came_deg{};    // along `along`; interpolated; the oldest sample stands for older
    std::array<double, kLags_ns.size()> across_deg{};  // across it, size
};

// `velocity` is the present one (Classified::fast_rad_s).
[[nodiscard]] MotionFeatures motion_features(const History& raw, Tangent velocity_rad_s) noexcept;

}  // namespace fovea::pipeline
