// `fovea status`: what a running fovead says of itself.
#include <cstdio>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/ask_admin.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {
namespace {

using nlohmann::json;

struct Options {
    WhichDaemon which;
    bool as_json = false;
};

std::uint64_t count(const json& j, const char* key) { return j.value(key, std::uint64_t{0}); }
double number(const json& j, const char* key) { return j.contains(key) && j[key].is_number() ? j[key].get<double>() : 0.0; }
std::string word(const json& j, const char* key) { return j.contains(key) && j[key].is_string() ? j[key].get<std::string>() : ""; }

// "a 1, b 2" of those that are not zero.
std::string nonzero(const json& counters) {
    std::string out;
    for (const auto& [name, value] : counters.items())
        if (value.is_number_unsigned() && value.get<std::uint64_t>() != 0)
            out += fmt::format("{}{} {}", out.empty() ? "" : ", ", name, value.get<std::uint64_t>());
    return out.empty() ? "none" : out;
}

void print_error(const json& error, const char* indent) {
    if (error.is_object())
        fmt::print("{}error       {}{}{}\n", indent, word(error, "what"),
                   word(error, "where").empty() ? "" : " at " + word(error, "where"),
                   word(error, "way_out").empty() ? "" : " (" + word(error, "way_out") + ")");
}

void print_source(const json& source) {
    fmt::print("source        {} {}\n", word(source, "driver"), word(source, "name"));
    fmt::print("  location    {}\n", word(source, "location"));
    fmt::print("  state       {}, opened {} times, lost {} times\n", word(source, "state"), count(source, "opens"), count(source, "losses"));
    print_error(source.value("error", json()), "  ");
    const bool known = source.contains("rate_hz") && source["rate_hz"].is_number();
    fmt::print("  rate        {} (nominal {:.1f} Hz), {} models published",
               known ? fmt::format("{:.1f} Hz", number(source, "rate_hz")) : "not known yet", number(source, "nominal_rate_hz"),
               count(source, "published"));
    if (source.contains("newest_age_ms") && source["newest_age_ms"].is_number())
        fmt::print(", newest {:.1f} ms ago", source["newest_age_ms"].get<double>());
    fmt::print("\n  pipeline    {}\n", nonzero(source.value("pipeline", json::object())));
    fmt::print("  device      {}\n", nonzero(source.value("device_counters", json::object())));
}

void print_model(const json& model) {
    if (!model.is_object()) {
        fmt::print("gaze          none published yet\n");
        return;
    }
    fmt::print("gaze          {} at azimuth {:+.2f} deg, elevation {:+.2f} deg, {:.0f} deg/s; {:.1f} ms ago\n", word(model, "event"),
               number(model, "azimuth_deg"), number(model, "elevation_deg"), number(model, "speed_deg_s"), number(model, "age_ms"));
    fmt::print("  model       {} of sample {}; exposed to received {:.3f} ms, received to published {:.3f} ms\n",
               count(model, "sequence"), count(model, "sample_id"), number(model, "exposed_to_received_ms"),
               number(model, "received_to_published_ms"));
}

void print_clients(const json& status) {
    const json clients = status.value("clients", json::array()), connections = status.value("connections", json::object());
    fmt::print("clients       {} now; {} so far, {} refused, {} misbehaved\n", clients.size(), count(connections, "connected"),
               count(connections, "refused"), count(connections, "misbehaved"));
    if (clients.empty()) return;
    fmt::print("  {:>4} {:>8} {:>6} {:>9} {:>9} {:>9}  {}\n", "id", "pid", "uid", "seconds", "frames", "rejected", "name");
    for (const json& c : clients) {
        const json frames = c.value("frames", json::object());
        fmt::print("  {:>4} {:>8} {:>6} {:>9.1f} {:>9} {:>9}  {}{}\n", count(c, "id"), count(c, "pid"), count(c, "uid"), number(c, "connected_s"),
                   count(frames, "accepted"), count(frames, "bad_values") + count(frames, "bad_instants") + count(frames, "overrun"),
                   word(c, "name"), c.value("reads_samples", false) ? " (reads raw samples)" : "");
    }
}

void print_recorder(const json& recorder) {
    if (!recorder.is_object()) {
        fmt::print("recorder      off\n");
        return;
    }
    fmt::print("recorder      {}\n", word(recorder, "path"));
    const auto dropped = count(recorder, "dropped_rows");
    fmt::print("  {:<11} {} samples, {} frames; lost, because they came too fast: {} samples, {} frames\n", dropped == 0 ? "written" : "taken",
               count(recorder, "samples"), count(recorder, "frames"), count(recorder, "lost_samples"), count(recorder, "lost_frames"));
    if (dropped != 0) fmt::print("  not written {} rows: the disk is too slow or full\n", dropped);
    if (!word(recorder, "error").empty()) fmt::print("  error       {}\n", word(recorder, "error"));
}

int run(const Options& options) {
    json reply;
    if (const int code = ask_admin("status", options.which, {}, &reply); code != kSuccess) return code;
    const json status = reply.value("status", json::object());
    if (options.as_json) {
        fmt::print("{}\n", status.dump(2));
        return kSuccess;
    }
    fmt::print("fovead        {} (pid {}), up {:.1f} s\n", word(status, "version"), count(status, "pid"), number(status, "uptime_s"));
    fmt::print("  socket      {}\n", word(status, "focus_socket"));
    print_source(status.value("source", json::object()));
    print_model(status.value("model", json()));
    print_clients(status);
    print_recorder(status.value("recorder", json()));
    return kSuccess;
}

}  // namespace

void add_status(CLI::App& app, int* exit_code) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("status", "Show what a running fovead does: source, rates, clients, recorder");
    add_which_daemon(*command, options->which);
    command->add_flag("--json", options->as_json, "Print everything as JSON, for scripts");
    command->footer("Exit codes: 0 it answered, 1 it answered wrongly or may not be asked, 4 no fovead is running there.");
    command->callback([options, exit_code] { *exit_code = run(*options); });
}

}  // namespace fovea::tools
