// From pictures to published gaze: rendered eyes through the camera driver, the calibration and the daemon's loop.
#include "drivers/camera/camera_device.hpp"

#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/pipeline/calibration.hpp"
#include "daemon/service/source_loop.hpp"
#include "drivers/camera/eye_model.hpp"
#include "drivers/synthetic/eye_image.hpp"
#include "protocol/sphere.hpp"
#include "tests/drivers/camera/fake_camera.hpp"
#include "tests/drivers/camera/jpeg_picture.hpp"

using namespace fovea;
using namespace fovea::drivers;
using fovea::tests::FakeCamera;
using fovea::tests::FakeCameras;

namespace {

constexpr int kSide = 192;
constexpr double kBall = 80, kMiddle = (kSide - 1) / 2.0, kDegree = std::numbers::pi / 180;

Direction<HeadFrame> at_deg(double x, double y) { return from_azimuth_elevation<HeadFrame>({x * kDegree, y * kDegree}); }

struct Slip {
    double x = 0, y = 0;   // of the whole eye in the picture, pixels: the headset has moved
};

// An eye of radius kBall that looks into `dir`, with one lamp's glint that the cornea carries along half as far.
std::vector<std::uint8_t> eye_looking(Direction<HeadFrame> dir, Slip slip = {}) {
    synthetic::EyeImageScene s;
    s.width = s.height = kSide;
    s.pupil_x = kMiddle + slip.x - kBall * dir.x;
    s.pupil_y = kMiddle + slip.y - kBall * dir.y;
    s.pupil_a = 18;
    s.pupil_b = 18 * std::max(0.5, -dir.z);
    s.pupil_angle_rad = std::atan2(dir.y, dir.x) + std::numbers::pi / 2;
    s.noise = 2;
    auto pixels = synthetic::render_eye(s);
    const double gx = kMiddle + slip.x - 0.5 * kBall * dir.x + 6, gy = kMiddle + slip.y - 0.5 * kBall * dir.y - 5;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            auto& p = pixels[static_cast<std::size_t>(y * kSide + x)];
            const double covered = std::clamp(2.5 - std::hypot(x - gx, y - gy), 0.0, 1.0);
            p = static_cast<std::uint8_t>(p + covered * (255 - p));
        }
    return pixels;
}

std::vector<std::uint8_t> as_jpeg(const std::vector<std::uint8_t>& pixels) { return fovea::tests::as_jpeg(pixels, kSide, kSide); }

struct Lab {
    FakeCameras calls;
    SystemTime time;
    std::unique_ptr<Device> device;
    std::map<std::string, std::uint32_t> sequence;

    FakeCamera& plug(const std::string& node) {
        FakeCamera& c = calls.at(node);
        c.width = c.height = kSide;
        return c;
    }
    void make(std::map<std::string, std::string> values) {
        DeviceSettings s;
        s.values = std::move(values);
        s.values["eyeball_px"] = "80";
        auto made = camera::create_on(calls, s, time);
        ASSERT_TRUE(made) << made.error().message();
        device = std::move(*made);
    }
    void show(const std::string& node, std::vector<std::uint8_t> bytes) {
        calls.show(node, {std::move(bytes), sequence[node]++, to_ns(time.now())});
    }
    GazeSample sample() {
        GazeSample s;
        EXPECT_EQ(device->poll(s, time.now() + std::chrono::seconds(60)), PollStatus::sample);
        return s;
    }
    EyeState seen(const std::string& node, std::vector<std::uint8_t> bytes) {
        show(node, std::move(bytes));
        return sample().eye(Eye::combined);
    }
};

double off_deg(const EyeState& e, Direction<HeadFrame> truth) {
    return e.valid ? angle_between(e.gaze_dir_head, truth) / kDegree : 180;
}

}  // namespace

TEST(CameraDevice, SeesWhereARenderedEyeLooks) {
    Lab lab;
    lab.plug("cam");
    lab.make({{"path", "cam"}});
    ASSERT_TRUE(lab.device->open());
    for (const double x : {-25.0, 0.0, 18.0})
        for (const double y : {-15.0, 4.0, 20.0}) EXPECT_LT(off_deg(lab.seen("cam", eye_looking(at_deg(x, y))), at_deg(x, y)), 0.3) << x << " " << y;
}

