// `fovea latency`: motion-to-photon of a recorded session, as text, JSON, CSV and a page.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command_line/checks.hpp"
#include "replay/latency.hpp"
#include "replay/session_file.hpp"
#include "tools/commands.hpp"
#include "tools/latency_html.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

using replay::kStageCount;
using replay::LatencyReport;
using replay::Percentiles;
using replay::Stage;

struct LatencyToolOptions {
    std::string session, html, csv, frame_png, levels_png;
    std::uint64_t client = 0;
    bool json = false;
};

struct Loaded {
    std::map<std::string, std::string> meta;
    bool finished = true;
    std::uint64_t client = 0;
    std::size_t clients = 0;
    std::vector<FrameTiming> frames;   // of that client
    std::vector<GazeSample> samples;
    std::vector<replay::SessionCounter> counters;
};

Result<Loaded> load(const LatencyToolOptions& o) {
    auto session = replay::SessionReader::open(o.session);
    if (!session) return std::unexpected(session.error());
    Loaded l;
    l.meta = session->meta();
    l.finished = session->finished();
    std::map<std::uint64_t, std::vector<FrameTiming>> by_client;
    auto read = session->frames([&](const replay::SessionFrame& f) {
        by_client[f.client].push_back(f.timing);
        return true;
    });
    if (!read) return std::unexpected(read.error());
    read = session->samples([&](const replay::RecordedSample& s) {
        // Out-of-order and repeated exposures are the pipeline's business; the truth is read along rising times.
        if (l.samples.empty() || s.sample.exposed > l.samples.back().exposed) l.samples.push_back(s.sample);
        return true;
    });
    if (!read) return std::unexpected(read.error());
    if (auto counters = session->counters()) l.counters = std::move(*counters);
    if (by_client.empty())
        return fail("the session has no frames: no client reported any while it was recorded", o.session,
                    "record while a renderer runs, e.g. fovea-view");
    auto chosen = by_client.find(o.client);
    if (o.client == 0)
        chosen = std::max_element(by_client.begin(), by_client.end(),
                                  [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    if (chosen == by_client.end()) {
        std::string known;
        for (const auto& [id, frames] : by_client) known += fmt::format("{}{}", known.empty() ? "" : ", ", id);
        return fail(fmt::format("no client {} in the session", o.client), o.session, "clients: " + known);
    }
    l.client = chosen->first;
    l.clients = by_client.size();
    l.frames = std::move(chosen->second);
    return l;
}

double percent(std::uint64_t part, std::uint64_t whole) {
    return whole ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

// Only where a frame was extrapolated: else the figures above say it all.
void print_kinds(const LatencyReport& r) {
    if (r.of(FrameKind::extrapolated).frames == 0) return;
    fmt::print("\n{:<16}{:>8}{:>22}{:>10}{:>18}{:>22}\n", "", "frames", "motion to photon p50", "p99 ms", "foveal error p50", "misses of judged");
    for (const FrameKind kind : {FrameKind::rendered, FrameKind::extrapolated}) {
        const auto& k = r.of(kind);
        fmt::print("{:<16}{:>8}{:>22.3f}{:>10.3f}{:>14.2f} deg{:>22}\n", replay::to_string(kind), k.frames, k.motion_to_photon_ms.p50, k.motion_to_photon_ms.p99,
                   k.error_deg.p50, fmt::format("{} of {} ({:.2f} %)", k.missed, k.judged, percent(k.missed, k.judged)));
    }
}

void print_text(const Loaded& l, const LatencyReport& r) {
    fmt::print("frames                  {} ({:.1f} Hz), client {}{}\n", r.frames, r.frame_rate_hz, l.client,
               l.clients > 1 ? fmt::format(" of {}", l.clients) : "");
    if (r.frames_without_model) fmt::print("  before the first gaze {}\n", r.frames_without_model);
    fmt::print("pixels shaded           {:.1f} % of the full frames'\n", percent(r.pixels_shaded, r.pixels_full));
    fmt::print("\n{:<24}{:>10}{:>10}{:>10}{:>10}   ms\n", "", "p50", "p95", "p99", "max");
    for (std::size_t i = 0; i < kStageCount; ++i) {
        const auto& p = r.stage_ms[i];
        if (i + 1 == kStageCount) fmt::print("{:-<64}\n", "");
        fmt::print("{:<24}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}\n", to_string(static_cast<Stage>(i)), p.p50, p.p95, p.p99, p.max);
    }
    if (r.photon_estimated) fmt::print("(photon times: estimated, the display did not tell them)\n");
    if (r.photon_simulated) fmt::print("(photon times: simulated scan-out, no display took part)\n");
    if (r.exposed_estimated) fmt::print("(exposure times: estimated, the tracker gave none)\n");
    fmt::print("\nfoveal misses           {} of {} judged frames ({:.2f} %)\n", r.missed, r.judged, percent(r.missed, r.judged));
    fmt::print("  foveal error, deg     p50 {:.2f}, p95 {:.2f}, p99 {:.2f}, max {:.2f}\n", r.error_deg.p50, r.error_deg.p95,
               r.error_deg.p99, r.error_deg.max);
    if (r.missed) fmt::print("  outside by, deg       p50 {:.2f}, max {:.2f} (missed frames)\n", r.outside_deg.p50, r.outside_deg.max);
    fmt::print("  not judged            {} in a blink or loss, {} after the recording's end\n", r.unjudged_no_gaze,
               r.unjudged_after_recording);
    print_kinds(r);
    fmt::print("photon time asked for   off by {:.2f} ms p50, {:.2f} ms p99\n", r.abs_prediction_ms.p50, r.abs_prediction_ms.p99);
    if (!l.finished) fmt::print("note: the session was not finished (its recorder was killed, or still runs)\n");
    for (const auto& c : l.counters)
        if (c.value != 0 && c.name.find("lost") != std::string::npos) fmt::print("note: {} = {}\n", c.name, c.value);
}

nlohmann::json to_json(const Percentiles& p) {
    return {{"count", p.count}, {"p50", p.p50}, {"p95", p.p95}, {"p99", p.p99}, {"max", p.max}};
}

void print_json(const Loaded& l, const LatencyReport& r) {
    static constexpr const char* kKeys[] = {"exposed_to_received",  "received_to_filtered",  "filtered_to_published",
                                            "published_to_latched", "latched_to_submitted",  "submitted_to_gpu_done",
                                            "gpu_done_to_photon",   "motion_to_photon"};
    nlohmann::json stages;
    for (std::size_t i = 0; i < kStageCount; ++i) stages[kKeys[i]] = to_json(r.stage_ms[i]);
    nlohmann::json kinds;
    for (const FrameKind kind : {FrameKind::rendered, FrameKind::extrapolated}) {
        const auto& k = r.of(kind);
        kinds[replay::to_string(kind)] = {{"frames", k.frames},
                                  {"motion_to_photon_ms", to_json(k.motion_to_photon_ms)},
                                  {"submitted_to_gpu_done_ms", to_json(k.submitted_to_gpu_done_ms)},
                                  {"foveal_error_deg", to_json(k.error_deg)},
                                  {"judged", k.judged},
                                  {"missed", k.missed}};
    }
    const nlohmann::json j = {{"frames", r.frames},
                              {"frames_without_model", r.frames_without_model},
                              {"frame_rate_hz", r.frame_rate_hz},
                              {"client", l.client},
                              {"session_finished", l.finished},
                              {"pixels_shaded", r.pixels_shaded},
                              {"pixels_full", r.pixels_full},
                              {"photon_simulated", r.photon_simulated},
                              {"photon_estimated", r.photon_estimated},
                              {"exposed_estimated", r.exposed_estimated},
                              {"stages_ms", stages},
                              {"abs_photon_prediction_ms", to_json(r.abs_prediction_ms)},
                              {"judged", r.judged},
                              {"missed", r.missed},
                              {"unjudged_no_gaze", r.unjudged_no_gaze},
                              {"unjudged_after_recording", r.unjudged_after_recording},
                              {"foveal_error_deg", to_json(r.error_deg)},
                              {"outside_deg", to_json(r.outside_deg)},
                              {"kinds", kinds}};
    fmt::print("{}\n", j.dump(2));
}

std::string per_frame_csv(const LatencyReport& r) {
    std::string s = "frame";
    for (const char* name : {"exposed_received_ms", "received_filtered_ms", "filtered_published_ms", "published_latched_ms",
                             "latched_submitted_ms", "submitted_gpu_done_ms", "gpu_done_photon_ms", "motion_to_photon_ms"})
        s += fmt::format(",{}", name);
    s += ",photon_asked_minus_came_ms,judged,missed,error_deg,outside_deg,kind\n";
    for (const auto& f : r.per_frame) {
        s += fmt::format("{}", f.frame);
        for (double v : f.stage_ms) s += fmt::format(",{:.6f}", v);
        const bool judged = f.unjudged == replay::Unjudged::no;
        s += fmt::format(",{:.6f},{:d},{:d},", f.prediction_ms, judged, judged && f.missed());
        s += judged ? fmt::format("{:.4f},{:.4f}", f.worst_error_deg(), f.worst_outside_deg()) : ",";
        s += fmt::format(",{}\n", replay::to_string(f.kind));
    }
    return s;
}

Result<std::string> read_png(const std::string& path) {
    constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
    if (path.empty()) return std::string{};
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail("cannot read the picture", path, "give a PNG file, or leave the option out");
    std::ostringstream text;
    text << in.rdbuf();
    if (!text.str().starts_with(kSignature)) return fail("this picture is no PNG", path, "give a PNG file, or leave the option out");
    return text.str();
}

Result<void> write_outputs(const LatencyToolOptions& o, const Loaded& l, const LatencyReport& r, ReportPage page) {
    if (!o.csv.empty())
        if (auto done = replay::write_file(o.csv, per_frame_csv(r)); !done) return done;
    if (o.html.empty()) return {};
    for (const auto& [key, value] : l.meta) page.facts.emplace_back(key, value);
    for (const auto& c : l.counters) page.facts.emplace_back(c.name, fmt::format("{}", c.value));
    return replay::write_file(o.html, latency_html(r, page));
}

int run(const LatencyToolOptions& o) {
    const auto refuse = [](const Error& e, int code) {
        fmt::print(stderr, "fovea latency: {}\n", e.message());
        return code;
    };
    if (auto ok = keep_inputs({o.session, o.frame_png, o.levels_png}, {o.html, o.csv}); !ok) return refuse(ok.error(), kUsage);
    if (!o.html.empty() && o.html == o.csv) return refuse({"two outputs would be one file", o.csv, "give each a name of its own"}, kUsage);
    auto frame = read_png(o.frame_png), levels = read_png(o.levels_png);
    if (!frame) return refuse(frame.error(), kBadInput);
    if (!levels) return refuse(levels.error(), kBadInput);
    auto loaded = load(o);
    if (!loaded) return refuse(loaded.error(), kBadInput);
    const LatencyReport report = replay::analyse_latency(loaded->frames, loaded->samples);
    o.json ? print_json(*loaded, report) : print_text(*loaded, report);
    if (auto done = write_outputs(o, *loaded, report, {std::filesystem::path(o.session).filename().string(), {}, std::move(*frame), std::move(*levels)}); !done) return refuse(done.error(), kFailed);
    return kSuccess;
}

}  // namespace

void add_latency(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<LatencyToolOptions>();
    auto* cmd = app.add_subcommand("latency", "Motion-to-photon latency and foveal misses of a recorded session");
    cmd->add_option("SESSION", o->session, "a .fovea session file in which a renderer reported frames")->required();
    auto* html = cmd->add_option("--html", o->html, "also write a self-contained page with charts")->check(command_line::file_name());
    cmd->add_option("--frame", o->frame_png, "PNG of a frame to show on the page")->needs(html)->check(command_line::file_name());
    cmd->add_option("--levels", o->levels_png, "PNG of that frame's foveation levels to show on the page")->needs(html)->check(command_line::file_name());
    cmd->add_option("--csv", o->csv, "also write one row per frame")->check(command_line::file_name());
    cmd->add_option("--client", o->client, "which client's frames (default: the one with the most)")->check(CLI::Range(std::uint32_t{1}, std::numeric_limits<std::uint32_t>::max()));
    cmd->add_flag("--json", o->json, "print JSON instead of text");
    cmd->footer("A frame runs from the exposure of the newest sample that its focal point used to the middle of its scan-out.\n"
                "It is a foveal miss when the recorded eye was, at that photon time, outside the full-resolution region.\n"
                "Exit codes: 0 reported, 1 cannot write, 2 wrong usage, 3 the session is missing, torn or has no frames, or a picture cannot be read.");
    cmd->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
