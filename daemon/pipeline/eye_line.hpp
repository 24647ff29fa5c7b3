// One eye's way through all stages: checked sample in, EyeMotion out.
//
// The classifier reads the raw samples, not the filtered ones, so that no filter's lag delays an onset; filter and
// predictor then know what the eye is doing.
// Threads: one at a time; update() and settle() are noexcept and allocate nothing.
#pragma once

#include "daemon/pipeline/blink_gate.hpp"
#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/filter.hpp"
#include "daemon/pipeline/history.hpp"
#include "daemon/pipeline/loss_tracker.hpp"
#include "daemon/pipeline/predictor.hpp"
#include "daemon/pipeline/self_judge.hpp"
#include "daemon/pipeline/uncertainty.hpp"
#include "daemon/pipeline/validate.hpp"

namespace fovea::pipeline {

class EyeLine {
public:
    [[nodiscard]] static Result<EyeLine> create(const PipelineSettings& settings);

    // What became of the sample; `good` means that the motion below now includes it.
    // `head_rad_s`: the head's angular velocity; zero when it rests or is not known.
    [[gnu::noinline]] Verdict update(Instant exposed, const EyeState& eye, Vec3<HeadFrame> head_rad_s = {}) noexcept;
    void settle() noexcept;   // pipeline.hpp
    // update() of a copy of `other`, made without the judge's memory, which is large: this line's is as good here.
    void stand_in_for(const EyeLine& other, Instant exposed, const EyeState& eye, Vec3<HeadFrame> head_rad_s) noexcept;
    void reset() noexcept;

    [[nodiscard]] const EyeMotion& motion() const noexcept { return motion_; }
    [[nodiscard]] std::uint64_t blinks() const noexcept { return blinks_; }
    [[nodiscard]] std::uint64_t losses() const noexcept { return losses_; }

private:
    EyeLine(const PipelineSettings& settings, Filter filter, Predictor predictor) noexcept;
    [[gnu::noinline]] void forget_motion() noexcept;
    void use(Instant exposed, Direction<HeadFrame> gaze_dir_head, Vec3<HeadFrame> head_rad_s) noexcept;
    void predict(std::int64_t t_ns, const Plane& filtered, const Classified& now, Vec3<HeadFrame> head_rad_s) noexcept;
    [[gnu::noinline]] void go_blind(GazeEvent event) noexcept;
    [[gnu::noinline]] void fill_saccade(const Classified& now, Direction<HeadFrame> gaze) noexcept;

    std::int64_t guard_before_ns_;
    Validator validator_;
    BlinkGate gate_;
    LossTracker loss_;
    History raw_;
    Trail shown_;  // filtered gaze, for the guard before a blink
    Classifier classifier_;
    Filter filter_;
    Predictor predictor_;
    SelfJudge judge_;
    Ahead ahead_{};
    bool unjudged_ = false;   // the newest sample of raw_ has yet to be held against what was foreseen
    bool unforeseen_ = false; // nor has the predictor been asked yet: nothing of its answer was to be shown
    MotionFeatures features_;
    NetInput net_{};
    Plane filtered_;
    EyeMotion motion_;
    std::uint64_t blinks_ = 0, losses_ = 0;
};

}  // namespace fovea::pipeline
