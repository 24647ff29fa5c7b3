// NumPy .npy files with a structured array (t, x, y, status, evt), as in r-zemblys/irf (lookAtPoint_EL).
//
// Source: NumPy's NPY format 1.0 to 3.0; meaning of the fields: the README of r-zemblys/irf.
// t: seconds. x, y: degrees of visual angle on a flat screen, origin at its centre, x right, y DOWN. The sign of y was
// measured: in all 45 losses with a blink label in S1, S2 and S3, y rises by 7 to 29 degrees while the lid
// closes; a closing lid hides the upper pupil, so the tracker sees the gaze fall; and the EyeLink ASC recordings,
// whose pixels are known to count downwards, rise likewise in 25 of 25. Two independent screen angles make the
// direction (tan x, -tan y, -1).
// status: true when tracked. evt: 0 undefined, 1 fixation, 2 saccade, 3 post-saccadic, 4 pursuit, 5 blink.
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";

struct Field {
    std::string name, type;  // type: as NumPy writes it, e.g. "<f8"
    std::size_t offset = 0, size = 0;
};

struct NpyHeader {
    std::vector<Field> fields;
    std::size_t row_bytes = 0, rows = 0, data_offset = 0;
};

// Reads the quoted strings of "[('t', '<f8'), ('x', '<f4')]".
Result<NpyHeader> parse_header(const ImportInput& in) {
    const std::string_view c = in.content;
    const auto torn = [&](std::size_t byte) {
        return fail("the NumPy header is torn or foreign", in.path.string() + ":byte " + std::to_string(byte),
                    "copy the file again; it must hold a structured array saved by numpy.save");
    };
    if (c.size() < 12 || !c.starts_with(kMagic)) return torn(0);
    const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(c[i])); };
    const bool wide = byte(6) >= 2;
    const std::size_t length =
        wide ? byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24 : byte(8) | byte(9) << 8;
    NpyHeader h;
    h.data_offset = (wide ? 12 : 10) + length;
    if (byte(6) < 1 || byte(6) > 3 || h.data_offset > c.size()) return torn(6);
    const std::string_view text = c.substr(wide ? 12 : 10, length);

    const auto descr = text.find("'descr': ["), descr_end = text.find(']', descr);
    if (descr == std::string_view::npos || descr_end == std::string_view::npos)
        return fail("the array is not structured", in.path.string() + ":byte 10",
                    "the fields t, x, y, status and evt are expected");
    if (text.find("'fortran_order': True") != std::string_view::npos) return torn(10);
    std::vector<std::string> words;
    for (std::size_t i = descr + 9; i < descr_end;) {
        const auto open = text.find('\'', i), close = text.find('\'', open + 1);
        if (open >= descr_end || close >= descr_end) break;
        words.emplace_back(text.substr(open + 1, close - open - 1));
        i = close + 1;
    }
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
        const std::string& type = words[i + 1];
        std::size_t size = 0;
        if (type.size() < 3 || std::from_chars(type.data() + 2, type.data() + type.size(), size).ec != std::errc{} ||
            size == 0 || size > 16)
            return fail("field '" + words[i] + "' has the unknown type '" + type + "'", in.path.string() + ":byte 10",
                        "floats, integers and booleans are understood");
        h.fields.push_back({words[i], type, h.row_bytes, size});
        h.row_bytes += size;
    }
    const auto shape = text.find("'shape': (");
    if (shape == std::string_view::npos || h.row_bytes == 0) return torn(10);
    const char* first = text.data() + shape + 10;
    const auto [after, ec] = std::from_chars(first, text.data() + text.size(), h.rows);
    if (ec != std::errc{} || after == text.data() + text.size() || *after != ',' || after[1] != ')') return torn(10);
    return h;
}

