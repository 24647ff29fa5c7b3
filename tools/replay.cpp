// `fovea replay`: a recording through the pipeline, on a virtual clock, without sockets.
#include <chrono>
#include <cstdio>
#include <thread>

#include <fmt/core.h>

#include "command_line/checks.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/settings_table.hpp"
#include "daemon/service/calibration_file.hpp"
#include "replay/recording.hpp"
#include "tools/commands.hpp"
#include "tools/model_csv.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

struct ReplayOptions {
    std::string in, csv, speed = "max", filter, predictor, calibration;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea replay: {}\n", error.message());
    return code;
}

// 0: as fast as possible. Nothing when the text is neither "max" nor a positive number.
std::optional<double> parse_speed(const std::string& text) {
    if (text == "max") return 0.0;
    char* end = nullptr;
    const double v = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(v > 0) || !(v <= 1e6)) return std::nullopt;
    return v;
}

int run(const ReplayOptions& o) {
    const auto speed = parse_speed(o.speed);
    if (!speed) return report({"--speed cannot be '" + o.speed + "'", "", "legal: max, or a factor in (0, 1e6]"}, kUsage);
    pipeline::PipelineSettings settings;
    for (const auto& [key, value] : {std::pair{"filter.name", o.filter}, {"predictor.name", o.predictor}})
        if (!value.empty())
            if (auto ok = apply_setting(settings, *pipeline::find_setting(key), value); !ok) return report(ok.error(), kUsage);
    auto line = service::create_pipeline(settings, o.calibration);
    if (!line) return report(line.error(), o.calibration.empty() ? kUsage : kBadInput);
    auto recording = replay::load_recording(o.in);
    if (!recording) return report(recording.error(), kBadInput);

    if (auto ok = keep_inputs({o.in, o.calibration}, {o.csv}); !ok) return report(ok.error(), kUsage);
    auto out = replay::OutputFile::create(o.csv);
    if (!out) return report(out.error(), kFailed);
    std::string text = model_csv_header();
    std::uint64_t sequence = 0;
    const auto started = std::chrono::steady_clock::now();
    const Instant first = recording->samples.empty() ? Instant{} : recording->samples.front().sample.exposed;
    for (const auto& r : recording->samples) {
        if (*speed > 0) {
            const std::chrono::duration<double> due{to_seconds(r.sample.exposed - first) / *speed};
            std::this_thread::sleep_until(started + std::chrono::duration_cast<std::chrono::nanoseconds>(due));
        }
        MotionModel model = line->update(r.sample);
        model.sequence = ++sequence;
        model.filtered = model.published = model.received;  // the virtual clock stands still while the pipeline works
        append_model_csv(text, model);
        if (text.size() > 1u << 20) {
            if (auto ok = out->write(text); !ok) return report(ok.error(), kFailed);
            text.clear();
        }
    }
    if (auto ok = out->write(text); !ok) return report(ok.error(), kFailed);
    if (auto ok = out->commit(); !ok) return report(ok.error(), kFailed);
    const auto& n = line->counters();
    fmt::print(stderr, "{}: {} samples; not used: {} invalid, {} not finite, {} duplicate, {} out of order; {} blinks, {} losses{}{}\n",
               o.in, n.samples, n.invalid, n.not_finite, n.duplicates, n.out_of_order, n.blinks, n.losses,
               o.csv.empty() || o.csv == "-" ? "" : " -> ", o.csv == "-" ? "" : o.csv);
    return kSuccess;
}

}  // namespace

void add_replay(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<ReplayOptions>();
    auto* c = app.add_subcommand("replay", "Run a recording through the pipeline and write the motion models it publishes");
    c->add_option("file", o->in, "The recording; its format is recognised from the content")->required();
    c->add_option("--speed", o->speed, "max: as fast as possible (default); 1: as it was recorded; 2: twice as fast");
    c->add_option("--csv", o->csv, "Write one row per sample here; - is standard output")->required()->check(command_line::file_name());
    c->add_option("--calibration", o->calibration, "A file of `fovea calibrate`, applied to each sample");
    c->add_option("--filter", o->filter, "none, one_euro, kalman or saccade_aware (default)");
    c->add_option("--predictor", o->predictor, "hold, velocity, damped_velocity, kalman, imm, gain_table, ballistic or auto (default)");
    c->footer(
        "The same recording, settings and build give the same bytes on every run.\n"
        "Example: fovea replay tests/data/recordings/eyelink_lookatpoint_s1.csv --speed max --csv models.csv\n"
        "Exit codes: 0 written, 1 cannot write, 2 wrong usage, 3 the recording is missing, torn or of no known format.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
