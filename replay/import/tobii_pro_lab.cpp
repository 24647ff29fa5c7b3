// Tobii Pro Lab data export (TSV): Glasses, and screen-based trackers with DACS positions.
//
// Source: Tobii's export columns, as public analysis code reads them; no such file is in the project's corpus, so this
// importer is tested on files written after that description.
// Time: "Recording timestamp", microseconds, or with its unit in brackets. Versions that wrote milliseconds without
// saying so are known by steps below 250 "microseconds" (4 kHz), which no Tobii tracker makes.
// Lines of another sensor than "Eye Tracker" (gyroscope, mouse) and of events are not samples.
// Direction, per eye: eye position and gaze point in DACS millimetres where the export has them (origin at the display's
// upper left, +x right, +y down, +z towards the person), else "Gaze direction": forward is +z for the glasses (+x left,
// +y up), -z in user coordinates (+x right, +y up).
#include <algorithm>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

using Column = std::optional<std::size_t>;

// "Name", "Name [unit]", "Name (unit)" or "Name (unit)" without the blank within.
Column find_with_unit(const TextTable& t, const std::string& name, std::initializer_list<const char*> units) {
    for (const char* unit : units)
        for (const auto& [open, close] : {std::pair{" [", "]"}, {" (", ")"}})
            if (const auto i = t.find(name + open + unit + close)) return i;
    return std::nullopt;
}

struct EyeColumns {
    Column eye[3], point[2], direction[3], pupil, validity;
    [[nodiscard]] bool positions() const { return eye[0] && eye[1] && eye[2] && point[0] && point[1]; }
    [[nodiscard]] bool directions() const { return direction[0] && direction[1] && direction[2]; }
};

EyeColumns eye_columns(const TextTable& t, const std::string& side) {
    EyeColumns c;
    const char* axes[3] = {" X", " Y", " Z"};
    for (int i = 0; i < 3; ++i) {
        c.eye[i] = find_with_unit(t, "Eye position " + side + axes[i], {"DACS mm", "DACSmm"});
        c.direction[i] = t.find("Gaze direction " + side + axes[i]);
        if (!c.direction[i]) c.direction[i] = find_with_unit(t, "Gaze direction " + side + axes[i], {"HUCS norm", "HUCSnorm", "UCS norm", "UCSnorm"});
        if (i < 2) c.point[i] = find_with_unit(t, "Gaze point " + side + axes[i], {"DACS mm", "DACSmm"});
    }
    c.pupil = t.find("Pupil diameter " + side);
    if (!c.pupil) c.pupil = find_with_unit(t, "Pupil diameter " + side, {"mm"});
    c.validity = t.find("Validity " + side);
    return c;
}

void read_eye(TextTable& t, const EyeColumns& c, EyeState& eye) {
    const std::string_view validity = t.cell(c.validity);
    const bool vouched = !c.validity || validity == "Valid" || validity == "0" || validity == "1";
    const double pupil = t.number(c.pupil);
    if (!vouched) return;
    if (c.positions()) {
        const double x = t.number(c.point[0]) - t.number(c.eye[0]), y = t.number(c.point[1]) - t.number(c.eye[1]);
        set_gaze(eye, from_screen(x, y, t.number(c.eye[2])));
    } else if (c.directions()) {
        const double x = t.number(c.direction[0]), y = t.number(c.direction[1]), z = t.number(c.direction[2]);
        const double n2 = x * x + y * y + z * z;
        if (n2 > 0 && (n2 < 0.81 || n2 > 1.21))
            t.fail_at(*c.direction[0], "the gaze direction is not a unit vector", "export it in normalised units");
        set_gaze(eye, z > 0 ? from_left_up_forward(x, y, z) : Direction<HeadFrame>::from({x, y, z}));
    }
    if (pupil > 0) eye.pupil_mm = pupil;
}

Label label_of(std::string_view type) {
    return type == "Fixation" ? Label::fixation : type == "Saccade" ? Label::saccade : Label::none;
}

}  // namespace

bool recognise_tobii_pro_lab(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return header.starts_with("Recording timestamp") || (header.find("\tRecording timestamp") != header.npos) ||
           header.starts_with("\"Recording timestamp");
}

Result<Recording> read_tobii_pro_lab(const ImportInput& input) {
    TextTable table(input.path, input.content, '\t');
    if (!table.read_header()) return table.error();
    Column time = table.find("Recording timestamp");
    bool unit_known = false;
    int exponent = -6;
    if (!time) {
        unit_known = true;
        time = find_with_unit(table, "Recording timestamp", {"\xce\xbcs", "\xc2\xb5s", "us"});
        if (!time) {
            time = find_with_unit(table, "Recording timestamp", {"ms"});
            exponent = -3;
        }
    }
    if (!time) time = table.need("Recording timestamp");
    const EyeColumns left = eye_columns(table, "left"), right = eye_columns(table, "right");
    if (!left.positions() && !left.directions() && !right.positions() && !right.directions())
        table.fail_line("the export has no gaze directions",
                        "export 'Gaze direction left/right X, Y, Z', or eye positions and gaze points in DACS mm");
    const auto sensor = table.find("Sensor"), type = table.find("Eye movement type");
    Recording recording{{"tobii_pro_lab", "Tobii Pro Lab", "", "", 0, type.has_value(), false}, {}};
    while (table.next_row()) {
        if (sensor && table.cell(sensor) != "Eye Tracker") continue;
        RecordedSample r;
        r.sample.id = recording.samples.size() + 1;
        r.sample.device_time.ns = table.need_time_ns(*time, exponent);
        read_eye(table, left, r.sample.eye(Eye::left));
        read_eye(table, right, r.sample.eye(Eye::right));
        combine_eyes(r.sample);
        r.label = label_of(table.cell(type));
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    auto& samples = recording.samples;
    std::vector<std::int64_t> steps;
    for (std::size_t i = 1; i < samples.size(); ++i)
        steps.push_back(samples[i].sample.device_time.ns - samples[i - 1].sample.device_time.ns);
    std::sort(steps.begin(), steps.end());
    const bool milliseconds = !unit_known && !steps.empty() && steps[steps.size() / 2] < 250'000;
    for (RecordedSample& r : samples) {
        std::int64_t& ns = r.sample.device_time.ns;
        if (milliseconds) {
            if (ns > kMaxTime_ns / 1000 || ns < -kMaxTime_ns / 1000)
                return fail("the times are beyond 146 years", input.path.string() + ":2:1", "mend the time column");
            ns *= 1000;
        }
        r.sample.exposed = r.sample.received = instant_from_ns(ns);
    }
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