// The field at `bytes` as double; nothing for a type that is not understood. The integers in question are small.
std::optional<double> read_number(const char* bytes, const Field& f) {
    if (f.type[0] == '>') return std::nullopt;
    const auto get = [&]<class T>(T value) {
        std::memcpy(&value, bytes, sizeof value);
        return static_cast<double>(value);
    };
    switch (f.type[1]) {
        case 'f': return f.size == 8 ? std::optional(get(double{})) : f.size == 4 ? std::optional(get(float{})) : std::nullopt;
        case 'b':
        case 'u':
        case 'i':
            if (f.size == 1) return f.type[1] == 'i' ? get(std::int8_t{}) : get(std::uint8_t{});
            if (f.size == 2) return f.type[1] == 'i' ? get(std::int16_t{}) : get(std::uint16_t{});
            if (f.size == 4) return f.type[1] == 'i' ? get(std::int32_t{}) : get(std::uint32_t{});
            if (f.size == 8) return f.type[1] == 'i' ? get(std::int64_t{}) : get(std::uint64_t{});
            return std::nullopt;
        default: return std::nullopt;
    }
}

}  // namespace

bool recognise_numpy(std::string_view prefix) { return prefix.starts_with(kMagic); }

Result<Recording> read_numpy(const ImportInput& in) {
    static_assert(std::endian::native == std::endian::little, "rows are read in place");
    const auto header = parse_header(in);
    if (!header) return std::unexpected(header.error());
    const auto find = [&](std::string_view name) -> const Field* {
        for (const Field& f : header->fields)
            if (f.name == name) return &f;
        return nullptr;
    };
    const Field *t = find("t"), *x = find("x"), *y = find("y"), *status = find("status"), *evt = find("evt");
    for (const auto& [name, field] : {std::pair{"t", t}, {"x", x}, {"y", y}}) {
        const char zero[16] = {};
        if (!field || !read_number(zero, *field))
            return fail(std::string("field '") + name + "' is missing or of a type that is not understood",
                        in.path.string() + ":byte 10", "the fields t, x, y (floats), status and evt are expected");
    }
    const std::size_t bytes = in.content.size() - header->data_offset;
    if (bytes / header->row_bytes != header->rows || bytes % header->row_bytes != 0)
        return fail("the header promises " + std::to_string(header->rows) + " rows of " +
                        std::to_string(header->row_bytes) + " bytes, the file holds " + std::to_string(bytes) + " bytes",
                    in.path.string() + ":byte " + std::to_string(header->data_offset),
                    "the file is torn: copy it again");

    Recording recording;
    recording.info.format = "numpy";
    recording.info.has_labels = evt != nullptr;
    recording.samples.reserve(header->rows);
    constexpr double degree = std::numbers::pi / 180;
    for (std::size_t i = 0; i < header->rows; ++i) {
        const char* row = in.content.data() + header->data_offset + i * header->row_bytes;
        const std::string where = in.path.string() + ":row " + std::to_string(i);
        const double t_s = *read_number(row + t->offset, *t), x_deg = *read_number(row + x->offset, *x),
                     y_deg = *read_number(row + y->offset, *y);
        if (!(std::abs(t_s) * 1e9 < static_cast<double>(kMaxTime_ns)))
            return fail("field 't' is not a time", where, "seconds are expected");
        RecordedSample r;
        r.sample.id = i + 1;
        r.sample.device_time.ns = std::llround(t_s * 1e9);
        r.sample.exposed = r.sample.received = instant_from_ns(r.sample.device_time.ns);
        EyeState& eye = r.sample.eye(Eye::combined);
        const bool tracked = !status || read_number(row + status->offset, *status).value_or(0) != 0;
        if (std::isfinite(x_deg) && std::isfinite(y_deg)) {
            if (tracked && (std::abs(x_deg) >= 89 || std::abs(y_deg) >= 89))
                return fail("a gaze of " + std::to_string(x_deg) + ", " + std::to_string(y_deg) +
                                " degrees cannot lie on a screen",
                            where, "fields 'x' and 'y' must be in degrees");
            if (std::abs(x_deg) < 89 && std::abs(y_deg) < 89) {
                eye.gaze_dir_head =
                    *Direction<HeadFrame>::from({std::tan(x_deg * degree), -std::tan(y_deg * degree), -1});
                eye.valid = tracked;
            }
        }
        if (evt) {
            const double code = read_number(row + evt->offset, *evt).value_or(0);
            if (code >= 0 && code < kLabelCount) r.label = static_cast<Label>(static_cast<int>(code));
        }
        recording.samples.push_back(r);
    }
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
