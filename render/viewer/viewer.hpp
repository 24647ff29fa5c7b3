// The stereo viewer: a VR app that follows libfovea's rules, frame by frame, in a window or without one.
//
//   prepare, record draws | predict photon | latch | plan, patch, submit, flush | fence: GPU done | present | report
//                                           ^ as late as possible
//
// Threads: run() uses the calling thread. `stop` may be set from a signal handler.
// Errors: no EGL or driver, no daemon (unless wait), a method or target that cannot be had, pictures that cannot be
// written. The loss of the daemon is no error: libfovea follows the signal-loss policy and reconnects.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "render/viewer/options.hpp"

namespace fovea::viewer {

struct Summary {
    std::uint64_t frames = 0, live_frames = 0;
    double seconds = 0;
    double frame_ms = 0;               // median of record to GPU done
    // Medians, from the latch on. Every frame latches twice, after recording (late) and before it (early, the second-best
    // case); `early_used` says which of them it was drawn with.
    struct LatchTo {
        double submit_ms = 0, gpu_done_ms = 0, photon_ms = 0;
    } late, early;
    bool early_used = false;
    double apart_deg = 0, apart_p95_deg = 0;   // between the two gazes, of frames with live gaze
    [[nodiscard]] const LatchTo& used() const noexcept { return early_used ? early : late; }
    std::uint64_t mouse_frames = 0;    // of the live ones: the pointer was the gaze
    double photon_error_ms = 0;        // median of |photon - what the latch asked for|
    double motion_to_photon_ms = 0;    // median of photon - exposure of the gaze sample (or movement of the mouse)
    std::uint64_t photons_measured = 0, photons_estimated = 0, photons_simulated = 0;   // of the frames whose photon became known
    std::uint64_t never_shown = 0;     // a newer frame took their place
    double draws = 0;                  // draw calls, mean
    std::string views;                 // how several views were drawn: multiview2, instanced, repeated; at the end
    int samples = 0;                   // a pixel, of the method's own images, at the end
    double shaded = 1;                 // pixels shaded against full, mean
    // What drew the frames and why, as FrameCost says: every way that was taken, the last first.
    struct Executor {
        std::string name, why;
        std::uint64_t frames = 0;
    };
    std::vector<Executor> executors;
    std::vector<std::string> effects;  // that the planner has switched on for what draws at the end
    std::uint64_t extrapolated = 0;    // shown after rendered ones; not among `frames`
    double extrapolation_ms = 0;       // median, both eyes
    double latch_to_photon_extrapolated_ms = 0;   // median; the latch is that of the frame before
    bool extrapolation_knows_motion = false;   // the renderer's own, not searched for
    std::string extrapolation_backend; // who does it and why; empty: nothing was extrapolated
    double extrapolated_psnr_db = 0, held_psnr_db = 0;   // the pictured one, and the frame before it, against the frame really rendered
    std::uint64_t connects = 0, frames_dropped = 0;
    std::uint64_t snapshot_frame = 0;  // 0: no picture
    std::string renderer, method;      // at the end
    int width_px = 0, height_px = 0;   // of each eye, at the end
    std::string presenter, display;    // the presenter's name and description
    std::string quality;               // the setting at the end; empty: no --quality
    std::uint64_t quality_changes = 0;
    std::uint64_t resets = 0;          // the driver lost the context, and everything was made anew
    bool interrupted = false;
};

struct Failure {
    Error error;
    ExitCode code = kFailed;
};

[[nodiscard]] inline std::unexpected<Failure> failed(const Error& error, ExitCode code = kFailed) { return std::unexpected(Failure{error, code}); }

[[nodiscard]] std::expected<Summary, Failure> run(const Options& options, const std::atomic<bool>& stop);

// One paragraph, or one JSON object.
[[nodiscard]] std::string to_text(const Summary& summary, const Options& options);
[[nodiscard]] std::string to_json(const Summary& summary, const Options& options);

}  // namespace fovea::viewer
