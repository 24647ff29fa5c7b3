// The HID driver as it is, on a machine of umockdev's: libudev finds the trackers, hidapi and hidraw speak to them.
#include <linux/hidraw.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/hid/hid_device.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"
#include "tests/drivers/udev/testbed.hpp"

using namespace fovea;
using namespace fovea::drivers;
using fovea::tests::Node;
using fovea::tests::Testbed;
using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;

namespace {

constexpr int kNrMask = 0xFF;

// A tracker on hidrawN: the kernel's side of sysfs and hidraw.
class Tracker {
public:
    Tracker(Testbed& testbed, int number, std::vector<std::uint8_t> descriptor, const std::string& serial)
        : testbed_{testbed}, number_{number}, descriptor_{std::move(descriptor)} {
        parent_ = fmt::format("/devices/virtual/misc/uhid/0003:1D50:E7E1.{:04X}", number + 1);
        testbed_.add(fmt::format("P: {0}\nE: SUBSYSTEM=hid\nE: DRIVER=hid-generic\nE: HID_ID=0003:00001D50:0000E7E1\n"
                                 "E: HID_NAME=Testbed Tracker\nE: HID_PHYS=usb-1\nE: HID_UNIQ={1}\n"
                                 "A: uevent=HID_ID=0003:00001D50:0000E7E1\\nHID_NAME=Testbed Tracker\\nHID_UNIQ={1}\\n\n"
                                 "H: report_descriptor={2}\n\n",
                                 parent_, serial, tests::hex(descriptor_)));
        testbed_.add(fmt::format("P: {0}/hidraw/hidraw{1}\nN: hidraw{1}\nE: DEVNAME=/dev/hidraw{1}\nE: MAJOR=240\n"
                                 "E: MINOR={1}\nE: SUBSYSTEM=hidraw\nA: dev=240:{1}\nL: device=../../../{2}\n\n",
                                 parent_, number, parent_.substr(parent_.rfind('/') + 1)));
        node_.emplace(testbed_, fmt::format("/dev/hidraw{}", number),
                      [this](unsigned long request, void* argument) { return answer(request, argument); });
    }
    ~Tracker() {
        node_.reset();
        testbed_.remove("/sys" + parent_ + fmt::format("/hidraw/hidraw{}", number_));
        testbed_.remove("/sys" + parent_);
    }
    Tracker(const Tracker&) = delete;
    Tracker& operator=(const Tracker&) = delete;

    void look(double x_m, double y_m, double time_s) {
        tests::Truth t;
        t.gaze_x = x_m, t.gaze_y = y_m, t.time_s = time_s;
        t.left[0] = 0.22, t.right[0] = 0.28, t.left[1] = t.right[1] = 0.15, t.left[2] = t.right[2] = 0.6;
        node_->send(tests::encode_tracking(drivers::hid::parse_report_descriptor(descriptor_).value(), t));
    }
    void unplug() { node_->unplug(); }

    std::vector<std::vector<std::uint8_t>> written;   // feature reports from the host

private:
    long answer(unsigned long request, void* argument) {
        auto* const bytes = static_cast<std::uint8_t*>(argument);
        const auto room = static_cast<std::size_t>(_IOC_SIZE(request));
        switch (request & kNrMask) {
            case 1: {
                const auto size = static_cast<int>(descriptor_.size());
                std::memcpy(argument, &size, sizeof size);
                return 0;
            }
            case 2: std::ranges::copy(descriptor_, static_cast<hidraw_report_descriptor*>(argument)->value); return 0;
            case 6: written.emplace_back(bytes, bytes + room); return static_cast<long>(room);
            case 7: {
                const auto report = tests::encode_feature(drivers::hid::parse_report_descriptor(descriptor_).value(), bytes[0], 250);
                if (report.empty()) return -EPIPE;
                const std::size_t n = std::min(room, report.size());
                std::copy_n(report.begin(), n, bytes);
                return static_cast<long>(n);
            }
            default: return -EINVAL;
        }
    }

