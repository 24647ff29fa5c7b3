#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "protocol/sphere.hpp"
#include "replay/import/importer.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;
using ::testing::HasSubstr;

namespace {

// Writes XDF as its specification lays it out.
class XdfWriter {
public:
    std::string out = "XDF:";

    void chunk(std::uint16_t tag, const std::string& content) {
        out += '\4';
        put(out, static_cast<std::uint32_t>(content.size() + 2));
        put(out, tag);
        out += content;
    }
    void header(std::uint32_t id, const std::string& type, const std::string& format, double rate,
                const std::vector<std::string>& channels) {
        std::string c;
        put(c, id);
        c += "<?xml version=\"1.0\"?><info><name>my tracker</name><type>" + type + "</type><channel_count>" +
             std::to_string(channels.size()) + "</channel_count><nominal_srate>" + std::to_string(rate) +
             "</nominal_srate><channel_format>" + format + "</channel_format><desc><channels>";
        for (const auto& channel : channels) c += "<channel>" + channel + "</channel>";
        chunk(2, c + "</channels></desc></info>");
    }
    template <class T>
    static void put(std::string& to, T value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        to.append(bytes, sizeof value);
    }
};

std::vector<std::string> directions(const std::string& eye) {
    std::vector<std::string> c;
    for (const char* axis : {"X", "Y", "Z"})
        c.push_back("<label>d</label><eye>" + eye + "</eye><type>Direction" + axis + "</type>");
    return c;
}

// Two streams; the second is the gaze, at 100 Hz, double64, its second sample without a stamp.
std::string example() {
    XdfWriter w;
    w.chunk(1, "<?xml version=\"1.0\"?><info><version>1.0</version></info>");
    w.header(1, "EEG", "float32", 0, {"<type>EEG</type>"});
    auto channels = directions("both");
    channels.push_back("<eye>both</eye><type>Confidence</type>");
    channels.push_back("<eye>left</eye><type>Diameter</type><unit>mm</unit>");
    w.header(7, "Gaze", "double64", 100, channels);
    std::string eeg;
    XdfWriter::put(eeg, std::uint32_t{1});
    eeg += "\1\1";
    eeg += '\0';
    XdfWriter::put(eeg, 1.5f);
    w.chunk(3, eeg);
    std::string samples;
    XdfWriter::put(samples, std::uint32_t{7});
    samples += "\1\3";
    for (int i = 0; i < 3; ++i) {
        samples += i == 1 ? '\0' : '\10';
        if (i != 1) XdfWriter::put(samples, 123456.25 + 0.01 * i);
        const double lost = i == 2 ? std::nan("") : 0.6;
        for (const double v : {lost, 0.0, i == 0 ? 0.8 : -0.8, 0.9, 3.5}) XdfWriter::put(samples, v);
    }
    w.chunk(3, samples);
    return w.out;
}

// A file of one stream of gaze, whose chunk of samples is `samples` behind the stream's id.
std::string one_stream(const std::string& format, double rate, const std::vector<std::string>& channels, const std::string& samples) {
    XdfWriter w;
    w.header(5, "Gaze", format, rate, channels);
    std::string c;
    XdfWriter::put(c, std::uint32_t{5});
    w.chunk(3, c + samples);
    return w.out;
}

// One sample with its stamp, values of type T.
template <class T>
std::string sample(double stamp_s, std::initializer_list<T> values) {
    std::string s = "\10";
    XdfWriter::put(s, stamp_s);
    for (const T v : values) XdfWriter::put(s, v);
    return s;
}

template <class T>
Result<Recording> of_format(const std::string& format) {
    return read_xdf({"a.xdf", one_stream(format, 0, directions("both"), "\1\2" + sample<T>(1, {T{3}, T{4}, T{-12}}) + sample<T>(2, {T{0}, T{0}, T{-1}}))});
}

Result<Recording> load_bytes(std::string_view bytes) {
    const TempDir dir;
    write_file(dir / "a.xdf", bytes);
    return load_recording(dir / "a.xdf");
}

}  // namespace

