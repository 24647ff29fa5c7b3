#include "tools/top_view.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace fovea::tools {
namespace {

using nlohmann::json;
using replay::Stage;

json member(const json& j, const char* key) { return j.is_object() && j.contains(key) ? j[key] : json(); }
double number(const json& j, const char* key) {
    const json v = member(j, key);
    return v.is_number() ? v.get<double>() : std::nan("");
}
std::string word(const json& j, const char* key) {
    const json v = member(j, key);
    return v.is_string() ? v.get<std::string>() : "";
}
std::size_t many(const json& j, const char* key) { return member(j, key).size(); }

std::string or_dash(double v, const char* unit, int digits = 1) { return std::isfinite(v) ? fmt::format("{:.{}f}{}", v, digits, unit) : std::string("-"); }

const replay::Percentiles& stage(const TopLook& look, Stage s) { return look.latency.stage_ms[static_cast<std::size_t>(s)]; }

std::string event_of(const json& status) {
    const std::string event = word(member(status, "model"), "event");
    return event.empty() ? "no gaze yet" : event;
}

void add_latency(const TopLook& look, std::vector<std::string>& lines) {
    if (!look.sees_frames) {
        lines.push_back("latency   " + (look.trouble.empty() ? std::string("not known") : look.trouble));
        return;
    }
    const replay::Percentiles& all = stage(look, Stage::motion_to_photon);
    if (all.count == 0) {
        lines.push_back(fmt::format("latency   no frame in the last {:.0f} s", look.window_s));
        return;
    }
    lines.push_back(fmt::format("latency   motion to photon {:.1f} ms median, {:.1f} p95, {:.1f} p99; {} frames, {:.1f} per second{}", all.p50, all.p95, all.p99, all.count, look.latency.frame_rate_hz,
                                look.latency.photon_simulated ? " (display simulated)" : ""));
    for (std::size_t i = 0; i + 1 < replay::kStageCount; ++i) {
        const auto s = static_cast<Stage>(i);
        const double share = all.p50 > 0 ? std::clamp(stage(look, s).p50 / all.p50, 0.0, 1.0) : 0;
        lines.push_back(fmt::format("            {:<22} {:>8.3f} ms  {}", to_string(s), stage(look, s).p50, std::string(static_cast<std::size_t>(std::lround(30 * share)), '#')));
    }
    const replay::LatencyReport& l = look.latency;
    if (l.judged == 0) lines.push_back("misses    no frame could be judged yet");
    else
        lines.push_back(fmt::format("misses    {} of {} frames judged ({:.1f} %); the fovea's centre off by {:.2f} deg median, {:.2f} p99", l.missed, l.judged,
                                    100.0 * static_cast<double>(l.missed) / static_cast<double>(l.judged), l.error_deg.p50, l.error_deg.p99));
    if (l.pixels_full != 0) lines.push_back(fmt::format("pixels    {:.1f} % shaded", 100 * static_cast<double>(l.pixels_shaded) / static_cast<double>(l.pixels_full)));
}

}  // namespace

