// `fovea latency` on sessions made here, whose latencies and misses are known.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "protocol/sphere.hpp"
#include "replay/session_file.hpp"
#include "tests/tools/command_runner.hpp"

using namespace fovea;
using namespace std::chrono_literals;
using testing::HasSubstr;

namespace {

constexpr double kRad = std::numbers::pi / 180;

class LatencyCommand : public test::CommandTest {
protected:
    // 50 frames of 20 ms, all 30 ms from exposure to photon; the eye rests at 0 for the first 500 ms, at 20 degrees
    // after, and each frame puts a fovea of 5 degrees straight ahead.
    void write_session(const std::string& path, int frames, bool every_other_extrapolated = false) {
        replay::SessionWriterOptions options;
        options.when_full = replay::SessionWriterOptions::WhenFull::wait;   // a slow disk costs no rows
        auto session = replay::SessionWriter::create(path, options).value();
        session.set_meta("device", "made <here> & now");
        for (int ms = 0; ms <= std::max(1000, 20 * frames); ++ms) {
            GazeSample s;
            s.id = static_cast<std::uint64_t>(ms) + 1;
            s.exposed = s.received = instant_from_ns(ms * 1'000'000);
            s.eye(Eye::combined).valid = true;
            s.eye(Eye::combined).gaze_dir_head = from_azimuth_elevation<HeadFrame>({ms < 500 ? 0 : 20 * kRad, 0});
            session.add_sample(s);
        }
        for (int i = 1; i <= frames; ++i) {
            FrameTiming f;
            f.frame = f.model_sequence = f.sample_id = static_cast<std::uint64_t>(i);
            f.exposed = f.received = f.filtered = f.published = instant_from_ns(i * 20'000'000 - 30'000'000);
            f.latched = f.submitted = f.published + 10ms;
            f.gpu_done = f.latched + 15ms;
            f.photon = f.predicted_photon = f.latched + 20ms;
            if (every_other_extrapolated && i % 2 == 0) f.kind = FrameKind::extrapolated;
            f.pixels_shaded = 200;
            f.pixels_full = 1000;
            f.view_count = 1;
            f.views[0].half_width_ndc = f.views[0].half_height_ndc = std::tan(5 * kRad);
            session.add_frame({1, f});
        }
        ASSERT_TRUE(session.close());
    }
};

}  // namespace

TEST_F(LatencyCommand, ReportsStagesAndMissesAsJson) {
    write_session(file("s.fovea"), 50);
    const auto r = fovea("latency " + file("s.fovea") + " --json");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto j = nlohmann::json::parse(r.out);
    EXPECT_EQ(j["frames"], 50);
    EXPECT_NEAR(j["stages_ms"]["motion_to_photon"]["p50"].get<double>(), 30, 1e-9);
    EXPECT_NEAR(j["stages_ms"]["submitted_to_gpu_done"]["max"].get<double>(), 15, 1e-9);
    EXPECT_EQ(j["judged"], 50);
    EXPECT_EQ(j["missed"], 26) << "photons at 500, 520 ... 1000 ms";
    EXPECT_NEAR(j["outside_deg"]["max"].get<double>(), 15, 1e-6);
    EXPECT_TRUE(j["photon_simulated"]);
}

