#include "drivers/hid/eye_tracker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "protocol/sphere.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"

using namespace fovea;
using namespace fovea::drivers::hid;
using namespace fovea::tests;

namespace {

struct Opened {
    EyeTracker tracker;
    ReportDescriptor descriptor;
};

Opened open_shape(const std::string& name, const Quirks& quirks = {}) {
    const Shape& s = shape(name);
    ScreenSettings screen;
    if (s.needs_screen_size) screen = {kScreenWidth, kScreenHeight, 0.6};
    Opened o{EyeTracker::create(s.descriptor, quirks, screen).value(), parse_report_descriptor(s.descriptor).value()};
    for (const auto& f : o.tracker.features_to_read()) {
        const auto report = encode_feature(o.descriptor, f.id, 250);
        EXPECT_EQ(report.size(), f.bytes);
        o.tracker.take_feature(report);
    }
    return o;
}

GazeSample decode(Opened& o, const Truth& truth, Decoded expected = Decoded::sample) {
    GazeSample s;
    bool has_time = false;
    EXPECT_EQ(o.tracker.decode(encode_tracking(o.descriptor, truth), s, has_time), expected);
    EXPECT_EQ(has_time, o.tracker.capabilities().timestamp);
    return s;
}

Truth looking_at(double x, double y) {
    Truth t;
    t.gaze_x = x;
    t.gaze_y = y;
    t.left[0] = 0.22, t.left[1] = 0.14, t.left[2] = 0.61;
    t.right[0] = 0.284, t.right[1] = 0.142, t.right[2] = 0.607;
    return t;
}

Direction<HeadFrame> expected(const Truth& t, double ex, double ey, double ez) {
    return Direction<HeadFrame>::from({t.gaze_x - ex, ey - t.gaze_y, -ez}).value();
}

constexpr double kDegree = 0.017453292519943295;

}  // namespace

TEST(EyeTracker, TurnsGazePointAndEyePositionsIntoRays) {
    for (const char* name : {"classic", "packed"}) {
        Opened o = open_shape(name);
        for (double x : {-0.12, 0.0, 0.1, 0.25, 0.5})   // left of the screen and above it, too
            for (double y : {-0.03, 0.02, 0.15, 0.3}) {
                const Truth t = looking_at(x, y);
                const GazeSample s = decode(o, t);
                ASSERT_TRUE(s.eye(Eye::combined).valid && s.eye(Eye::left).valid && s.eye(Eye::right).valid);
                // packed has steps of 0.1 mm, which 0.6 m away are 0.01 degrees.
                EXPECT_LT(angle_between(s.eye(Eye::combined).gaze_dir_head, expected(t, 0.252, 0.141, 0.6085)), 0.02 * kDegree);
                EXPECT_LT(angle_between(s.eye(Eye::left).gaze_dir_head, expected(t, 0.22, 0.14, 0.61)), 0.02 * kDegree);
                EXPECT_LT(angle_between(s.eye(Eye::right).gaze_dir_head, expected(t, 0.284, 0.142, 0.607)), 0.02 * kDegree);
            }
    }
}

TEST(EyeTracker, LooksUpAndRightForAPointUpAndRightOfTheEyes) {
    Opened o = open_shape("classic");
    const GazeSample s = decode(o, looking_at(0.45, 0.02));
    EXPECT_GT(s.eye(Eye::combined).gaze_dir_head.x, 0.1);
    EXPECT_GT(s.eye(Eye::combined).gaze_dir_head.y, 0.1);
    EXPECT_LT(s.eye(Eye::combined).gaze_dir_head.z, -0.8);
}

TEST(EyeTracker, CompletesAShareOfTheScreenFromTheDevicesOwnGeometry) {
    Opened o = open_shape("ratio");
    EXPECT_NEAR(o.tracker.capabilities().screen_width_m, kScreenWidth, 1e-6);
    const Truth t = looking_at(0.4, 0.05);
    const GazeSample s = decode(o, t);
    // No eye positions: the head's stands in for both.
    EXPECT_FALSE(s.eye(Eye::left).valid);
    EXPECT_LT(angle_between(s.eye(Eye::combined).gaze_dir_head, expected(t, 0.252, 0.141, 0.6085)), 0.02 * kDegree);
}

