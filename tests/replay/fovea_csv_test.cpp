#include "replay/import/fovea_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>

#include "protocol/sphere.hpp"
#include "replay/import/importer.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;
using ::testing::HasSubstr;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

Result<Recording> load_text(std::string_view text) {
    const TempDir dir;
    write_file(dir / "a.csv", text);
    return load_recording(dir / "a.csv");
}

std::string body(std::string_view rows) { return "# fovea-gaze-csv 1\n" + std::string(rows); }

struct Bad {
    const char* text;
    const char* where;
    const char* what;
};

}  // namespace

TEST(FoveaCsv, WritesAndReadsEveryKindOfValueExactly) {
    const TempDir dir;
    const Recording recording = odd_recording(3000, 21);
    ASSERT_TRUE(write_csv(dir / "a.csv", recording));
    const auto back = load_recording(dir / "a.csv");
    ASSERT_TRUE(back) << back.error().message();
    EXPECT_EQ(back->info.format, "fovea_csv");
    EXPECT_EQ(back->info.device, recording.info.device);
    EXPECT_EQ(back->info.source, recording.info.source);
    EXPECT_EQ(back->info.nominal_rate_hz, recording.info.nominal_rate_hz);
    ASSERT_EQ(back->samples.size(), recording.samples.size());
    for (std::size_t i = 0; i < recording.samples.size(); ++i)
        ASSERT_TRUE(same(back->samples[i], recording.samples[i])) << i;
}

TEST(FoveaCsv, DegreesAreRightAndUp) {
    const auto r = load_text(body("t_ns,combined_az_deg,combined_el_deg\n0,10,0\n1,0,20\n2,,\n"));
    ASSERT_TRUE(r) << r.error().message();
    const auto& right = r->samples[0].sample.eye(Eye::combined);
    EXPECT_TRUE(right.valid);
    EXPECT_NEAR(right.gaze_dir_head.x, std::sin(10 * kDegree), 1e-15);
    EXPECT_NEAR(right.gaze_dir_head.z, -std::cos(10 * kDegree), 1e-15);
    EXPECT_NEAR(r->samples[1].sample.eye(Eye::combined).gaze_dir_head.y, std::sin(20 * kDegree), 1e-15);
    EXPECT_FALSE(r->samples[2].sample.eye(Eye::combined).valid) << "no direction: not valid, and no error";
}

TEST(FoveaCsv, RoundedDegreesStayWithinTheirRounding) {
    const TempDir dir;
    Recording recording = odd_recording(500, 22);
    ASSERT_TRUE(write_csv(dir / "a.csv", recording, {.degree_decimals = 5}));
    const auto back = load_recording(dir / "a.csv");
    ASSERT_TRUE(back) << back.error().message();
    for (std::size_t i = 0; i < recording.samples.size(); ++i)
        for (std::size_t e = 0; e < kEyeCount; ++e) {
            const EyeState &a = recording.samples[i].sample.eyes[e], &b = back->samples[i].sample.eyes[e];
            ASSERT_EQ(a.valid, b.valid);
            if (a.valid) {
                ASSERT_LT(angle_between(a.gaze_dir_head, b.gaze_dir_head), 0.8e-5 * kDegree);
            }
        }
}

TEST(FoveaCsv, EpochNanosecondsAboveTwoTo53Survive) {
    const auto r = load_text(body("t_ns,combined_az_deg,combined_el_deg\n1650316509598345895,1,1\n1650316509598345896,1,1\n"));
    ASSERT_TRUE(r);
    EXPECT_EQ(r->samples[0].sample.device_time.ns, 1'650'316'509'598'345'895);
    EXPECT_EQ((r->samples[1].sample.exposed - r->samples[0].sample.exposed).count(), 1);
}

TEST(FoveaCsv, WindowsLineEndsAndAByteOrderMarkAreRead) {
    const auto r = load_text("\xef\xbb\xbf# fovea-gaze-csv 1\r\nt_ns,combined_az_deg,combined_el_deg\r\n5,1,2\r\n");
    ASSERT_TRUE(r) << r.error().message();
    EXPECT_EQ(r->samples.size(), 1u);
}

