// Two research data sets whose tables say little about themselves: dcnieho/ETDQualitizer and elmadjian/OEMC (HMR).
#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

// ETDQualitizer's example data: the screen of its example/python.py.
constexpr double kScreenWidth_mm = 528, kScreenWidth_px = 1920, kViewingDistance_mm = 650;
constexpr double kDistance_px = kViewingDistance_mm * kScreenWidth_px / kScreenWidth_mm;

// HMR gives the pupil in the eye camera's image and no calibration. One image width counts as 100 degrees of gaze about
// the median pupil, a nominal scale: the pupil turns about a point some 10 mm behind it, and the image shows some 18 mm of
// the face. What it keeps is the course of the movement; it is no use for angular error.
constexpr double kNominalDegPerImage = 100;
constexpr std::int64_t kHmrStep_ns = 5'000'000;  // 200 Hz nominal; the file has no times

}  // namespace

bool recognise_etdqualitizer(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, '\t', "timestamp") && has_cell(header, '\t', "tar_x") &&
           (has_cell(header, '\t', "left_x") || has_cell(header, '\t', "right_x"));
}

// timestamp: milliseconds. left_x ...: pixels from the screen's centre, x right, y DOWN (the trackers' own direction; the
// validation tool turns its targets round for drawing, not the data). Exactly (0, 0) and empty cells are losses.
Result<Recording> read_etdqualitizer(const ImportInput& input) {
    TextTable table(input.path, input.content, '\t');
    if (!table.read_header()) return table.error();
    const std::size_t time = table.need("timestamp");
    const std::pair<std::optional<std::size_t>, std::optional<std::size_t>> columns[2] = {
        {table.find("left_x"), table.find("left_y")}, {table.find("right_x"), table.find("right_y")}};
    Recording recording{{"etdqualitizer", "screen-based tracker (ETDQualitizer)", "", "", 0, false, false}, {}};
    while (table.next_row()) {
        RecordedSample r;
        r.sample.id = recording.samples.size() + 1;
        r.sample.device_time.ns = table.need_time_ns(time, -3);
        r.sample.exposed = r.sample.received = instant_from_ns(r.sample.device_time.ns);
        for (const Eye eye : {Eye::left, Eye::right}) {
            const auto& [cx, cy] = columns[eye == Eye::left ? 0 : 1];
            if (!cx || !cy) continue;
            const double x = table.number(cx), y = table.number(cy);
            if (std::abs(x) > 1e5 || std::abs(y) > 1e5)
                table.fail_at(*cx, "lies a hundred thousand pixels from the screen", "mend the line, or leave the cells empty");
            if (x != 0 || y != 0) set_gaze(r.sample.eye(eye), from_screen(x, y, kDistance_px));
        }
        combine_eyes(r.sample);
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

bool recognise_oemc_hmr(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, '\t', "X_coord") && has_cell(header, '\t', "Pattern");
}

// X_coord, Y_coord: 0 to 1 of the image, +y up (Pupil's norm_pos); Pattern: F, S, P or B by the authors.
Result<Recording> read_oemc_hmr(const ImportInput& input) {
    TextTable table(input.path, input.content, '\t');
    if (!table.read_header()) return table.error();
    const std::size_t x = table.need("X_coord"), y = table.need("Y_coord"), confidence = table.need("Confidence"),
                      pattern = table.need("Pattern");
    Recording recording{{"oemc_hmr", "Pupil Core, eye camera, uncalibrated", "", "", 200, true, false}, {}};
    std::vector<std::pair<double, double>> image;
    while (table.next_row()) {
        RecordedSample r;
        r.sample.id = recording.samples.size() + 1;
        r.sample.device_time.ns = static_cast<std::int64_t>(recording.samples.size()) * kHmrStep_ns;
        r.sample.exposed = r.sample.received = instant_from_ns(r.sample.device_time.ns);
        r.sample.exposed_estimated = true;
        r.sample.eye(Eye::combined).confidence = table.number(confidence);
        const std::string_view code = table.cell(pattern);
        r.label = code == "F" ? Label::fixation : code == "S" ? Label::saccade : code == "P" ? Label::pursuit
                  : code == "B" ? Label::blink : Label::none;
        if (r.label == Label::none && !code.empty()) table.fail_at(pattern, "is none of F, S, P and B", "mend the line");
        image.emplace_back(table.number(x), table.number(y));
        if (std::abs(image.back().first) > 10 || std::abs(image.back().second) > 10)
            table.fail_at(x, "lies far outside the image", "coordinates must be between 0 and 1");
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    const auto median = [&](auto take) {
        std::vector<double> values;
        for (const auto& p : image)
            if (std::isfinite(take(p))) values.push_back(take(p));
        if (values.empty()) return 0.0;
        std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
        return values[values.size() / 2];
    };
    const double x0 = median([](const auto& p) { return p.first; }), y0 = median([](const auto& p) { return p.second; });
    const double scale = kNominalDegPerImage * kRadPerDeg;
    for (std::size_t i = 0; i < image.size(); ++i) {
        EyeState& eye = recording.samples[i].sample.eye(Eye::combined);
        const double u = (image[i].first - x0) * scale, v = (image[i].second - y0) * scale;
        if (!std::isfinite(u) || !std::isfinite(v) || !(eye.confidence > 0) || std::abs(u) > 1.5 || std::abs(v) > 1.5) continue;
        set_gaze(eye, Direction<HeadFrame>::from({std::tan(u), std::tan(v), -1}));
    }
    return recording;
}

}  // namespace fovea::replay
