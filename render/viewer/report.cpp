#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

std::string to_text(const Summary& s, const Options& o) {
    std::array<char, 2048> text{};
    const char* photons = s.photons_measured > 0 ? "measured" : s.photons_estimated > 0 ? "estimated" : "simulated";
    std::snprintf(text.data(), text.size(),
                  "%llu frames in %.1f s (%.1f per second), %llu with live gaze%s; %s, 2 x %dx%d, %s\n"
                  "shaded %.1f %% of the pixels; per frame (medians): %.1f ms, latch to submit %.2f ms, latch to GPU done %.1f ms\n"
                  "latched late%s: submit %.2f ms, GPU done %.1f ms, photon %.1f ms after it; early%s: %.2f, %.1f, %.1f ms; gaze apart by %.2f deg, p95 %.2f\n"
                  "display: %s, %s; photon off its prediction by %.2f ms (median)\n"
                  "photons: %s (%llu measured, %llu estimated, %llu simulated; %llu frames never shown)\n",
                  static_cast<unsigned long long>(s.frames), s.seconds, s.seconds > 0 ? static_cast<double>(s.frames) / s.seconds : 0.0,
                  static_cast<unsigned long long>(s.live_frames), s.mouse_frames > 0 ? " (mouse)" : "", s.quality.empty() ? s.method.c_str() : ("--quality " + o.quality).c_str(), s.width_px, s.height_px, s.renderer.c_str(),
                  100 * s.shaded, s.frame_ms, s.used().submit_ms, s.used().gpu_done_ms, s.early_used ? "" : " (used)", s.late.submit_ms, s.late.gpu_done_ms,
                  s.late.photon_ms, s.early_used ? " (used)" : "", s.early.submit_ms, s.early.gpu_done_ms, s.early.photon_ms, s.apart_deg, s.apart_p95_deg,
                  s.presenter.c_str(), s.display.c_str(), s.photon_error_ms, photons, static_cast<unsigned long long>(s.photons_measured),
                  static_cast<unsigned long long>(s.photons_estimated), static_cast<unsigned long long>(s.photons_simulated), static_cast<unsigned long long>(s.never_shown));
    std::string out = text.data();
    std::snprintf(text.data(), text.size(), "views: %s, %.0f draws a frame%s\n", s.views.c_str(), s.draws,
                  s.samples > 1 ? (", " + std::to_string(s.samples) + " samples a pixel").c_str() : "");
    out += text.data();
    if (s.extrapolated != 0) {
        std::snprintf(text.data(), text.size(), "extrapolated %llu frames between them: %.1f ms each, photon %.1f ms after the latch (medians); motion %s; %s\n",
                      static_cast<unsigned long long>(s.extrapolated), s.extrapolation_ms, s.latch_to_photon_extrapolated_ms, s.extrapolation_knows_motion ? "known" : "searched",
                      s.extrapolation_backend.c_str());
        out += text.data();
    } else if (o.extrapolate == Extrapolate::automatic) {
        out += "extrapolated no frame: nothing moved, no frame took longer than a refresh, or the scene declares none\n";
    }
    if (s.extrapolated_psnr_db > 0) {
        std::snprintf(text.data(), text.size(), "the last of them: %.1f dB from the frame really rendered (repeating: %.1f dB): %s/frame_extrapolated.png\n",
                      s.extrapolated_psnr_db, s.held_psnr_db, o.out.c_str());
        out += text.data();
    }
    for (std::size_t i = 0; i < s.executors.size(); ++i)
        out += (i == 0 ? "drawn by " : "; ") + s.executors[i].name + ": " + std::to_string(s.executors[i].frames) + " frames (" + s.executors[i].why + ")" + (i + 1 == s.executors.size() ? "\n" : "");
    if (!s.effects.empty()) {
        out += "effects that the scene calls for:";
        for (const std::string& e : s.effects) out += " " + e;
        out += "\n";
    }
    if (!s.quality.empty()) out += "quality: " + s.quality + " at the end, " + std::to_string(s.quality_changes) + " changes\n";
    if (s.snapshot_frame != 0)
        out += "pictures of frame " + std::to_string(s.snapshot_frame) + ": " + o.out + "/frame.png, " + o.out + "/frame_levels.png\n";
    if (s.resets != 0) out += "the driver lost the context " + std::to_string(s.resets) + " times: everything was made anew\n";
    if (s.interrupted) out += "interrupted\n";
    return out;
}

std::string to_json(const Summary& s, const Options& o) {
    nlohmann::ordered_json j;
    j["frames"] = s.frames;
    j["live_frames"] = s.live_frames;
    j["seconds"] = s.seconds;
    j["method"] = s.method;
    j["scene"] = o.scene;
    j["width_px"] = s.width_px;
    j["height_px"] = s.height_px;
    j["renderer"] = s.renderer;
    j["pixels_shaded_ratio"] = s.shaded;
    j["views"] = {{"drawing", s.views}, {"draws_per_frame", s.draws}, {"samples", s.samples}};
    j["frame_ms"] = s.frame_ms;
    j["latch_to_submit_ms"] = s.used().submit_ms;
    j["latch_to_gpu_done_ms"] = s.used().gpu_done_ms;
    const auto latch = [](const Summary::LatchTo& to) { return nlohmann::ordered_json{{"to_submit_ms", to.submit_ms}, {"to_gpu_done_ms", to.gpu_done_ms}, {"to_photon_ms", to.photon_ms}}; };
    j["latch"] = {{"used", s.early_used ? "early" : "late"}, {"late", latch(s.late)}, {"early", latch(s.early)}, {"apart_deg", s.apart_deg}, {"apart_p95_deg", s.apart_p95_deg}};
    j["motion_to_photon_ms"] = s.motion_to_photon_ms;
    j["mouse_frames"] = s.mouse_frames;
    j["display"] = {{"presenter", s.presenter}, {"description", s.display}, {"simulated", s.photons_measured + s.photons_estimated == 0},
                    {"photons_measured", s.photons_measured}, {"photons_estimated", s.photons_estimated}, {"photons_simulated", s.photons_simulated},
                    {"never_shown", s.never_shown}, {"photon_error_ms", s.photon_error_ms}};
    if (s.extrapolated != 0)
        j["extrapolation"] = {{"frames", s.extrapolated}, {"preset", render::extrapolation::preset_name(o.extrapolation_preset)}, {"backend", s.extrapolation_backend}, {"motion", s.extrapolation_knows_motion ? "known" : "searched"},
                              {"frame_ms", s.extrapolation_ms}, {"latch_to_photon_ms", s.latch_to_photon_extrapolated_ms}};
    if (s.extrapolated_psnr_db > 0) {
        j["extrapolation"]["psnr_db"] = s.extrapolated_psnr_db;
        j["extrapolation"]["held_psnr_db"] = s.held_psnr_db;
    }
    j["executors"] = nlohmann::ordered_json::array();
    for (const auto& e : s.executors) j["executors"].push_back({{"name", e.name}, {"frames", e.frames}, {"why", e.why}});
    j["effects"] = s.effects;
    if (!s.quality.empty()) j["quality"] = {{"setting", s.quality}, {"changes", s.quality_changes}};
    j["connects"] = s.connects;
    j["frames_dropped"] = s.frames_dropped;
    j["snapshot_frame"] = s.snapshot_frame;
    j["context_resets"] = s.resets;
    j["interrupted"] = s.interrupted;
    return j.dump(2) + "\n";
}

}  // namespace fovea::viewer
