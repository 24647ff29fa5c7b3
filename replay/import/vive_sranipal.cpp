// HTC Vive Pro Eye, SRanipal: a ';' CSV with one line per eye camera frame, as in EveCharbie/EyeDentify3d.
//
// Axes: gaze_direct has +x LEFT, +y up, +z forward. Known from the files: gaze_origin_L.x is about +39 mm and
// gaze_origin_R.x about -31 mm, so the left eye is on +x; and in all four files the eye moves by the vestibulo-ocular
// reflex towards +x while helmet_rot_y (Unity: positive turns right) grows, and towards +y while helmet_rot_x (Unity:
// positive looks down) grows (gain 0.42 to 0.91, the same sign in all eight measurements).
// Times: time_stamp(ms) is the tracker's own clock (steps of 8 and 9 ms at 120 Hz, a 32-bit count that wraps), so it
// is the device time; time(100ns) is the host's clock at arrival (.NET ticks, jitter of -4 to +4 ms). Arrival becomes
// `received`: the fastest one counts as no delay.
// Validity: eye_valid is a bit set (SRanipal: 1 origin, 2 direction, 4 pupil diameter, 8 openness, 16 pupil position).
#include <limits>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

constexpr std::int64_t kDirectionBit = 2, kPupilBit = 4, kOpennessBit = 8;
constexpr std::int64_t kTicksAtUnixEpoch = 621'355'968'000'000'000;  // .NET counts 100 ns since the year 1
constexpr std::int64_t kMaxTicks = kMaxTime_ns / 2 / 100;  // so that no difference below overflows
constexpr std::int64_t kMaxTurns = 1000;                   // 136 years
// A host clock that strays further than this from the tracker's says nothing about delay.
constexpr std::int64_t kMaxDelay_ns = 250'000'000;

struct EyeColumns {
    std::size_t valid, openness, pupil, x, y, z;
};

EyeColumns eye_columns(TextTable& table, const std::string& side) {
    return {table.need("eye_valid_" + side),       table.need("openness_" + side),
            table.need("pupil_diameter_" + side + "(mm)"), table.need("gaze_direct_" + side + ".x"),
            table.need("gaze_direct_" + side + ".y"), table.need("gaze_direct_" + side + ".z")};
}

void read_eye(TextTable& table, const EyeColumns& c, EyeState& eye) {
    const std::int64_t bits = table.need_integer(c.valid);
    if (bits < 0 || bits > 31) table.fail_at(c.valid, "is not a set of 5 bits", "0 to 31 are legal; 31 is all valid");
    const double x = table.number(c.x), y = table.number(c.y), z = table.number(c.z);
    if ((bits & kDirectionBit) != 0) {
        const double n2 = x * x + y * y + z * z;
        const auto direction = from_left_up_forward(x, y, z);
        if (direction && (n2 < 0.64 || n2 > 1.44))
            table.fail_at(c.x, "the direction is not a unit vector", "this is not a SRanipal file");
        eye.valid = direction.has_value();
        if (direction) eye.gaze_dir_head = *direction;
    }
    const double openness = table.number(c.openness), pupil = table.number(c.pupil);
    if ((bits & kOpennessBit) != 0) eye.openness = openness;
    if ((bits & kPupilBit) != 0 && pupil > 0) eye.pupil_mm = pupil;
}

}  // namespace

bool recognise_vive_sranipal(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, ';', "gaze_direct_L.x") && has_cell(header, ';', "time_stamp(ms)");
}

Result<Recording> read_vive_sranipal(const ImportInput& input) {
    TextTable table(input.path, input.content, ';');
    if (!table.read_header()) return table.error();
    const std::size_t ticks = table.need("time(100ns)"), stamp = table.need("time_stamp(ms)");
    const EyeColumns left = eye_columns(table, "L"), right = eye_columns(table, "R");
    const auto head_x = table.find("helmet_rot_x"), head_y = table.find("helmet_rot_y"),
               head_z = table.find("helmet_rot_z");
    Recording recording;
    recording.info = {"vive_sranipal", "HTC Vive Pro Eye (SRanipal)", "", "", 0, false, head_x && head_y && head_z};

    std::int64_t last_stamp = 0, turns = 0, least_delay = std::numeric_limits<std::int64_t>::max();
    std::vector<std::int64_t> delays;  // host clock minus tracker clock, from some constant
    while (table.next_row()) {
        RecordedSample r;
        const std::int64_t stamp_ms = table.need_integer(stamp), tick = table.need_integer(ticks);
        if (stamp_ms < -(std::int64_t{1} << 31) || stamp_ms >= std::int64_t{1} << 32)
            table.fail_at(stamp, "does not fit into 32 bits", "this is not a SRanipal file");
        if (tick < kTicksAtUnixEpoch - kMaxTicks || tick > kTicksAtUnixEpoch + kMaxTicks)
            table.fail_at(ticks, "is not a .NET time within 70 years of 1970", "this is not a SRanipal file");
        if (table.failed()) break;
        if (!recording.samples.empty() && stamp_ms - last_stamp < -(std::int64_t{1} << 31)) ++turns;
        if (turns > kMaxTurns) table.fail_at(stamp, "runs backwards again and again", "the file is damaged: copy it again");
        if (table.failed()) break;
        last_stamp = stamp_ms;
        r.sample.id = recording.samples.size() + 1;
        r.sample.device_time.ns = (stamp_ms + (turns << 32)) * 1'000'000;
        r.sample.exposed = instant_from_ns(r.sample.device_time.ns);
        delays.push_back((tick - kTicksAtUnixEpoch) * 100 - r.sample.device_time.ns);
        least_delay = std::min(least_delay, delays.back());
        read_eye(table, left, r.sample.eye(Eye::left));
        read_eye(table, right, r.sample.eye(Eye::right));
        combine_eyes(r.sample);
        if (recording.info.has_head_pose)
            r.sample.head = head_from_unity_euler(table.number(head_x), table.number(head_y), table.number(head_z));
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
        GazeSample& s = recording.samples[i].sample;
        const auto delay = static_cast<unsigned __int128>(delays[i] - static_cast<__int128>(least_delay));
        s.received = s.exposed + Duration{delay <= kMaxDelay_ns ? static_cast<std::int64_t>(delay) : 0};
    }
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
