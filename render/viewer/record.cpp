#include "render/viewer/record.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

namespace fovea::viewer {
namespace {
double milliseconds(Duration d) noexcept { return to_seconds(d) * 1e3; }

double angle_deg(const float* a, const float* b) noexcept {   // unit vectors
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return 2 * std::asin(std::min(std::sqrt(x * x + y * y + z * z) / 2, 1.0)) * 180 / 3.14159265358979323846;
}
}  // namespace

double Kept::quantile(double q) const {
    if (values_.empty()) return 0;
    auto v = values_;
    const auto n = static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1) + 0.5);
    std::nth_element(v.begin(), v.begin() + n, v.end());
    return v[static_cast<std::size_t>(n)];
}

void Record::rendered(const Frame& f) {
    ++summary_.frames;
    summary_.early_used = f.uses_early;
    frame_ms_.add(milliseconds(f.gpu_done - f.started));
    for (const auto& [latched, to] : {std::pair(&f.late, &late_), std::pair(&f.early, &early_)}) {
        to->submit_ms.add(milliseconds(f.submitted - latched->when()));
        to->gpu_done_ms.add(milliseconds(f.gpu_done - latched->when()));
    }
    if (f.latched().live()) {
        ++summary_.live_frames;
        if (f.latched().source == GazeSource::mouse) ++summary_.mouse_frames;
        apart_deg_.add(angle_deg(f.late.focals[0].gaze_dir_view, f.early.focals[0].gaze_dir_view));
    }
    shaded_sum_ += f.shaded();
    draws_sum_ += f.cost.draws;
    summary_.views = gl::view_drawing_name(f.cost.drawing);
    summary_.samples = f.cost.samples;
    if (*f.cost.executor == 0) return;
    const auto same = [&](const Way& w) { return std::strcmp(w.name, f.cost.executor) == 0; };
    auto way = std::ranges::find_if(ways_, same);
    if (way == ways_.end()) way = ways_.insert(way, {f.cost.executor, f.cost.why});
    way->why = f.cost.why;
    way->last = f.number;
    ++way->frames;
}

void Record::extrapolated(const Frame& f) {
    ++summary_.extrapolated;
    between_ms_.add(milliseconds(f.gpu_done - f.submitted));
}

void Record::shown(const Frame& f, const present::Feedback& feedback) {
    if (!feedback.shown) {
        ++summary_.never_shown;
        return;
    }
    switch (feedback.source) {
        case present::PhotonSource::measured: ++summary_.photons_measured; break;
        case present::PhotonSource::estimated: ++summary_.photons_estimated; break;
        case present::PhotonSource::simulated: ++summary_.photons_simulated; break;
    }
    if (f.extrapolated) {
        between_photon_ms_.add(milliseconds(feedback.photon - f.latched().when()));
        return;
    }
    error_ms_.add(std::abs(milliseconds(feedback.photon - f.asked)));
    late_.photon_ms.add(milliseconds(feedback.photon - f.late.when()));
    early_.photon_ms.add(milliseconds(feedback.photon - f.early.when()));
    if (f.latched().live()) motion_to_photon_ms_.add(milliseconds(feedback.photon - instant_from_ns(f.latched().info.exposed_ns)));
}

Summary Record::summary() const {
    Summary s = summary_;
    s.frame_ms = frame_ms_.median();
    s.late = late_.medians();
    s.early = early_.medians();
    s.motion_to_photon_ms = motion_to_photon_ms_.median();
    s.apart_deg = apart_deg_.median();
    s.apart_p95_deg = apart_deg_.quantile(0.95);
    s.extrapolation_ms = between_ms_.median();
    s.latch_to_photon_extrapolated_ms = between_photon_ms_.median();
    s.photon_error_ms = error_ms_.median();
    std::vector<Way> ways = ways_;
    std::ranges::sort(ways, std::greater{}, &Way::last);
    for (const Way& w : ways) s.executors.push_back({w.name, w.why, w.frames});
    if (s.frames > 0) {
        s.shaded = shaded_sum_ / static_cast<double>(s.frames);
        s.draws = draws_sum_ / static_cast<double>(s.frames);
    }
    return s;
}

}  // namespace fovea::viewer