TEST_F(LatencyCommand, TellsRenderedFromExtrapolatedFrames) {
    write_session(file("s.fovea"), 50, true);
    const auto r = fovea("latency " + file("s.fovea") + " --html " + file("r.html") + " --csv " + file("r.csv"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.out, testing::ContainsRegex("rendered +25 +30.000"));
    EXPECT_THAT(r.out, testing::ContainsRegex("extrapolated +25 +30.000.* 13 of 25"));
    EXPECT_THAT(bytes(file("r.html")), HasSubstr("<td>extrapolated</td><td>25</td>"));
    EXPECT_THAT(bytes(file("r.csv")), HasSubstr(",extrapolated\n"));
    const auto j = nlohmann::json::parse(fovea("latency " + file("s.fovea") + " --json").out);
    EXPECT_EQ(j["kinds"]["rendered"]["missed"].get<int>() + j["kinds"]["extrapolated"]["missed"].get<int>(), 26);
    write_session(file("plain.fovea"), 50);
    EXPECT_THAT(fovea("latency " + file("plain.fovea")).out, testing::Not(HasSubstr("extrapolated")));
}

TEST_F(LatencyCommand, WritesAPageThatStandsAloneAndOneRowPerFrame) {
    write_session(file("s.fovea"), 50);
    const auto r = fovea("latency " + file("s.fovea") + " --html " + file("r.html") + " --csv " + file("r.csv"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.out, HasSubstr("motion to photon"));
    EXPECT_THAT(r.out, HasSubstr("26 of 50 judged frames"));
    const std::string html = bytes(file("r.html"));
    EXPECT_THAT(html, HasSubstr("</html>"));
    EXPECT_THAT(html, HasSubstr("made &lt;here&gt; &amp; now"));
    EXPECT_THAT(html, testing::Not(HasSubstr("http")));
    const std::string csv = bytes(file("r.csv"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 51);
}

TEST_F(LatencyCommand, SaysWhatIsWrongWithItsInputAndWhatToDo) {
    const auto missing = fovea("latency " + file("none.fovea"));
    EXPECT_EQ(missing.exit_code, 3);
    EXPECT_THAT(missing.err, HasSubstr("none.fovea"));
    { std::ofstream(file("foreign.fovea")) << "not a session"; }
    const auto foreign = fovea("latency " + file("foreign.fovea"));
    EXPECT_EQ(foreign.exit_code, 3);
    EXPECT_THAT(foreign.err, HasSubstr("foreign.fovea"));
    write_session(file("empty.fovea"), 0);
    const auto empty = fovea("latency " + file("empty.fovea"));
    EXPECT_EQ(empty.exit_code, 3);
    EXPECT_THAT(empty.err, HasSubstr("fovea-view"));
    EXPECT_EQ(fovea("latency").exit_code, 2);
}

TEST_F(LatencyCommand, PicturesArePngsAndBelongOnAPage) {
    write_session(file("s.fovea"), 5);
    { std::ofstream(file("no.png")) << "not a picture"; }
    for (const char* option : {" --frame ", " --levels "}) {
        const auto alone = fovea("latency " + file("s.fovea") + option + file("no.png"));
        EXPECT_EQ(alone.exit_code, 2);
        EXPECT_THAT(alone.err, HasSubstr("--html"));
        for (const char* bad : {"no.png", "none.png"}) {
            const auto r = fovea("latency " + file("s.fovea") + option + file(bad) + " --html " + file("r.html") + " --csv " + file("r.csv"));
            EXPECT_EQ(r.exit_code, 3);
            EXPECT_THAT(r.err, HasSubstr(bad));
            EXPECT_FALSE(std::filesystem::exists(file("r.html")));
            EXPECT_FALSE(std::filesystem::exists(file("r.csv"))) << "nothing is written before all is known to be there";
        }
    }
}

TEST_F(LatencyCommand, ThePageOfALongSessionStaysSmall) {
    write_session(file("s.fovea"), 5000);
    ASSERT_EQ(fovea("latency " + file("s.fovea") + " --html " + file("r.html")).exit_code, 0);
    const std::string html = bytes(file("r.html"));
    std::size_t dots = 0;
    for (std::size_t at = 0; (at = html.find("<circle", at)) != std::string::npos; ++at) ++dots;
    EXPECT_GT(dots, 2000u);
    EXPECT_LE(dots, 4025u);
}

TEST_F(LatencyCommand, LeavesNothingHalfWrittenWhereItMayNotWrite) {
    write_session(file("s.fovea"), 5);
    const auto r = fovea("latency " + file("s.fovea") + " --html " + file("no/such/folder/r.html"));
    EXPECT_EQ(r.exit_code, 1);
    EXPECT_THAT(r.err, HasSubstr("no/such/folder"));
    EXPECT_FALSE(std::filesystem::exists(file("no")));
}
