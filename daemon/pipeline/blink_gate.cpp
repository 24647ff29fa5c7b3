#include "daemon/pipeline/blink_gate.hpp"

namespace fovea::pipeline {

BlinkGate::BlinkGate(const BlinkSettings& s) noexcept
    : openness_closed_{s.openness_closed},
      min_confidence_{s.min_confidence},
      min_ns_{seconds(s.min_duration_ms * 1e-3).count()},
      max_ns_{seconds(s.max_duration_ms * 1e-3).count()},
      guard_after_ns_{seconds(s.guard_after_ms * 1e-3).count()} {}

void BlinkGate::reset() noexcept {
    state_ = GateState::open;
    any_ = bad_ = guarding_ = false;
}

GateState BlinkGate::update(std::int64_t t_ns, bool finite, const EyeState& eye) noexcept {
    // Comparisons with a value that the device did not give (NaN) are false: no evidence.
    const bool closed = eye.openness < openness_closed_ || eye.pupil_mm <= 0;
    const bool bad = !finite || !eye.valid || closed || eye.confidence < min_confidence_;
    if (bad) {
        if (!bad_ && !any_) last_good_ns_ = t_ns;  // starts invalid: the run counts from here
        any_ = true;
        bad_ = true;
        guarding_ = false;
        const std::int64_t run_ns = t_ns - last_good_ns_;
        if (run_ns > max_ns_)
            state_ = GateState::lost;
        else if (closed || run_ns >= min_ns_ || state_ == GateState::blink)
            state_ = GateState::blink;
        else if (state_ != GateState::lost)
            state_ = GateState::drop_out;
        return state_;
    }
    any_ = true;
    if (bad_) {  // the run ends here
        bad_ = false;
        guarding_ = state_ != GateState::drop_out;
        guard_from_ns_ = t_ns;
    }
    if (guarding_ && t_ns - guard_from_ns_ < guard_after_ns_) return state_;
    guarding_ = false;
    last_good_ns_ = t_ns;
    return state_ = GateState::open;
}

}  // namespace fovea::pipeline
