#include "daemon/pipeline/loss_tracker.hpp"

#include <algorithm>

namespace fovea::pipeline {

void LossTracker::valid(Instant exposed, Direction<HeadFrame> gaze_dir_head) noexcept {
    if (!ever_) {
        ever_ = true;
        valid_since_ = exposed;
    } else {
        const Duration gap = exposed - last_valid_;
        const Duration run = last_valid_ - valid_since_;
        if (lost_before_ && run >= policy_.recover + policy_.ease) lost_before_ = false;
        if (!lost_before_) {
            if (gap > policy_.hold) {
                lost_before_ = true;
                ++losses_;
                lost_since_ = last_valid_;
                held_ = last_gaze_;
                valid_since_ = exposed;
            }
        } else if (gap > policy_.hold || (interrupted_ && run < policy_.recover)) {
            if (gap > policy_.hold && run >= policy_.recover) {
                // On the way back when it broke off: date the new loss so that the share of live gaze goes on from
                // what it had reached.
                ++losses_;
                const Duration back = std::min(run - policy_.recover, policy_.ease);
                lost_since_ = last_valid_ - (back < policy_.ease ? policy_.hold + (policy_.ease - back) : Duration{0});
                held_ = last_gaze_;
            }
            valid_since_ = exposed;
        }
        if (lost_before_ && exposed - valid_since_ >= policy_.recover + policy_.ease) lost_before_ = false;
    }
    interrupted_ = false;
    last_valid_ = exposed;
    last_gaze_ = gaze_dir_head;
}

void LossTracker::fill(EyeMotion& motion) const noexcept {
    motion.ever_valid = ever_;
    motion.valid_since = valid_since_;
    motion.lost_before = lost_before_;
    motion.lost_since = lost_since_;
    motion.held_dir_head = held_;
}

}  // namespace fovea::pipeline
