// The pipeline: calibrate -> validate -> blink gate -> classify -> filter -> predict -> MotionModel, one sample at a time.
//
// Pure: no I/O, no clock, no thread. Everything follows from exposure times and values, as differences in int64
// nanoseconds, so the same recording gives the same bits whenever it is played.
//
// Cost/Lag: see fovea_bench, BM_Pipeline; adds no sample of delay.
// Threads: one at a time. update(), settle() and rehearse() are noexcept and allocate nothing.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/pipeline/calibration.hpp"
#include "daemon/pipeline/settings.hpp"
#include "protocol/error.hpp"
#include "protocol/motion_model.hpp"

namespace fovea::pipeline {

// Why samples were not used; raised in the steady loop, read by `fovea status`.
struct PipelineCounters {
    std::uint64_t samples = 0;
    std::uint64_t invalid = 0;        // the device did not vouch for it
    std::uint64_t not_finite = 0;     // NaN, infinity or a direction without length
    std::uint64_t duplicates = 0;     // same exposure time, or same values with a new time
    std::uint64_t out_of_order = 0;   // older than the newest used
    std::uint64_t blinks = 0;
    std::uint64_t losses = 0;
};

class Pipeline {
public:
    [[nodiscard]] static Result<Pipeline> create(const PipelineSettings& settings);
    Pipeline(Pipeline&&) noexcept;
    Pipeline& operator=(Pipeline&&) noexcept;
    ~Pipeline();

    // Takes one sample and returns the model that is to be published for it (sequence, filtered and published are the
    // caller's to fill). The reference stays valid until the next call.
    [[nodiscard]] MotionModel& update(const GazeSample& sample) noexcept;
    // Learns from the newest sample how good earlier predictions were: a third of the work, which need not hold up the
    // model. To be called once that is published; update() does it first where it was not, so results are the same.
    void settle() noexcept;
    // Shortly before the sample that follows `last` is due, `gap` after it: goes the next sample's way on a copy, so
    // that update() then meets its code, its data and its branches in the caches. Changes no result. About 4 us, cold.
    void rehearse(const GazeSample& last, Duration gap) noexcept;
    // From the next sample on, this eye's directions go through the calibration. Not in the steady loop. Keep the gaze
    // that a tracker combined by itself apart: `combined` is applied to it, left and right to the eyes.
    void set_calibration(Eye eye, const Calibration& calibration) noexcept;
    // As after create(), calibrations kept: for a new source.
    void reset() noexcept;
    [[nodiscard]] const PipelineCounters& counters() const noexcept;

private:
    struct State;
    explicit Pipeline(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::pipeline
