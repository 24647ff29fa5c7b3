// Tobii Pro Glasses 2 (livedata.json) and Glasses 3 (gazedata): JSON, one object per line, usually gzipped.
//
// Axes: +x LEFT, +y up, +z forward. Known from the files: the left eye's origin lies at x = +28 mm in both, the right
// one at -29 and -32 mm; and where gaze2d (0 left, 0 top) is right of the middle, the direction's x is negative.
// Glasses 2: `ts` microseconds of the glasses' clock; the lines of one sample share `gidx`; `s` other than 0 means that
// the value is not to be used. Glasses 3: `timestamp` seconds since the start; an eye without a gaze is an empty object.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

using nlohmann::json;

// Calls take(object, where) for each line; `where` is file:line.
template <class Take>
Result<void> each_line(const ImportInput& input, Take&& take) {
    std::string_view rest = input.content;
    for (std::size_t line = 1; !rest.empty(); ++line) {
        const auto end = rest.find('\n');
        const std::string_view text = rest.substr(0, end);
        rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
        if (trimmed(text).empty()) continue;
        const std::string where = input.path.string() + ":" + std::to_string(line);
        try {
            const json object = json::parse(text.begin(), text.end());
            if (!object.is_object()) return fail("the line is no JSON object", where + ":1", "mend or delete the line");
            if (auto taken = take(object, where); !taken) return taken;
        } catch (const json::parse_error& e) {
            return fail(end == std::string_view::npos ? "the file ends in the middle of a line" : "the line is not JSON",
                        where + ":" + std::to_string(e.byte), "copy the file again, or delete the line");
        } catch (const json::exception& e) {  // a value of another type than the format's
            return fail(std::string("a value is of the wrong type: ") + e.what(), where + ":1", "mend or delete the line");
        }
    }
    return {};
}

std::optional<Direction<HeadFrame>> direction(const json& v) {
    if (!v.is_array() || v.size() != 3) return std::nullopt;
    return from_left_up_forward(v[0].get<double>(), v[1].get<double>(), v[2].get<double>());
}

Result<std::int64_t> time_ns(const json& value, double ns_per_unit, const std::string& where) {
    const double ns = value.is_number() ? value.get<double>() * ns_per_unit : kUnknown;
    if (std::abs(ns) < static_cast<double>(kMaxTime_ns)) return std::llround(ns);
    return fail("the time is missing or is none", where + ":1", "mend or delete the line");
}

void set_time(GazeSample& s, std::int64_t ns) {
    s.device_time.ns = ns;
    s.exposed = s.received = instant_from_ns(ns);
}

}  // namespace

bool recognise_tobii_glasses2(std::string_view prefix) {
    const std::string_view line = first_line(prefix);
    return line.starts_with("{\"ts\":") && line.find("\"s\":") != line.npos;
}

Result<Recording> read_tobii_glasses2(const ImportInput& input) {
    Recording recording{{"tobii_glasses2", "Tobii Pro Glasses 2", "", "", 0, false, false}, {}};
    std::map<std::int64_t, std::size_t> index;  // gidx -> sample
    auto read = each_line(input, [&](const json& o, const std::string& where) -> Result<void> {
        const bool gaze = o.contains("gd"), pupil = o.contains("pd");
        if ((!gaze && !pupil) || !o.contains("gidx") || !o.contains("eye")) return {};  // gyroscope, scene camera, ...
        const auto ts = time_ns(o.value("ts", json()), 1000, where);
        if (!ts) return std::unexpected(ts.error());
        const auto [entry, is_new] = index.try_emplace(o["gidx"].get<std::int64_t>(), recording.samples.size());
        if (is_new) {
            recording.samples.emplace_back();
            recording.samples.back().sample.id = recording.samples.size();
            set_time(recording.samples.back().sample, *ts);
        }
        const std::string side = o["eye"].get<std::string>();
        if (side != "left" && side != "right")
            return fail("the eye is neither left nor right", where + ":1", "mend or delete the line");
        EyeState& eye = recording.samples[entry->second].sample.eye(side == "left" ? Eye::left : Eye::right);
        const bool usable = o.value("s", 0) == 0;
        if (gaze && usable) set_gaze(eye, direction(o["gd"]));
        if (pupil && usable && o["pd"].get<double>() > 0) eye.pupil_mm = o["pd"].get<double>();
        return {};
    });
    if (!read) return std::unexpected(read.error());
    for (RecordedSample& r : recording.samples) combine_eyes(r.sample);
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

bool recognise_tobii_glasses3(std::string_view prefix) {
    const std::string_view line = first_line(prefix);
    return line.starts_with("{\"type\":\"") && line.find("\"timestamp\":") != line.npos;
}

Result<Recording> read_tobii_glasses3(const ImportInput& input) {
    Recording recording{{"tobii_glasses3", "Tobii Pro Glasses 3", "", "", 0, false, false}, {}};
    auto read = each_line(input, [&](const json& o, const std::string& where) -> Result<void> {
        if (o.value("type", "") != "gaze") return {};  // events and synchronisation marks
        const auto t = time_ns(o.value("timestamp", json()), 1e9, where);
        if (!t) return std::unexpected(t.error());
        RecordedSample r;
        r.sample.id = recording.samples.size() + 1;
        set_time(r.sample, *t);
        const json data = o.value("data", json::object());
        for (const auto& [key, side] : {std::pair{"eyeleft", Eye::left}, {"eyeright", Eye::right}}) {
            const json eye = data.value(key, json::object());
            EyeState& state = r.sample.eye(side);
            if (eye.contains("gazedirection")) set_gaze(state, direction(eye["gazedirection"]));
            if (eye.contains("pupildiameter") && eye["pupildiameter"].get<double>() > 0)
                state.pupil_mm = eye["pupildiameter"].get<double>();
        }
        combine_eyes(r.sample);
        recording.samples.push_back(r);
        return {};
    });
    if (!read) return std::unexpected(read.error());
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
