#include "render/viewer/controls.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace fovea::viewer {
namespace {

template <class... Args>
std::string text(const char* format, Args... args) {
    std::array<char, 192> buffer{};
    std::snprintf(buffer.data(), buffer.size(), format, args...);
    return buffer.data();
}

const char* event_name(std::uint32_t event) noexcept {
    switch (event) {
        case FOVEA_EVENT_BLINK: return "blink";
        case FOVEA_EVENT_FIXATION: return "fixation";
        case FOVEA_EVENT_PURSUIT: return "pursuit";
        case FOVEA_EVENT_SACCADE: return "saccade";
        default: return "lost";
    }
}

}  // namespace

void Controls::handle(const present::Event& event, std::span<const std::string> methods) {
    if (event.kind == present::EventKind::close) {
        quit = true;
        return;
    }
    const auto current = static_cast<std::size_t>(std::ranges::find(methods, method) - methods.begin());
    const std::size_t n = methods.size();
    switch (event.key) {
        case U'q': case U'Q': case 27: quit = true; break;
        case U'h': case U'H': case U'?': help = !help; break;
        case U'l': case U'L': levels = !levels; break;
        case U'g': case U'G': gaze = !gaze; break;
        case U't': case U'T': readout = !readout; break;
        case U'm': case U'M': mouse = !mouse; break;
        case U'e': case U'E': latch_early = !latch_early; break;
        case U' ': paused = !paused; break;
        case U'n': case U'N': method = methods[(current + 1) % n]; break;
        case U'p': case U'P': method = methods[(current + n - 1) % n]; break;
        default:
            if (event.key >= U'1' && event.key <= U'9' && event.key - U'1' < n) method = methods[event.key - U'1'];
    }
}

std::vector<std::string> text_lines(const Controls& c, const ReadOut& r, std::span<const std::string> methods) {
    std::vector<std::string> lines;
    if (c.help) {
        std::string names;
        for (std::size_t i = 0; i < methods.size(); ++i) {
            names += text("   %zu ", i + 1) + methods[i];
            if (i + 1 == (methods.size() + 1) / 2) lines.push_back(std::exchange(names, ""));
        }
        lines.push_back(names);
        lines.insert(lines.begin(), "n, p  next, previous method, or a digit:");
        lines.insert(lines.end(), {"l  levels: blue 1, green 1/2, red 1/4      g  gaze: cross predicted, dot measured", "e  latch before recording (second best)     m  mouse as gaze, also with a tracker",
                                   "t  read-out     space  hold the scene still     h  this help     q, Esc  quit"});
    }
    if (!c.readout) return lines;
    const Summary& s = r.summary;
    const Latched& l = r.newest.latched();
    lines.push_back((r.quality.empty() ? c.method : "quality " + r.quality) + (r.executor != c.method ? " (" + r.executor + ")" : "") + (*r.newest.cost.executor != 0 ? std::string(", ") + r.newest.cost.executor + ": " + r.newest.cost.why : "") + ", " + r.scene + text(", 2 x %d x %d", r.width_px, r.height_px));
    lines.push_back(text("%.1f frames/s, %.1f ms each, %.1f %% of the pixels shaded%s", r.frames_per_second, s.frame_ms, 100 * r.newest.shaded(), c.paused ? ", held still" : ""));
    lines.push_back(!l.live()                               ? std::string("gaze: none (static focal point)")
                    : l.source == GazeSource::mouse ? std::string("gaze: mouse")
                                                            : text("gaze: %s, 95 %% within %.1f deg", event_name(l.focals[0].event), l.focals[0].radius95_rad * 180 / 3.14159265));
    const char* photons = s.photons_measured > 0 ? "measured" : s.photons_estimated > 0 ? "estimated" : "simulated";
    lines.push_back(text("latch %s to submit %.1f, GPU done %.1f, photon %.1f ms (%s)", c.latch_early ? "early" : "late", s.used().submit_ms, s.used().gpu_done_ms, s.used().photon_ms, photons));
    lines.push_back(text("motion to photon %.1f ms, photon off by %.1f ms", s.motion_to_photon_ms, s.photon_error_ms));
    lines.push_back(text("latched %s instead: photon %.1f ms, gaze %.2f deg apart", c.latch_early ? "late" : "early", c.latch_early ? s.late.photon_ms : s.early.photon_ms, s.apart_deg));
    if (!c.help) lines.emplace_back("h: help");
    return lines;
}

}  // namespace fovea::viewer
