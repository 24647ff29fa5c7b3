// Pupil Labs: gaze_positions.csv of Pupil Core (Pupil Player), and gaze.csv of Pupil Invisible and Neon (Pupil Cloud).
//
// Source: Pupil Labs' documentation of the raw data exporters; the Cloud's format checked on a Pupil Invisible file:
// azimuth is negative where gaze x lies in the left half of the 1088 px wide image and elevation negative where gaze y
// lies in its lower half, so they are + right and + up.
// The frame is the scene camera's, which sits on the head.
#include <cmath>

#include "protocol/sphere.hpp"
#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {

bool recognise_pupil_core(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, ',', "gaze_timestamp") && has_cell(header, ',', "norm_pos_x");
}

// Time: seconds of Pupil's clock. gaze_point_3d and gaze_normal0 (right eye), gaze_normal1 (left eye): scene camera, +x
// right, +y down, +z forward. Low confidence stays a valid sample with its confidence: the pipeline decides.
Result<Recording> read_pupil_core(const ImportInput& input) {
    TextTable table(input.path, input.content, ',');
    if (!table.read_header()) return table.error();
    const std::size_t time = table.need("gaze_timestamp"), confidence = table.need("confidence");
    const std::size_t point[3] = {table.need("gaze_point_3d_x"), table.need("gaze_point_3d_y"),
                                  table.need("gaze_point_3d_z")};
    struct Normal {
        Eye eye;
        std::optional<std::size_t> x, y, z;
    };
    const Normal normals[2] = {
        {Eye::right, table.find("gaze_normal0_x"), table.find("gaze_normal0_y"), table.find("gaze_normal0_z")},
        {Eye::left, table.find("gaze_normal1_x"), table.find("gaze_normal1_y"), table.find("gaze_normal1_z")}};
    Recording recording{{"pupil_core", "Pupil Labs Pupil Core", "", "", 0, false, false}, {}};
    bool any_direction = false;
    while (table.next_row()) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording.samples.size() + 1;
        s.device_time.ns = table.need_time_ns(time, 0);
        s.exposed = s.received = instant_from_ns(s.device_time.ns);
        EyeState& combined = s.eye(Eye::combined);
        combined.confidence = table.number(confidence);
        set_gaze(combined, from_right_down_forward(table.number(point[0]), table.number(point[1]), table.number(point[2])));
        any_direction |= combined.valid;
        combined.valid &= combined.confidence > 0;
        for (const Normal& n : normals) {
            if (!n.x || !n.y || !n.z) continue;
            EyeState& eye = s.eye(n.eye);
            set_gaze(eye, from_right_down_forward(table.number(n.x), table.number(n.y), table.number(n.z)));
            eye.confidence = combined.confidence;
            eye.valid &= combined.valid;
        }
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    if (!any_direction && !recording.samples.empty())
        return fail("no line has a gaze_point_3d: the recording was calibrated in 2D, which knows no angles",
                    input.path.string() + ":2:1", "export it again with a 3D gaze mapper");
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

bool recognise_pupil_cloud(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, ',', "timestamp [ns]") && has_cell(header, ',', "azimuth [deg]");
}

// Time: int64 nanoseconds of UTC. Valid while worn. Labels: blink id, else fixation id (the vendor's detectors).
Result<Recording> read_pupil_cloud(const ImportInput& input) {
    TextTable table(input.path, input.content, ',');
    if (!table.read_header()) return table.error();
    const std::size_t time = table.need("timestamp [ns]"), az = table.need("azimuth [deg]"),
                      el = table.need("elevation [deg]");
    const auto worn = table.find("worn"), fixation = table.find("fixation id"), blink = table.find("blink id");
    Recording recording{{"pupil_cloud", "Pupil Labs Pupil Invisible or Neon", "", "", 0, fixation || blink, false}, {}};
    while (table.next_row()) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording.samples.size() + 1;
        s.device_time.ns = table.need_time_ns(time, -9);
        s.exposed = s.received = instant_from_ns(s.device_time.ns);
        const double az_deg = table.number(az), el_deg = table.number(el), worn_value = table.number(worn);
        if (std::abs(az_deg) > 180 || std::abs(el_deg) > 90)
            table.fail_at(az, "angles beyond +-180 degrees of azimuth or +-90 degrees of elevation",
                          "the columns must be in degrees");
        if (std::isfinite(az_deg) && std::isfinite(el_deg)) {
            EyeState& eye = s.eye(Eye::combined);
            eye.gaze_dir_head = from_azimuth_elevation<HeadFrame>({az_deg * kRadPerDeg, el_deg * kRadPerDeg});
            eye.valid = std::isnan(worn_value) || worn_value != 0;
        }
        if (!table.cell(blink).empty()) r.label = Label::blink;
        else if (!table.cell(fixation).empty()) r.label = Label::fixation;
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
