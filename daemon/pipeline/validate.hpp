// Decides whether a sample is new, in order and a number: the only stage that sees raw, possibly hostile values.
//
// Output: unit directions, strictly rising exposure times, at most 73 years apart (so that no later difference can
// overflow). Threads: one at a time; noexcept, no allocation.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/gaze_sample.hpp"

namespace fovea::pipeline {

enum class Verdict : std::uint8_t {
    good,
    invalid,       // in order, but the device does not vouch for it
    not_finite,    // in order, but NaN, infinite or without length: to be treated as invalid
    duplicate,     // the same exposure, or the same values again: to be ignored
    out_of_order,  // older than the newest, or an impossible time: to be ignored
};

class Validator {
public:
    // A tracker polled faster than it measures repeats its last values under new times (28 to 36 % of the samples in
    // the headset recordings). A repeat this soon after the values first came is no new sample; one that lasts longer
    // is an eye that really rests (a synthetic one, or a coarse tracker).
    static constexpr std::int64_t kRepeatWindow_ns = 40'000'000;

    // A verdict for one eye, and for `good` its direction made a unit vector. `t_ns` is the exposure.
    struct Checked {
        Verdict verdict = Verdict::invalid;
        Direction<HeadFrame> gaze_dir_head;
    };
    [[nodiscard]] Checked update(std::int64_t t_ns, const EyeState& eye) noexcept;
    void reset() noexcept { *this = Validator{}; }

private:
    bool any_ = false;
    std::int64_t newest_ns_ = 0;    // of any sample in order
    bool any_good_ = false;
    std::int64_t first_seen_ns_ = 0;  // when these values came first
    Direction<HeadFrame> values_;     // as the device gave them
};

// The gaze of both eyes as one where the tracker gives no combined gaze: the mean of the valid ones. Openness, pupil
// and confidence that the combined eye lacks come from the more open eye.
[[nodiscard]] EyeState combined_eye(const GazeSample& sample) noexcept;

}  // namespace fovea::pipeline
