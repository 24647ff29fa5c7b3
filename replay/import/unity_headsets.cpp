// Headset recordings made in Unity: ischtz/jov2023-vr-objects (HTC Vive Pro Eye), and Pico Neo 3 Pro.
//
// Axes: +x right, +y up, +z forward, head frame; head rotation as Unity's Euler angles. Known for jov2023 from the files:
// the world point that was hit (gaze_x, _y, _z) lies within a median of 0.5 degrees of the direction turned by the head's
// rotation with these axes (5.5 degrees with x mirrored), over 4577 samples of sub06.
#include <cmath>
#include <utility>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {

bool recognise_jov2023(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, ',', "dir_x") && has_cell(header, ',', "gaze_object");
}

namespace {

// The head file beside "..._gaze.csv": "..._head.csv". Empty when there is none.
std::string read_head_file(const std::filesystem::path& gaze, std::filesystem::path& head) {
    std::string name = gaze.filename().string();
    const auto at = name.rfind("_gaze");
    if (at == std::string::npos) return {};
    head = gaze.parent_path() / name.replace(at, 5, "_head");
    auto content = read_recording_file(head);
    return content ? std::move(*content) : std::string{};
}

// Takes the pose of the line with the same time; the files are written in the same frames.
void add_head_pose(const ImportInput& input, Recording& recording, std::optional<Error>& error) {
    std::filesystem::path path;
    const std::string content = read_head_file(input.path, path);
    if (content.empty()) return;
    TextTable table(path, content, ',');
    if (table.read_header()) {
        const std::size_t time = table.need("time"), x = table.need("head_rot_x"), y = table.need("head_rot_y"),
                          z = table.need("head_rot_z");
        std::size_t next = 0;
        while (table.next_row()) {
            const std::int64_t t = table.need_time_ns(time, 0);
            const HeadPose head = head_from_unity_euler(table.number(x), table.number(y), table.number(z));
            auto& samples = recording.samples;
            while (next < samples.size() && samples[next].sample.device_time.ns < t) ++next;
            if (next < samples.size() && samples[next].sample.device_time.ns == t) samples[next++].sample.head = head;
        }
    }
    recording.info.has_head_pose = true;
    if (table.failed()) error = table.error().error();
}

}  // namespace

// time: seconds of Unity's frame clock, when the sample was fetched; the camera's own time is not in the file, so the
// exposure is marked estimated. About 28 % of the lines repeat the sample before: they stay. (0, 0, 1) is what the SDK
// gives without a gaze; a pupil of -1 is no pupil.
Result<Recording> read_jov2023(const ImportInput& input) {
    TextTable table(input.path, input.content, ',');
    if (!table.read_header()) return table.error();
    const std::size_t time = table.need("time"), x = table.need("dir_x"), y = table.need("dir_y"),
                      z = table.need("dir_z"), left = table.need("pupil_l"), right = table.need("pupil_r");
    Recording recording{{"jov2023", "HTC Vive Pro Eye (SRanipal in Unity)", "", "", 0, false, false}, {}};
    while (table.next_row()) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording.samples.size() + 1;
        s.device_time.ns = table.need_time_ns(time, 0);
        s.exposed = s.received = instant_from_ns(s.device_time.ns);
        s.exposed_estimated = true;
        for (const auto& [column, eye] : {std::pair{left, Eye::left}, {right, Eye::right}})
            if (const double pupil = table.number(column); pupil > 0) s.eye(eye).pupil_mm = pupil;
        combine_eyes(s);
        const double dx = table.number(x), dy = table.number(y), dz = table.number(z);
        const double n2 = dx * dx + dy * dy + dz * dz;
        if (n2 > 0 && (n2 < 0.81 || n2 > 1.21))
            table.fail_at(x, "the direction is not a unit vector", "this is not a file of this kind");
        const bool sentinel = dx == 0 && dy == 0;
        if (!sentinel) set_gaze(s.eye(Eye::combined), from_right_up_forward(dx, dy, dz));
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    std::optional<Error> error;
    add_head_pose(input, recording, error);
    if (error) return std::unexpected(*error);
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

bool recognise_pico_neo3(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, '\t', "Timeline") && header.find("Combine Eye Gaze Vector.") != header.npos;
}

// Timeline: seconds. Pose Status 52: tracked. Openness is only ever 0 or 1. The columns are those of EveCharbie/
// EyeDentify3d's documentation; its axes are taken to be Unity's, which no file here could confirm. Where forward is -z
// the axes are OpenXR's, as in Pico's native interface.
Result<Recording> read_pico_neo3(const ImportInput& input) {
    constexpr double kTracked = 52;
    TextTable table(input.path, input.content, '\t');
    if (!table.read_header()) return table.error();
    // With or without a blank before the axis.
    const auto axis = [&](const std::string& name, const char* letter) {
        const auto i = table.find(name + letter);
        return i ? i : table.find(name + " " + letter);
    };
    const auto need_axis = [&](const std::string& name, const char* letter) {
        const auto i = axis(name, letter);
        return i ? *i : table.need(name + " " + letter);
    };
    const std::string gaze = "Combine Eye Gaze Vector.";
    const std::size_t time = table.need("Timeline"), x = need_axis(gaze, "x"), y = need_axis(gaze, "y"),
                      z = need_axis(gaze, "z"),
                      left = table.need("Left Eye Pose Status"), right = table.need("Right Eye Pose Status");
    const auto open_left = table.find("Left Eye Gaze Openness"), open_right = table.find("Right Eye Gaze Openness"),
               head_x = axis("Head Rotation.", "x"), head_y = axis("Head Rotation.", "y"),
               head_z = axis("Head Rotation.", "z");
    Recording recording{{"pico_neo3", "Pico Neo 3 Pro Eye", "", "", 0, false, head_x && head_y && head_z}, {}};
    while (table.next_row()) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording.samples.size() + 1;
        s.device_time.ns = table.need_time_ns(time, 0);
        s.exposed = s.received = instant_from_ns(s.device_time.ns);
        s.eye(Eye::left).openness = table.number(open_left);
        s.eye(Eye::right).openness = table.number(open_right);
        combine_eyes(s);
        const double dx = table.number(x), dy = table.number(y), dz = table.number(z);
        const double n2 = dx * dx + dy * dy + dz * dz;
        if (n2 > 0 && (n2 < 0.64 || n2 > 1.44))
            table.fail_at(x, "the direction is not a unit vector", "this is not a file of this kind");
        if (table.number(left) == kTracked || table.number(right) == kTracked)
            set_gaze(s.eye(Eye::combined),
                     dz < 0 ? Direction<HeadFrame>::from({dx, dy, dz}) : from_right_up_forward(dx, dy, dz));
        if (recording.info.has_head_pose)
            s.head = head_from_unity_euler(table.number(head_x), table.number(head_y), table.number(head_z));
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
