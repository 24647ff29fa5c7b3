// Each importer on an excerpt of a real file: units, frames, times, validity and labels come through right.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "protocol/sphere.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;
using ::testing::HasSubstr;

namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

Recording excerpt(const std::string& name, const std::string& format) {
    auto r = load_recording(source_path("tests/data/import/" + name));
    EXPECT_TRUE(r) << r.error().message();
    if (!r) return {};
    EXPECT_EQ(r->info.format, format);
    EXPECT_FALSE(r->samples.empty());
    for (std::size_t i = 0; i < r->samples.size(); ++i) EXPECT_EQ(r->samples[i].sample.id, i + 1);
    return std::move(*r);
}

Result<Recording> load_text(std::string_view text, const std::string& name = "a.txt") {
    const TempDir dir;
    write_file(dir / name, text);
    return load_recording(dir / name);
}

const EyeState& combined(const Recording& r, std::size_t i) { return r.samples.at(i).sample.eye(Eye::combined); }
std::int64_t t_ns(const Recording& r, std::size_t i) { return r.samples.at(i).sample.device_time.ns; }
std::size_t count_valid(const Recording& r) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < r.samples.size(); ++i) n += combined(r, i).valid;
    return n;
}

void expect_direction(const Direction<HeadFrame>& d, double x, double y, double z) {
    const auto expected = *Direction<HeadFrame>::from({x, y, z});
    EXPECT_LT(angle_between(d, expected), 1e-9) << d.x << " " << d.y << " " << d.z;
}

}  // namespace

