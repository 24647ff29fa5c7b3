#include "daemon/pipeline/predictor.hpp"

#include <cmath>

namespace fovea::pipeline {

Result<Predictor> Predictor::create(const PredictorSettings& s) {
    Predictor p;
    if (s.name == "hold")
        p.kind_ = Kind::hold;
    else if (s.name == "damped_velocity")
        p.kind_ = Kind::damped_velocity;
    else
        return fail("there is no predictor '" + s.name + "'");
    const double tau = s.time_constant_ms * 1e-3;
    for (std::size_t i = 0; i < kHorizons_ns.size(); ++i)
        p.damped_s_[i] = s.damping * tau * -std::expm1(-static_cast<double>(kHorizons_ns[i]) * 1e-9 / tau);
    return p;
}

void Predictor::update(const History& raw, const Classified& now, Direction<HeadFrame> filtered,
                       Displacements& out) noexcept {
    out.fill({});
    if (kind_ == Kind::hold || now.event == GazeEvent::fixation || raw.size() == 0) return;
    const Tangent velocity = now.event == GazeEvent::pursuit ? now.slow_rad_s : now.fast_rad_s;
    const Tangent v = transport(raw.direction(0), filtered, velocity);
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = damped_s_[i] * v;
        const double l = length(out[i]);
        if (l > kLargestPrediction_rad) out[i] = (kLargestPrediction_rad / l) * out[i];
    }
}

}  // namespace fovea::pipeline
