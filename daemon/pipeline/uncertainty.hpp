// How far the eye may be from the last gaze seen, while a blink or a loss hides it.
//
// What an open eye's predictions are worth is learned (motion_net.hpp, self_judge.hpp). Behind a lid there is nothing
// to learn from, so this is a line through what was measured: gaze before against gaze after.
// Source: 45 blinks, EyeLink, head still: 68 % within 1.1 and 95 % within 3.3 degrees; 276 blinks and losses, all
// devices, moving heads: 18 and 47 degrees, after about 300 ms (docs/pipeline.md). Linear between.
// Threads: pure function; noexcept.
#pragma once

#include <cstdint>

namespace fovea::pipeline {

struct Radii {
    double radius68_rad = 0, radius95_rad = 0;
};

// `age_ns`: since the last gaze that was seen, in [0, 1e18].
[[nodiscard]] Radii blind_radii(std::int64_t age_ns) noexcept;

}  // namespace fovea::pipeline
