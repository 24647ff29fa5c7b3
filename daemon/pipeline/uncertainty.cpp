#include "daemon/pipeline/uncertainty.hpp"

#include <algorithm>
#include <numbers>

namespace fovea::pipeline {

Radii blind_radii(std::int64_t age_ns) noexcept {
    constexpr double kDegree = std::numbers::pi / 180;
    const double share = std::clamp(static_cast<double>(age_ns) / 300e6, 0.0, 1.0);
    return {(1.1 + share * (18 - 1.1)) * kDegree, (3.3 + share * (47 - 3.3)) * kDegree};
}

}  // namespace fovea::pipeline
