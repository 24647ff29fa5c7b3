// `fovea calibrate` on a synthetic eye, of which it is known where it really looks.
#include <cmath>
#include <map>
#include <sstream>

#include <gmock/gmock.h>

#include "protocol/sphere.hpp"
#include "replay/recording.hpp"
#include "tests/tools/command_runner.hpp"

namespace fovea {
namespace {

using testing::HasSubstr;

const std::string kScenarios = FOVEA_SOURCE_DIR "/configs/scenarios/";
// The same person in front of the same wrong tracker, at another time: bent as in calibration.toml.
constexpr const char* kLater = "name = \"later\"\nseed = 77\nduration_s = 20\nrate_hz = 250\nbinocular = true\n"
                               "[fixations]\nwidth_deg = 28\nheight_deg = 18\n[saccades]\n[miscalibration]\n";

class CalibrateCommand : public test::CommandTest {
protected:
    // Mean angle between what is shown for now and where the eye really looks, degrees.
    double error_deg(const std::string& session, const std::string& options) {
        const auto recording = replay::load_recording(session);
        if (!recording) return HUGE_VAL;
        if (fovea("predict " + session + " --horizon-ms 0 --predictor hold --filter none --csv " + file("p.csv") + options).exit_code != 0) return HUGE_VAL;
        std::map<long long, Direction<HeadFrame>> truth;
        for (const auto& s : recording->samples) truth[to_ns(s.sample.exposed)] = *s.truth_dir_head;
        std::istringstream in(bytes(file("p.csv")));
        std::string line;
        std::getline(in, line);
        double sum = 0, n = 0;
        while (std::getline(in, line)) {
            std::vector<std::string> f;
            std::istringstream fields(line);
            for (std::string x; std::getline(fields, x, ',');) f.push_back(x);
            if (f.at(1) != "1" || f.at(6).empty()) continue;
            const auto shown = from_azimuth_elevation<HeadFrame>({std::stod(f[6]) * M_PI / 180, std::stod(f[7]) * M_PI / 180});
            sum += angle_between(shown, truth.at(std::stoll(f[0]))) * 180 / M_PI;
            ++n;
        }
        return n > 1000 ? sum / n : HUGE_VAL;
    }
};

TEST_F(CalibrateCommand, TakesAwayATrackersBendForTheSamePersonLater) {
    ASSERT_EQ(fovea("synth " + kScenarios + "calibration.toml " + file("c.fovea")).exit_code, 0);
    const auto r = fovea("calibrate --from " + file("c.fovea") + " --out " + file("me.toml"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    for (const char* eye : {"combined:", "left:", "right:"}) EXPECT_THAT(r.out, HasSubstr(eye));
    std::ofstream(file("later.toml")) << kLater;
    ASSERT_EQ(fovea("synth " + file("later.toml") + " " + file("l.fovea")).exit_code, 0);
    const double before = error_deg(file("l.fovea"), ""), after = error_deg(file("l.fovea"), " --calibration " + file("me.toml"));
    EXPECT_GT(before, 1.5);
    EXPECT_LT(after, 0.2 * before);
    EXPECT_LT(after, 0.35);
}

TEST_F(CalibrateCommand, MendsAHeadsetThatHasSlipped) {
    // After a slip the old calibration is wrong; a new one, of the slipped headset, is right again.
    std::ofstream(file("slipped.toml")) << "name = \"slipped\"\nseed = 5\nduration_s = 30\nrate_hz = 250\n[fixations]\npattern = \"targets\"\nmedian_ms = 1800\nspread = 0.1\n"
                                           "[saccades]\n[slip]\nrate_per_min = 0.1\ncreep_deg_per_min = 0\n[miscalibration]\noffset_x_deg = -4\noffset_y_deg = 3\ngain_x = 1\ngain_y = 1\nshear = 0.08\n[noise]\n";
    ASSERT_EQ(fovea("synth " + file("slipped.toml") + " " + file("s.fovea")).exit_code, 0);
    ASSERT_EQ(fovea("calibrate --from " + file("s.fovea") + " --out " + file("s.toml")).exit_code, 0);
    const double before = error_deg(file("s.fovea"), ""), after = error_deg(file("s.fovea"), " --calibration " + file("s.toml"));
    EXPECT_GT(before, 4.5);
    EXPECT_LT(after, 0.4) << "noise of 0.1 and its fit";
}

TEST_F(CalibrateCommand, TakesTheTargetsOfAFileBeforeThoseOfTheSession) {
    ASSERT_EQ(fovea("synth " + kScenarios + "calibration.toml " + file("c.fovea")).exit_code, 0);
    std::ofstream(file("two.csv")) << "start_ms,end_ms,x_deg,y_deg\n0,1000,0,0\n1000,2500,5,5\n";
    const auto r = fovea("calibrate --from " + file("c.fovea") + " --targets " + file("two.csv") + " --out " + file("me.toml"));
    EXPECT_EQ(r.exit_code, 3);
    EXPECT_THAT(r.err, HasSubstr("too few"));
    EXPECT_FALSE(std::filesystem::exists(file("me.toml")));
    std::ofstream(file("torn.csv")) << "start_ms,end_ms,x_deg,y_deg\n0,1000,zero,0\n";
    EXPECT_THAT(fovea("calibrate --from " + file("c.fovea") + " --targets " + file("torn.csv") + " --out -").err, HasSubstr("torn.csv:2: column 3"));
}

TEST_F(CalibrateCommand, SaysWhenNothingTellsTheTargets) {
    const auto r = fovea("calibrate --from " FOVEA_SOURCE_DIR "/tests/data/recordings/vive_pro_eye_360vr.csv --out " + file("me.toml"));
    EXPECT_EQ(r.exit_code, 3);
    EXPECT_THAT(r.err, HasSubstr("--targets"));
}

TEST_F(CalibrateCommand, RefusesAFileThatIsNoCalibration) {
    const std::string session = FOVEA_SOURCE_DIR "/tests/data/recordings/vive_pro_eye_360vr.csv";
    const struct {
        const char *text, *says;
    } cases[] = {{"[calibration.combined]\nmodel = \"affine\"\ncoefficients = [1]\n", "no complete [calibration.combined]"},
                 {"[calibration.third]\n", "bad.toml:1:14: there is no eye 'third'"},
                 {"[noise]\n", "there is no calibration"},
                 {"[calibration", "no calibration file"},
                 {"[calibration.left]\nmodel = \"cubic\"\ncoefficients = [0,0,0,0,0,0,0,0,0,0,0,0]\n", "'cubic'"}};
    for (const auto& c : cases) {
        std::ofstream(file("bad.toml")) << c.text;
        for (const char* command : {"predict ", "replay "}) {
            const auto r = fovea(command + session + " --csv " + file("p.csv") + " --calibration " + file("bad.toml"));
            EXPECT_EQ(r.exit_code, 3) << c.text;
            EXPECT_THAT(r.err, HasSubstr(c.says));
        }
    }
    EXPECT_THAT(fovea("predict " + session + " --csv - --calibration " + file("none.toml")).err, HasSubstr("none.toml"));
}

}  // namespace
}  // namespace fovea
