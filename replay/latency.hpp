// Motion-to-photon latency of recorded frames, in time and in degrees.
//
// Time: each frame runs from the exposure of the newest sample that its focal point used to the middle of its
// scan-out; the stages between add up to the whole. Degrees: where the recorded eye really was at that photon time
// (interpolated from the samples around it, most of which came after the latch) against where the fovea was put.
//
// Input: frames in the order they were shown; samples in exposure order; times in CLOCK_MONOTONIC.
// Cost: O(frames log samples).
// Threads: pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame_timing.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::replay {

// The stages of a frame, in order. `motion_to_photon` is their sum.
enum class Stage : std::uint8_t {
    exposed_to_received,
    received_to_filtered,
    filtered_to_published,
    published_to_latched,
    latched_to_submitted,
    submitted_to_gpu_done,
    gpu_done_to_photon,
    motion_to_photon,
};
inline constexpr std::size_t kStageCount = 8;
[[nodiscard]] const char* to_string(FrameKind kind) noexcept;   // "rendered"
[[nodiscard]] const char* to_string(Stage stage) noexcept;   // "exposed -> received"
[[nodiscard]] const char* explain(Stage stage) noexcept;     // what happens in it, in a few words

// Nearest-rank percentiles: each is a value that occurred.
struct Percentiles {
    std::size_t count = 0;
    double p50 = 0, p95 = 0, p99 = 0, max = 0;
};
[[nodiscard]] Percentiles percentiles(std::vector<double> values);

// The judgement of one view of one frame.
struct ViewJudgement {
    double error_deg = 0;    // between the fovea's centre and where the eye was
    double outside_deg = 0;  // how far the eye was outside the full-resolution region; 0: inside
    bool missed = false;     // outside_deg > 0, or the gaze was not in the view at all
};

// Why a frame could not be judged.
enum class Unjudged : std::uint8_t {
    no,               // it was judged
    no_gaze,          // blink or loss at photon time: there is no truth
    after_recording,  // the recording ends before the photon
    no_view,          // the client reported no view
};

struct FrameJudgement {
    std::uint64_t frame = 0;
    FrameKind kind = FrameKind::rendered;
    std::array<double, kStageCount> stage_ms{};
    double prediction_ms = 0;      // photon time asked of the latch minus the photon time that came
    Unjudged unjudged = Unjudged::no;
    std::array<ViewJudgement, kMaxViews> views{};
    std::uint32_t view_count = 0;
    [[nodiscard]] bool missed() const noexcept;
    [[nodiscard]] double worst_error_deg() const noexcept;
    [[nodiscard]] double worst_outside_deg() const noexcept;
};

// The same figures for the frames of one kind. An extrapolated frame's motion to photon counts from the sample behind the
// frame that it continues: it is longer by the time that the extrapolation looks ahead.
struct KindReport {
    std::size_t frames = 0;                // without those before the first motion model
    Percentiles motion_to_photon_ms, submitted_to_gpu_done_ms, error_deg;
    std::size_t judged = 0, missed = 0;
};
inline constexpr std::size_t kFrameKinds = 2;

struct LatencyReport {
    std::size_t frames = 0;
    std::size_t frames_without_model = 0;  // before the first motion model: not in the stages
    bool exposed_estimated = false;        // at least one frame's exposure time was an estimate
    bool photon_estimated = false;         // at least one frame's photon time is a guess at what a display did
    bool photon_simulated = false;         // at least one frame's photon time came from a simulated scan-out
    std::array<Percentiles, kStageCount> stage_ms;
    Percentiles abs_prediction_ms;         // |asked - came|
    Percentiles frame_interval_ms;         // between successive photons
    double frame_rate_hz = 0;
    std::uint64_t pixels_shaded = 0, pixels_full = 0;

    std::size_t judged = 0, missed = 0;    // frames; a frame misses when one of its views does
    std::size_t unjudged_no_gaze = 0, unjudged_after_recording = 0;
    Percentiles error_deg;                 // worst view of each judged frame
    Percentiles outside_deg;               // the same, of the missed frames only
    std::array<KindReport, kFrameKinds> kinds;   // by FrameKind; the figures above are of both together
    [[nodiscard]] const KindReport& of(FrameKind kind) const noexcept { return kinds[static_cast<std::size_t>(kind)]; }
    std::vector<FrameJudgement> per_frame; // frames with a model, in order
};

struct LatencyOptions {
    // Two samples further apart than this bracket no truth: the eye may have done anything between them.
    Duration max_gap = std::chrono::milliseconds(50);
};

// Where the eye was at t, interpolated along the great circle; nothing in a blink, a loss or a gap.
// `eye` falls back to combined where the tracker gave no such eye.
[[nodiscard]] std::optional<Direction<HeadFrame>> gaze_at(std::span<const GazeSample> samples, Eye eye, Instant t,
                                                          Duration max_gap) noexcept;

[[nodiscard]] LatencyReport analyse_latency(std::span<const FrameTiming> frames, std::span<const GazeSample> samples,
                                            const LatencyOptions& options = {});

}  // namespace fovea::replay
