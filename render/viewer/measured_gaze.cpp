#include "render/viewer/measured_gaze.hpp"

#include <algorithm>

namespace fovea::viewer {

void MeasuredGaze::add(const Latched& measured) noexcept {
    if (!measured.live()) return;
    const Instant exposed = instant_from_ns(measured.info.exposed_ns);
    if (count_ > 0 && exposed <= samples_[(count_ - 1) % samples_.size()].exposed) return;   // the same sample as before
    Sample& s = samples_[count_++ % samples_.size()];
    s.exposed = exposed;
    for (std::size_t i = 0; i < kEyes; ++i) s.points[i] = {measured.focals[i].x_ndc, measured.focals[i].y_ndc};
}

std::optional<MeasuredGaze::Points> MeasuredGaze::at(Instant instant) const noexcept {
    const std::size_t kept = std::min(count_, samples_.size());
    for (std::size_t back = 1; back < kept; ++back) {
        const Sample &after = samples_[(count_ - back) % samples_.size()], &before = samples_[(count_ - back - 1) % samples_.size()];
        if (after.exposed < instant) return std::nullopt;   // not yet
        if (before.exposed > instant) continue;
        if (after.exposed - before.exposed > kGap) return std::nullopt;
        const double t = to_seconds(instant - before.exposed) / to_seconds(after.exposed - before.exposed);
        Points p;
        for (std::size_t i = 0; i < kEyes; ++i)
            p[i] = {before.points[i].x + t * (after.points[i].x - before.points[i].x), before.points[i].y + t * (after.points[i].y - before.points[i].y)};
        return p;
    }
    return std::nullopt;
}

}  // namespace fovea::viewer
