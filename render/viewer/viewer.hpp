// The headless stereo viewer: a VR app that follows libfovea's rules, frame by frame.
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

#include "protocol/error.hpp"
#include "render/viewer/options.hpp"

namespace fovea::viewer {

struct Summary {
    std::uint64_t frames = 0, live_frames = 0;
    double seconds = 0;
    double frame_ms = 0;               // median of record to GPU done
    double latch_to_submit_ms = 0, latch_to_done_ms = 0;   // medians
    double photon_error_ms = 0;        // median of |photon - what the latch asked for|
    double shaded = 1;                 // pixels shaded against full, mean
    std::uint64_t connects = 0, frames_dropped = 0;
    std::uint64_t snapshot_frame = 0;  // 0: no picture
    std::string renderer;
    bool interrupted = false;
};

struct Failure {
    Error error;
    ExitCode code = kFailed;
};

[[nodiscard]] std::expected<Summary, Failure> run(const Options& options, const std::atomic<bool>& stop);

// One paragraph, or one JSON object.
[[nodiscard]] std::string to_text(const Summary& summary, const Options& options);
[[nodiscard]] std::string to_json(const Summary& summary, const Options& options);

}  // namespace fovea::viewer
