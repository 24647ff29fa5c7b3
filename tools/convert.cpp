// `fovea convert`: one recording format into another.
#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "command_line/checks.hpp"
#include "replay/import/fovea_csv.hpp"
#include "replay/import/importer.hpp"
#include "replay/recording.hpp"
#include "replay/session_file.hpp"
#include "tools/commands.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

struct ConvertOptions {
    std::string in, out, from, device, source, licence;
    double start_s = 0, duration_s = -1;
    int degree_decimals = -1;
    bool list = false, json = false, force = false;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea convert: {}\n", error.message());
    return code;
}

void print_list(bool json) {
    if (json) {
        auto rows = nlohmann::json::array();
        for (const auto& i : replay::importers()) rows.push_back({{"name", i.name}, {"description", i.one_line}});
        fmt::print("{}\n", rows.dump(2));
        return;
    }
    for (const auto& i : replay::importers()) fmt::print("{:<18} {}\n", i.name, i.one_line);
}

Result<void> write(const ConvertOptions& o, const replay::Recording& recording) {
    const std::string extension = std::filesystem::path(o.out).extension();
    if (extension == ".csv") return replay::write_csv(o.out, recording, {o.degree_decimals, o.force});
    if (extension == ".fovea") return replay::write_session(o.out, recording, o.force);
    return fail("the extension '" + extension + "' is not known", o.out, "end the name in .fovea (session) or .csv");
}

void print_summary(const ConvertOptions& o, const replay::Recording& recording) {
    std::size_t valid = 0;
    for (const auto& r : recording.samples) valid += r.sample.eye(Eye::combined).valid;
    const double span_s = recording.samples.empty() ? 0
                                                    : to_seconds(recording.samples.back().sample.exposed -
                                                                 recording.samples.front().sample.exposed);
    const auto& info = recording.info;
    if (o.json) {
        const nlohmann::json summary = {
            {"in", o.in},           {"out", o.out},           {"format", info.format},
            {"device", info.device}, {"samples", recording.samples.size()}, {"valid", valid},
            {"duration_s", span_s}, {"rate_hz", info.nominal_rate_hz}, {"labels", info.has_labels},
            {"head_pose", info.has_head_pose}};
        fmt::print("{}\n", summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
        return;
    }
    fmt::print("{}: {} samples ({} valid) over {:.3f} s at {:g} Hz, read as {}{}{} -> {}\n", o.in,
               recording.samples.size(), valid, span_s, info.nominal_rate_hz, info.format,
               info.has_labels ? ", labelled" : "", info.has_head_pose ? ", with head pose" : "", o.out);
}

int run(const ConvertOptions& o) {
    if (o.list) {
        print_list(o.json);
        return kSuccess;
    }
    if (o.in.empty() || o.out.empty()) {
        fmt::print(stderr, "fovea convert: name an input and an output file, or ask for --list\n");
        return kUsage;
    }
    if (auto ok = keep_inputs({o.in}, {o.out}); !ok) return report(ok.error(), kUsage);
    auto recording = o.from.empty() ? replay::load_recording(o.in) : replay::load_recording_as(o.in, o.from);
    if (!recording) return report(recording.error(), kBadInput);
    if (o.start_s > 0 || o.duration_s >= 0)
        replay::trim(*recording, seconds(o.start_s), o.duration_s < 0 ? Duration{-1} : seconds(o.duration_s));
    if (recording->samples.empty())
        return report({"nothing is left", o.in, "choose an earlier --start or a longer --duration"}, kUsage);
    if (!o.device.empty()) recording->info.device = o.device;
    if (!o.source.empty()) recording->info.source = o.source;
    if (!o.licence.empty()) recording->info.licence = o.licence;
    if (auto written = write(o, *recording); !written) {
        Error error = written.error();
        if (error.what == "the file exists") error.way_out = "choose another name, or say --force";
        return report(error, kFailed);
    }
    print_summary(o, *recording);
    return kSuccess;
}

}  // namespace

void add_convert(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<ConvertOptions>();
    auto* c = app.add_subcommand("convert", "Convert a gaze recording into a session or CSV");
    c->add_option("in", o->in, "The recording; its format is recognised from the content");
    c->add_option("out", o->out, "What to write: .fovea is a session, .csv Fovea's own CSV");
    c->add_flag("--list", o->list, "Print the formats that can be read, and end");
    c->add_option("--from", o->from, "Read as this format (a name of --list) instead of recognising it");
    c->add_option("--start", o->start_s, "Leave out this much of the beginning, seconds")->check(command_line::within(0.0, 1e9));
    c->add_option("--duration", o->duration_s, "Keep no more than this, seconds")->check(command_line::within(0.0, 1e9));
    c->add_option("--degrees", o->degree_decimals,
                  "CSV: directions as azimuth and elevation with so many decimals (default: unit vectors, exact)")
        ->check(CLI::Range(0, 9));
    c->add_option("--device", o->device, "Write this as the device");
    c->add_option("--source", o->source, "Write this as the source");
    c->add_option("--licence", o->licence, "Write this as the licence");
    c->add_flag("--force", o->force, "Overwrite an existing file");
    c->add_flag("--json", o->json, "Print the summary (or the list) as JSON");
    c->footer(
        "Examples:\n"
        "  fovea convert gaze.npy gaze.fovea\n"
        "  fovea convert session.fovea gaze.csv --start 10 --duration 5\n"
        "  fovea convert --list\n"
        "Exit codes: 0 written, 1 cannot write, 2 wrong usage, 3 the input is missing, torn or of no known format.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
