#include "replay/import/fovea_csv.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocol/sphere.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"
#include "replay/output_file.hpp"

namespace fovea::replay {
namespace {

constexpr std::string_view kMagic = "# fovea-gaze-csv ";
constexpr int kVersion = 1;
constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kEyeNames[kEyeCount] = {"combined", "left", "right"};

struct EyeColumns {
    std::optional<std::size_t> az, el, x, y, z, valid, openness, pupil, confidence;
    [[nodiscard]] bool any() const {
        return az || el || x || y || z || valid || openness || pupil || confidence;
    }
};

struct Columns {
    std::size_t t = 0;
    std::optional<std::size_t> id, exposed, received, estimated, label;
    std::array<EyeColumns, kEyeCount> eyes;
    std::optional<std::size_t> head_valid, head_w, head_x, head_y, head_z;
};

// Every column must be known: a misspelt one would otherwise vanish in silence.
bool find_columns(TextTable& table, Columns& c) {
    c.t = table.need("t_ns");
    std::vector<bool> known(table.names().size(), false);
    const auto find = [&](const std::string& name) {
        const auto i = table.find(name);
        if (i) known[*i] = true;
        return i;
    };
    (void)find("t_ns");
    c.id = find("id");
    c.exposed = find("exposed_ns");
    c.received = find("received_ns");
    c.estimated = find("exposed_estimated");
    c.label = find("label");
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        const std::string eye = kEyeNames[e];
        EyeColumns& columns = c.eyes[e];
        columns = {find(eye + "_az_deg"), find(eye + "_el_deg"),   find(eye + "_x"),
                   find(eye + "_y"),      find(eye + "_z"),        find(eye + "_valid"),
                   find(eye + "_openness"), find(eye + "_pupil_mm"), find(eye + "_confidence")};
        const int vector = columns.x.has_value() + columns.y.has_value() + columns.z.has_value();
        const int angles = columns.az.has_value() + columns.el.has_value();
        if (vector % 3 != 0 || angles % 2 != 0 || (vector != 0 && angles != 0))
            table.fail_line("the direction columns of eye '" + eye + "' are incomplete or given twice",
                            "give either " + eye + "_az_deg and " + eye + "_el_deg, or " + eye + "_x, " + eye +
                                "_y and " + eye + "_z");
    }
    c.head_valid = find("head_valid");
    c.head_w = find("head_w");
    c.head_x = find("head_x");
    c.head_y = find("head_y");
    c.head_z = find("head_z");
    const int head = c.head_w.has_value() + c.head_x.has_value() + c.head_y.has_value() + c.head_z.has_value();
    if (head % 4 != 0 || (c.head_valid && head == 0))
        table.fail_line("the head pose columns are incomplete", "give head_w, head_x, head_y and head_z, or none");
    for (std::size_t i = 0; i < known.size(); ++i)
        if (!known[i])
            table.fail_line("unknown column '" + table.names()[i] + "'",
                            "docs/recording_csv.md lists the columns; others are not allowed");
    return !table.failed();
}

// A length that rounding explains stays as it is, bit for bit; up to 10 % off is normalised; more is a wrong unit.
bool unit_length(double n2, bool& normalise) {
    normalise = std::abs(n2 - 1) > 1e-9;
    return n2 > 0.81 && n2 < 1.21;
}

void read_direction(TextTable& table, const EyeColumns& c, EyeState& eye) {
    const std::size_t column = c.x ? *c.x : *c.az;
    bool given = false, finite = false, legal = true;
    if (c.x) {
        const double x = table.number(c.x), y = table.number(c.y), z = table.number(c.z);
        given = !(table.cell(c.x).empty() && table.cell(c.y).empty() && table.cell(c.z).empty());
        if (given) {
            eye.gaze_dir_head = {x, y, z};
            finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
            bool normalise = false;
            if (finite) legal = unit_length(x * x + y * y + z * z, normalise);
            if (finite && legal && normalise) eye.gaze_dir_head = *Direction<HeadFrame>::from({x, y, z});
        }
    } else {
        const double az = table.number(c.az), el = table.number(c.el);
        given = !(table.cell(c.az).empty() && table.cell(c.el).empty());
        if (given) {
            finite = std::isfinite(az) && std::isfinite(el);
            legal = !finite || (std::abs(az) <= 180 && std::abs(el) <= 90);
            eye.gaze_dir_head = finite ? from_azimuth_elevation<HeadFrame>({az * kDegree, el * kDegree})
                                       : Direction<HeadFrame>{kUnknown, kUnknown, kUnknown};
        }
    }
    eye.valid = c.valid ? table.need_flag(*c.valid) : given && finite;
    if (eye.valid && !given)
        table.fail_at(column, "a valid sample without a direction", "give the direction, or set the valid flag to 0");
    if (eye.valid && !legal)
        table.fail_at(column,
                      c.x ? "the vector is not of unit length"
                          : "the angles are beyond +-180 degrees of azimuth or +-90 degrees of elevation",
                      "mend the direction, or set the valid flag to 0");
}

void read_head(TextTable& table, const Columns& c, HeadPose& head) {
    const bool given = !table.cell(c.head_w).empty();
    if (given) {
        const double w = table.number(c.head_w), x = table.number(c.head_x), y = table.number(c.head_y),
                     z = table.number(c.head_z);
        const double n2 = w * w + x * x + y * y + z * z;
        bool normalise = false;
        const bool legal = unit_length(n2, normalise);
        const double s = legal && normalise ? 1 / std::sqrt(n2) : 1;
        head.world_from_head = {w * s, x * s, y * s, z * s};
        head.valid = true;
        if (c.head_valid) head.valid = table.need_flag(*c.head_valid);
        if (head.valid && !legal)
            table.fail_at(*c.head_w, "the head quaternion is not of unit length",
                          "mend it, leave all four cells empty, or set head_valid to 0");
    } else if (c.head_valid && table.need_flag(*c.head_valid)) {
        table.fail_at(*c.head_w, "a valid head pose without a quaternion", "give it, or set head_valid to 0");
    }
}

struct Preamble {
    RecordingInfo info;
    std::optional<std::size_t> samples;
    std::size_t lines = 0, bytes = 0;
};

Result<Preamble> read_preamble(const std::filesystem::path& path, std::string_view content) {
    Preamble p;
    const auto where = [&] { return path.string() + ":" + std::to_string(p.lines) + ":1"; };
    if (content.starts_with("\xef\xbb\xbf")) p.bytes = 3;
    while (p.bytes < content.size() && content[p.bytes] == '#') {
        std::string_view line = content.substr(p.bytes);
        const auto end = line.find('\n');
        ++p.lines;
        if (end == std::string_view::npos)
            return fail("the file ends in the middle of its preamble", where(), "copy the file again");
        line = trimmed(line.substr(0, end));
        p.bytes += end + 1;
        if (p.lines == 1) {
            int version = 0;
            const std::string_view text = line.substr(std::min(line.size(), kMagic.size()));
            const auto [stop, ec] = std::from_chars(text.data(), text.data() + text.size(), version);
            if (!line.starts_with(kMagic) || ec != std::errc{} || stop != text.data() + text.size())
                return fail("the first line is not '# fovea-gaze-csv 1'", where(), "see docs/recording_csv.md");
            if (version != kVersion)
                return fail("format version " + std::to_string(version) + " is not known; this Fovea reads version " +
                                std::to_string(kVersion),
                            where(), version > kVersion ? "update Fovea" : "see docs/recording_csv.md");
            continue;
        }
        const auto colon = line.find(':');
        if (colon == std::string_view::npos) continue;  // a remark
        const std::string_view key = trimmed(line.substr(1, colon - 1)), value = trimmed(line.substr(colon + 1));
        if (key == "device") p.info.device = value;
        if (key == "source") p.info.source = value;
        if (key == "licence") p.info.licence = value;
        const char* const value_end = value.data() + value.size();
        if (key == "rate_hz") {
            const auto [stop, ec] = std::from_chars(value.data(), value_end, p.info.nominal_rate_hz);
            if (ec != std::errc{} || stop != value_end || !(p.info.nominal_rate_hz >= 0 && p.info.nominal_rate_hz <= 1e6))
                return fail("rate_hz is not a rate between 0 and 1000000", where(), "0 means unknown");
        }
        if (key == "samples") {
            std::size_t count = 0;
            const auto [stop, ec] = std::from_chars(value.data(), value_end, count);
            if (ec != std::errc{} || stop != value_end)
                return fail("samples is not a count", where(), "correct the number, or delete the line");
            p.samples = count;
        }
    }
    return p;
}

// Exactly the default, bit for bit: such a value needs no cells.
bool is_default(const Direction<HeadFrame>& d) {
    return d == Direction<HeadFrame>{} && !std::signbit(d.x) && !std::signbit(d.y);
}
bool is_default(const Rotation<WorldFrame, HeadFrame>& q) {
    return q == Rotation<WorldFrame, HeadFrame>{} && !std::signbit(q.x) && !std::signbit(q.y) && !std::signbit(q.z);
}

// Appends text; every number in the shortest form that reads back as the same bits.
class Text {
public:
    std::string out;
    void integer(std::int64_t v) { digits(v); }
    void real(double v) {
        if (!std::isnan(v)) digits(v);  // unknown: an empty cell
    }
    void coordinate(double v) { digits(v); }  // NaN is written as such: it was given
    void fixed(double v, int decimals) {
        char buffer[64];
        auto [end, ec] = std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::fixed, decimals);
        std::string_view text(buffer, static_cast<std::size_t>(end - buffer));
        if (text.find('.') != std::string_view::npos) {
            while (text.back() == '0') text.remove_suffix(1);
            if (text.back() == '.') text.remove_suffix(1);
        }
        out += text == "-0" ? "0" : text;
    }
    void next() { out += ','; }

private:
    template <class T>
    void digits(T v) {
        char buffer[64];
        const auto [end, ec] = std::to_chars(buffer, buffer + sizeof buffer, v);
        out.append(buffer, end);
    }
};

