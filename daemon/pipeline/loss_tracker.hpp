// Keeps the fields of EyeMotion that the signal-loss policy reads (protocol/loss_policy.hpp).
//
// A gap within `hold` leaves no trace. A longer one sets lost_before; it clears when a valid run has lasted `recover`
// and the way back (`ease`) is complete, because until then the client is still easing. A loss that interrupts the way
// back is dated so that the client goes on from where it was: nothing jumps.
//
// Threads: one at a time; noexcept, no allocation.
#pragma once

#include "protocol/loss_policy.hpp"

namespace fovea::pipeline {

class LossTracker {
public:
    explicit LossTracker(const LossPolicy& policy) noexcept : policy_{policy} {}

    // A sample that is used: its exposure and the gaze to be held should it be the last for a while.
    void valid(Instant exposed, Direction<HeadFrame> gaze_dir_head) noexcept;
    // A sample that is not used: ends the run that recovery counts.
    void invalid() noexcept { interrupted_ = true; }
    // The gaze shown through the present gap differs from that of the last valid sample (the guard before a blink).
    void hold(Direction<HeadFrame> gaze_dir_head) noexcept { last_gaze_ = gaze_dir_head; }
    void reset() noexcept { *this = LossTracker{LossPolicy{policy_}}; }

    // Copies the policy's fields into `motion`.
    void fill(EyeMotion& motion) const noexcept;
    [[nodiscard]] std::uint64_t losses() const noexcept { return losses_; }

private:
    LossPolicy policy_;
    bool ever_ = false, lost_before_ = false, interrupted_ = false;
    Instant valid_since_, last_valid_, lost_since_;
    Direction<HeadFrame> held_, last_gaze_;
    std::uint64_t losses_ = 0;
};

}  // namespace fovea::pipeline