TEST(EyeTracker, LooksFromInFrontOfTheScreensMiddleWithoutEyeOrHead) {
    Opened o = open_shape("inches");
    const Truth t = looking_at(0.4, 0.05);
    EXPECT_LT(angle_between(decode(o, t).eye(Eye::combined).gaze_dir_head, expected(t, 0.25, 0.15, 0.6)), 0.01 * kDegree);
    EXPECT_TRUE(o.tracker.check_geometry());
    const auto blind = EyeTracker::create(shape("inches").descriptor).value();
    EXPECT_THAT(blind.check_geometry().error().message(), testing::HasSubstr("screen_width_m"));
}

TEST(EyeTracker, HasNoGazeWhereTheDeviceHasNone) {
    for (const Shape& shape : shapes()) {
        Opened o = open_shape(shape.name);
        Truth t = looking_at(0.2, 0.1);
        t.eyes_seen = false;
        for (const EyeState& e : decode(o, t).eyes) EXPECT_FALSE(e.valid) << shape.name;
    }
    Opened o = open_shape("classic");
    EXPECT_FALSE(decode(o, looking_at(2.5, 0.1)).eye(Eye::combined).valid) << "outside the logical range";
    Truth one = looking_at(0.2, 0.1);
    one.left[0] = one.left[1] = one.left[2] = 0;
    const GazeSample s = decode(o, one);
    EXPECT_FALSE(s.eye(Eye::left).valid);
    EXPECT_TRUE(s.eye(Eye::right).valid && s.eye(Eye::combined).valid);
    EXPECT_EQ(s.eye(Eye::combined).gaze_dir_head, s.eye(Eye::right).gaze_dir_head);
}

TEST(EyeTracker, KeepsTheDevicesTimeToTheTick) {
    Opened o = open_shape("classic");
    Truth t = looking_at(0.1, 0.1);
    t.time_s = 86400.000123;
    EXPECT_EQ(decode(o, t).device_time.ns, 86'400'000'123'000);
}