// Which columns a recording needs.
struct Needed {
    bool id = false, exposed = false, received = false, estimated = false, label = false, head = false;
    struct Eye {
        bool any = false, openness = false, pupil = false, confidence = false;
    };
    std::array<Eye, kEyeCount> eyes;
};

Needed needed_columns(const Recording& recording) {
    Needed n;
    n.label = recording.info.has_labels;
    n.head = recording.info.has_head_pose;
    std::uint64_t id = 0;
    for (const RecordedSample& r : recording.samples) {
        const GazeSample& s = r.sample;
        n.id |= s.id != ++id;
        n.exposed |= to_ns(s.exposed) != s.device_time.ns;
        n.received |= s.received != s.exposed;
        n.estimated |= s.exposed_estimated;
        n.label |= r.label != Label::none;
        n.head |= s.head.valid || !is_default(s.head.world_from_head);
        for (std::size_t e = 0; e < kEyeCount; ++e) {
            n.eyes[e].any |= s.eyes[e].valid || !is_default(s.eyes[e].gaze_dir_head);
            n.eyes[e].openness |= !std::isnan(s.eyes[e].openness);
            n.eyes[e].pupil |= !std::isnan(s.eyes[e].pupil_mm);
            n.eyes[e].confidence |= !std::isnan(s.eyes[e].confidence);
        }
    }
    return n;
}

