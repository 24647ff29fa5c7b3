// What a scene and its effects cost on this driver, by drawing frames.
//
// Source: medians of frames drawn in turn, so that a slow moment of the machine meets all of them alike. Milliseconds of
// processor time (all threads) on a processor rasteriser, of wall time elsewhere.
// Cost: some dozen frames; on load or for a report, never in the loop. Threads: the context's.
// Errors: what the driver refuses.
#pragma once

#include "protocol/error.hpp"
#include "render/effects/effects.hpp"
#include "render/scene/scene.hpp"

namespace fovea::effects {

struct MeasureSettings {
    int rounds = 3;      // frames of each kind; their median counts
    double time_s = 1;   // the moment drawn
    bool software = true;   // processor time instead of wall time
};

// Fills vertex_ms, full_ms and foveated_ms.
[[nodiscard]] Result<void> measure_frames(const scene::Scene& scene, const Situation& situation, const MeasureSettings& settings, Needs& needs);

struct Cost {
    double without_ms = 0, with_ms = 0;   // the same frame, everything else as planned
    [[nodiscard]] double ratio() const noexcept { return without_ms > 0 ? with_ms / without_ms : 0; }
};
// Of one effect under the plan's method; nothing where the method has none, or always has it (foveation: Needs has it).
// Extrapolation: a frame that is followed by one made from it and the frame before, against the frame alone.
// scene: made with count_fragments if Effect::fragment_counter is to be measured.
[[nodiscard]] Result<std::optional<Cost>> measure_effect(Effect effect, const scene::Scene& scene, const Plan& plan, const Situation& situation,
                                                         const MeasureSettings& settings);

}  // namespace fovea::effects
