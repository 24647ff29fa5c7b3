#include "daemon/pipeline/motion_features.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::pipeline {

MotionFeatures motion_features(const History& raw, Tangent velocity_rad_s) noexcept {
    MotionFeatures f;
    const std::size_t n = raw.size();
    const double speed = std::sqrt(velocity_rad_s.u * velocity_rad_s.u + velocity_rad_s.v * velocity_rad_s.v);
    if (n < 2 || !(speed > 1e-9)) return f;
    f.usable = true;
    f.speed_deg_s = speed * kDegreesPerRadian;
    f.along = (1 / speed) * velocity_rad_s;
    const std::int64_t t0 = raw.time_ns(0);
    const std::size_t few = std::min<std::size_t>(n - 1, 4);
    f.interval_ms = static_cast<double>(t0 - raw.time_ns(few)) * 1e-6 / static_cast<double>(few);
    std::size_t i = 0, placed = 0;   // the newest sample that is at least as old as the lag
    Tangent older, newer;            // where it and the one after it lie
    for (std::size_t k = 0; k < kLags_ns.size(); ++k) {
        while (i + 1 < n && t0 - raw.time_ns(i) < kLags_ns[k]) ++i;
        if (i != placed) {
            newer = i == placed + 1 ? older : nearby(raw.plane(), raw.direction(i - 1));
            older = nearby(raw.plane(), raw.direction(i));
            placed = i;
        }
        Tangent p = older;
        const std::int64_t age = t0 - raw.time_ns(i);
        if (age > kLags_ns[k]) {  // then i > 0
            const std::int64_t since = t0 - raw.time_ns(i - 1);
            const double share = static_cast<double>(kLags_ns[k] - since) / static_cast<double>(age - since);
            p = newer + share * (older - newer);
        }
        f.came_deg[k] = -(p.u * f.along.u + p.v * f.along.v) * kDegreesPerRadian;
        f.across_deg[k] = std::fabs(p.u * f.along.v - p.v * f.along.u) * kDegreesPerRadian;
    }
    return f;
}

}  // namespace fovea::pipeline
