// XDF 1.0, the recording format of the Lab Streaming Layer: the first stream of type "Gaze" that has directions.
//
// Source: "Specifications" of sccn/xdf (chunk layout) and its meta-data page for gaze. Read here and not by libxdf,
// which is GPL-3 (this project is Apache-2.0), keeps no double channels, and trusts the file.
//
//   "XDF:" then chunks   [length of length: 1, 4 or 8][length][tag u16][content]
//   tag 2 stream header  [stream id u32][XML]
//   tag 3 samples        [stream id u32][count, as a length][per sample: 0 or 8, then the stamp f64][channel values]
//
// Time: the stamps of the stream (seconds of its LSL clock), or the one before plus the nominal interval.
// Channels: by type and eye: DirectionX, Y, Z of left, right and both; without directions of "both", PositionX, Y, Z of
// "both" (the gaze point, seen from the origin); Confidence; Diameter in mm. The meta-data name no axes: where forward is
// +z the axes are a camera's (+x right, +y down; so does the Pupil relay), where it is -z they are ours.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

constexpr std::string_view kMagic = "XDF:";
constexpr std::size_t kMaxChannels = 4096;

// The content of the first <tag> element in `xml`, or nothing. Enough for the flat XML that XDF headers are.
std::optional<std::string_view> element(std::string_view xml, const std::string& tag) {
    const auto open = xml.find("<" + tag + ">");
    if (open == xml.npos) return std::nullopt;
    const auto from = open + tag.size() + 2, close = xml.find("</" + tag + ">", from);
    if (close == xml.npos) return std::nullopt;
    return trimmed(xml.substr(from, close - from));
}

bool same_word(std::string_view a, std::string_view b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
               return (x >= 'A' && x <= 'Z' ? x + 32 : x) == (y >= 'A' && y <= 'Z' ? y + 32 : y);
           });
}

enum class Format : std::uint8_t { float32, double64, int8, int16, int32, int64, string };

struct Channels {  // index of each wanted channel; -1: absent
    int direction[kEyeCount][3] = {{-1, -1, -1}, {-1, -1, -1}, {-1, -1, -1}};
    int point[3] = {-1, -1, -1};
    int confidence[kEyeCount] = {-1, -1, -1};
    int diameter_mm[kEyeCount] = {-1, -1, -1};
};

struct Stream {
    std::string name;
    Format format = Format::float32;
    std::size_t channel_count = 0;
    double rate_hz = 0, last_stamp_s = 0;
    Channels channels;
};

std::size_t eye_of(std::string_view text) {
    return static_cast<std::size_t>(same_word(text, "left") ? Eye::left : same_word(text, "right") ? Eye::right : Eye::combined);
}

Channels find_channels(std::string_view xml) {
    Channels c;
    std::size_t at = 0;
    for (int index = 0;; ++index) {
        const auto open = xml.find("<channel>", at);
        if (open == xml.npos) return c;
        at = std::min(xml.find("</channel>", open), xml.size());
        const std::string_view channel = xml.substr(open, at - open);
        const std::string_view type = element(channel, "type").value_or(""), unit = element(channel, "unit").value_or("");
        const std::size_t eye = eye_of(element(channel, "eye").value_or("both"));
        const auto first = [&](int& slot) { slot = slot < 0 ? index : slot; };
        for (int axis = 0; axis < 3; ++axis) {
            const char letter = static_cast<char>('X' + axis);
            if (same_word(type, std::string("Direction") + letter)) first(c.direction[eye][axis]);
            if (same_word(type, std::string("Position") + letter) && eye == 0) first(c.point[axis]);
        }
        if (same_word(type, "Confidence")) first(c.confidence[eye]);
        if (same_word(type, "Diameter") && (same_word(unit, "mm") || same_word(unit, "millimeters"))) first(c.diameter_mm[eye]);
    }
}

class XdfReader {
public:
    explicit XdfReader(const ImportInput& input) : input_(input), data_(input.content) {}

    Result<Recording> read() {
        at_ = kMagic.size();
        while (at_ < data_.size() && !error_) read_chunk();
        if (error_) return std::unexpected(*error_);
        if (!stream_)
            return fail("there is no stream of type Gaze with channels of direction", input_.path.string(),
                        "record a stream whose channels have the types DirectionX, DirectionY and DirectionZ");
        recording_.info.device = stream_->name;
        recording_.info.nominal_rate_hz = stream_->rate_hz > 0 ? stream_->rate_hz : measured_rate_hz(recording_);
        return std::move(recording_);
    }

private:
    void set_error(std::string what, std::string way_out) {
        if (!error_)
            error_ = Error{std::move(what), input_.path.string() + ":byte " + std::to_string(at_), std::move(way_out)};
    }
    void torn() { set_error("the XDF data are torn", "copy the file again from its origin"); }

    template <class T>
    T take(std::size_t end) {
        T value{};
        if (error_ || end > data_.size() || at_ > end || end - at_ < sizeof(T)) {
            torn();
            return value;
        }
        std::memcpy(&value, data_.data() + at_, sizeof value);
        at_ += sizeof value;
        return value;
    }

    std::uint64_t take_length(std::size_t end) {
        switch (take<std::uint8_t>(end)) {
            case 1: return take<std::uint8_t>(end);
            case 4: return take<std::uint32_t>(end);
            case 8: return take<std::uint64_t>(end);
            default: torn(); return 0;
        }
    }