    Testbed& testbed_;
    int number_;
    std::vector<std::uint8_t> descriptor_;
    std::string parent_;
    std::optional<Node> node_;
};

std::vector<std::uint8_t> classic() { return tests::shape("classic").descriptor; }
// Usage page 1, a mouse with three buttons.
std::vector<std::uint8_t> mouse() {
    return {0x05, 0x01, 0x09, 0x02, 0xA1, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x03, 0x15,
            0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x08, 0x81, 0x02, 0xC0};
}

class UdevHid : public ::testing::Test {
protected:
    void SetUp() override {
        std::string why;
        if (!tests::testbed_works(why)) GTEST_SKIP() << why;
        testbed.emplace();
    }
    std::unique_ptr<Device> device(std::map<std::string, std::string> values = {}) {
        return hid::create({std::move(values), "test", {}}, time).value();
    }
    SystemTime time;
    std::optional<Testbed> testbed;
};

}  // namespace

TEST_F(UdevHid, FindsTrackersByTheirUsagePageAmongOtherDevices) {
    EXPECT_TRUE(hid::list(false).empty());
    const Tracker a(*testbed, 2, mouse(), "M1"), b(*testbed, 10, classic(), "ET10"), c(*testbed, 3, classic(), "ET3");
    const auto found = hid::list(true);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].location, "/dev/hidraw3") << "in the order of their numbers";
    EXPECT_EQ(found[1].location, "/dev/hidraw10");
    EXPECT_EQ(found[0].name, "Testbed Tracker (1d50:e7e1, serial ET3)");
    EXPECT_EQ(found[0].problem, "");
    EXPECT_THAT(found[0].facts, Contains(HasSubstr("calibrated screen 0.500 m x 0.300 m"))) << "from a feature report";
    EXPECT_THAT(found[0].facts, Contains("250 Hz"));
    EXPECT_THAT(found[0].details, HasSubstr("Gaze Point"));
}

TEST_F(UdevHid, StreamsWhatTheChosenTrackerSays) {
    Tracker first(*testbed, 0, classic(), "ET0"), second(*testbed, 1, classic(), "ET1");
    const auto d = device({{"serial", "ET1"}});
    const auto opened = d->open();
    ASSERT_TRUE(opened) << opened.error().message();
    EXPECT_EQ(d->info().location, "/dev/hidraw1");
    EXPECT_EQ(d->info().nominal_rate_hz, 250);
    EXPECT_TRUE(first.written.empty());
    EXPECT_EQ(second.written.size(), 1u) << "the mode request";
    for (int i = 0; i < 12; ++i) {   // a FIFO in packet mode holds 16
        second.look(0.25 + 0.01 * i, 0.15, 10 + 0.004 * i);
        first.look(0, 0, 10);
    }
    for (int i = 0; i < 12; ++i) {
        GazeSample s;
        ASSERT_EQ(d->poll(s, time.now() + 10s), PollStatus::sample);
        const auto gaze = s.eye(Eye::combined).gaze_dir_head;
        EXPECT_NEAR(gaze.x / -gaze.z, 0.01 * i / 0.6, 1e-5);
        EXPECT_NEAR(gaze.y, 0, 1e-5);
        EXPECT_EQ(s.device_time.ns, 10'000'000'000 + 4'000'000 * i);
    }
    GazeSample s;
    EXPECT_EQ(d->poll(s, time.now()), PollStatus::nothing);
}

TEST_F(UdevHid, IsLostWhenUnpluggedAndFoundAgain) {
    const auto d = device();
    const auto none = d->open();
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message(), HasSubstr("no eye tracker of HID usage page 0x12 is plugged in"));
    for (int round = 1; round <= 3; ++round) {
        Tracker tracker(*testbed, round, classic(), "ET");   // it comes back under another number
        const auto opened = d->open();
        ASSERT_TRUE(opened) << opened.error().message();
        tracker.look(0.25, 0.15, round);
        GazeSample s;
        ASSERT_EQ(d->poll(s, time.now() + 10s), PollStatus::sample);
        tracker.unplug();
        ASSERT_EQ(d->poll(s, time.now() + 10s), PollStatus::lost);
        EXPECT_STREQ(d->counters().last_loss, "unplugged");
        EXPECT_EQ(d->counters().losses, static_cast<std::uint64_t>(round));
    }
}
