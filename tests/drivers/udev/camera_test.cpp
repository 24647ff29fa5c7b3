// The camera driver as it is, on a machine of umockdev's: which nodes of sysfs are cameras, and pictures from one.
#include <algorithm>
#include <cerrno>
#include <optional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/camera_device.hpp"
#include "drivers/synthetic/eye_image.hpp"
#include "tests/drivers/camera/fake_camera.hpp"
#include "tests/drivers/udev/testbed.hpp"

using namespace fovea;
using namespace fovea::drivers;
using fovea::tests::FakeCameras;
using fovea::tests::Node;
using fovea::tests::Testbed;
using namespace std::chrono_literals;
using ::testing::HasSubstr;

namespace {

// /dev/videoN, whose ioctls a camera made of code answers.
class Camera {
public:
    Camera(Testbed& testbed, int number, std::vector<std::uint32_t> formats)
        : node_name_{fmt::format("/dev/video{}", number)} {
        testbed.add(fmt::format("P: /devices/platform/eye.{0}/video4linux/video{0}\nN: video{0}\nE: DEVNAME=/dev/video{0}\n"
                                "E: MAJOR=81\nE: MINOR={0}\nE: SUBSYSTEM=video4linux\nA: dev=81:{0}\nA: name=Eye\n\n",
                                number));
        auto& c = cameras_.at(node_name_);
        c.formats = std::move(formats);
        c.width = c.height = 192;
        fd_ = cameras_.open(node_name_.c_str());
        node_.emplace(testbed, node_name_, [this](unsigned long request, void* argument) {
            const long r = cameras_.ioctl(fd_, request, argument);
            if (request == VIDIOC_DQBUF && r == 0) node_->drain();
            return r < 0 ? -long{errno} : r;
        });
    }
    ~Camera() {
        node_.reset();
        cameras_.close(fd_);
    }
    Camera(const Camera&) = delete;
    Camera& operator=(const Camera&) = delete;

    void show(std::vector<std::uint8_t> pixels) {
        cameras_.show(node_name_, {.bytes = std::move(pixels), .sequence = 0, .captured_ns = to_ns(MonotonicClock::now())});
        const std::uint8_t ready = 1;
        node_->send({&ready, 1});
    }
    void unplug() { node_->unplug(); }
    [[nodiscard]] std::uint32_t memory() { return cameras_.at(node_name_).memory; }

private:
    std::string node_name_;
    FakeCameras cameras_;
    int fd_ = -1;
    std::optional<Node> node_;
};

class UdevCamera : public ::testing::Test {
protected:
    void SetUp() override {
        std::string why;
        if (!tests::testbed_works(why)) GTEST_SKIP() << why;
        testbed.emplace();
    }
    SystemTime time;
    std::optional<Testbed> testbed;
};

}  // namespace

TEST_F(UdevCamera, FindsTheCamerasAmongTheVideoNodes) {
    EXPECT_TRUE(camera::list(false).empty());
    const Camera ten(*testbed, 10, {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_MJPEG}), two(*testbed, 2, {V4L2_PIX_FMT_H264});
    testbed->add("P: /devices/platform/eye.3/video4linux/video3\nN: video3\nE: DEVNAME=/dev/video3\nE: MAJOR=81\nE: MINOR=3\n"
                 "E: SUBSYSTEM=video4linux\nA: dev=81:3\n\n");
    const Node metadata(*testbed, "/dev/video3", [](unsigned long request, void* argument) -> long {
        if (request != VIDIOC_QUERYCAP) return -ENOTTY;
        auto& cap = *static_cast<v4l2_capability*>(argument);
        cap.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
    });
    const auto found = camera::list(false);
    ASSERT_EQ(found.size(), 2u) << "a node for metadata is no camera";
    EXPECT_EQ(found[0].location, "/dev/video2");
    EXPECT_EQ(found[0].problem, "it offers none of GREY, Y16, YUYV and MJPG");
    EXPECT_EQ(found[1].location, "/dev/video10") << "2 comes before 10";
    EXPECT_EQ(found[1].problem, "");
    EXPECT_THAT(found[1].facts, ::testing::ElementsAre("offers GREY, MJPG"));
}

TEST_F(UdevCamera, OpensTheFirstUsableOneAndLosesItWhenUnplugged) {
    const Camera useless(*testbed, 0, {V4L2_PIX_FMT_H264});
    Camera eye(*testbed, 1, {V4L2_PIX_FMT_GREY});
    const auto device = camera::create({{}, "test", {}}, time).value();
    const auto opened = device->open();
    ASSERT_TRUE(opened) << opened.error().message();
    EXPECT_EQ(eye.memory(), std::uint32_t{V4L2_MEMORY_USERPTR}) << "a FIFO cannot be mapped: the next way is taken";
    synthetic::EyeImageScene scene;
    scene.width = scene.height = 192;
    scene.pupil_x = scene.pupil_y = 95.5;
    GazeSample s;
    for (int i = 0; i < 3; ++i) {
        eye.show(synthetic::render_eye(scene));
        ASSERT_EQ(device->poll(s, time.now() + 10s), PollStatus::sample);
        EXPECT_TRUE(s.eye(Eye::combined).valid);
        EXPECT_NEAR(s.eye(Eye::combined).gaze_dir_head.x, 0, 0.01);
    }
    eye.unplug();
    ASSERT_EQ(device->poll(s, time.now() + 10s), PollStatus::lost);
    EXPECT_STREQ(device->counters().last_loss, "unplugged");
}
