// `fovea synth`: a session of a synthetic eye, from a scenario.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "command_line/checks.hpp"
#include "drivers/synthetic/synthetic_eye.hpp"
#include "replay/output_file.hpp"
#include "replay/session_file.hpp"
#include "tools/commands.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

using drivers::synthetic::Movement;

struct SynthOptions {
    std::string scenario, out;
    std::vector<std::string> without;
    std::int64_t seed = -1;
    double duration_s = 0;
    bool force = false, keys = false;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea synth: {}\n", error.message());
    return code;
}

replay::Label label_of(Movement m) {
    switch (m) {
        case Movement::fixation: return replay::Label::fixation;
        case Movement::saccade: return replay::Label::saccade;
        case Movement::post_saccadic: return replay::Label::post_saccadic;
        case Movement::pursuit: return replay::Label::pursuit;
        case Movement::blink: return replay::Label::blink;
    }
    return replay::Label::none;
}

struct Written {
    std::uint64_t samples = 0, invalid = 0, missing = 0;
    std::size_t targets = 0;
};

Result<Written> write(const SynthOptions& o, const drivers::synthetic::Scenario& scenario, const std::string& part) {
    replay::SessionWriterOptions options;
    options.overwrite = true;
    options.when_full = replay::SessionWriterOptions::WhenFull::wait;
    auto writer = replay::SessionWriter::create(part, options);
    if (!writer) return std::unexpected(writer.error());
    replay::RecordingInfo info;
    info.device = "synthetic eye: " + scenario.name;
    info.source = o.scenario;
    info.licence = "none needed";
    info.nominal_rate_hz = scenario.rate_hz;
    info.has_labels = info.has_truth = true;
    info.has_head_pose = scenario.head.has_value();
    writer->set_info(info);
    writer->set_meta("seed", std::to_string(scenario.seed));
    std::ifstream text(o.scenario);
    std::ostringstream whole;
    whole << text.rdbuf();
    writer->set_meta("scenario", whole.str());
    Written n;
    drivers::synthetic::SyntheticEye eye(scenario);
    drivers::synthetic::SyntheticSample s;
    while (eye.next(s)) {
        ++n.samples;
        n.invalid += !s.sample.eye(Eye::combined).valid;
        n.missing = s.sample.id - n.samples;
        writer->add_sample(s.sample, label_of(s.movement), s.truth_dir_head);
    }
    for (const auto& t : drivers::synthetic::shown_targets(scenario)) {
        writer->add_target({instant_from_ns(t.start_ns), instant_from_ns(t.end_ns), t.dir_head});
        ++n.targets;
    }
    if (auto closed = writer->close(); !closed) return std::unexpected(closed.error());
    return n;
}

int run(const SynthOptions& o) {
    if (o.keys) {
        fmt::print("{}", drivers::synthetic::print_keys());
        return kSuccess;
    }
    if (o.scenario.empty() || o.out.empty()) {
        fmt::print(stderr, "fovea synth: name a scenario and the session to write, or ask for --keys\n");
        return kUsage;
    }
    auto scenario = drivers::synthetic::load_scenario(o.scenario);
    if (!scenario) return report(scenario.error(), kBadInput);
    for (const std::string& effect : o.without)
        if (!remove(*scenario, effect)) return report({"--without names no effect: '" + effect + "'", "", "`fovea synth --keys` prints them"}, kUsage);
    if (o.seed >= 0) scenario->seed = static_cast<std::uint64_t>(o.seed);
    if (o.duration_s > 0) scenario->duration_s = o.duration_s;
    if (!(scenario->duration_s > 0)) return report({"the scenario has no end", o.scenario, "say --duration-s"}, kUsage);
    if (auto ok = keep_inputs({o.scenario}, {o.out}); !ok) return report(ok.error(), kUsage);
    std::error_code none;
    if (!o.force && std::filesystem::exists(o.out, none)) return report({"the file exists", o.out, "choose another name, or say --force"}, kFailed);
    auto part = replay::PartFile::beside(o.out);
    if (!part) return report(part.error(), kFailed);
    const auto written = write(o, *scenario, part->path());
    if (!written) return report(part->told_of_file(written.error()), kFailed);
    if (auto ok = part->put_in_place(); !ok) return report(ok.error(), kFailed);
    std::string effects;
    for (std::size_t i = 0; i < drivers::synthetic::kEffectCount; ++i)
        if (const auto e = static_cast<drivers::synthetic::Effect>(i); has(*scenario, e)) effects += fmt::format("{}{}", effects.empty() ? "" : ", ", to_string(e));
    fmt::print(stderr, "{}: {} samples over {:g} s at {:g} Hz, seed {}; {} invalid, {} missing, {} targets; effects: {} -> {}\n", scenario->name, written->samples,
               scenario->duration_s, scenario->rate_hz, scenario->seed, written->invalid, written->missing, written->targets, effects.empty() ? "none" : effects, o.out);
    return kSuccess;
}

}  // namespace

void add_synth(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<SynthOptions>();
    auto* c = app.add_subcommand("synth", "Make a recording of a synthetic eye from a scenario");
    c->add_option("scenario", o->scenario, "TOML file with one table per effect; configs/scenarios has some");
    c->add_option("out", o->out, "The session to write; it holds the noise-free gaze and labels too");
    c->add_option("--seed", o->seed, "Another run of the same scenario (default: the scenario's own)")->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
    c->add_option("--duration-s", o->duration_s, "How long, seconds (default: the scenario's own)")->check(command_line::within(0.001, 86400.0));
    c->add_option("--without", o->without, "Leave out this effect; all others stay the same to the bit")->delimiter(',');
    c->add_flag("--keys", o->keys, "Print every effect and key with default, range and meaning, and end");
    c->add_flag("--force", o->force, "Overwrite an existing file");
    c->footer(
        "The same scenario and seed give the same samples, bit for bit.\n"
        "Example: fovea synth configs/scenarios/reading.toml reading.fovea && fovea predict reading.fovea --csv predicted.csv\n"
        "Exit codes: 0 written, 1 cannot write, 2 wrong usage, 3 the scenario is missing or wrong (the message says where).");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