std::string one_line(std::string_view text) {
    std::string out(text);
    for (char& c : out)
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return out;
}

void write_header(Text& t, const Recording& recording, const Needed& n, bool degrees) {
    t.out += kMagic;
    t.integer(kVersion);
    t.out += "\n# device: " + one_line(recording.info.device) + "\n# source: " + one_line(recording.info.source) +
             "\n# licence: " + one_line(recording.info.licence) + "\n# rate_hz: ";
    t.coordinate(recording.info.nominal_rate_hz);
    t.out += "\n# samples: " + std::to_string(recording.samples.size()) + "\nt_ns";
    if (n.id) t.out += ",id";
    if (n.exposed) t.out += ",exposed_ns";
    if (n.received) t.out += ",received_ns";
    if (n.estimated) t.out += ",exposed_estimated";
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        const std::string eye = std::string(",") + kEyeNames[e];
        if (n.eyes[e].any) t.out += degrees ? eye + "_az_deg" + eye + "_el_deg" : eye + "_x" + eye + "_y" + eye + "_z";
        if (n.eyes[e].any) t.out += eye + "_valid";
        if (n.eyes[e].openness) t.out += eye + "_openness";
        if (n.eyes[e].pupil) t.out += eye + "_pupil_mm";
        if (n.eyes[e].confidence) t.out += eye + "_confidence";
    }
    if (n.head) t.out += ",head_valid,head_w,head_x,head_y,head_z";
    if (n.label) t.out += ",label";
    t.out += '\n';
}

void write_eye(Text& t, const EyeState& eye, const Needed::Eye& n, int decimals) {
    if (n.any && decimals < 0) {
        const bool blank = !eye.valid && is_default(eye.gaze_dir_head);
        for (const double v : {eye.gaze_dir_head.x, eye.gaze_dir_head.y, eye.gaze_dir_head.z}) {
            t.next();
            if (!blank) t.coordinate(v);
        }
    } else if (n.any) {
        const AzimuthElevation a = to_azimuth_elevation(eye.gaze_dir_head);
        for (const double v : {a.azimuth_rad, a.elevation_rad}) {
            t.next();
            if (eye.valid && std::isnan(v)) t.out += "nan";
            else if (eye.valid) t.fixed(v / kDegree, decimals);
        }
    }
    if (n.any) t.out += eye.valid ? ",1" : ",0";
    if (n.openness) t.next(), t.real(eye.openness);
    if (n.pupil) t.next(), t.real(eye.pupil_mm);
    if (n.confidence) t.next(), t.real(eye.confidence);
}

}  // namespace

