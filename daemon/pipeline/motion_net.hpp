// What most eyes do next: how far the gaze goes on along its present direction, learned from recordings, and how far
// off that guess may be.
//
// Source: two networks of one hidden layer, fitted offline to the recordings of docs/pipeline.md (loss: mean angular
// error, per class of movement; radii: quantile loss). They see only MotionFeatures: lengths along and across the
// direction of movement, so the answer turns and moves with the gaze.
// Input: degrees. Output: degrees along MotionFeatures::along; radii in degrees.
// Cost: about 250 ns each, no transcendental function. Threads: pure functions; noexcept, no allocation.
#pragma once

#include <array>

#include "daemon/pipeline/fours.hpp"
#include "daemon/pipeline/motion_features.hpp"
#include "protocol/motion_model.hpp"

namespace fovea::pipeline {

inline constexpr std::size_t kNetInputs = 17, kNetHidden = 16, kNetHorizons = kHorizons_ns.size() - 1;
using NetInput = std::array<float, kNetInputs>;
static_assert(kHorizonLanes >= kNetHorizons && kHorizonLanes % 4 == 0 && kNetHidden % 4 == 0);

// `since_onset_ms`: since the last saccade's onset, or anything above 300 when there was none.
[[nodiscard]] NetInput net_input(const MotionFeatures& features, double noise_deg_s, double since_onset_ms) noexcept;

// Degrees along, for the horizons after the first (which is the present).
[[nodiscard]] PerHorizon net_advance(const NetInput& in, double speed_deg_s) noexcept;

struct NetRadii {
    PerHorizon r68_deg, r95_deg;
};
[[nodiscard]] NetRadii net_radii(const NetInput& in) noexcept;

// Generated tables (motion_net_weights.cpp): input scaling folded in. A horizon's lanes end in a zero.
struct AdvanceWeights {
    alignas(64) float in[kNetInputs][kNetHidden], in_bias[kNetHidden];
    float out[kNetHidden][kHorizonLanes], out_bias[kHorizonLanes];
};
struct RadiusWeights {
    alignas(64) float in[kNetInputs][kNetHidden], in_bias[kNetHidden];
    float out[kNetHidden][2 * kHorizonLanes], out_bias[2 * kHorizonLanes];  // log2 of r68, then log2 of r95 / r68
};
extern const AdvanceWeights kAdvanceWeights;
extern const RadiusWeights kRadiusWeights;

}  // namespace fovea::pipeline
