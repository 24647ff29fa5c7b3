#include "daemon/pipeline/pipeline.hpp"

#include <optional>

#include "daemon/pipeline/eye_line.hpp"
#include "daemon/pipeline/head_motion.hpp"
#include "daemon/pipeline/settings_table.hpp"

namespace fovea::pipeline {

struct Pipeline::State {
    std::array<std::optional<EyeLine>, kEyeCount> lines;  // left and right only when asked for
    std::array<std::optional<EyeLine>, kEyeCount> stand_ins;  // what rehearse() goes through in their place
    MotionModel model;
    PipelineCounters counters;
    std::array<Calibration, kEyeCount> calibrations;  // identity until set
    bool calibrated = false;
    HeadMotion head;
    bool use_head = true;
};

Pipeline::Pipeline(std::unique_ptr<State> state) noexcept : state_{std::move(state)} {}
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

Result<Pipeline> Pipeline::create(const PipelineSettings& settings) {
    if (auto ok = check_settings(settings); !ok) return std::unexpected(ok.error());
    auto state = std::make_unique<State>();
    state->use_head = settings.predictor.head_pose;
    for (std::size_t i = 0; i < (settings.per_eye ? kEyeCount : 1); ++i) {
        auto line = EyeLine::create(settings);
        if (!line) return std::unexpected(line.error());
        state->stand_ins[i].emplace(*line);
        state->lines[i].emplace(*std::move(line));
    }
    return Pipeline(std::move(state));
}

namespace {

[[gnu::noinline]] void calibrate(EyeState& eye, const Calibration& calibration) noexcept {
    if (!eye.valid) return;
    // Whatever is no direction stays as it is: the validator tells it.
    if (const auto unit = Direction<HeadFrame>::from(eye.gaze_dir_head.vec())) eye.gaze_dir_head = calibration.apply(*unit);
}

}  // namespace

void Pipeline::set_calibration(Eye eye, const Calibration& calibration) noexcept {
    state_->calibrations[static_cast<std::size_t>(eye)] = calibration;
    state_->calibrated = true;
}

[[gnu::flatten]] MotionModel& Pipeline::update(const GazeSample& as_measured) noexcept {
    State& s = *state_;
    std::optional<GazeSample> calibrated;   // a copy only where it differs
    if (s.calibrated) {
        calibrated = as_measured;
        for (std::size_t i = 0; i < kEyeCount; ++i) calibrate(calibrated->eyes[i], s.calibrations[i]);
    }
    const GazeSample& sample = calibrated ? *calibrated : as_measured;
    PipelineCounters& n = s.counters;
    ++n.samples;
    if (s.use_head) s.head.update(to_ns(sample.exposed), sample.head);
    const Vec3<HeadFrame> head_rad_s = s.head.angular_velocity(to_ns(sample.exposed));
    EyeLine& both = *s.lines[0];
    const Verdict verdict = both.update(sample.exposed, combined_eye(sample), head_rad_s);
    switch (verdict) {
        case Verdict::good: break;
        case Verdict::invalid: ++n.invalid; break;
        case Verdict::not_finite: ++n.not_finite; break;
        case Verdict::duplicate: ++n.duplicates; break;
        case Verdict::out_of_order: ++n.out_of_order; break;
    }
    n.blinks = both.blinks();
    n.losses = both.losses();
    s.model.eyes[0] = both.motion();
    for (std::size_t i = 1; i < kEyeCount; ++i) {
        if (!s.lines[i]) continue;
        s.lines[i]->update(sample.exposed, sample.eyes[i], head_rad_s);
        s.model.eyes[i] = s.lines[i]->motion();
        if (s.model.eyes[i].ever_valid) s.model.eyes_present |= static_cast<std::uint8_t>(1u << i);
    }
    if (verdict != Verdict::duplicate && verdict != Verdict::out_of_order) {
        s.model.sample_id = sample.id;
        s.model.exposed = sample.exposed;
        s.model.received = sample.received;
        s.model.exposed_estimated = sample.exposed_estimated;
    }
    return s.model;
}

void Pipeline::rehearse(const GazeSample& last, Duration gap) noexcept {
    State& s = *state_;
    GazeSample sample = last;
    sample.exposed += gap;
    for (std::size_t i = 0; i < kEyeCount; ++i) {
        // A gaze a little further on: the same values again would be no new sample.
        if (const auto unit = Direction<HeadFrame>::from(sample.eyes[i].gaze_dir_head.vec() + Vec3<HeadFrame>{1e-5, 1e-5, 0}))
            sample.eyes[i].gaze_dir_head = *unit;
        if (s.calibrated) calibrate(sample.eyes[i], s.calibrations[i]);
    }
    const Vec3<HeadFrame> head_rad_s = s.head.angular_velocity(to_ns(sample.exposed));
    for (std::size_t i = 0; i < kEyeCount; ++i)
        if (s.lines[i]) s.stand_ins[i]->stand_in_for(*s.lines[i], sample.exposed, i == 0 ? combined_eye(sample) : sample.eyes[i], head_rad_s);
    __builtin_prefetch(&s.model, 1);
}

void Pipeline::settle() noexcept {
    for (auto& line : state_->lines)
        if (line) line->settle();
}

void Pipeline::reset() noexcept {
    for (auto& line : state_->lines)
        if (line) line->reset();
    state_->head.reset();
    state_->model = {};
}

const PipelineCounters& Pipeline::counters() const noexcept { return state_->counters; }

}  // namespace fovea::pipeline
