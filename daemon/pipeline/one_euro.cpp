#include "daemon/pipeline/one_euro.hpp"

#include <cmath>
#include <numbers>

namespace fovea::pipeline {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
// Share of a step that a first-order low-pass of this cutoff takes in dt.
double share(double cutoff_hz, double dt_s) noexcept {
    const double r = 2 * std::numbers::pi * cutoff_hz * dt_s;
    return r / (r + 1);
}

}  // namespace

Direction<HeadFrame> OneEuro::update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head) noexcept {
    if (!any_) {
        any_ = true;
        last_ns_ = t_ns;
        velocity_ = {};
        return raw_ = out_ = gaze_dir_head;
    }
    const double dt = static_cast<double>(t_ns - last_ns_) * 1e-9;
    last_ns_ = t_ns;
    const Tangent raw_velocity = (1 / dt) * transport(raw_, out_, log_map(raw_, gaze_dir_head));
    raw_ = gaze_dir_head;
    velocity_ = velocity_ + share(settings_.derivative_cutoff_hz, dt) * (raw_velocity - velocity_);
    const double cutoff = settings_.min_cutoff_hz + settings_.beta_per_deg * length(velocity_) * kDegreesPerRadian;
    const Direction<HeadFrame> next = exp_map(out_, share(cutoff, dt) * log_map(out_, gaze_dir_head));
    velocity_ = transport(out_, next, velocity_);
    return out_ = next;
}

}  // namespace fovea::pipeline