bool recognise_fovea_csv(std::string_view prefix) {
    if (prefix.starts_with("\xef\xbb\xbf")) prefix.remove_prefix(3);
    return prefix.starts_with(kMagic);
}

Result<Recording> read_fovea_csv(const ImportInput& input) {
    auto preamble = read_preamble(input.path, input.content);
    if (!preamble) return std::unexpected(preamble.error());
    Recording recording{preamble->info, {}};
    TextTable table(input.path, input.content.substr(preamble->bytes), ',', preamble->lines + 1);
    Columns c;
    if (!table.read_header() || !find_columns(table, c)) return table.error();
    recording.info.format = "fovea_csv";
    recording.info.has_labels = c.label.has_value();
    recording.info.has_head_pose = c.head_w.has_value();
    if (preamble->samples) recording.samples.reserve(std::min(*preamble->samples, input.content.size() / 4));
    const auto time = [&](std::size_t column) {
        const std::int64_t ns = table.need_integer(column);
        if (ns > kMaxTime_ns || ns < -kMaxTime_ns)
            table.fail_at(column, "the time lies outside +-2^62 ns", "count from an epoch within 146 years");
        return ns;
    };
    while (table.next_row()) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording.samples.size() + 1;
        if (c.id) s.id = static_cast<std::uint64_t>(table.need_integer(*c.id));
        s.device_time.ns = time(c.t);
        s.exposed = instant_from_ns(c.exposed ? time(*c.exposed) : s.device_time.ns);
        s.received = c.received ? instant_from_ns(time(*c.received)) : s.exposed;
        if (c.estimated) s.exposed_estimated = table.need_flag(*c.estimated);
        for (std::size_t e = 0; e < kEyeCount; ++e) {
            const EyeColumns& columns = c.eyes[e];
            if (columns.x || columns.az) read_direction(table, columns, s.eyes[e]);
            s.eyes[e].openness = table.number(columns.openness);
            s.eyes[e].pupil_mm = table.number(columns.pupil);
            s.eyes[e].confidence = table.number(columns.confidence);
        }
        if (c.head_w) read_head(table, c, s.head);
        if (c.label && !table.cell(c.label).empty()) {
            const auto label = label_from(table.cell(c.label));
            if (!label)
                table.fail_at(*c.label, "unknown label",
                              "labels are none, fixation, saccade, post_saccadic, pursuit and blink");
            r.label = label.value_or(Label::none);
        }
        if (table.unterminated())
            table.fail_line("the file ends in the middle of a line", "copy the file again, or end its last line");
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    if (preamble->samples && *preamble->samples != recording.samples.size())
        return fail("the preamble promises " + std::to_string(*preamble->samples) + " samples, the file holds " +
                        std::to_string(recording.samples.size()),
                    input.path.string() + ":" + std::to_string(table.line()) + ":1",
                    "copy the file again, or correct or delete the line '# samples:'");
    return recording;
}

std::string to_csv(const Recording& recording, const CsvOptions& options) {
    const Needed n = needed_columns(recording);
    Text t;
    t.out.reserve(recording.samples.size() * 64 + 1024);
    write_header(t, recording, n, options.degree_decimals >= 0);
    for (const RecordedSample& r : recording.samples) {
        const GazeSample& s = r.sample;
        t.integer(s.device_time.ns);
        if (n.id) t.next(), t.integer(static_cast<std::int64_t>(s.id));
        if (n.exposed) t.next(), t.integer(to_ns(s.exposed));
        if (n.received) t.next(), t.integer(to_ns(s.received));
        if (n.estimated) t.out += s.exposed_estimated ? ",1" : ",0";
        for (std::size_t e = 0; e < kEyeCount; ++e) write_eye(t, s.eyes[e], n.eyes[e], options.degree_decimals);
        if (n.head) {
            t.out += s.head.valid ? ",1" : ",0";
            const auto& q = s.head.world_from_head;
            const bool blank = !s.head.valid && is_default(q);
            for (const double v : {q.w, q.x, q.y, q.z}) {
                t.next();
                if (!blank) t.coordinate(v);
            }
        }
        if (n.label) {
            t.next();
            if (r.label != Label::none) t.out += to_string(r.label);
        }
        t.out += '\n';
    }
    return std::move(t.out);
}

Result<void> write_csv(const std::filesystem::path& path, const Recording& recording, const CsvOptions& options) {
    std::error_code ignored;
    if (!options.overwrite && std::filesystem::exists(path, ignored))
        return fail("the file exists", path.string(), "choose another name, or allow overwriting");
    return write_file(path.string(), to_csv(recording, options));
}

}  // namespace fovea::replay
