// Judges foveation methods on one scene: what they cost against a full render, and what they show instead of it.
//
// Error of the frontier: root mean square difference to the full render, of 255, each pixel weighted by the share of it
// that the eye resolves at its eccentricity: density::needed_scale() squared, for this display's pixels. A difference that
// the eye cannot see there does not count.
// Flicker: mean absolute change, of 255, between successive pictures of a still scene while the gaze moves as in pursuit,
// over the pixels that are outside the fovea in both. A full render has none.
// Exactness, fragments and pixels are counted in the pictures, not computed.
// Input: gazes and movement are fixed, so that the same build and driver give the same errors in every run.
// Threads: the context's. Errors: no scene of that name, a method or target that cannot be had.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "render/quality/ladder.hpp"

namespace fovea::tools {

struct JudgeOptions {
    int size_px = 512;        // edge of each eye's picture
    int frames = 5;           // timed pairs of a full and a foveated frame
    double fovea_deg = 5;     // radius at full resolution, of scaled_bins; 0: the equation with area 0
    std::function<void(const std::string& what, std::size_t done, std::size_t of)> progress;
};

struct FoveationScore {
    double cpu_ratio = 1, wall_ratio = 1;          // medians, both eyes, record to done, against the full frames drawn in turn with it
    double cpu_ms = 0, wall_ms = 0;                // the ratios times the median of all full frames of the scene
    double latch_to_done_ratio = 1;                // wall time after the latch, against a full frame
    double pixels = 1, fragments = 1;              // shaded, against full: of the method's masks; counted by the GPU
    double exact = 1;                              // share of the fovea's pixels that equal the full render's
    double psnr_out_db = 99, ssim_out = 1;         // outside the fovea
    double weighted_error = 0, flicker = 0;        // of 255
    double flicker_smooth = 0;                     // the same with temporal smoothing (render/effects/smoothing.hpp)
    std::string fovea_png, periphery_png;          // crops, as data URIs
};

// One score per setting, in their order. The first must be `full`.
[[nodiscard]] Result<std::vector<FoveationScore>> judge_foveation(const std::string& scene, const std::vector<quality::Setting>& settings,
                                                                  const JudgeOptions& options);

// What the table measures by default, `full` first.
[[nodiscard]] std::vector<quality::Setting> foveation_settings();

}  // namespace fovea::tools
