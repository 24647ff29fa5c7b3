// Signal loss, one policy in one place: hold the last gaze, ease to the static focal point, and come back only after
// enough valid data. The daemon publishes the settings; every client evaluates them by itself, so that it also works
// when the daemon is gone. Dead gaze is never shown as live.
//
//             age <= hold            hold < age <= hold+ease          age > hold+ease
//   tracked 1 ------------> held 1 --------------------------> easing ----------------> static 0
//      ^                                                                                  |
//      +------ eases back over `ease` <-- `recover` of uninterrupted valid data ----------+
//
// A gap that ends within `hold` (a blink) leaves no trace. All of it is a pure function of the published model and
// the time asked for: two clients that ask for the same time get the same answer.
#pragma once

#include "protocol/motion_model.hpp"

namespace fovea {

struct LossPolicy {
    Duration hold = std::chrono::milliseconds(250);     // a blink with its guards lasts 100 to 400 ms
    Duration ease = std::chrono::milliseconds(300);
    Duration recover = std::chrono::milliseconds(40);   // what a filter needs to settle after a gap
    Direction<HeadFrame> static_dir_head;               // where to look when nothing is known: straight ahead
    double static_radius_rad = 0.35;                    // size of the sharp region there, 20 degrees
};

// The focal direction at time t under the policy. noexcept, no allocation.
[[nodiscard]] GazeEstimate evaluate(const EyeMotion& motion, const LossPolicy& policy, Instant t) noexcept;

}  // namespace fovea