TEST(EyeTracker, CountsOnOverWrapsOfTheDevicesCounter) {
    for (const auto& [name, tick_ns, period] : {std::tuple{"packed", 1'000'000, 65.536}, {"ratio", 100'000, 429496.7296}}) {
        Opened o = open_shape(name);
        Truth t = looking_at(0.1, 0.1);
        const std::int64_t first = decode(o, t).device_time.ns;
        std::int64_t last = first;
        for (int i = 1; i <= 2000; ++i) {
            t.time_s = i * period / 700;
            last = decode(o, t).device_time.ns;
            EXPECT_NEAR(static_cast<double>(last - first) * 1e-9, t.time_s, tick_ns * 1e-9);
        }
        t.time_s -= period / 100;   // a report out of order goes back, not once round
        EXPECT_LT(decode(o, t).device_time.ns, last);
    }
}

TEST(EyeTracker, ARehearsedReportLeavesCounterAndStatusAlone) {
    Opened o = open_shape("packed"), other = open_shape("packed");
    Truth t = looking_at(0.1, 0.1);
    const auto old = encode_tracking(o.descriptor, t);
    for (int i = 1; i <= 40; ++i) {
        t.time_s = i * 7.0;   // of the 65.5 s after which the counter wraps
        GazeSample scratch;
        o.tracker.rehearse(old, scratch);
        EXPECT_TRUE(scratch.eye(Eye::combined).valid);
        EXPECT_EQ(decode(o, t).device_time.ns, decode(other, t).device_time.ns) << i;
        EXPECT_EQ(o.tracker.capabilities().status, other.tracker.capabilities().status);
    }
}

TEST(EyeTracker, TellsItsCapabilities) {
    Opened o = open_shape("classic");
    const Capabilities& c = o.tracker.capabilities();
    EXPECT_EQ(c.sampling_hz, 250);
    EXPECT_EQ(c.status, ConfigurationStatus::ready);
    EXPECT_NEAR(c.optimum_distance_m, 0.65, 1e-9);
    EXPECT_NEAR(c.screen_height_m, kScreenHeight, 1e-9);
    EXPECT_TRUE(c.eye_positions && c.timestamp);
    EXPECT_FALSE(c.head_position) << "the head's fields are constant";
    EXPECT_EQ(o.tracker.mode_request(), (std::vector<std::uint8_t>{0x14, 7}));
}

TEST(EyeTracker, CountsShortAndOverlongReportsAsMalformed) {
    for (const Shape& shape : shapes()) {
        Opened o = open_shape(shape.name);
        GazeSample s;
        bool has_time = false;
        auto report = encode_tracking(o.descriptor, looking_at(0.1, 0.1));
        EXPECT_EQ(o.tracker.decode({report.data(), report.size() - 1}, s, has_time), Decoded::malformed);
        report.push_back(0);
        EXPECT_EQ(o.tracker.decode(report, s, has_time), Decoded::malformed);
        EXPECT_EQ(o.tracker.decode({}, s, has_time), Decoded::malformed);
    }
    Opened o = open_shape("ratio");
    GazeSample s;
    bool has_time = false;
    const std::uint8_t touch[] = {9, 1};
    EXPECT_EQ(o.tracker.decode(touch, s, has_time), Decoded::foreign);
}

TEST(EyeTracker, AllocatesNothingPerReport) {
    for (const Shape& shape : shapes()) {
        Opened o = open_shape(shape.name);
        const auto report = encode_tracking(o.descriptor, looking_at(0.2, 0.1));
        GazeSample s;
        bool has_time = false;
        const std::size_t before = fovea::test::allocated_bytes();
        for (int i = 0; i < 1000; ++i) (void)o.tracker.decode(report, s, has_time);
        EXPECT_EQ(fovea::test::allocated_bytes(), before) << shape.name;
    }
}

TEST(EyeTracker, RefusesADescriptorWithoutGaze) {
    DescriptorBuilder mouse;
    mouse.page(1).begin(2, 1).usage(0x30).logical(-127, 127).size(8, 1).input(6).end();
    EXPECT_THAT(EyeTracker::create(mouse.bytes).error().message(), testing::HasSubstr("no Eye Tracker collection"));
    DescriptorBuilder head;
    head.page(0x12).begin(1, 1).begin(0x27, 0).usages(0x21, 0x23).logical(0, 100).size(8, 3).input().end().end();
    EXPECT_THAT(EyeTracker::create(head.bytes).error().message(), testing::HasSubstr("no gaze point"));
}

TEST(EyeTracker, DecodesHeadRotation) {
    DescriptorBuilder b;
    b.page(0x12).begin(1, 1).begin(0x10, 2).logical(-18000, 18000).unit(0x11, -4);
    b.begin(0x24, 0).usages(0x21, 0x22).size(16, 2).input().end();
    b.unit(0x14, -2).usages(0x29, 0x2B).size(16, 3).input().end().end();
    ScreenSettings screen{kScreenWidth, kScreenHeight, 0.6};
    auto t = EyeTracker::create(b.bytes, {}, screen).value();
    GazeSample s;
    bool has_time = false;
    // About the device's y axis (down) by +30 degrees: z (to the user) turns to x (right), so the nose, which points
    // along -z, turns to the left.
    const std::uint8_t report[] = {1, 0, 1, 0, 0, 0, 3000 & 0xFF, 3000 >> 8, 0, 0};
    ASSERT_EQ(t.decode(report, s, has_time), Decoded::sample);
    ASSERT_TRUE(s.head.valid);
    const auto nose = s.head.world_from_head * Direction<HeadFrame>{};
    EXPECT_NEAR(nose.x, 0.5, 1e-3);
    EXPECT_NEAR(nose.y, 0, 1e-12);
}

TEST(Quirks, CompleteWhatTheDescriptorLeavesOut) {
    Quirks q;
    q.length_unit_m = 1e-3;
    q.timestamp_unit_s = 1e-3;
    q.flip_x = true;
    q.screen_width_m = kScreenWidth;
    auto b = DescriptorBuilder();
    b.page(0x12).begin(1, 1).begin(0x10, 2).logical(0, 2000).usage(0x20).size(16, 1).input();
    b.begin(0x24, 0).usages(0x21, 0x22).size(16, 2).input().end();
    b.begin(0x25, 0).usages(0x21, 0x23).size(16, 3).input().end().end().end();
    auto t = EyeTracker::create(b.bytes, q).value();
    GazeSample s;
    bool has_time = false;
    const std::uint8_t report[] = {5, 0, 100, 0, 150, 0, 250, 0, 150, 0, 88, 2};   // gaze 0.1 0.15, eye 0.25 0.15 0.6
    ASSERT_EQ(t.decode(report, s, has_time), Decoded::sample);
    EXPECT_EQ(s.device_time.ns, 5'000'000);
    EXPECT_NEAR(s.eye(Eye::left).gaze_dir_head.x, 0.15 / std::hypot(0.15, 0.6), 1e-12) << "flipped: to the right";
    EXPECT_NEAR(s.eye(Eye::left).gaze_dir_head.y, 0, 1e-12);
}

TEST(Quirks, AreReadFromFilesAndFoundByVendorProductAndName) {
    const auto all = load_quirks({FOVEA_SOURCE_DIR "/configs/devices"});
    ASSERT_TRUE(all) << all.error().message();
    EXPECT_GE(all->size(), 1u);
    const auto folder = std::filesystem::temp_directory_path() / "fovea_quirks_test";
    std::filesystem::create_directories(folder);
    const auto file = folder / "a.toml";
    std::ofstream(file) << "[match]\nvendor = 0x1d50\nproduct = 0xe7e1\nname_contains = \"Lab\"\n[quirks]\nflip_y = true\n"
                           "start_report = [3, 0xFF]\n";
    const auto one = load_quirks({folder, folder / "not there"});
    ASSERT_TRUE(one) << one.error().message();
    EXPECT_TRUE(quirks_for(*one, 0x1d50, 0xe7e1, "A Lab tracker").flip_y);
    EXPECT_EQ(quirks_for(*one, 0x1d50, 0xe7e1, "A Lab tracker").start_report, (std::vector<std::uint8_t>{3, 255}));
    EXPECT_FALSE(quirks_for(*one, 0x1d50, 0xe7e1, "other").flip_y);
    EXPECT_FALSE(quirks_for(*one, 0x1d50, 0xe7e2, "Lab").flip_y);

    const std::pair<const char*, const char*> bad[] = {
        {"[match]\nvendor = 1\n[quirks]\nflip_w = true\n", ":4:10: unknown key 'quirks.flip_w'"},
        {"[match]\nvendor = 70000\n", "0 to 0xFFFF"},
        {"[match]\nproduct = 7\n", "needs vendor or name_contains"},
        {"[quirks]\nflip_x = true\n", "[match] is missing"},
        {"[match]\nvendor = 1\n[quirks]\nlength_unit_m = -1.0\n", ":4:17: length_unit_m must be a number"},
        {"[match\n", ":1:"},
    };
    for (const auto& [text, says] : bad) {
        std::ofstream(file) << text;
        const auto r = load_quirks({folder});
        ASSERT_FALSE(r) << text;
        EXPECT_THAT(r.error().message(), testing::HasSubstr(says));
    }
    std::filesystem::remove_all(folder);
}

TEST(EyeTracker, AnArrayThatNamesThePointsSaysWhichAreThere) {
    DescriptorBuilder b;
    b.page(0x12).begin(0x01, 1).begin(0x10, 2).id(3);
    b.logical(-2'000'000, 2'000'000).unit(0x11, -4);
    for (const int where : {0x24, 0x25, 0x26}) b.begin(where, 0).usages(0x21, 0x23).size(32, 3).input().end();
    b.unit(0, 0).usages(0x24, 0x26).logical(1, 3).size(4, 4).input(0).end().end();   // 1 gaze, 2 left eye, 3 right eye
    Opened o{EyeTracker::create(b.bytes, {}, {kScreenWidth, kScreenHeight, 0.6}).value(), parse_report_descriptor(b.bytes).value()};
    const auto seen = [&](std::uint8_t first, std::uint8_t second) {
        auto report = encode_tracking(o.descriptor, looking_at(0.3, 0.1));
        report[report.size() - 2] = first;
        report[report.size() - 1] = second;
        GazeSample s;
        bool has_time = false;
        EXPECT_EQ(o.tracker.decode(report, s, has_time), Decoded::sample);
        return s;
    };
    const GazeSample all = seen(0x21, 0x03), right = seen(0x31, 0x00), none = seen(0x32, 0x00), left = seen(0x02, 0xF1);
    EXPECT_TRUE(all.eye(Eye::combined).valid && all.eye(Eye::left).valid && all.eye(Eye::right).valid);
    EXPECT_TRUE(right.eye(Eye::combined).valid && right.eye(Eye::right).valid);
    EXPECT_FALSE(right.eye(Eye::left).valid);
    EXPECT_FALSE(none.eye(Eye::combined).valid) << "no gaze point in the list";
    EXPECT_TRUE(left.eye(Eye::left).valid) << "the order is free, and 0 and 15 select nothing";
    EXPECT_FALSE(left.eye(Eye::right).valid);
}