TEST(CameraDevice, ReadsMotionJpegToo) {
    Lab lab;
    lab.plug("cam").formats = {V4L2_PIX_FMT_MJPEG};
    lab.make({{"path", "cam"}});
    ASSERT_TRUE(lab.device->open());
    EXPECT_LT(off_deg(lab.seen("cam", as_jpeg(eye_looking(at_deg(10, -8)))), at_deg(10, -8)), 0.5);
    auto torn = as_jpeg(eye_looking(at_deg(0, 0)));
    torn.resize(40);
    lab.show("cam", torn);
    EXPECT_LT(off_deg(lab.seen("cam", as_jpeg(eye_looking(at_deg(-10, 8)))), at_deg(-10, 8)), 0.5);
    EXPECT_EQ(lab.device->counters().malformed + lab.device->counters().dropped, 1u);
}

TEST(CameraDevice, TheGlintPupilVectorWithstandsASlippingHeadset) {
    const Direction<HeadFrame> ahead = at_deg(0, 0), aside = at_deg(12, 6);
    const Slip slip{5, -4};
    Lab lab;
    lab.plug("cam");
    lab.make({{"path", "cam"}});
    ASSERT_TRUE(lab.device->open());
    EXPECT_GT(off_deg(lab.seen("cam", eye_looking(aside, slip)), aside), 3);
    // Half of the eye's turn moves the glint along, so the vector is half as long.
    lab.make({{"path", "cam"}, {"reference", "glint"}, {"centre_x_px", "-6"}, {"centre_y_px", "5"}});
    lab.device->close();
    ASSERT_TRUE(lab.device->open());
    const EyeState still = lab.seen("cam", eye_looking(aside)), slipped = lab.seen("cam", eye_looking(aside, slip));
    EXPECT_LT(off_deg(lab.seen("cam", eye_looking(ahead, slip)), ahead), 0.5);
    ASSERT_TRUE(still.valid && slipped.valid);
    EXPECT_LT(off_deg(slipped, still.gaze_dir_head), 0.5);
}

TEST(CameraDevice, ACameraBesideTheEyeIsTurnedBackByTheModel) {
    camera::EyeModel m;
    m.radius_px = 80;
    m.camera_azimuth_rad = 25 * kDegree;
    m.camera_elevation_rad = -20 * kDegree;
    camera::PupilResult p;
    p.found = true;   // in the middle of the picture: the eye looks into the camera
    const auto dir = camera::look(m, p);
    ASSERT_TRUE(dir);
    EXPECT_LT(angle_between(*dir, at_deg(25, -20)) / kDegree, 1e-6);
    p.ellipse.y = -80 * std::sin(20 * kDegree);   // up by as much as the camera is below
    EXPECT_LT(angle_between(*camera::look(m, p), at_deg(25, 0)) / kDegree, 1e-6);
}

TEST(CameraDevice, TwoCamerasMakeOneGazeAndOneGoesOnAloneForAnEye) {
    Lab lab;
    lab.plug("left").rate_hz = 2;   // the other eye's picture counts for two frames: a second
    lab.plug("right").rate_hz = 2;
    lab.make({{"path", "left"}, {"right_path", "right"}});
    ASSERT_TRUE(lab.device->open());
    const auto l = at_deg(6, 2), r = at_deg(2, 2);   // converging
    const auto right = eye_looking(r);
    lab.show("left", eye_looking(l));
    const GazeSample one = lab.sample();
    EXPECT_FALSE(one.eye(Eye::right).valid);
    EXPECT_LT(off_deg(one.eye(Eye::combined), l), 0.3);
    lab.show("right", right);
    const GazeSample both = lab.sample();
    EXPECT_LT(off_deg(both.eye(Eye::left), l), 0.3);
    EXPECT_LT(off_deg(both.eye(Eye::right), r), 0.3);
    EXPECT_LT(off_deg(both.eye(Eye::combined), at_deg(4, 2)), 0.3);
    lab.calls.unplug("right");
    GazeSample s;
    EXPECT_EQ(lab.device->poll(s, lab.time.now() + std::chrono::seconds(60)), PollStatus::lost);
    EXPECT_EQ(lab.calls.held(), 0) << "the other one is given back as well";
    EXPECT_FALSE(lab.device->open());
    lab.calls.plug_in("right");
    EXPECT_TRUE(lab.device->open());
}