TEST(Xdf, ReadsTheGazeStreamAmongOthers) {
    const auto r = load_bytes(example());
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(r->info.format, "xdf");
    EXPECT_EQ(r->info.device, "my tracker");
    EXPECT_EQ(r->info.nominal_rate_hz, 100);
    ASSERT_EQ(r->samples.size(), 3u);
    EXPECT_EQ(r->samples[0].sample.device_time.ns, 123'456'250'000'000);
    EXPECT_EQ(r->samples[1].sample.device_time.ns, 123'456'260'000'000) << "no stamp: one interval later";
    const auto& camera = r->samples[0].sample.eye(Eye::combined);
    EXPECT_TRUE(camera.valid);
    EXPECT_NEAR(camera.gaze_dir_head.x, 0.6, 1e-15);
    EXPECT_NEAR(camera.gaze_dir_head.z, -0.8, 1e-15) << "+z forward is a camera's";
    EXPECT_EQ(camera.confidence, 0.9);
    EXPECT_EQ(r->samples[0].sample.eye(Eye::left).pupil_mm, 3.5);
    EXPECT_NEAR(r->samples[1].sample.eye(Eye::combined).gaze_dir_head.z, -0.8, 1e-15);
    EXPECT_FALSE(r->samples[2].sample.eye(Eye::combined).valid) << "NaN is a lost eye";
}

TEST(Xdf, CombinesTheEyesWhereNothingElseIsGiven) {
    XdfWriter w;
    auto channels = directions("left");
    for (const auto& c : directions("right")) channels.push_back(c);
    w.header(2, "gaze", "float32", 0, channels);
    std::string samples;
    XdfWriter::put(samples, std::uint32_t{2});
    samples += "\1\1\10";
    XdfWriter::put(samples, 1.0);
    for (const float v : {0.1f, 0.f, -1.f, -0.1f, 0.f, -1.f}) XdfWriter::put(samples, v);
    w.chunk(3, samples);
    const auto r = load_bytes(w.out);
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_NEAR(r->samples[0].sample.eye(Eye::combined).gaze_dir_head.x, 0, 1e-9);
    EXPECT_GT(r->samples[0].sample.eye(Eye::left).gaze_dir_head.x, 0);
}

TEST(Xdf, WithoutDirectionsItSaysWhatIsMissing) {
    XdfWriter w;
    w.header(1, "Gaze", "float32", 60, {"<type>ScreenX</type>", "<type>ScreenY</type>"});
    const auto r = load_bytes(w.out);
    ASSERT_FALSE(r);
    EXPECT_THAT(r.error().way_out, HasSubstr("DirectionX"));
}

TEST(Xdf, TornAtEveryByteNeverCrashes) {
    const std::string whole = example();
    for (std::size_t n = 4; n < whole.size(); ++n) {
        const auto r = read_xdf({"torn.xdf", std::string_view(whole).substr(0, n)});
        EXPECT_TRUE(!r || r->samples.empty()) << n;
    }
}

TEST(Xdf, ReadsEveryFormatOfNumbers) {
    int which = 0;
    for (const auto& r : {of_format<float>("float32"), of_format<double>("double64"), of_format<std::int8_t>("int8"), of_format<std::int16_t>("int16"),
                          of_format<std::int32_t>("int32"), of_format<std::int64_t>("int64")}) {
        ASSERT_TRUE(r) << which << r.error().message();
        ASSERT_EQ(r->samples.size(), 2u) << which;
        const auto d = r->samples[0].sample.eye(Eye::combined).gaze_dir_head;
        EXPECT_NEAR(d.x, 3.0 / 13, 1e-12) << which;
        EXPECT_NEAR(d.y, 4.0 / 13, 1e-12) << which << ": -z forward is ours, y up";
        EXPECT_NEAR(d.z, -12.0 / 13, 1e-12) << which;
        EXPECT_EQ(r->samples[1].sample.eye(Eye::combined).gaze_dir_head.z, -1) << which;
        EXPECT_NEAR(r->info.nominal_rate_hz, 1, 1e-9) << which << ": measured where the header knows none";
        ++which;
    }
}

