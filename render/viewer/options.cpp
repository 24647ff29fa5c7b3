#include "render/viewer/options.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>

#include "command_line/checks.hpp"
#include "render/foveation/method.hpp"
#include "render/present/presenter.hpp"
#include "render/scene/scene.hpp"

namespace fovea::viewer {
namespace {

// "768" or "1024x768".
bool parse_size(const std::string& text, int* width, int* height) {
    char rest = 0;
    const int n = std::sscanf(text.c_str(), "%dx%d%c", width, height, &rest);
    if (n == 1) *height = *width;
    const bool shape = n == 2 || (n == 1 && text.find_first_not_of("0123456789") == std::string::npos);
    return shape && *width >= 16 && *height >= 16 && *width <= 8192 && *height <= 8192;
}

template <class Entries>
std::string list_of(const Entries& entries) {
    std::string text;
    for (const auto& e : entries) text += "\n    " + std::string(e.name) + ": " + e.summary;
    return text;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, int* exit_code) {
    Options o;
    std::string size = "768", latch = "late";
    double radius_deg = 4, max_deg = 25;
    CLI::App app{
        "Renders a stereo scene that is sharp where the eye tracker says the person looks.\n"
        "It needs no GPU, and no window: without one, pictures go to files. Start fovead first (or use --wait), then for\n"
        "example:\n"
        "    fovea-view --duration 10 --out out\n"
        "In a window, without a tracker, the mouse is the gaze; h shows the keys."};
    app.set_version_flag("--version", "fovea-view " FOVEA_VERSION);
    app.failure_message([](const CLI::App*, const CLI::Error& e) { return std::string("fovea-view: ") + e.what() + "; `fovea-view --help` explains\n"; });
    app.add_option("--socket", o.socket, "fovead's socket (default: $FOVEA_SOCKET, then the usual places)");
    app.add_option("--duration", o.duration_s, "seconds to run; 0 runs until Ctrl-C (default: 10, in a window 0)")->check(command_line::within(0.0, 1e6));
    app.add_option("--frames", o.frames, "end after this many frames instead")->check(CLI::Range(1L, 1'000'000'000L));
    app.add_option("--size", size, "pixels per eye, WIDTHxHEIGHT or one number for a square; a window can be resized and keeps the shape")->capture_default_str();
    app.add_option("--method", o.method, "foveation method:" + list_of(foveation::methods()))->capture_default_str();
    auto* quality = app.add_option("--quality", o.quality,
                   "off; auto: hold --budget-ms by moving along the built-in ladder of settings; or a file of `fovea tradeoff foveation --toml`: its pick, "
                   "or with --budget-ms along its settings. --method and --gain do not count then")->capture_default_str();
    app.add_option("--budget-ms", o.budget_ms, "time of a frame, recording to GPU done, that --quality holds (default: one refresh)")
        ->needs(quality)->check(command_line::within(0.1, 100'000.0));
    app.add_option("--scene", o.scene, "what to draw, or the path of a .gltf or .glb file or of a .toml scene file:" + list_of(scene::scenes()))->capture_default_str();
    app.add_option("--present", o.present, "where frames are shown; auto: the first of these that the environment offers:" + list_of(present::presenters()))
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)->capture_default_str();
    app.add_flag("--mouse", o.mouse, "the mouse is the gaze even if there is a tracker (without one it is, in a window)");
    app.add_option("--latch", latch, "when the gaze is latched: late (after the draws are recorded) or early (before: the second-best case, "
                                     "which is measured in every run)")
        ->check(CLI::IsMember({"late", "early"}))->capture_default_str();
    app.add_flag("--levels", o.levels, "show the levels in the window from the start (key l)");
    app.add_option("--refresh-hz", o.scanout.refresh_hz, "refresh rate of the simulated display")->capture_default_str();
    app.add_option("--scanout-ms", o.scanout.scanout_ms, "time the simulated display takes to emit a frame")->capture_default_str();
    app.add_option("--gain", o.fovea.gain, "how fast resolution falls outside the fovea (QCOM gain, 1/NDC)")
        ->check(command_line::within(0.1, 1000.0))->capture_default_str();
    app.add_option("--fovea-deg", radius_deg, "radius of full resolution around a certain gaze, degrees")
        ->check(command_line::within(0.1, 60.0))->capture_default_str();
    app.add_option("--fovea-max-deg", max_deg, "its bound when the gaze is uncertain, degrees")
        ->check(command_line::within(0.1, 90.0))->capture_default_str();
    app.add_option("--speed", o.speed, "of the scene's motion; 0 stands still")->check(command_line::within(0.0, 100.0))->capture_default_str();
    app.add_option("--views", o.views,
                   "how inset_outset draws its four views: multiview2 (one draw, GL_OVR_multiview2), instanced (one draw, an instance a view), "
                   "repeated; auto: multiview2 where the driver has it, else repeated")
        ->check(CLI::IsMember({"auto", "multiview2", "instanced", "repeated"}))->capture_default_str();
    std::string extrapolate = "off", preset = render::extrapolation::preset_name(o.extrapolation_preset);
    app.add_option("--extrapolate", extrapolate,
                   "show an extrapolated frame after each rendered one: off, auto (while the picture moves and frames take longer than a refresh), on")
        ->check(CLI::IsMember({"off", "auto", "on"}))->capture_default_str();
    std::string motion = "known";
    app.add_option("--extrapolation-motion", motion, "known: from the camera's and the objects' motion and the depth; searched: from the pictures")
        ->check(CLI::IsMember({"known", "searched"}))->capture_default_str();
    app.add_option("--extrapolation-preset", preset, "what an extrapolated frame may cost")
        ->check(CLI::IsMember({"draft", "fast", "balanced", "best"}))->capture_default_str();
    app.add_option("--out", o.out, "directory for frame.png and frame_levels.png (made if missing)");
    app.add_option("--snapshot-frame", o.snapshot_frame, "which frame to picture, from 1 (default: a live one past the middle)")
        ->check(CLI::Range(1L, 1'000'000'000L));
    app.add_flag("--wait", o.wait, "start without fovead and use its gaze as soon as there is one");
    app.add_flag("--json", o.json, "print the summary as JSON");
    app.add_flag("--progress", o.progress, "a progress line on stderr even when it is no terminal");
    app.add_flag("--quiet", o.quiet, "no progress line");
    app.add_flag("--verbose", o.verbose, "say where what is known of the driver comes from (measured, or remembered in which file; $FOVEA_PROBE_CACHE names the folder, off: none)");
    app.footer(
        "Without a display it is simulated: photon times are computed from --refresh-hz and --scanout-ms.\n"
        "Exit codes: 0 success (also after Ctrl-C), 1 failed while running, 2 wrong usage, 3 unusable input, 4 no daemon.");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        *exit_code = app.exit(e) == 0 ? kSuccess : kUsage;
        return std::nullopt;
    }
    o.known_motion = motion == "known";
    o.extrapolate = extrapolate == "on" ? Extrapolate::on : extrapolate == "auto" ? Extrapolate::automatic : Extrapolate::off;
    o.extrapolation_preset = *render::extrapolation::preset_from_name(preset.c_str());   // checked above
    if (!parse_size(size, &o.width_px, &o.height_px)) {
        std::fprintf(stderr, "fovea-view: --size '%s' is no size (WIDTHxHEIGHT or one number, 16 to 8192)\n", size.c_str());
        *exit_code = kUsage;
        return std::nullopt;
    }
    o.latch_early = latch == "early";
    constexpr double kRadPerDeg = 3.14159265358979323846 / 180;
    o.fovea.min_radius_rad = radius_deg * kRadPerDeg;
    o.fovea.max_radius_rad = std::max(radius_deg, max_deg) * kRadPerDeg;
    if (::isatty(STDERR_FILENO) != 0 && !o.json) o.progress = true;
    if (o.quiet) o.progress = false;
    return o;
}

}  // namespace fovea::viewer
