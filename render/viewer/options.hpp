// The command line of fovea-view.
#pragma once

#include <optional>
#include <string>

#include "render/density/fovea_size.hpp"
#include "render/extrapolation/extrapolation.hpp"
#include "render/present/scanout.hpp"

namespace fovea::viewer {

// Exit codes, those of the `fovea` command.
enum ExitCode { kSuccess = 0, kFailed = 1, kUsage = 2, kUnusableInput = 3, kNoDaemon = 4 };

// Whether frames are extrapolated between those rendered.
enum class Extrapolate : std::uint8_t { off, automatic, on };   // automatic: while the picture moves and frames miss their budget

struct Options {
    std::string socket;                 // empty: where libfovea looks
    double duration_s = -1;             // 0: until interrupted or closed; < 0: 10 without a window, 0 in one
    long frames = 0;                    // > 0: ends after so many frames, whatever the duration
    int width_px = 768, height_px = 768;   // per eye
    std::string method = "scaled_bins", scene = "circuit";
    std::string quality = "off";        // off, auto, or the path of a ladder: the setting is then not `method`
    double budget_ms = 0;               // of a frame, for quality; 0: one refresh of the simulated display
    std::string present = "auto";       // a presenter's name, or auto
    present::ScanoutSettings scanout;
    density::FoveaSizeSettings fovea;
    std::string views = "auto";         // how a method's several views are drawn: auto, multiview2, instanced, repeated
    double speed = 1;                   // of the scene's camera and lamps
    Extrapolate extrapolate = Extrapolate::off;
    bool known_motion = true;           // the renderer tells the extrapolation how its points move
    render::extrapolation::Preset extrapolation_preset = render::extrapolation::Preset::fast;
    std::string out;                    // directory; empty: no pictures
    long snapshot_frame = 0;            // 0: a live frame past the middle
    bool mouse = false;                 // the pointer is the gaze even if there is a tracker
    bool latch_early = false;           // before recording: the second-best case
    bool levels = false;                // shown from the start
    bool wait = false, json = false, progress = false, quiet = false, verbose = false;
};

// Nothing, and *exit_code set, when the program is done (help) or the arguments are wrong (already printed).
[[nodiscard]] std::optional<Options> parse_options(int argc, char** argv, int* exit_code);

}  // namespace fovea::viewer