TEST(CameraDevice, AnEmptyPictureIsNoGazeAndThreeAreAClosedEye) {
    Lab lab;
    lab.plug("cam");
    lab.make({{"path", "cam"}});
    ASSERT_TRUE(lab.device->open());
    const std::vector<std::uint8_t> skin(kSide * kSide, 150);
    EXPECT_FALSE(lab.seen("cam", skin).valid);
    EXPECT_FALSE(lab.seen("cam", skin).openness == 0);
    EXPECT_EQ(lab.seen("cam", skin).openness, 0);
    EXPECT_TRUE(lab.seen("cam", eye_looking(at_deg(0, 0))).valid);
}

// The whole way, calibrated: an eye whose line of sight is 5 degrees off its axis, before a camera that stands aside of
// where the model has it. Nine targets teach the calibration; other gazes are then published where the person looks.
TEST(CameraDevice, CalibratedItsGazeIsPublishedWhereThePersonLooks) {
    Lab lab;
    lab.plug("cam");
    lab.make({{"path", "cam"}});
    ASSERT_TRUE(lab.device->open());
    const auto shown_for = [](double x, double y) { return eye_looking(at_deg(0.95 * x + 5, 1.05 * y - 2 + 0.02 * x)); };
    std::vector<pipeline::CalibrationPoint> points;
    for (const double x : {-12.0, 0.0, 12.0})
        for (const double y : {-9.0, 0.0, 9.0}) {
            const EyeState e = lab.seen("cam", shown_for(x, y));
            ASSERT_TRUE(e.valid);
            points.push_back({e.gaze_dir_head, at_deg(x, y)});
        }
    const auto calibration = pipeline::fit_calibration(points);
    ASSERT_TRUE(calibration) << calibration.error().message();

    pipeline::PipelineSettings settings;
    settings.filter = "none";
    auto pipe = pipeline::Pipeline::create(settings).value();
    pipe.set_calibration(Eye::combined, *calibration);
    auto focus = FocusPublisher::create({}, lab.time.now()).value();
    auto samples = SamplesPublisher::create({8, 8}, focus.epoch()).value();
    auto ring = SamplesReader::map(samples.fd()).value();
    lab.device->close();
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<service::SourceState> states;
    service::SourceLoop* told = nullptr;
    service::SourceLoop loop(std::move(lab.device), true, std::move(pipe), {focus, samples}, lab.time, [&] {
        const std::lock_guard lock(mutex);
        if (told != nullptr) states.push_back(told->status().state);
        changed.notify_all();
    });
    told = &loop;
    const auto wait_for = [&](service::SourceState s) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, std::chrono::seconds(60), [&] { return std::ranges::count(states, s) > 0; });
    };
    loop.begin();
    ASSERT_TRUE(wait_for(service::SourceState::running));
    int good = 0;
    for (const double x : {-9.0, 3.0, 8.0})
        for (const double y : {-6.0, 5.0}) {
            lab.show("cam", shown_for(x, y));
            SampleRecord r;
            while (!ring.next_sample(r)) std::this_thread::yield();
            const EyeMotion& e = r.model.eye(Eye::combined);
            if (e.reference != r.model.exposed) continue;   // held: the pipeline takes so fast a change for a lid
            ++good;
            EXPECT_LT(angle_between(e.gaze_dir_head, at_deg(x, y)) / kDegree, 0.5) << x << " " << y;
            EXPECT_GT(angle_between(r.raw.eye(Eye::combined).gaze_dir_head, at_deg(x, y)) / kDegree, 2.0) << "uncalibrated";
            EXPECT_FALSE(r.model.exposed_estimated);
        }
    EXPECT_GE(good, 4);
    lab.calls.unplug("cam");
    ASSERT_TRUE(wait_for(service::SourceState::lost));
    loop.stop();
}
