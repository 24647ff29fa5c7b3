// Which samples belong to a blink or a loss, with guards on both sides. Causal.
//
//            invalid sample            run >= min_duration, or eye closed           run > max_duration
//   open -----------------> drop_out ---------------------------------> blink ------------------------> lost
//     ^                        |                                          |                              |
//     +---- valid sample ------+                                          +-- valid --> guard <- valid --+
//     +------------------------------ guard_after of valid samples -------------------------+
//
// Source: blinks carry artefacts of up to 42 degrees before and after the samples that the tracker itself marks
// (docs/pipeline.md). Threads: one at a time; noexcept, no allocation.
#pragma once

#include <cstdint>

#include "daemon/pipeline/settings.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::pipeline {

enum class GateState : std::uint8_t {
    open,      // the sample may be used
    drop_out,  // not usable; too short to be a blink so far
    blink,     // eye closed, or guard after it
    lost,
};

class BlinkGate {
public:
    explicit BlinkGate(const BlinkSettings& settings) noexcept;

    // For each sample in order. `finite` is false where the validator found no direction.
    GateState update(std::int64_t t_ns, bool finite, const EyeState& eye) noexcept;
    void reset() noexcept;
    [[nodiscard]] GateState state() const noexcept { return state_; }

private:
    double openness_closed_, min_confidence_;
    std::int64_t min_ns_, max_ns_, guard_after_ns_;
    GateState state_ = GateState::open;
    bool any_ = false;
    bool bad_ = false;              // in an invalid run
    std::int64_t last_good_ns_ = 0; // before the run
    std::int64_t guard_from_ns_ = 0;
    bool guarding_ = false;
};

}  // namespace fovea::pipeline