std::vector<std::string> top_screen(const TopLook& look, std::size_t columns, std::size_t rows) {
    std::vector<std::string> lines;
    if (!look.connected) {
        lines = {"fovea top", "", look.trouble, "", "waiting for it; q or Ctrl-C ends"};
    } else {
        const json source = member(look.status, "source"), model = member(look.status, "model"), clients = member(look.status, "clients"), recorder = member(look.status, "recorder");
        lines.push_back(fmt::format("fovead {} (pid {}), up {:.0f} s", word(look.status, "version"), member(look.status, "pid").dump(), number(look.status, "uptime_s")));
        lines.push_back("");
        lines.push_back(fmt::format("source    {} {}: {}", word(source, "driver"), word(source, "name"), word(source, "state")));
        if (const json e = member(source, "error"); e.is_object()) lines.push_back("          " + word(e, "what") + (word(e, "way_out").empty() ? "" : " (" + word(e, "way_out") + ")"));
        lines.push_back(fmt::format("rate      {} (nominal {}), newest {} ago", or_dash(number(source, "rate_hz"), " Hz"), or_dash(number(source, "nominal_rate_hz"), " Hz"), or_dash(number(source, "newest_age_ms"), " ms")));
        lines.push_back(fmt::format("gaze      {}  azimuth {:+.2f}  elevation {:+.2f} deg, {} deg/s; 95 % within {} deg at 30 ms", event_of(look.status), number(model, "azimuth_deg"), number(model, "elevation_deg"),
                                    or_dash(number(model, "speed_deg_s"), "", 0), or_dash(number(model, "radius95_at_30ms_deg"), "", 2)));
        lines.push_back(fmt::format("pipeline  {} blinks, {} losses, {} invalid, {} out of order; device lost {} times", or_dash(number(member(source, "pipeline"), "blinks"), "", 0), or_dash(number(member(source, "pipeline"), "losses"), "", 0),
                                    or_dash(number(member(source, "pipeline"), "invalid"), "", 0), or_dash(number(member(source, "pipeline"), "out_of_order"), "", 0), or_dash(number(source, "losses"), "", 0)));
        lines.push_back("");
        add_latency(look, lines);
        if (look.lost != 0) lines.push_back(fmt::format("          {} records came too fast for this command", look.lost));
        lines.push_back("");
        lines.push_back(fmt::format("clients   {}", many(look.status, "clients")));
        if (clients.is_array())
            for (const json& c : clients)
                lines.push_back(fmt::format("  {:>4} {:>8}  {:>9} frames  {}", member(c, "id").dump(), member(c, "pid").dump(), or_dash(number(member(c, "frames"), "accepted"), "", 0), word(c, "name")));
        lines.push_back(recorder.is_object() ? fmt::format("recorder  {}: {} samples{}", word(recorder, "path"), or_dash(number(recorder, "samples"), "", 0), word(recorder, "error").empty() ? "" : "; it no longer writes: `fovea status` says why") : "recorder  off");
        lines.push_back("");
        lines.push_back(fmt::format("figures of the last {:.0f} s; q or Ctrl-C ends", look.window_s));
    }
    if (lines.size() > rows) lines.resize(rows);
    for (std::string& l : lines) {
        for (char& c : l)
            if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';   // names are not ours
        if (l.size() > columns) l.resize(columns);
    }
    return lines;
}

std::string top_line(const TopLook& look) {
    if (!look.connected) return fmt::format("{:.1f} s  no fovead: {}", look.at_s, look.trouble);
    const json source = member(look.status, "source"), model = member(look.status, "model");
    const replay::Percentiles& all = stage(look, Stage::motion_to_photon);
    return fmt::format("{:.1f} s  rate {}  {}  {:+.1f} {:+.1f} deg  latency {}  misses {}/{}  clients {}", look.at_s, or_dash(number(source, "rate_hz"), " Hz"), event_of(look.status), number(model, "azimuth_deg"),
                       number(model, "elevation_deg"), all.count != 0 ? fmt::format("{:.1f} ms", all.p50) : "-", look.latency.missed, look.latency.judged, many(look.status, "clients"));
}

std::string top_json(const TopLook& look) {
    json j = {{"at_s", look.at_s}, {"connected", look.connected}};
    if (!look.trouble.empty()) j["trouble"] = look.trouble;
    if (look.connected) {
        const json source = member(look.status, "source"), model = member(look.status, "model");
        j["rate_hz"] = member(source, "rate_hz");
        j["source_state"] = member(source, "state");
        j["event"] = member(model, "event");
        j["azimuth_deg"] = member(model, "azimuth_deg");
        j["elevation_deg"] = member(model, "elevation_deg");
        j["clients"] = many(look.status, "clients");
        const replay::Percentiles& all = stage(look, Stage::motion_to_photon);
        j["latency_ms"] = all.count != 0 ? json{{"p50", all.p50}, {"p95", all.p95}, {"p99", all.p99}} : json();
        j["frames"] = all.count;
        j["judged"] = look.latency.judged;
        j["missed"] = look.latency.missed;
    }
    return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace fovea::tools
