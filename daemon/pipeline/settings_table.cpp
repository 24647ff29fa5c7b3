#include "daemon/pipeline/settings_table.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "protocol/sphere.hpp"

namespace fovea::pipeline {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array<const char*, 4> kFilters = {"none", "one_euro", "kalman", "saccade_aware"};
constexpr std::array<const char*, 8> kPredictors = {"hold",       "velocity",  "damped_velocity", "kalman", "imm",
                                                     "gain_table", "ballistic", "auto"};

using S = PipelineSettings;
using V = SettingValue;

// Rounds away the last bit that the conversion from degrees leaves, so that a written default reads back as itself.
double degrees(double rad) { return std::round(rad / kDegree * 1e9) / 1e9; }
double milliseconds(Duration d) { return static_cast<double>(d.count()) * 1e-6; }
Duration from_ms(const V& v) { return seconds(std::get<double>(v) * 1e-3); }

void set_static(S& s, double azimuth_deg, double elevation_deg) {
    s.loss.static_dir_head = from_azimuth_elevation<HeadFrame>({azimuth_deg * kDegree, elevation_deg * kDegree});
}
double static_azimuth(const S& s) { return degrees(to_azimuth_elevation(s.loss.static_dir_head).azimuth_rad); }
double static_elevation(const S& s) { return degrees(to_azimuth_elevation(s.loss.static_dir_head).elevation_rad); }

#define FOVEA_NUMBER(key, unit, min, max, min_legal, member, text)                                          \
    SettingRow {                                                                                            \
        key, SettingKind::number, unit, min, max, min_legal, {}, text, [](const S& s) { return V{s.member}; }, \
            [](S& s, const V& v) { s.member = std::get<double>(v); }                                        \
    }
#define FOVEA_LOSS_MS(key, min, max, member, text)                                                      \
    SettingRow {                                                                                        \
        key, SettingKind::number, "ms", min, max, true, {}, text,                                       \
            [](const S& s) { return V{milliseconds(s.loss.member)}; },                                  \
            [](S& s, const V& v) { s.loss.member = from_ms(v); }                                        \
    }

const SettingRow kRows[] = {
    {"filter.name", SettingKind::choice, "", 0, 0, true, kFilters, "How the gaze is smoothed",
     [](const S& s) { return V{s.filter}; }, [](S& s, const V& v) { s.filter = std::get<std::string>(v); }},
    FOVEA_NUMBER("filter.one_euro.min_cutoff_hz", "Hz", 0, 1000, false, one_euro.min_cutoff_hz,
                 "Cutoff for a still eye; lower is smoother and later"),
    FOVEA_NUMBER("filter.one_euro.beta_per_deg", "Hz per deg/s", 0, 1000, true, one_euro.beta_per_deg,
                 "How fast the cutoff rises with the eye's speed"),
    FOVEA_NUMBER("filter.one_euro.derivative_cutoff_hz", "Hz", 0, 1000, false, one_euro.derivative_cutoff_hz,
                 "Cutoff of the speed that drives the rise"),
    FOVEA_NUMBER("filter.kalman.acceleration_psd", "deg^2/s^3", 0, 1e9, false, kalman.acceleration_psd,
                 "How freely the modelled eye accelerates; higher follows faster and smooths less"),
    FOVEA_NUMBER("filter.saccade_aware.fixation_ms", "ms", 0, 1000, false, saccade_aware.fixation_ms,
                 "Averaging time while the eye is not in a saccade"),
    FOVEA_NUMBER("blink.openness_closed", "", 0, 1, true, blink.openness_closed,
                 "Openness below which an eye counts as closed"),
    FOVEA_NUMBER("blink.min_confidence", "", 0, 1, true, blink.min_confidence,
                 "Tracker confidence below which a sample counts as invalid"),
    FOVEA_NUMBER("blink.min_duration_ms", "ms", 0, 500, true, blink.min_duration_ms,
                 "Shorter invalid runs are drop-outs and get no guards"),
    FOVEA_NUMBER("blink.max_duration_ms", "ms", 0, 10000, true, blink.max_duration_ms,
                 "A longer invalid run is a loss, not a blink"),
    FOVEA_NUMBER("blink.guard_before_ms", "ms", 0, 500, true, blink.guard_before_ms,
                 "Through a blink, show the gaze of this long before it"),
    FOVEA_NUMBER("blink.guard_after_ms", "ms", 0, 500, true, blink.guard_after_ms,
                 "Valid samples this soon after a blink are not used"),
    FOVEA_NUMBER("classifier.min_onset_deg_s", "deg/s", 1, 1000, true, classifier.min_onset_deg_s,
                 "Lowest speed at which a saccade can begin"),
    FOVEA_NUMBER("classifier.noise_factor", "", 1, 50, true, classifier.noise_factor,
                 "A saccade must also exceed this many times the speed that the tracker's noise shows"),
    FOVEA_NUMBER("classifier.end_ratio", "", 0.1, 1, true, classifier.end_ratio,
                 "A saccade ends below this share of its onset speed threshold"),
    FOVEA_NUMBER("classifier.pursuit_min_deg_s", "deg/s", 0.5, 100, true, classifier.pursuit_min_deg_s,
                 "Lowest speed of smooth pursuit; slower is a fixation"),
    FOVEA_NUMBER("classifier.pursuit_window_ms", "ms", 20, 1000, true, classifier.pursuit_window_ms,
                 "Time over which pursuit must keep its direction"),
    {"predictor.name", SettingKind::choice, "", 0, 0, true, kPredictors, "How the gaze is predicted",
     [](const S& s) { return V{s.predictor.name}; },
     [](S& s, const V& v) { s.predictor.name = std::get<std::string>(v); }},
    FOVEA_NUMBER("predictor.damping", "", 0, 1, true, predictor.damping,
                 "damped_velocity: share of the velocity that is extrapolated"),
    {"predictor.head_pose", SettingKind::boolean, "", 0, 0, true, {},
     "auto: where the source gives the head's pose, let the eyes turn against the head", [](const S& s) { return V{s.predictor.head_pose}; },
     [](S& s, const V& v) { s.predictor.head_pose = std::get<bool>(v); }},
    FOVEA_NUMBER("predictor.time_constant_ms", "ms", 0, 1000, false, predictor.time_constant_ms,
                 "damped_velocity: time after which the extrapolated velocity has died away"),
    FOVEA_LOSS_MS("loss.hold_ms", 0, 10000, hold, "How long the last gaze is held when tracking is lost"),
    FOVEA_LOSS_MS("loss.ease_ms", 0, 10000, ease, "Then: how long the way to the static focal point takes, and back"),
    FOVEA_LOSS_MS("loss.recover_ms", 0, 10000, recover, "Uninterrupted valid data needed before live gaze is used again"),
    {"loss.static_azimuth_deg", SettingKind::number, "deg", -89, 89, true, {},
     "Static focal point, + right of straight ahead", [](const S& s) { return V{static_azimuth(s)}; },
     [](S& s, const V& v) { set_static(s, std::get<double>(v), static_elevation(s)); }},
    {"loss.static_elevation_deg", SettingKind::number, "deg", -89, 89, true, {},
     "Static focal point, + above straight ahead", [](const S& s) { return V{static_elevation(s)}; },
     [](S& s, const V& v) { set_static(s, static_azimuth(s), std::get<double>(v)); }},
    {"loss.static_radius_deg", SettingKind::number, "deg", 0, 90, true, {}, "Radius of the sharp region there",
     [](const S& s) { return V{degrees(s.loss.static_radius_rad)}; },
     [](S& s, const V& v) { s.loss.static_radius_rad = std::get<double>(v) * kDegree; }},
    {"pipeline.per_eye", SettingKind::boolean, "", 0, 0, true, {},
     "Also model the left and the right eye where the tracker gives them", [](const S& s) { return V{s.per_eye}; },
     [](S& s, const V& v) { s.per_eye = std::get<bool>(v); }},
};
#undef FOVEA_NUMBER
#undef FOVEA_LOSS_MS

const char* kind_name(SettingKind kind) {
    switch (kind) {
        case SettingKind::boolean: return "true or false";
        case SettingKind::number: return "a number";
        case SettingKind::choice: return "a name in quotes";
    }
    return "";
}

}  // namespace

