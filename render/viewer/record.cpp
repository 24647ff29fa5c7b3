#include "render/viewer/record.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::viewer {
namespace {
double milliseconds(Duration d) noexcept { return to_seconds(d) * 1e3; }
}  // namespace

double Kept::median() const {
    if (values_.empty()) return 0;
    auto v = values_;
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
}

void Record::rendered(const Frame& f) {
    ++summary_.frames;
    if (f.latched.live()) ++summary_.live_frames;
    frame_ms_.add(milliseconds(f.gpu_done - f.started));
    submit_ms_.add(milliseconds(f.submitted - f.latched.when()));
    done_ms_.add(milliseconds(f.gpu_done - f.latched.when()));
    shaded_sum_ += f.shaded();
}

void Record::extrapolated(const Frame& f) {
    ++summary_.extrapolated;
    between_ms_.add(milliseconds(f.gpu_done - f.submitted));
}

void Record::shown(const Frame& f, const present::Feedback& feedback) {
    switch (feedback.source) {
        case present::PhotonSource::measured: ++summary_.photons_measured; break;
        case present::PhotonSource::estimated: ++summary_.photons_estimated; break;
        case present::PhotonSource::simulated: break;
    }
    if (!feedback.shown) {
        ++summary_.never_shown;
        return;
    }
    if (f.extrapolated) {
        between_photon_ms_.add(milliseconds(feedback.photon - f.latched.when()));
        return;
    }
    error_ms_.add(std::abs(milliseconds(feedback.photon - f.asked)));
    photon_ms_.add(milliseconds(feedback.photon - f.latched.when()));
}

Summary Record::summary() const {
    Summary s = summary_;
    s.frame_ms = frame_ms_.median();
    s.latch_to_submit_ms = submit_ms_.median();
    s.latch_to_done_ms = done_ms_.median();
    s.latch_to_photon_ms = photon_ms_.median();
    s.extrapolation_ms = between_ms_.median();
    s.latch_to_photon_extrapolated_ms = between_photon_ms_.median();
    s.photon_error_ms = error_ms_.median();
    if (s.frames > 0) s.shaded = shaded_sum_ / static_cast<double>(s.frames);
    return s;
}

}  // namespace fovea::viewer
