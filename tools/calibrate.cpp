// `fovea calibrate`: a calibration from recorded fixations of known targets.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "command_line/checks.hpp"
#include "daemon/pipeline/calibration.hpp"
#include "daemon/pipeline/validate.hpp"
#include "replay/recording.hpp"
#include "tools/commands.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

struct CalibrateOptions {
    std::string from, targets, out;
    double largest_error_deg = 3, settle_ms = 300;
};

struct Target {
    std::int64_t start_ns, end_ns;
    Direction<HeadFrame> dir;
};

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

// start_ms,end_ms,x_deg,y_deg with a header line; times count from the recording's first sample.
Result<std::vector<Target>> read_targets(const std::string& path) {
    std::ifstream in(path);
    std::error_code none;
    if (!in || std::filesystem::is_directory(path, none)) return fail("cannot read the targets", path, "write a CSV with start_ms,end_ms,x_deg,y_deg");
    std::vector<Target> targets;
    std::string line;
    for (int row = 1; std::getline(in, line); ++row) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (row == 1 && line == "start_ms,end_ms,x_deg,y_deg") continue;
        if (line.empty() || line[0] == '#') continue;
        std::array<double, 4> v{};
        const char* at = line.data();
        const char* const end = at + line.size();
        for (std::size_t k = 0; k < v.size(); ++k) {
            const auto [next, code] = std::from_chars(at, end, v[k]);
            const bool last = k + 1 == v.size();
            if (code != std::errc{} || !std::isfinite(v[k]) || (last ? next != end : next == end || *next != ','))
                return fail(fmt::format("column {} is not a number", k + 1), fmt::format("{}:{}", path, row), "columns: start_ms,end_ms,x_deg,y_deg");
            at = next + 1;
        }
        if (v[1] <= v[0] || std::fabs(v[0]) > 1e9 || std::fabs(v[1]) > 1e9 || std::fabs(v[2]) > 80 || std::fabs(v[3]) > 80)
            return fail("the target ends before it starts, or lies beyond 80 degrees", fmt::format("{}:{}", path, row), "columns: start_ms,end_ms,x_deg,y_deg");
        targets.push_back({seconds(v[0] * 1e-3).count(), seconds(v[1] * 1e-3).count(),
                           from_azimuth_elevation<HeadFrame>({v[2] * kRadiansPerDegree, v[3] * kRadiansPerDegree})});
    }
    return targets;
}

// The median gaze of one eye while a target was shown; nothing with fewer than 10 valid samples.
std::optional<Direction<HeadFrame>> median_gaze(const replay::Recording& recording, Eye eye, std::int64_t from_ns, std::int64_t to_ns_) {
    std::vector<double> x, y;
    const Instant first = recording.samples.front().sample.exposed;
    for (const auto& r : recording.samples) {
        const std::int64_t t = (r.sample.exposed - first).count();
        if (t < from_ns || t > to_ns_) continue;
        const EyeState e = eye == Eye::combined ? pipeline::combined_eye(r.sample) : r.sample.eye(eye);
        const auto d = Direction<HeadFrame>::from(e.gaze_dir_head.vec());
        if (!e.valid || !d || e.openness < 0.3) continue;
        const AzimuthElevation a = to_azimuth_elevation(*d);
        x.push_back(a.azimuth_rad);
        y.push_back(a.elevation_rad);
    }
    if (x.size() < 10) return std::nullopt;
    const auto middle = [](std::vector<double>& v) {
        std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
        return v[v.size() / 2];
    };
    return from_azimuth_elevation<HeadFrame>({middle(x), middle(y)});
}

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea calibrate: {}\n", error.message());
    return code;
}

// Those that the recording itself knows of.
std::vector<Target> recorded_targets(const replay::Recording& recording) {
    const Instant first = recording.samples.front().sample.exposed;
    std::vector<Target> targets;
    for (const replay::TargetShown& t : recording.targets) targets.push_back({(t.start - first).count(), (t.end - first).count(), t.dir_head});
    return targets;
}

int run(const CalibrateOptions& o) {
    if (auto ok = keep_inputs({o.from, o.targets}, {o.out}); !ok) return report(ok.error(), kUsage);
    Result<std::vector<Target>> targets;
    if (!o.targets.empty()) targets = read_targets(o.targets);
    if (!targets) return report(targets.error(), kBadInput);
    const auto recording = replay::load_recording(o.from);
    if (!recording) return report(recording.error(), kBadInput);
    if (recording->samples.empty()) return report({"the recording is empty", o.from, "record again, or name another file"}, kBadInput);
    if (o.targets.empty()) targets = recorded_targets(*recording);
    if (targets->empty()) return report({"nothing says what was to be looked at", o.targets.empty() ? o.from : o.targets, "give --targets: a CSV with start_ms,end_ms,x_deg,y_deg"}, kBadInput);
    std::string toml;
    std::optional<Error> refused;
    for (const auto& [eye, name] : {std::pair{Eye::combined, "combined"}, {Eye::left, "left"}, {Eye::right, "right"}}) {
        std::vector<pipeline::CalibrationPoint> points;
        for (const Target& t : *targets)
            if (const auto gaze = median_gaze(*recording, eye, t.start_ns + seconds(o.settle_ms * 1e-3).count(), t.end_ns))
                points.push_back({*gaze, t.dir});
        if (points.empty() && eye != Eye::combined) continue;  // the tracker does not give this eye
        const auto c = pipeline::fit_calibration(points, o.largest_error_deg);
        if (!c) {
            fmt::print(stderr, "{}: {}\n", name, c.error().message());
            if (eye == Eye::combined) refused = c.error();
            continue;
        }
        fmt::print("{}: {} from {} targets, {:.2f} degrees off on targets left out, {} outliers\n", name, to_string(c->model()), points.size(), c->leave_one_out_deg(), c->outliers());
        toml += c->to_toml(name);
    }
    if (refused || toml.empty()) return kBadInput;
    if (auto ok = replay::write_file(o.out, toml); !ok) return report(ok.error(), kFailed);
    return kSuccess;
}

}  // namespace

void add_calibrate(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<CalibrateOptions>();
    auto* c = app.add_subcommand("calibrate", "Fit a calibration to recorded fixations of known targets");
    c->add_option("--from", o->from, "The recording (a session file or any known format)")->required();
    c->add_option("--targets", o->targets, "CSV with start_ms,end_ms,x_deg,y_deg: what was shown when, from the first sample on (default: the session's own)");
    c->add_option("--out", o->out, "Write the calibration here, as TOML; - is standard output")->required()->check(command_line::file_name());
    c->add_option("--largest-error", o->largest_error_deg, "Refuse a fit that is worse on targets left out, degrees (default 3)")->check(command_line::within(0.01, 90.0));
    c->add_option("--settle-ms", o->settle_ms, "Leave out this much of each target's beginning (default 300)")->check(command_line::within(0.0, 10000.0));
    c->footer("Example: fovea calibrate --from session.fovea --targets targets.csv --out me.toml\n"
              "Then: fovead --set pipeline.calibration=me.toml\n"
              "Exit codes: 0 written, 1 cannot write, 2 wrong usage, 3 unusable input or a fit that was refused (the message says why).");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
