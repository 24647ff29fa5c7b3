// Where the eye will be: a displacement for each horizon of the motion model.
//
// Input: the raw history, what the classifier made of it, the filtered gaze. Output: displacements in radians in the
// tangent plane of the filtered gaze, bounded by kLargestPrediction_rad.
// Threads: one at a time; noexcept, no allocation after create().
#pragma once

#include <array>

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/history.hpp"
#include "daemon/pipeline/settings.hpp"
#include "protocol/error.hpp"
#include "protocol/motion_model.hpp"

namespace fovea::pipeline {

inline constexpr double kLargestPrediction_rad = 0.7;  // 40 degrees: no eye makes a longer saccade
using Displacements = std::array<Tangent, kHorizons_ns.size()>;

class Predictor {
public:
    // Error: a name that is not in predictor_names().
    [[nodiscard]] static Result<Predictor> create(const PredictorSettings& settings);

    void update(const History& raw, const Classified& now, Direction<HeadFrame> filtered, Displacements& out) noexcept;
    void reset() noexcept {}

private:
    enum class Kind : std::uint8_t { hold, damped_velocity };
    Kind kind_ = Kind::hold;
    std::array<double, kHorizons_ns.size()> damped_s_{};  // seconds of velocity to extrapolate, per horizon
};

}  // namespace fovea::pipeline