TEST(EyelinkAsc, TurnsPixelsIntoAnglesAboutTheScreensCentre) {
    const Recording r = excerpt("eyelink_binocular.asc", "eyelink_asc");
    EXPECT_EQ(r.info.nominal_rate_hz, 250);
    EXPECT_EQ(t_ns(r, 0), 570'443'000'000);
    const auto& s = r.samples[0].sample;
    const double dx = 40.67 / kDeg, dy = 40.74 / kDeg;
    expect_direction(s.eye(Eye::left).gaze_dir_head, (226.9 - 640) / dx, -(73.1 - 512) / dy, -1);
    expect_direction(s.eye(Eye::right).gaze_dir_head, (242.9 - 640) / dx, -(71.1 - 512) / dy, -1);
    EXPECT_GT(s.eye(Eye::combined).gaze_dir_head.y, 0) << "small pixel y is above the centre";
    EXPECT_LT(s.eye(Eye::combined).gaze_dir_head.x, 0);
    EXPECT_TRUE(std::isnan(s.eye(Eye::left).pupil_mm)) << "an area in camera units is no diameter";
}

TEST(EyelinkAsc, LabelsABlinkWithTheSaccadeThatWrapsItAsBlink) {
    const Recording r = excerpt("eyelink_binocular.asc", "eyelink_asc");
    ASSERT_TRUE(r.info.has_labels);
    std::size_t lost = 0;
    for (const auto& s : r.samples) {
        const std::int64_t ms = s.sample.device_time.ns / 1'000'000;
        if (ms >= 577'647 && ms <= 577'791) {
            EXPECT_EQ(s.label, Label::blink) << ms;  // ESACC L around EBLINK L
        }
        if (ms <= 577'635 && ms >= 577'607) {
            EXPECT_EQ(s.label, Label::fixation) << ms;
        }
        lost += !s.sample.eye(Eye::combined).valid;
    }
    EXPECT_EQ(lost, 20u);
}

TEST(EyelinkAsc, ErrorsNameLineAndColumn) {
    const std::string head =
        "** TYPE: EDF_FILE\nMSG 1 DISPLAY_COORDS 0 0 1919 1079\nSTART\t10\tLEFT\tSAMPLES\n"
        "SAMPLES\tGAZE\tLEFT\tRATE\t1000.00\n";
    const std::string end = "END\t12\tSAMPLES\tRES\t38.00\t38.00\n";
    EXPECT_TRUE(load_text(head + "10\t960.5\t540.5\t900.0\t...\n" + end));
    for (const auto& [text, where, what] :
         {std::tuple{head + "10\tx\t540.5\t900.0\t...\n" + end, ":5:4", "not a number"},
          {head + "10\t960.5\n" + end, ":5:1", "too short"},
          {head + "10\t960.5\t540.5\t900.0\t...\n", ":5:1", "no END"},
          {head + "10\t960.5\t540.5\t900.0\t...\nEND\t12\n", ":6:1", "no RES"},
          {"** TYPE: EDF_FILE\nSTART\t10\tLEFT\nSAMPLES\tPUPIL\tLEFT\n" + end, ":3:9", "raw pupil"}}) {
        const auto r = load_text(text);
        ASSERT_FALSE(r) << text;
        EXPECT_THAT(r.error().where, HasSubstr(where)) << r.error().message();
        EXPECT_THAT(r.error().what, HasSubstr(what));
        EXPECT_FALSE(r.error().way_out.empty());
    }
}

TEST(EyelinkAsc, At2000HzTheSecondOfTwoEqualStampsIsHalfAMillisecondLater) {
    const auto r = load_text(
        "** TYPE: EDF_FILE\nMSG 1 DISPLAY_COORDS 0 0 1919 1079\nSTART\t10\tRIGHT\tSAMPLES\n"
        "SAMPLES\tGAZE\tRIGHT\tRATE\t2000.00\n10\t960.0\t540.0\t900.0\t...\n10\t960.0\t540.0\t900.0\t...\n"
        "11\t960.0\t540.0\t900.0\t...\nEND\t12\tSAMPLES\tRES\t38.00\t38.00\n");
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(t_ns(*r, 1), 10'500'000);
    EXPECT_EQ(t_ns(*r, 2), 11'000'000);
    expect_direction(combined(*r, 0).gaze_dir_head, 0, 0, -1);
}

TEST(Numpy, ReadsDegreesStatusAndHandLabels) {
    const Recording r = excerpt("irf_lookatpoint.npy", "numpy");
    ASSERT_EQ(r.samples.size(), 90u);
    EXPECT_EQ(t_ns(r, 0), 20'000'000);
    EXPECT_EQ(t_ns(r, 1), 21'000'000);
    EXPECT_EQ(r.samples[0].label, Label::fixation);
    EXPECT_EQ(r.samples[58].label, Label::blink);
    EXPECT_TRUE(combined(r, 58).valid);
    EXPECT_FALSE(combined(r, 59).valid) << "row 79 of the file is the first lost one";
    // Row 78 has y = 10.89 degrees DOWN while the lid closes.
    EXPECT_NEAR(to_azimuth_elevation(combined(r, 58).gaze_dir_head).elevation_rad / kDeg, -10.89, 0.02);
}

TEST(Numpy, TornAndForeignArraysAreRefused) {
    const std::string whole = read_file(source_path("tests/data/import/irf_lookatpoint.npy"));
    const TempDir dir;
    for (std::size_t n = 1; n < whole.size(); n += 7) {
        write_file(dir / "torn.npy", std::string_view(whole).substr(0, n));
        EXPECT_FALSE(load_recording(dir / "torn.npy")) << n;
    }
    std::string other = whole;
    other.replace(other.find("'x'"), 3, "'q'");
    const auto r = load_text(other);
    ASSERT_FALSE(r);
    EXPECT_THAT(r.error().what, HasSubstr("'x'"));
}

TEST(ViveSranipal, MirrorsXAndKeepsBothClocks) {
    const Recording r = excerpt("vive_sranipal.csv", "vive_sranipal");
    ASSERT_EQ(r.samples.size(), 20u);
    const auto& s = r.samples[0].sample;
    EXPECT_TRUE(s.eye(Eye::left).valid);
    EXPECT_GT(s.eye(Eye::left).pupil_mm, 1);
    EXPECT_GT(s.eye(Eye::left).openness, 0.5);
    std::size_t repeated = 0;
    for (std::size_t i = 1; i < r.samples.size(); ++i) repeated += t_ns(r, i) == t_ns(r, i - 1);
    EXPECT_EQ(repeated, 1u) << "a repeated stamp stays";
    for (const auto& x : r.samples) {
        EXPECT_GE(x.sample.received, x.sample.exposed);
        EXPECT_LE(x.sample.received - x.sample.exposed, std::chrono::milliseconds(20));
        EXPECT_TRUE(x.sample.head.valid);
    }
    EXPECT_LT(count_valid(r), r.samples.size());
    // One line by hand.
    const auto one = load_text(
        "time(100ns);time_stamp(ms);eye_valid_L;eye_valid_R;openness_L;openness_R;pupil_diameter_L(mm);"
        "pupil_diameter_R(mm);gaze_direct_L.x;gaze_direct_L.y;gaze_direct_L.z;gaze_direct_R.x;gaze_direct_R.y;"
        "gaze_direct_R.z\n638342794000115346;2147483647;31;8;0.9;0.8;3.5;-1;0.6;0;0.8;0;0;0\n"
        "638342794000195116;-2147483641;31;31;0.9;0.8;3.5;3.5;0;0.6;0.8;0;0.6;0.8\n");
    ASSERT_TRUE(one) << one.error().message();
    expect_direction(combined(*one, 0).gaze_dir_head, -0.6, 0, -0.8);
    expect_direction(combined(*one, 1).gaze_dir_head, 0, 0.6, -0.8);
    EXPECT_FALSE(one->samples[0].sample.eye(Eye::right).valid);
    EXPECT_EQ(one->samples[0].sample.eye(Eye::right).openness, 0.8) << "bit 8: openness is still good";
    EXPECT_TRUE(std::isnan(one->samples[0].sample.eye(Eye::right).pupil_mm));
    EXPECT_EQ(t_ns(*one, 1) - t_ns(*one, 0), 8'000'000) << "the 32-bit count wraps";
    EXPECT_FALSE(one->samples[0].sample.head.valid);
}

TEST(ViveSranipal, TimesThatCannotBeAreErrorsAndNotOverflows) {
    const std::string head =
        "time(100ns);time_stamp(ms);eye_valid_L;eye_valid_R;openness_L;openness_R;pupil_diameter_L(mm);"
        "pupil_diameter_R(mm);gaze_direct_L.x;gaze_direct_L.y;gaze_direct_L.z;gaze_direct_R.x;gaze_direct_R.y;"
        "gaze_direct_R.z\n";
    const std::string rest = ";31;31;0.9;0.8;3.5;3.5;0;0;1;0;0;1\n";
    EXPECT_TRUE(load_text(head + "638342794000115346;0" + rest));
    for (const char* times : {"0;0", "1242711936000000001;0", "9223372036854775807;0", "638342794000115346;4294967296"})
        EXPECT_THAT(load_text(head + times + rest).error().where, HasSubstr(":2:")) << times;
    std::string backwards = head;  // each pair of lines turns the 32-bit count over once
    for (int i = 0; i < 1100; ++i)
        backwards += "638342794000115346;4294967295" + rest + "638342794000115346;-2147483648" + rest;
    EXPECT_FALSE(load_text(backwards));
}

TEST(PupilCloud, KeepsUtcNanosecondsToTheLastDigit) {
    const Recording r = excerpt("pupil_invisible_gaze.csv", "pupil_cloud");
    EXPECT_EQ(t_ns(r, 0), 1'650'316'509'598'345'895);
    EXPECT_EQ(t_ns(r, 1), 1'650'316'509'602'370'895);
    const auto a = to_azimuth_elevation(combined(r, 0).gaze_dir_head);
    EXPECT_NEAR(a.azimuth_rad / kDeg, -19.83485199373903, 1e-9);
    EXPECT_NEAR(a.elevation_rad / kDeg, -15.464591180790238, 1e-9);
    std::set<Label> labels;
    std::set<std::int64_t> steps_ms;
    for (std::size_t i = 0; i < r.samples.size(); ++i) {
        labels.insert(r.samples[i].label);
        if (i > 0) steps_ms.insert((t_ns(r, i) - t_ns(r, i - 1) + 500'000) / 1'000'000);
    }
    EXPECT_TRUE(labels.contains(Label::blink) && labels.contains(Label::fixation) && labels.contains(Label::none));
    EXPECT_TRUE(steps_ms.contains(4) && steps_ms.contains(8));
}

TEST(PupilCloud, NotWornIsNotValidAndImpossibleAnglesAreAnError) {
    const std::string head = "timestamp [ns],worn,fixation id,blink id,azimuth [deg],elevation [deg]\n";
    const auto r = load_text(head + "1,0,,,1,2\n2,1,,,1,2\n3,1,,,,\n");
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_FALSE(combined(*r, 0).valid);
    EXPECT_TRUE(combined(*r, 1).valid);
    EXPECT_FALSE(combined(*r, 2).valid);
    const auto wrong = load_text(head + "1,1,,,700,2\n");
    ASSERT_FALSE(wrong);
    EXPECT_THAT(wrong.error().where, HasSubstr(":2:7"));
    EXPECT_FALSE(load_text(head + "16503165095983458950000,1,,,1,2\n"));
}

TEST(PupilCore, ReadsTheSceneCamerasAxes) {
    const std::string head =
        "gaze_timestamp,world_index,confidence,norm_pos_x,norm_pos_y,base_data,gaze_point_3d_x,gaze_point_3d_y,"
        "gaze_point_3d_z,eye_center0_3d_x,gaze_normal0_x,gaze_normal0_y,gaze_normal0_z,gaze_normal1_x,gaze_normal1_y,"
        "gaze_normal1_z\n";
    const auto r = load_text(head +
                             "4362.123456789,1,0.98,0.5,0.5,\"4362.1-0 4362.1-1\",30,-40,500,20,0.06,-0.08,0.995,,,\n"
                             "4362.128456789,1,0.0,0.5,0.5,4362.1-0,30,-40,500,20,0.06,-0.08,0.995,,,\n"
                             "4362.133456789,1,0.9,0.5,0.5,4362.1-0,,,,20,,,,,,\n");
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(r->info.format, "pupil_core");
    EXPECT_EQ(t_ns(*r, 0), 4'362'123'456'789);
    expect_direction(combined(*r, 0).gaze_dir_head, 30, 40, -500);
    EXPECT_EQ(combined(*r, 0).confidence, 0.98);
    EXPECT_TRUE(r->samples[0].sample.eye(Eye::right).valid) << "eye 0 is the right one";
    EXPECT_FALSE(r->samples[0].sample.eye(Eye::left).valid);
    EXPECT_FALSE(combined(*r, 1).valid) << "no confidence at all";
    EXPECT_FALSE(combined(*r, 2).valid);
    const auto flat = load_text(head + "1,1,0.98,0.5,0.5,x,,,,,,,,,,\n");
    ASSERT_FALSE(flat);
    EXPECT_THAT(flat.error().what, HasSubstr("2D"));
}

TEST(TobiiGlasses2, JoinsTheLinesOfASample) {
    const Recording r = excerpt("tobii_glasses2_livedata.json", "tobii_glasses2");
    EXPECT_EQ(t_ns(r, 0), 484'678'568'000);
    const auto& s = r.samples[0].sample;
    expect_direction(s.eye(Eye::left).gaze_dir_head, 0.0983, 0.1388, -0.9854);
    expect_direction(s.eye(Eye::right).gaze_dir_head, 0.0191, 0.1295, -0.9914);
    EXPECT_EQ(s.eye(Eye::left).pupil_mm, 5.40);
    std::size_t lost = 0;
    for (const auto& x : r.samples) lost += !x.sample.eye(Eye::combined).valid;
    EXPECT_EQ(lost, 2u) << "status 4";
}

TEST(TobiiGlasses3, AnEmptyEyeIsALostEye) {
    const Recording r = excerpt("tobii_glasses3_gazedata.gz", "tobii_glasses3");
    EXPECT_EQ(t_ns(r, 0), 6'684'000);
    expect_direction(r.samples[0].sample.eye(Eye::left).gaze_dir_head, 0.1463, -0.0633, -0.9872);
    EXPECT_NEAR(r.samples[0].sample.eye(Eye::right).pupil_mm, 4.593, 1e-12);
    std::size_t none = 0, one = 0;
    for (const auto& x : r.samples) {
        const bool left = x.sample.eye(Eye::left).valid, right = x.sample.eye(Eye::right).valid;
        none += !left && !right;
        one += left != right;
        EXPECT_EQ(x.sample.eye(Eye::combined).valid, left || right);
    }
    EXPECT_EQ(none, 4u);
    EXPECT_EQ(one, 1u);
}

TEST(TobiiGlasses, TornLinesAndTornGzipAreErrors) {
    const auto torn = load_text("{\"type\":\"gaze\",\"timestamp\":0.006684,\"data\":{}}\n{\"type\":\"gaze\",\"times");
    ASSERT_FALSE(torn);
    EXPECT_THAT(torn.error().message(), HasSubstr(":2:"));
    EXPECT_THAT(torn.error().what, HasSubstr("middle of a line"));
    const auto type = load_text("{\"type\":\"gaze\",\"timestamp\":\"soon\",\"data\":{}}\n");
    ASSERT_FALSE(type);
    EXPECT_THAT(type.error().where, HasSubstr(":1:1"));
    const std::string packed = read_file(source_path("tests/data/import/tobii_glasses3_gazedata.gz"));
    const TempDir dir;
    for (std::size_t n = 1; n < packed.size(); ++n) {
        write_file(dir / "torn.gz", std::string_view(packed).substr(0, n));
        EXPECT_FALSE(load_recording(dir / "torn.gz")) << n;
    }
}

TEST(TobiiTx300, TakesGazePointMinusEyeAndDropsLostEyes) {
    const Recording r = excerpt("tobii_tx300.tsv", "tobii_tx300");
    EXPECT_EQ(t_ns(r, 0), 2'619'771'723'000);
    EXPECT_FALSE(combined(r, 0).valid);
    EXPECT_TRUE(std::isnan(combined(r, 0).pupil_mm)) << "-1 is no pupil";
    expect_direction(r.samples[2].sample.eye(Eye::left).gaze_dir_head, -0.9102 + 2.3434, 171.5653 - 3.4425,
                     55.9954 - 595.0995);
    std::size_t one = 0;
    for (const auto& x : r.samples) one += x.sample.eye(Eye::left).valid != x.sample.eye(Eye::right).valid;
    EXPECT_EQ(one, 1u);
}

// Validity above 1: the eye may be the other one (Tobii SDK), whatever the positions say.
TEST(TobiiTx300, TrustsValidity0And1AndNothingAbove) {
    std::string text = "Time\tLEyePos3dx\tLEyePos3dy\tLEyePos3dz\tLGazePos3dx\tLGazePos3dy\tLGazePos3dz\tLPupilDm\tLValidity\t"
                       "REyePos3dx\tREyePos3dy\tREyePos3dz\tRGazePos3dx\tRGazePos3dy\tRGazePos3dz\tRPupilDm\tRValidity\n";
    for (int validity = 0; validity <= 4; ++validity)
        text += std::to_string(1000 + 3333 * validity) + "\t-30\t0\t600\t10\t20\t50\t3.5\t" + std::to_string(validity) + "\t30\t0\t600\t10\t20\t50\t3.5\t0\n";
    const auto r = load_text(text);
    ASSERT_TRUE(r) << r.error().message();
    ASSERT_EQ(r->info.format, "tobii_tx300");
    ASSERT_EQ(r->samples.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(r->samples[i].sample.eye(Eye::left).valid, i <= 1) << "validity " << i;
        EXPECT_EQ(std::isnan(r->samples[i].sample.eye(Eye::left).pupil_mm), i > 1) << "validity " << i;
        EXPECT_TRUE(r->samples[i].sample.eye(Eye::right).valid);
    }
    text.replace(text.rfind("\t4\t"), 3, "\t5\t");
    EXPECT_FALSE(load_text(text)) << "5 is no validity";
}

TEST(TobiiProLab, ReadsGlassesAndScreenExports) {
    const auto glasses = load_text(
        "Recording timestamp\tSensor\tEvent\tGaze direction left X\tGaze direction left Y\tGaze direction left Z\t"
        "Gaze direction right X\tGaze direction right Y\tGaze direction right Z\tPupil diameter left\tValidity left\t"
        "Validity right\tEye movement type\n"
        "0\t\tRecordingStart\t\t\t\t\t\t\t\t\t\t\n"
        "8000\tGyroscope\t\t\t\t\t\t\t\t\t\t\t\n"
        "10000\tEye Tracker\t\t0,6\t0\t0,8\t0,6\t0\t0,8\t3,25\tValid\tValid\tSaccade\n"
        "20000\tEye Tracker\t\t\t\t\t0\t0.6\t0.8\t\tInvalid\tValid\tFixation\n"
        "30000\tEye Tracker\t\t\t\t\t\t\t\t\tInvalid\tInvalid\tEyesNotFound\n");
    ASSERT_TRUE(glasses) << glasses.error().message();
    ASSERT_EQ(glasses->samples.size(), 3u);
    EXPECT_EQ(t_ns(*glasses, 0), 10'000'000);
    expect_direction(combined(*glasses, 0).gaze_dir_head, -0.6, 0, -0.8);
    expect_direction(combined(*glasses, 1).gaze_dir_head, 0, 0.6, -0.8);
    EXPECT_FALSE(combined(*glasses, 2).valid);
    EXPECT_EQ(glasses->samples[0].label, Label::saccade);
    EXPECT_EQ(glasses->samples[0].sample.eye(Eye::left).pupil_mm, 3.25) << "decimal comma";

    const auto screen = load_text(
        "Recording timestamp [ms]\tSensor\tGaze point left X [DACS mm]\tGaze point left Y [DACS mm]\t"
        "Eye position left X [DACS mm]\tEye position left Y [DACS mm]\tEye position left Z [DACS mm]\tValidity left\n"
        "16.7\tEye Tracker\t300\t100\t200\t150\t600\tValid\n");
    ASSERT_TRUE(screen) << screen.error().message();
    EXPECT_EQ(t_ns(*screen, 0), 16'700'000);
    expect_direction(combined(*screen, 0).gaze_dir_head, 100, 50, -600);

    const auto pixels = load_text("Recording timestamp\tSensor\tGaze point X\tGaze point Y\n0\tEye Tracker\t1\t2\n");
    ASSERT_FALSE(pixels);
    EXPECT_THAT(pixels.error().way_out, HasSubstr("Gaze direction"));
}

TEST(TobiiProLab, MillisecondsWithoutAUnitAreFoundOut) {
    std::string text = "Recording timestamp\tGaze direction left X\tGaze direction left Y\tGaze direction left Z\n";
    for (int i = 0; i < 10; ++i) text += std::to_string(i * 17) + "\t0\t0\t1\n";
    const auto r = load_text(text);
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(t_ns(*r, 1), 17'000'000);
    EXPECT_EQ(r->info.nominal_rate_hz, 60);
}

TEST(Jov2023, MarksTheSentinelInvalidAndTakesTheHeadBesideIt) {
    const Recording r = excerpt("jov2023_sub06_gaze.csv", "jov2023");
    ASSERT_EQ(r.samples.size(), 28u);
    EXPECT_EQ(count_valid(r), 21u);
    EXPECT_TRUE(r.info.has_head_pose);
    std::size_t repeated = 0;
    for (std::size_t i = 0; i < r.samples.size(); ++i) {
        EXPECT_TRUE(r.samples[i].sample.head.valid) << i;
        EXPECT_TRUE(r.samples[i].sample.exposed_estimated);
        if (i > 0 && combined(r, i).valid)
            repeated += combined(r, i).gaze_dir_head == combined(r, i - 1).gaze_dir_head && t_ns(r, i) > t_ns(r, i - 1);
    }
    EXPECT_GE(repeated, 1u) << "repeated samples stay";
    EXPECT_EQ(t_ns(r, 27), 98'070'500'000);
    expect_direction(combined(r, 27).gaze_dir_head, 0.052353, -0.34465, -0.937256);
    EXPECT_NEAR(r.samples[27].sample.eye(Eye::right).pupil_mm, 3.405823, 1e-12);
    EXPECT_TRUE(std::isnan(r.samples[27].sample.eye(Eye::left).pupil_mm));
}

TEST(Jov2023, AFileWithoutAValidSampleIsARecordingAllTheSame) {
    const Recording r = excerpt("jov2023_sub08_gaze.csv", "jov2023");
    EXPECT_EQ(r.samples.size(), 12u);
    EXPECT_EQ(count_valid(r), 0u);
}

TEST(Jov2023, TheHeadTurnsAsUnityTurns) {
    const TempDir dir;
    write_file(dir / "x_gaze.csv", "time,dir_x,dir_y,dir_z,gaze_object,pupil_l,pupil_r\n1,0.6,0,0.8,a,3,3\n2,0.6,0,0.8,a,3,3\n");
    write_file(dir / "x_head.csv", "time,head_rot_x,head_rot_y,head_rot_z\n1,0,90,0\n2,30,0,0\n");
    const auto r = load_recording(dir / "x_gaze.csv");
    ASSERT_TRUE(r) << r.error().message();
    const Direction<HeadFrame> ahead{};
    const auto right = r->samples[0].sample.head.world_from_head * ahead;
    EXPECT_NEAR(right.x, 1, 1e-12) << "+90 of yaw looks right";
    const auto down = r->samples[1].sample.head.world_from_head * ahead;
    EXPECT_NEAR(down.y, -0.5, 1e-12) << "+30 of pitch looks down";
    write_file(dir / "x_head.csv", "time,head_rot_x,head_rot_y\n1,0,90\n");
    const auto broken = load_recording(dir / "x_gaze.csv");
    ASSERT_FALSE(broken);
    EXPECT_THAT(broken.error().where, HasSubstr("x_head.csv:1"));
}

TEST(PicoNeo3, ReadsTheDocumentedColumns) {
    const auto r = load_text(
        "Timeline\tLeft Eye Pose Status\tRight Eye Pose Status\tLeft Eye Gaze Openness\tRight Eye Gaze Openness\t"
        "Combine Eye Gaze Vector. x\tCombine Eye Gaze Vector. y\tCombine Eye Gaze Vector. z\tHead Rotation. x\t"
        "Head Rotation. y\tHead Rotation. z\n10.011\t52\t52\t1\t1\t0.6\t0\t0.8\t0\t0\t0\n10.022\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\n");
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(t_ns(*r, 0), 10'011'000'000);
    expect_direction(combined(*r, 0).gaze_dir_head, 0.6, 0, -0.8);
    EXPECT_FALSE(combined(*r, 1).valid);
    EXPECT_EQ(combined(*r, 1).openness, 0);
    const auto native = load_text(
        "Timeline\tLeft Eye Pose Status\tRight Eye Pose Status\tCombine Eye Gaze Vector.x\tCombine Eye Gaze Vector.y\t"
        "Combine Eye Gaze Vector.z\r\n1\t52\t52\t0.6\t0\t-0.8\t\r\n");
    ASSERT_TRUE(native) << native.error().message();
    expect_direction(combined(*native, 0).gaze_dir_head, 0.6, 0, -0.8);
}

TEST(Etdqualitizer, TurnsCentredPixelsIntoAngles) {
    const Recording r = excerpt("etdqualitizer_smi.tsv", "etdqualitizer");
    EXPECT_EQ(t_ns(r, 0), 6'436'740'687'000);
    expect_direction(r.samples[0].sample.eye(Eye::left).gaze_dir_head, 493.64 * 528 / 1920, 319.106 * 528 / 1920, -650);
    const auto lost = load_text("timestamp\tleft_x\tleft_y\ttar_x\n1\t0\t0\t0\n2\t\t\t0\n3\t0\t5\t0\n");
    ASSERT_TRUE(lost) << lost.error().message();
    EXPECT_EQ(count_valid(*lost), 1u);
}

TEST(OemcHmr, KeepsLabelsAndMarksItsTimesEstimated) {
    const Recording r = excerpt("oemc_hmr.csv", "oemc_hmr");
    EXPECT_EQ(r.info.nominal_rate_hz, 200);
    EXPECT_EQ(t_ns(r, 1), 5'000'000);
    EXPECT_TRUE(r.samples[0].sample.exposed_estimated);
    EXPECT_EQ(r.samples[0].label, Label::fixation);
    EXPECT_EQ(r.samples.back().label, Label::blink);
}

TEST(DecimalTime, IsExactWhereADoubleIsNot) {
    EXPECT_EQ(decimal_to_ns("1650316509.598345895", 0), 1'650'316'509'598'345'895);
    EXPECT_EQ(decimal_to_ns("95.74914", 0), 95'749'140'000);
    EXPECT_EQ(decimal_to_ns("-0.0000000005", 0), -1);
    EXPECT_EQ(decimal_to_ns("0.0000000004", 0), 0);
    EXPECT_EQ(decimal_to_ns("6436740.68700000", -3), 6'436'740'687'000);
    EXPECT_EQ(decimal_to_ns("1.5e3", -3), 1'500'000'000);
    EXPECT_EQ(decimal_to_ns("4611686018427387903", -9), kMaxTime_ns);
    EXPECT_EQ(decimal_to_ns("4611686018427387904", -9), std::nullopt);
    for (const char* bad : {"", "-", ".", "1.2.3", "0x10", "1e", "1e400", "nan", "inf", "99999999999999999999999999999999999999999999"})
        EXPECT_EQ(decimal_to_ns(bad, 0), std::nullopt) << bad;
}

TEST(ImporterTable, EveryRowHasAnOwnNameAndOneLine) {
    std::set<std::string> names;
    for (const Importer& i : importers()) {
        EXPECT_TRUE(names.insert(i.name).second) << i.name;
        EXPECT_FALSE(std::string(i.one_line).empty());
    }
}

TEST(ImporterTable, AnExcerptIsRecognisedByItsOwnImporterOnly) {
    for (const auto& entry : std::filesystem::directory_iterator(source_path("tests/data/import"))) {
        const std::string content = read_file(entry.path());
        int claims = 0;
        for (const Importer& i : importers()) claims += i.recognise(std::string_view(content).substr(0, kPrefixSize));
        EXPECT_LE(claims, 1) << entry.path();
    }
}
