// Where the eye will be: a displacement for each horizon of the motion model, by one of several methods.
//
//   hold             nowhere else
//   velocity         on with the present velocity
//   damped_velocity  on with a share of it that dies away, in pursuit and saccades only
//   kalman           constant velocity, Kalman-filtered
//   imm              three Kalman filters mixed by likelihood
//   gain_table       the present velocity times a measured number of seconds, per phase and horizon
//   ballistic        main sequence while a saccade runs, else hold
//   auto             learned advance (motion_net.hpp), believed as far as it proves right (self_judge.hpp), and
//                    while the head turns its turn backwards; the default
//
// Output: radians in the tangent plane of the filtered gaze, at most kLargestPrediction_rad long.
// Threads: one at a time; update() is noexcept and allocates nothing.
#pragma once

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/history.hpp"
#include "daemon/pipeline/kalman.hpp"
#include "daemon/pipeline/motion_net.hpp"
#include "daemon/pipeline/self_judge.hpp"
#include "daemon/pipeline/settings.hpp"
#include "protocol/error.hpp"

namespace fovea::pipeline {

inline constexpr double kLargestPrediction_rad = 0.7;  // 40 degrees: no eye makes a longer saccade

// What every predictor may look at, all as of the newest sample.
struct PredictorInput {
    const History& raw;  // holds at least one sample
    const Classified& now;
    const MotionFeatures& features;
    const NetInput& net;
    Phase phase;
    const Plane& filtered;
    Vec3<HeadFrame> head_rad_s = {};  // head_motion.hpp
};

[[nodiscard]] Phase phase_of(const Classified& now, const MotionFeatures& features, std::int64_t t_ns) noexcept;

class Predictor {
public:
    // Error: a name that is not in predictor_names().
    [[nodiscard]] static Result<Predictor> create(const PredictorSettings& settings);

    // Fills in du_rad and dv_rad.
    void update(const PredictorInput& in, Ahead& out) noexcept;
    [[gnu::noinline]] void reset() noexcept;  // after a gap
    [[nodiscard]] bool adaptive() const noexcept { return kind_ == Kind::automatic; }

private:
    [[gnu::noinline]] void filtered(const PredictorInput& in, Ahead& out) noexcept;
    [[gnu::noinline]] void other(const PredictorInput& in, PerHorizon& amounts, Tangent& way) const noexcept;

    enum class Kind : std::uint8_t { hold, velocity, damped_velocity, kalman, imm, gain_table, ballistic, automatic };
    Kind kind_ = Kind::hold;
    PerHorizon damped_s_{};  // seconds of velocity to extrapolate, per horizon
    NoiseEstimate noise_;
    KalmanCv kalman_{1000};
    Imm imm_;
};

}  // namespace fovea::pipeline
