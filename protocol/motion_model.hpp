// The motion model: where the eye is, how it moves, and how sure we are. The daemon publishes it for each sample; a
// client evaluates it for its own photon time, so that no frame waits for a round trip and a late frame still gets
// the right answer.
//
// Input/Output: directions in HeadFrame, times in CLOCK_MONOTONIC, angles in radians in the tangent plane of
// `gaze_dir_head` (TangentBasis).
// Threads: plain data and pure functions.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/gaze_sample.hpp"
#include "protocol/sphere.hpp"

namespace fovea {

// Horizons after EyeMotion::reference at which the model states its prediction, nanoseconds. Between two of them a
// client interpolates linearly (at most 0.5 degrees off in the middle of the fastest saccade, where the eye sees
// least); beyond the last one the last one holds.
inline constexpr std::array<std::int64_t, 12> kHorizons_ns = {0,          10'000'000, 20'000'000,  30'000'000,
                                                              40'000'000, 50'000'000, 60'000'000,  70'000'000,
                                                              85'000'000, 100'000'000, 125'000'000, 150'000'000};

// The prediction for one horizon.
struct HorizonPoint {
    float du_rad = 0, dv_rad = 0;        // displacement from gaze_dir_head, tangent plane of gaze_dir_head
    float radius68_rad = 0, radius95_rad = 0;  // the eye is this close to the prediction with probability 0.68, 0.95
};

// The saccade in flight; meaningful while event == saccade.
struct SaccadeProfile {
    Instant onset;
    Duration duration{};                      // predicted
    Direction<HeadFrame> start_dir_head;
    Direction<HeadFrame> landing_dir_head;    // predicted
};

struct EyeMotion {
    Instant reference;                        // exposure of the last valid sample: what all horizons count from
    Direction<HeadFrame> gaze_dir_head;       // filtered gaze at `reference`
    Tangent velocity_rad_s;                   // at `reference`
    GazeEvent event = GazeEvent::lost;
    SaccadeProfile saccade;
    std::array<HorizonPoint, kHorizons_ns.size()> horizons;

    // For the signal-loss policy (loss_policy.hpp).
    bool ever_valid = false;                  // false: there has never been a valid sample; nothing below means anything
    Instant valid_since;                      // exposure of the first sample of the present (or last) valid run
    bool lost_before = false;                 // a loss that is not yet recovered from came before valid_since
    Instant lost_since;                       // if lost_before: exposure of the last valid sample before that loss
    Direction<HeadFrame> held_dir_head;       // if lost_before: the gaze held through that loss
};

struct MotionModel {
    std::uint64_t sequence = 0;               // 1, 2, 3 ... per published model; 0: nothing published yet
    std::uint64_t sample_id = 0;              // the newest sample in it, valid or not
    Instant exposed, received, filtered, published;  // of that sample
    bool exposed_estimated = false;
    std::uint8_t eyes_present = 1;            // bit per Eye; an absent eye is read as combined
    std::array<EyeMotion, kEyeCount> eyes;

    [[nodiscard]] const EyeMotion& eye(Eye e) const noexcept {
        const auto i = static_cast<std::size_t>(e);
        return eyes[(eyes_present >> i) & 1u ? i : 0];
    }
};

// A motion model evaluated at one time.
struct GazeEstimate {
    Direction<HeadFrame> gaze_dir_head;
    double radius68_rad = 0, radius95_rad = 0;
    GazeEvent event = GazeEvent::lost;
    double tracked = 0;   // 1: the prediction itself; 0: the static focal point; between: easing (loss_policy.hpp)
    bool operator==(const GazeEstimate&) const = default;
};

// The horizon i for which the prediction at t lies between horizons[i] and horizons[i + 1]: what evaluate() looks at.
// 0 before the reference, the last interval after the last horizon.
[[nodiscard]] std::size_t horizon_before(Instant reference, Instant t) noexcept;

// The prediction alone, no loss policy. Any t is legal: before `reference` the answer is that of `reference`.
// Cost: about 40 ns. noexcept, no allocation.
[[nodiscard]] GazeEstimate evaluate(const EyeMotion& motion, Instant t) noexcept;

}  // namespace fovea
