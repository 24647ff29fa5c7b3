// The synthetic eye: a person's gaze and what a tracker makes of it, sample by sample, from a scenario.
//
// The same scenario and seed give the same samples, bit for bit. Each effect draws from a stream of its own, so that
// taking one out of a scenario leaves every other effect's part the same to the bit; an absent effect costs one test.
//
//   fixations + saccades + microsaccades + drift + tremor + pursuit    angles add up: the gaze in space
//     -> vestibulo-ocular reflex against the head                     the truth: gaze in the head
//     -> (binocular: vergence, half to each eye)
//     -> oscillation + slip + lid's drag + noise -> miscalibration -> quantisation    what is measured
//     -> rate jitter, latency, drop-outs                              when, and whether, it comes
//
// Times: `exposed` and `received` count from the scenario's start (0); device_time is `exposed`.
// Cost: 1 to 3 us per sample with everything on. Threads: one at a time; noexcept, no allocation after creation.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "drivers/synthetic/scenario.hpp"
#include "drivers/synthetic/tracker_effects.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::drivers::synthetic {

enum class Movement : std::uint8_t { fixation, saccade, post_saccadic, pursuit, blink };

struct SyntheticSample {
    GazeSample sample;                      // what the tracker says; id is its number from 1, with gaps where it misses one
    Direction<HeadFrame> truth_dir_head;    // where both eyes together really look
    Movement movement = Movement::fixation; // what the eye really does; microsaccades belong to a fixation
    bool missing = false;                   // the tracker drops it
    // What each effect did, by Effect: degrees; blinks: x is openness, y the drag; rate_jitter and latency: x in ms;
    // drop_outs: x is 1 invalid, 2 missing; vergence: x half the angle.
    std::array<Offset, kEffectCount> parts{};
};

class SyntheticEye {
public:
    explicit SyntheticEye(const Scenario& scenario);
    SyntheticEye(SyntheticEye&&) noexcept;
    SyntheticEye& operator=(SyntheticEye&&) noexcept;
    ~SyntheticEye();

    // The next sample that the tracker delivers; false at the scenario's end (duration_s; 0 is without end).
    [[nodiscard]] bool next(SyntheticSample& out) noexcept;

    // Sample `index` as if it were exposed at exposed_ns. Both must not fall from call to call.
    void sample_at(std::uint64_t index, std::int64_t exposed_ns, SyntheticSample& out) noexcept;
    [[nodiscard]] std::int64_t exposure_ns(std::uint64_t index) const noexcept;       // with the rate's jitter
    [[nodiscard]] std::int64_t even_exposure_ns(std::uint64_t index) const noexcept;  // without

private:
    struct State;
    std::unique_ptr<State> state_;
};

// A target that was shown to the person (pattern "targets").
struct ShownTarget {
    std::int64_t start_ns = 0, end_ns = 0;
    Direction<HeadFrame> dir_head;  // with the head straight
};
[[nodiscard]] std::vector<ShownTarget> shown_targets(const Scenario& scenario);

}  // namespace fovea::drivers::synthetic