    void read_chunk() {
        const std::uint64_t length = take_length(data_.size());
        if (error_) return;
        if (length < 2 || length > data_.size() - at_) return torn();
        const std::size_t end = at_ + static_cast<std::size_t>(length);
        const auto tag = take<std::uint16_t>(end);
        if (tag == 2) read_header(end);
        if (tag == 3) read_samples(end);
        at_ = error_ ? at_ : end;
    }

    void read_header(std::size_t end) {
        const auto id = take<std::uint32_t>(end);
        if (error_ || stream_) return;
        const std::string_view xml = data_.substr(at_, end - at_);
        if (!same_word(element(xml, "type").value_or(""), "Gaze")) return;
        Stream s;
        s.name = element(xml, "name").value_or("");
        s.channels = find_channels(xml);
        const auto whole = [](const int (&axes)[3]) { return axes[0] >= 0 && axes[1] >= 0 && axes[2] >= 0; };
        if (!whole(s.channels.direction[0]) && !whole(s.channels.direction[1]) && !whole(s.channels.direction[2]) &&
            !whole(s.channels.point))
            return;
        static const std::map<std::string_view, Format> formats = {
            {"float32", Format::float32}, {"double64", Format::double64}, {"int8", Format::int8}, {"int16", Format::int16},
            {"int32", Format::int32},     {"int64", Format::int64},       {"string", Format::string}};
        const auto format = formats.find(element(xml, "channel_format").value_or(""));
        const std::string_view count = element(xml, "channel_count").value_or(""),
                               rate = element(xml, "nominal_srate").value_or("0");
        std::from_chars(count.data(), count.data() + count.size(), s.channel_count);
        std::from_chars(rate.data(), rate.data() + rate.size(), s.rate_hz);
        if (format == formats.end() || s.channel_count == 0 || s.channel_count > kMaxChannels || !(s.rate_hz >= 0 && s.rate_hz <= 1e6))
            return set_error("the header of the Gaze stream is damaged", "copy the file again from its origin");
        s.format = format->second;
        stream_ = std::move(s);
        stream_id_ = id;
    }

    double take_value(std::size_t end) {
        switch (stream_->format) {
            case Format::float32: return static_cast<double>(take<float>(end));
            case Format::double64: return take<double>(end);
            case Format::int8: return take<std::int8_t>(end);
            case Format::int16: return take<std::int16_t>(end);
            case Format::int32: return take<std::int32_t>(end);
            case Format::int64: return static_cast<double>(take<std::int64_t>(end));
            case Format::string: {
                const std::uint64_t length = take_length(end);
                if (error_ || length > end - at_) {
                    torn();
                    return kUnknown;
                }
                at_ += static_cast<std::size_t>(length);
                return kUnknown;
            }
        }
        return kUnknown;
    }

    void read_samples(std::size_t end) {
        const auto id = take<std::uint32_t>(end);
        if (error_ || !stream_ || id != stream_id_) return;
        const std::uint64_t count = take_length(end);
        std::vector<double> values(stream_->channel_count);
        for (std::uint64_t i = 0; i < count && !error_; ++i) {
            const auto stamp_bytes = take<std::uint8_t>(end);
            if (stamp_bytes == 8)
                stream_->last_stamp_s = take<double>(end);
            else if (stamp_bytes == 0)
                stream_->last_stamp_s += stream_->rate_hz > 0 ? 1 / stream_->rate_hz : 0;
            else
                torn();
            for (double& v : values) v = take_value(end);
            if (error_) return;
            if (!(std::abs(stream_->last_stamp_s) * 1e9 < static_cast<double>(kMaxTime_ns)))
                return set_error("a time stamp is none", "the file is damaged: copy it again");
            add(values);
        }
    }

    void add(const std::vector<double>& values) {
        const Channels& c = stream_->channels;
        const auto get = [&](int channel) {
            return channel >= 0 && static_cast<std::size_t>(channel) < values.size() ? values[static_cast<std::size_t>(channel)]
                                                                                     : kUnknown;
        };
        const auto direction = [&](const int (&axes)[3]) {
            const double x = get(axes[0]), y = get(axes[1]), z = get(axes[2]);
            return z > 0 ? from_right_down_forward(x, y, z) : Direction<HeadFrame>::from({x, y, z});
        };
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = recording_.samples.size() + 1;
        s.device_time.ns = std::llround(stream_->last_stamp_s * 1e9);
        s.exposed = s.received = instant_from_ns(s.device_time.ns);
        for (std::size_t e = 0; e < kEyeCount; ++e) {
            set_gaze(s.eyes[e], direction(c.direction[e]));
            s.eyes[e].confidence = get(c.confidence[e]);
            if (get(c.diameter_mm[e]) > 0) s.eyes[e].pupil_mm = get(c.diameter_mm[e]);
        }
        const EyeState given = s.eye(Eye::combined);
        if (!given.valid) {
            combine_eyes(s);
            EyeState& combined = s.eye(Eye::combined);
            if (const auto point = direction(c.point); !combined.valid && point) set_gaze(combined, point);
            if (!std::isnan(given.confidence)) combined.confidence = given.confidence;
        }
        recording_.samples.push_back(r);
    }

    const ImportInput& input_;
    std::string_view data_;
    std::size_t at_ = 0;
    std::optional<Stream> stream_;
    std::uint32_t stream_id_ = 0;
    std::optional<Error> error_;
    Recording recording_{{"xdf", "", "", "", 0, false, false}, {}};
};

}  // namespace

bool recognise_xdf(std::string_view prefix) { return prefix.starts_with(kMagic); }

Result<Recording> read_xdf(const ImportInput& input) { return XdfReader(input).read(); }

}  // namespace fovea::replay
