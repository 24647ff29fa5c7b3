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
