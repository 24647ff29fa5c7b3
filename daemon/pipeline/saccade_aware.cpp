#include "daemon/pipeline/saccade_aware.hpp"

#include <algorithm>

namespace fovea::pipeline {

Direction<HeadFrame> SaccadeAware::update(std::int64_t t_ns, Direction<HeadFrame> gaze, const Classified& now) noexcept {
    const double dt = static_cast<double>(t_ns - last_ns_) * 1e-9;
    last_ns_ = t_ns;
    if (!any_ || now.event == GazeEvent::saccade) {
        any_ = true;
        age_s_ = 0;
        return out_ = gaze;
    }
    age_s_ = std::min(age_s_ + dt, tau_s_);
    double share = dt / (age_s_ + dt);  // at first the plain mean, then the exponential one
    const double stir = now.threshold_deg_s > 0 ? std::min(now.speed_deg_s / now.threshold_deg_s, 1.0) : 0;
    share += (1 - share) * stir * stir;
    const Plane from(out_);
    return out_ = reached(from, share * way_to(from, gaze));
}

}  // namespace fovea::pipeline