std::span<const SettingRow> settings_table() { return kRows; }
std::span<const char* const> filter_names() { return kFilters; }
std::span<const char* const> predictor_names() { return kPredictors; }

const SettingRow* find_setting(std::string_view key) {
    for (const SettingRow& row : kRows)
        if (key == row.key) return &row;
    return nullptr;
}

std::string legal_values(const SettingRow& row) {
    switch (row.kind) {
        case SettingKind::boolean: return "true or false";
        case SettingKind::number:
            return fmt::format("{}{}, {}]{}{}", row.min_legal ? '[' : '(', row.min, row.max, *row.unit ? " " : "", row.unit);
        case SettingKind::choice: return fmt::format("{}", fmt::join(row.choices, ", "));
    }
    return {};
}

std::string toml_value(const SettingValue& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
    if (const double* d = std::get_if<double>(&value)) {
        const std::string text = fmt::format("{}", *d);
        return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
    }
    return fmt::format("\"{}\"", std::get<std::string>(value));
}

Result<void> apply_setting(PipelineSettings& settings, const SettingRow& row, const SettingValue& value) {
    const std::size_t wanted = row.kind == SettingKind::boolean ? 0u : row.kind == SettingKind::number ? 1u : 2u;
    if (value.index() != wanted)
        return fail(fmt::format("'{}' must be {}", row.key, kind_name(row.kind)), {}, "legal: " + legal_values(row));
    bool legal = true;
    if (const double* d = std::get_if<double>(&value))  // written so that NaN is not legal
        legal = (row.min_legal ? *d >= row.min : *d > row.min) && *d <= row.max;
    if (const std::string* s = std::get_if<std::string>(&value)) {
        legal = false;
        for (const char* choice : row.choices) legal = legal || *s == choice;
    }
    if (!legal) return fail(fmt::format("'{}' cannot be {}", row.key, toml_value(value)), {}, "legal: " + legal_values(row));
    row.set(settings, value);
    return {};
}

Result<void> check_settings(const PipelineSettings& settings) {
    PipelineSettings scratch;
    for (const SettingRow& row : kRows)
        if (auto ok = apply_setting(scratch, row, row.get(settings)); !ok) return ok;
    return {};
}

}  // namespace fovea::pipeline
