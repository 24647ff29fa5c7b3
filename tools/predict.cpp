// `fovea predict`: what the pipeline foresees for each sample of a recording, as CSV.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "command_line/checks.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/settings_table.hpp"
#include "daemon/pipeline/validate.hpp"
#include "daemon/service/calibration_file.hpp"
#include "replay/recording.hpp"
#include "tools/commands.hpp"
#include "tools/outputs.hpp"

namespace fovea::tools {
namespace {

struct PredictOptions {
    std::string in, csv, filter, predictor, calibration;
    double horizon_ms = 50;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea predict: {}\n", error.message());
    return code;
}

struct Degrees {
    double x, y;
};
Degrees degrees(Direction<HeadFrame> d) {
    const AzimuthElevation a = to_azimuth_elevation(d);
    return {a.azimuth_rad * 180 / std::numbers::pi, a.elevation_rad * 180 / std::numbers::pi};
}

void append_row(std::string& out, const GazeSample& sample, const MotionModel& model, Duration horizon) {
    const EyeState eye = pipeline::combined_eye(sample);
    const auto raw = Direction<HeadFrame>::from(eye.gaze_dir_head.vec());
    const bool valid = eye.valid && raw;
    const EyeMotion& m = model.eyes[0];
    const Instant target = sample.exposed + horizon;
    auto to = std::back_inserter(out);
    fmt::format_to(to, "{},{:d},{},", to_ns(sample.exposed), valid, to_string(m.event));
    if (valid) fmt::format_to(to, "{:.5f},{:.5f},", degrees(*raw).x, degrees(*raw).y);
    else out += ",,";
    fmt::format_to(to, "{},", to_ns(target));
    if (m.ever_valid) {
        const GazeEstimate e = evaluate(m, target);
        const Degrees p = degrees(e.gaze_dir_head);
        fmt::format_to(to, "{:.5f},{:.5f},{:.5f},", p.x, p.y, e.radius68_rad * 180 / std::numbers::pi);
    } else {
        out += ",,,";
    }
    fmt::format_to(to, "{:d}\n", m.event == GazeEvent::saccade);
}

int run(const PredictOptions& o) {
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
    std::string text = "t_ns,valid,event,x_deg,y_deg,pred_t_ns,pred_x_deg,pred_y_deg,sigma_deg,onset_seen\n";
    for (const auto& r : recording->samples) {
        append_row(text, r.sample, line->update(r.sample), seconds(o.horizon_ms * 1e-3));
        if (text.size() > 1u << 20) {
            if (auto ok = out->write(text); !ok) return report(ok.error(), kFailed);
            text.clear();
        }
    }
    if (auto ok = out->write(text); !ok) return report(ok.error(), kFailed);
    if (auto ok = out->commit(); !ok) return report(ok.error(), kFailed);
    return kSuccess;
}

}  // namespace

void add_predict(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<PredictOptions>();
    auto* c = app.add_subcommand("predict", "Predict the gaze of a recording and write one row per sample");
    c->add_option("file", o->in, "The recording; its format is recognised from the content")->required();
    c->add_option("--horizon-ms", o->horizon_ms, "How far ahead, milliseconds (default 50)")->check(command_line::within(0.0, 150.0));
    c->add_option("--predictor", o->predictor, "hold, velocity, damped_velocity, kalman, imm, gain_table, ballistic or auto (default)");
    c->add_option("--calibration", o->calibration, "A file of `fovea calibrate`, applied to each sample");
    c->add_option("--filter", o->filter, "none, one_euro, kalman or saccade_aware (default)");
    c->add_option("--csv", o->csv, "Write here; - is standard output")->required()->check(command_line::file_name());
    c->footer(
        "Columns: t_ns exposure; valid: the recording vouches for the sample; event: fixation, pursuit, saccade, blink or\n"
        "lost, as seen at t; x_deg, y_deg the recorded gaze (+ right, + up, head frame; empty when invalid); pred_t_ns,\n"
        "pred_x_deg, pred_y_deg the prediction; sigma_deg the radius about it that holds 68 % of the outcomes;\n"
        "onset_seen 1 while a saccade is seen. Only samples up to t are used for a row.\n"
        "Example: fovea predict gaze.csv --horizon-ms 50 --csv predicted.csv\n"
        "Exit codes: 0 written, 1 cannot write, 2 wrong usage, 3 the recording is missing, torn or of no known format.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
