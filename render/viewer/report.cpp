#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

std::string to_text(const Summary& s, const Options& o) {
    std::array<char, 1024> text{};
    std::snprintf(text.data(), text.size(),
                  "%llu frames in %.1f s (%.1f per second), %llu with live gaze; %s, 2 x %dx%d, %s\n"
                  "shaded %.1f %% of the pixels; per frame (medians): %.1f ms, latch to submit %.2f ms, latch to GPU done %.1f ms\n"
                  "display: simulated, %.4g Hz, scan-out %.4g ms; photon off its prediction by %.2f ms (median)\n",
                  static_cast<unsigned long long>(s.frames), s.seconds, s.seconds > 0 ? static_cast<double>(s.frames) / s.seconds : 0.0,
                  static_cast<unsigned long long>(s.live_frames), o.method.c_str(), o.width_px, o.height_px, s.renderer.c_str(),
                  100 * s.shaded, s.frame_ms, s.latch_to_submit_ms, s.latch_to_done_ms, o.scanout.refresh_hz, o.scanout.scanout_ms, s.photon_error_ms);
    std::string out = text.data();
    if (s.snapshot_frame != 0)
        out += "pictures of frame " + std::to_string(s.snapshot_frame) + ": " + o.out + "/frame.png, " + o.out + "/frame_levels.png\n";
    if (s.interrupted) out += "interrupted\n";
    return out;
}

std::string to_json(const Summary& s, const Options& o) {
    nlohmann::ordered_json j;
    j["frames"] = s.frames;
    j["live_frames"] = s.live_frames;
    j["seconds"] = s.seconds;
    j["method"] = o.method;
    j["scene"] = o.scene;
    j["width_px"] = o.width_px;
    j["height_px"] = o.height_px;
    j["renderer"] = s.renderer;
    j["pixels_shaded_ratio"] = s.shaded;
    j["frame_ms"] = s.frame_ms;
    j["latch_to_submit_ms"] = s.latch_to_submit_ms;
    j["latch_to_gpu_done_ms"] = s.latch_to_done_ms;
    j["display"] = {{"simulated", true}, {"refresh_hz", o.scanout.refresh_hz}, {"scanout_ms", o.scanout.scanout_ms}, {"photon_error_ms", s.photon_error_ms}};
    j["connects"] = s.connects;
    j["frames_dropped"] = s.frames_dropped;
    j["snapshot_frame"] = s.snapshot_frame;
    j["interrupted"] = s.interrupted;
    return j.dump(2) + "\n";
}

}  // namespace fovea::viewer