TEST(Xdf, ACamerasYRunsDown) {
    const auto r = read_xdf({"a.xdf", one_stream("float32", 60, directions("both"), "\1\1" + sample<float>(1, {0, 0.6f, 0.8f}))});
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_NEAR(r->samples[0].sample.eye(Eye::combined).gaze_dir_head.y, -0.6, 1e-6);
}

TEST(Xdf, StepsOverStringsAndChannelsThatItDoesNotKnow) {
    std::string samples = "\1\2";
    for (const char* text : {"none", ""}) {
        samples += "\10";
        XdfWriter::put(samples, 1.0);
        for (int channel = 0; channel < 3; ++channel) samples += "\1" + std::string(1, static_cast<char>(std::strlen(text))) + text;
    }
    const auto r = read_xdf({"a.xdf", one_stream("string", 0, directions("both"), samples)});
    ASSERT_TRUE(r) << r.error().message();
    ASSERT_EQ(r->samples.size(), 2u);
    EXPECT_FALSE(r->samples[0].sample.eye(Eye::combined).valid);
}

TEST(Xdf, ReadsLengthsOfEveryWidthAndChunksThatItDoesNotKnow) {
    std::string file = "XDF:";
    const auto chunk = [&](int width, std::uint16_t tag, const std::string& content) {
        file += static_cast<char>(width);
        if (width == 1) XdfWriter::put(file, static_cast<std::uint8_t>(content.size() + 2));
        if (width == 4) XdfWriter::put(file, static_cast<std::uint32_t>(content.size() + 2));
        if (width == 8) XdfWriter::put(file, static_cast<std::uint64_t>(content.size() + 2));
        XdfWriter::put(file, tag);
        file += content;
    };
    XdfWriter header;
    header.header(5, "Gaze", "float32", 0, directions("both"));
    file += header.out.substr(4);
    std::string id;
    XdfWriter::put(id, std::uint32_t{5});
    chunk(1, 4, id + "a clock offset");
    double stamp = 1;
    for (const int width : {1, 4, 8}) {
        std::string samples = id + static_cast<char>(width) + '\1';
        samples.append(static_cast<std::size_t>(width) - 1, '\0');
        chunk(width, 3, samples + sample<float>(stamp++, {0, 0, -1}));
    }
    chunk(8, 5, "a boundary");
    const auto r = read_xdf({"a.xdf", file});
    ASSERT_TRUE(r) << r.error().message();
    ASSERT_EQ(r->samples.size(), 3u);
    EXPECT_EQ(r->samples[2].sample.device_time.ns, 3'000'000'000);
}

TEST(Xdf, TakesTheFirstStreamOfGazeAlone) {
    XdfWriter w;
    w.header(1, "Gaze", "float32", 0, {"<type>ScreenX</type>"});   // no directions: not this one
    w.header(2, "Gaze", "float32", 0, directions("both"));
    w.header(3, "Gaze", "float32", 0, directions("both"));
    for (std::uint32_t stream = 1; stream <= 3; ++stream) {
        std::string c;
        XdfWriter::put(c, stream);
        c += "\1\1" + (stream == 1 ? sample<float>(stream, {5}) : sample<float>(stream, {0, 0, -1}));
        w.chunk(3, c);
    }
    const auto r = read_xdf({"a.xdf", w.out});
    ASSERT_TRUE(r) << r.error().message();
    ASSERT_EQ(r->samples.size(), 1u);
    EXPECT_EQ(r->samples[0].sample.device_time.ns, 2'000'000'000);
}

TEST(Xdf, ThePointServesWhereNoDirectionDoes) {
    std::vector<std::string> channels;
    for (const char* axis : {"X", "Y", "Z"}) channels.push_back(std::string("<eye>both</eye><type>Position") + axis + "</type>");
    for (const char* axis : {"X", "Y", "Z"}) channels.push_back(std::string("<eye>left</eye><type>Position") + axis + "</type>");   // where the eye is
    channels.push_back("<eye>both</eye><type>Confidence</type>");
    channels.push_back("<eye>left</eye><type>Diameter</type><unit>pixels</unit>");
    const auto r = read_xdf({"a.xdf", one_stream("double64", 0, channels, "\1\1" + sample<double>(1, {300, 400, 1200, 9, 9, 9, 0.25, 40}))});
    ASSERT_TRUE(r) << r.error().message();
    const EyeState& combined = r->samples[0].sample.eye(Eye::combined);
    ASSERT_TRUE(combined.valid);
    EXPECT_NEAR(combined.gaze_dir_head.x, 3.0 / 13, 1e-12);
    EXPECT_NEAR(combined.gaze_dir_head.y, -4.0 / 13, 1e-12);
    EXPECT_EQ(combined.confidence, 0.25) << "kept beside the point";
    EXPECT_TRUE(std::isnan(r->samples[0].sample.eye(Eye::left).pupil_mm)) << "pixels are no millimetres";
}

TEST(Xdf, RefusesADamagedHeaderOrStampWithThePlace) {
    const std::string one = "\1\1" + sample<float>(1, {0, 0, -1});
    for (const auto& [format, rate] : std::vector<std::pair<std::string, double>>{{"float33", 60}, {"", 60}, {"float32", -1}, {"float32", 1e7}}) {
        const auto r = read_xdf({"a.xdf", one_stream(format, rate, directions("both"), one)});
        ASSERT_FALSE(r) << format << rate;
        EXPECT_THAT(r.error().message(), HasSubstr("header of the Gaze stream is damaged"));
        EXPECT_THAT(r.error().where, HasSubstr("a.xdf:byte "));
    }
    for (const std::string count : {"0", "4097", "99999999999999999999", "", "-3"}) {
        std::string file = one_stream("float32", 60, directions("both"), one);
        const std::string had = "<channel_count>3<";
        const std::size_t grown = count.size() - 1;   // may wrap, and wraps back
        file.replace(file.find(had), had.size(), "<channel_count>" + count + "<");
        std::uint32_t length = 0;
        std::memcpy(&length, &file[5], sizeof length);
        length += static_cast<std::uint32_t>(grown);
        std::memcpy(&file[5], &length, sizeof length);
        const auto r = read_xdf({"a.xdf", file});
        ASSERT_FALSE(r) << count;
        EXPECT_THAT(r.error().message(), HasSubstr("header of the Gaze stream is damaged")) << count;
    }
    for (const double stamp : {std::nan(""), static_cast<double>(INFINITY), 1e300, -1e11}) {
        const auto r = read_xdf({"a.xdf", one_stream("float32", 60, directions("both"), "\1\1" + sample<float>(stamp, {0, 0, -1}))});
        ASSERT_FALSE(r) << stamp;
        EXPECT_THAT(r.error().message(), HasSubstr("a time stamp is none"));
    }
}

TEST(Xdf, RefusesSamplesThatAreFewerThanTheyClaim) {
    std::string claims = "\10";   // a count of 2^62, in eight bytes
    XdfWriter::put(claims, std::uint64_t{1} << 62);
    for (const std::string& samples : {"\1\2" + sample<float>(1, {0, 0, -1}), claims + sample<float>(1, {0, 0, -1}), "\1\1" + sample<float>(1, {0, 0}), std::string("\1\1\3") + std::string(20, 'x'), std::string("\2\1")}) {
        XdfWriter behind;   // what stands there is another chunk's
        behind.chunk(5, std::string(64, '\0'));
        const auto r = read_xdf({"a.xdf", one_stream("float32", 60, directions("both"), samples) + behind.out.substr(4)});
        ASSERT_FALSE(r);
        EXPECT_THAT(r.error().message(), HasSubstr("torn"));
    }
}

TEST(Xdf, EveryByteChangedIsReadOrRefusedButNeverBelievedOutOfBounds) {
    const std::string whole = example();
    for (std::size_t n = 4; n < whole.size(); ++n)
        for (const char flip : {'\1', '\x80', '\xFF'}) {
            std::string changed = whole;
            changed[n] = static_cast<char>(changed[n] ^ flip);
            const auto r = read_xdf({"changed.xdf", changed});
            if (r) EXPECT_LE(r->samples.size(), 4u) << n;
            else EXPECT_FALSE(r.error().way_out.empty()) << n;
        }
}