TEST(FoveaCsv, ErrorsNameLineAndColumn) {
    const Bad cases[] = {
        {"# fovea-gaze-csv 2\nt_ns\n1\n", ":1:1", "version 2"},
        {"# fovea-gaze-csv one\nt_ns\n1\n", ":1:1", "fovea-gaze-csv 1"},
        {"# fovea-gaze-csv 1\n# rate_hz: fast\nt_ns\n1\n", ":2:1", "rate_hz"},
        {"# fovea-gaze-csv 1\n# samples: 3\nt_ns\n1\n", ":4:1", "promises 3 samples, the file holds 1"},
        {"# fovea-gaze-csv 1\n", ":2:1", "header"},
        {"# fovea-gaze-csv 1\nt,combined_az_deg\n1,2\n", ":2:1", "'t_ns' is missing"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_degs\n1,2\n", ":2:1", "unknown column 'combined_az_degs'"},
        {"# fovea-gaze-csv 1\nt_ns,t_ns\n1,2\n", ":2:1", "unknown column 't_ns'"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg\n1,2\n", ":2:1", "incomplete"},
        {"# fovea-gaze-csv 1\nt_ns,head_w\n1,2\n", ":2:1", "incomplete"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1,2\n", ":3:1", "2 cells where the header has 3"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1,2,3\n2,zwei,3\n", ":4:3", "'zwei' is not a number"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1.5,2,3\n", ":3:1", "not an integer"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n9223372036854775807,2,3\n", ":3:1", "2^62"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n99999999999999999999,2,3\n", ":3:1", "64 bits"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1,2,1e999\n", ":3:5", "beyond the range"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1,2,91\n", ":3:3", "beyond"},
        {"# fovea-gaze-csv 1\nt_ns,combined_x,combined_y,combined_z\n1,0,0,-12\n", ":3:3", "unit length"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg,combined_valid\n1,,,1\n", ":3:3", "without a direction"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg,combined_valid\n1,2,3,maybe\n", ":3:7", "neither 0 nor 1"},
        {"# fovea-gaze-csv 1\nt_ns,label\n1,saccaed\n", ":3:3", "unknown label"},
        {"# fovea-gaze-csv 1\nt_ns,combined_az_deg,combined_el_deg\n1,2,3", ":3:1", "middle of a line"},
    };
    for (const Bad& bad : cases) {
        const auto r = load_text(bad.text);
        ASSERT_FALSE(r) << bad.text;
        EXPECT_THAT(r.error().where, HasSubstr(std::string("a.csv") + bad.where)) << bad.text << r.error().message();
        EXPECT_THAT(r.error().what, HasSubstr(bad.what)) << bad.text;
        EXPECT_FALSE(r.error().way_out.empty()) << bad.text;
    }
}

TEST(FoveaCsv, TornAtEveryByteIsAnError) {
    const std::string whole = to_csv(odd_recording(12, 23));
    ASSERT_TRUE(read_fovea_csv({"whole.csv", whole}));
    for (std::size_t length = 0; length < whole.size(); ++length) {
        const auto r = read_fovea_csv({"torn.csv", std::string_view(whole).substr(0, length)});
        ASSERT_FALSE(r) << length;
        EXPECT_FALSE(r.error().way_out.empty());
    }
}

TEST(FoveaCsv, ASlightlyUnnormalisedVectorIsNormalised) {
    const auto r = load_text(body("t_ns,combined_x,combined_y,combined_z\n1,0.6001,0,-0.8\n"));
    ASSERT_TRUE(r);
    EXPECT_NEAR(length(r->samples[0].sample.eye(Eye::combined).gaze_dir_head.vec()), 1, 1e-15);
}

TEST(FoveaCsv, NeverLeavesHalfAFile) {
    const TempDir dir;
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        ::signal(SIGXFSZ, SIG_IGN);
        const struct rlimit limit = {4096, 4096};
        if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(2);
        const auto written = write_csv(dir / "a.csv", odd_recording(1000, 24));
        ::_exit(!written && written.error().way_out.find("space") != std::string::npos ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
    EXPECT_TRUE(std::filesystem::is_empty(dir.path()));
}

TEST(FoveaCsv, RefusesToOverwriteAndToWriteNowhere) {
    const TempDir dir;
    write_file(dir / "a.csv", "precious");
    EXPECT_FALSE(write_csv(dir / "a.csv", odd_recording(2, 25)));
    EXPECT_EQ(read_file(dir / "a.csv"), "precious");
    EXPECT_TRUE(write_csv(dir / "a.csv", odd_recording(2, 25), {.overwrite = true}));
    const auto nowhere = write_csv(dir / "no/a.csv", odd_recording(2, 25));
    ASSERT_FALSE(nowhere);
    EXPECT_THAT(nowhere.error().message(), HasSubstr("No such file"));
}

TEST(LoadRecording, SaysWhatIsWrongWithAFileThatIsNone) {
    const TempDir dir;
    write_file(dir / "empty", "");
    write_file(dir / "image.png", std::string_view("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16));
    EXPECT_THAT(load_recording(dir / "missing").error().message(), HasSubstr("No such file"));
    EXPECT_THAT(load_recording(dir.path()).error().message(), HasSubstr("is a directory"));
    EXPECT_THAT(load_recording(dir / "empty").error().message(), HasSubstr("is empty"));
    EXPECT_THAT(load_recording(dir / "image.png").error().message(), HasSubstr("format is not known"));
    EXPECT_THAT(load_recording("/proc/self/exe").error().way_out, HasSubstr("fovea_csv"));
    EXPECT_THAT(load_recording("/dev/null").error().message(), HasSubstr("not a regular file"));
    EXPECT_THAT(load_recording_as(dir / "image.png", "gif").error().message(), HasSubstr("there is no format 'gif'"));
    EXPECT_FALSE(load_recording_as(dir / "image.png", "fovea_csv"));
}

TEST(ShippedRecordings, AreWhatTheirReadmeSays) {
    const auto eyelink = load_recording(source_path("tests/data/recordings/eyelink_lookatpoint_s1.csv"));
    ASSERT_TRUE(eyelink) << eyelink.error().message();
    EXPECT_EQ(eyelink->samples.size(), 81'003u);
    EXPECT_EQ(eyelink->info.nominal_rate_hz, 1000);
    EXPECT_TRUE(eyelink->info.has_labels);
    // A closing lid makes the tracker see the gaze sink: y is up in our file when it falls before blink losses.
    int falls = 0, losses = 0;
    const auto& s = eyelink->samples;
    for (std::size_t i = 60; i < s.size(); ++i) {
        const auto valid = [&](std::size_t k) { return s[k].sample.eye(Eye::combined).valid; };
        if (valid(i) || !valid(i - 1) || s[i].label != Label::blink) continue;
        ++losses;
        falls += s[i - 1].sample.eye(Eye::combined).gaze_dir_head.y < s[i - 60].sample.eye(Eye::combined).gaze_dir_head.y;
    }
    EXPECT_EQ(losses, 22);
    EXPECT_EQ(falls, losses);

    const auto vive = load_recording(source_path("tests/data/recordings/vive_pro_eye_360vr.csv"));
    ASSERT_TRUE(vive) << vive.error().message();
    EXPECT_EQ(vive->samples.size(), 1665u);
    EXPECT_TRUE(vive->info.has_head_pose);
    // The vestibulo-ocular reflex turns the eyes against the head: over 100 ms steps without a saccade the sum of
    // products of both turns is negative, in azimuth (only if x is right and the head's yaw has our sign).
    double products = 0;
    for (std::size_t i = 12; i < vive->samples.size(); ++i) {
        const GazeSample &a = vive->samples[i - 12].sample, &b = vive->samples[i].sample;
        if (!a.eye(Eye::combined).valid || !b.eye(Eye::combined).valid) continue;
        const auto ga = to_azimuth_elevation(a.eye(Eye::combined).gaze_dir_head);
        const auto gb = to_azimuth_elevation(b.eye(Eye::combined).gaze_dir_head);
        const double eye = gb.azimuth_rad - ga.azimuth_rad;
        const Direction<HeadFrame> ahead{};
        const auto fa = a.head.world_from_head * ahead, fb = b.head.world_from_head * ahead;
        const double head = std::remainder(std::atan2(fb.x, -fb.z) - std::atan2(fa.x, -fa.z), 2 * 3.14159265358979);
        if (std::abs(eye) < 4 * kDegree && std::abs(head) > 0.7 * kDegree) products += eye * head;
    }
    EXPECT_LT(products, 0);
}
