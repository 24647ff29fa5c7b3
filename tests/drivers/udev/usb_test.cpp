// The USB driver as it is, on a machine of umockdev's: libusb finds the headset in sysfs, and this file is the kernel's
// side of its node (usbfs): claims, kernel drivers, transfers in flight, faults, unplugging.
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/usb/psvr2_device.hpp"
#include "protocol/sphere.hpp"
#include "tests/drivers/udev/testbed.hpp"
#include "tests/drivers/usb/psvr2_encode.hpp"

using namespace fovea;
using namespace fovea::drivers;
using fovea::tests::Node;
using fovea::tests::Testbed;
using namespace std::chrono_literals;
using ::testing::HasSubstr;

namespace {

constexpr const char* kNode = "/dev/bus/usb/001/002";
constexpr const char* kPath = "/devices/pci0000:00/usb1/1-1";
constexpr const char* kSysPath = "/sys/devices/pci0000:00/usb1/1-1";
constexpr std::uint8_t kInterface = usb::kPsvr2Interface, kEndpoint = 0x86;   // the controller has renumbered it

std::vector<std::uint8_t> descriptors() {
    std::vector<std::uint8_t> b = {18, 1, 0, 2, 0, 0, 0, 64, 0x4C, 0x05, 0xDE, 0x0C, 0, 1, 0, 2, 0, 1};
    const std::vector<std::uint8_t> interface = {9, 4, kInterface, 0, 1, 0xFF, 0, 0, 0, 7, 5, kEndpoint, 2, 0, 2, 0};
    const std::vector<std::uint8_t> config = {9, 2, static_cast<std::uint8_t>(9 + interface.size()), 0, 1, 1, 0, 0x80, 50};
    b.insert(b.end(), config.begin(), config.end());
    b.insert(b.end(), interface.begin(), interface.end());
    return b;
}

class Headset {
public:
    explicit Headset(Testbed& testbed) : testbed_{testbed} {
        testbed_.add(fmt::format("P: {0}\nN: bus/usb/001/002={1}\nE: DEVNAME={2}\nE: DEVTYPE=usb_device\nE: DRIVER=usb\n"
                                 "E: PRODUCT=54c/cde/100\nE: BUSNUM=001\nE: DEVNUM=002\nE: MAJOR=189\nE: MINOR=1\n"
                                 "E: SUBSYSTEM=usb\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum=2\\n\n"
                                 "A: dev=189:1\\n\nA: speed=480\\n\nA: bNumConfigurations=1\\n\nH: descriptors={1}\n\n",
                                 kPath, tests::hex(descriptors()), kNode));
        node_.emplace(testbed_, kNode, [this](unsigned long request, void* argument) { return answer(request, argument); });
        node_->fill();
    }
    ~Headset() {
        node_.reset();
        if (plugged_) testbed_.remove(kSysPath);
    }
    Headset(const Headset&) = delete;
    Headset& operator=(const Headset&) = delete;

    // Completes the oldest queued transfer; a status is as in usbfs: 0, or minus an errno.
    void complete(std::span<const std::uint8_t> bytes, int status = 0) {
        const std::lock_guard lock(mutex_);
        ASSERT_FALSE(queued_.empty());
        usbdevfs_urb* urb = queued_.front();
        queued_.pop_front();
        ASSERT_LE(bytes.size(), static_cast<std::size_t>(urb->buffer_length));
        if (!bytes.empty()) std::memcpy(urb->buffer, bytes.data(), bytes.size());
        finish(urb, static_cast<int>(bytes.size()), status);
    }
    void look(double azimuth_rad, std::uint32_t frame) {
        tests::Psvr2Truth t;
        t.left = t.right = t.combined = from_azimuth_elevation<HeadFrame>({azimuth_rad, 0});
        t.frame = frame;
        t.timestamp_us = 1'000'000 + 8000 * std::int64_t{frame};
        const auto packet = tests::encode_psvr2(t);
        complete(packet);
    }
    // As the kernel does: what is queued comes back as shut down, then the node says ENODEV and udev "remove".
    void unplug() {
        {
            const std::lock_guard lock(mutex_);
            for (usbdevfs_urb* urb : queued_) finish(urb, 0, -ESHUTDOWN);
            queued_.clear();
            plugged_ = false;
        }
        testbed_.send_event(kSysPath, "remove");
        testbed_.remove(kSysPath);
    }

    std::string kernel_driver;                // bound to the interface; empty: none
    std::string detached;                     // the one that was
    bool claimed = false, claimed_by_other = false;
    int halts_cleared = 0;
    std::vector<std::uint8_t> enable;         // the last vendor request with its setup
    [[nodiscard]] std::size_t queued() const {
        const std::lock_guard lock(mutex_);
        return queued_.size();
    }

private:
    void finish(usbdevfs_urb* urb, int bytes, int status) {
        urb->actual_length = bytes;
        urb->status = status;
        done_.push_back(urb);
        node_->drain();   // now it can be written to: libusb looks what is done
    }

    long submit(usbdevfs_urb* urb) {
        if (urb->type != USBDEVFS_URB_TYPE_CONTROL) {
            if (urb->endpoint != kEndpoint || !claimed) return -ENOENT;
            queued_.push_back(urb);
            return 0;
        }
        auto* const setup = static_cast<std::uint8_t*>(urb->buffer);
        if ((setup[0] & 0x60) == 0x40) {
            enable.assign(setup, setup + urb->buffer_length);
            finish(urb, urb->buffer_length - 8, 0);
        } else if (setup[1] == 6 && setup[3] == 3) {   // a string descriptor: the languages, or the product's name
            static constexpr std::uint8_t kLanguages[] = {4, 3, 9, 4}, kName[] = {8, 3, 'E', 0, 'y', 0, 'e', 0};
            const std::span<const std::uint8_t> text = setup[2] == 0 ? std::span<const std::uint8_t>(kLanguages) : kName;
            std::ranges::copy(text, setup + 8);
            finish(urb, static_cast<int>(text.size()), 0);
        } else {
            finish(urb, 0, -EPIPE);
        }
        return 0;
    }

    long answer(unsigned long request, void* argument) {
        const std::lock_guard lock(mutex_);
        if (request == USBDEVFS_REAPURBNDELAY) {
            if (done_.empty()) {
                node_->fill();
                return plugged_ ? -EAGAIN : -ENODEV;
            }
            *static_cast<void**>(argument) = done_.front();
            done_.pop_front();
            return 0;
        }
        if (!plugged_) return -ENODEV;
        switch (request) {
            case USBDEVFS_GET_CAPABILITIES: *static_cast<std::uint32_t*>(argument) = 0; return 0;
            case USBDEVFS_GETDRIVER: {
                auto& d = *static_cast<usbdevfs_getdriver*>(argument);
                if (kernel_driver.empty()) return -ENODATA;
                std::strncpy(d.driver, kernel_driver.c_str(), sizeof d.driver - 1);
                return 0;
            }
            case USBDEVFS_DISCONNECT_CLAIM:
                if (claimed_by_other) return -EBUSY;
                if (!kernel_driver.empty()) detached = std::exchange(kernel_driver, {});
                claimed = true;
                return 0;
            case USBDEVFS_CLAIMINTERFACE:
                if (claimed_by_other || !kernel_driver.empty()) return -EBUSY;
                claimed = true;
                return 0;
            case USBDEVFS_RELEASEINTERFACE: claimed = false; return 0;
            case USBDEVFS_IOCTL:
                if (static_cast<unsigned>(static_cast<usbdevfs_ioctl*>(argument)->ioctl_code) == USBDEVFS_CONNECT) {
                    kernel_driver = std::exchange(detached, {});
                    return kernel_driver.empty() ? 0 : 1;
                }
                return -ENODATA;
            case USBDEVFS_SUBMITURB: return submit(static_cast<usbdevfs_urb*>(argument));
            case USBDEVFS_DISCARDURB: {
                const auto it = std::ranges::find(queued_, argument);
                if (it == queued_.end()) return -EINVAL;
                finish(*it, 0, -ENOENT);
                queued_.erase(it);
                return 0;
            }
            case USBDEVFS_CLEAR_HALT: ++halts_cleared; return 0;
            default: return -ENOTTY;
        }
    }

    Testbed& testbed_;
    mutable std::mutex mutex_;
    std::deque<usbdevfs_urb*> queued_, done_;   // in the driver's own memory, as libusb handed them over
    bool plugged_ = true;
    std::optional<Node> node_;
};

class UdevUsb : public ::testing::Test {
protected:
    void SetUp() override {
        std::string why;
        if (!tests::testbed_works(why)) GTEST_SKIP() << why;
        testbed.emplace();
    }
    std::unique_ptr<Device> device() { return usb::create_psvr2({{}, "test", {}}, time).value(); }
    PollStatus poll(Device& d) { return d.poll(sample, time.now() + 10s); }
    double azimuth() const { return to_azimuth_elevation(sample.eye(Eye::combined).gaze_dir_head).azimuth_rad; }

    SystemTime time;
    std::optional<Testbed> testbed;
    GazeSample sample;
};

}  // namespace

TEST_F(UdevUsb, ListsTheHeadsetWithItsEndpoints) {
    EXPECT_TRUE(usb::list_psvr2(false).empty());
    const Headset headset(*testbed);
    const auto found = usb::list_psvr2(true);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].location, kNode);
    EXPECT_EQ(found[0].problem, "");
    EXPECT_EQ(found[0].details, "interface 5 alternate 0: class 0xFF\n  endpoint 0x86 bulk in, 512 bytes\n");
}

TEST_F(UdevUsb, StreamsWithSeveralTransfersInFlightFromTheEndpointThatIsThere) {
    Headset headset(*testbed);
    const auto d = device();
    const auto opened = d->open();
    ASSERT_TRUE(opened) << opened.error().message();
    EXPECT_EQ(headset.queued(), 4u);
    EXPECT_EQ(d->info().name, "Eye");
    EXPECT_EQ(d->info().location, "bus 1, address 2");
    EXPECT_EQ(d->poll(sample, time.now()), PollStatus::nothing);
    ASSERT_GE(headset.enable.size(), 8u) << "it is asked to stream";
    EXPECT_EQ(headset.enable[1], 9);
    for (std::uint32_t i = 0; i < 20; ++i) {
        headset.look(0.01 * i, i);
        ASSERT_EQ(poll(*d), PollStatus::sample);
        EXPECT_NEAR(azimuth(), 0.01 * i, 1e-6);
    }
    EXPECT_GE(headset.queued(), 3u) << "each is queued again but the one being read";
    d->close();
    EXPECT_EQ(headset.queued(), 0u) << "all cancelled";
    EXPECT_FALSE(headset.claimed);
}

TEST_F(UdevUsb, DetachesTheKernelsDriverAndGivesTheInterfaceBackToIt) {
    Headset headset(*testbed);
    headset.kernel_driver = "usbhid";
    const auto d = device();
    ASSERT_TRUE(d->open());
    EXPECT_EQ(headset.kernel_driver, "");
    EXPECT_EQ(headset.detached, "usbhid");
    EXPECT_TRUE(headset.claimed);
    d->close();
    EXPECT_FALSE(headset.claimed);
    EXPECT_EQ(headset.kernel_driver, "usbhid");
}

TEST_F(UdevUsb, SaysThatAnotherProgramHoldsTheInterface) {
    Headset headset(*testbed);
    headset.claimed_by_other = true;
    const auto opened = device()->open();
    ASSERT_FALSE(opened);
    EXPECT_THAT(opened.error().message(), HasSubstr("another program holds this device"));
}

TEST_F(UdevUsb, PutsUpWithStallsAndShortOverlongAndTornTransfers) {
    Headset headset(*testbed);
    const auto d = device();
    ASSERT_TRUE(d->open());
    headset.complete({}, -EPIPE);        // stalled: everything is cancelled, the halt cleared, all queued again
    EXPECT_EQ(d->poll(sample, time.now() + 20ms), PollStatus::nothing);
    EXPECT_EQ(headset.halts_cleared, 1);
    EXPECT_EQ(headset.queued(), 4u);
    headset.complete({}, -EOVERFLOW);    // overlong
    const std::uint8_t piece[] = {1, 2, 3};
    headset.complete(piece);             // short, and no packet's beginning
    tests::Psvr2Truth t;
    t.left = t.right = t.combined = from_azimuth_elevation<HeadFrame>({0.25, 0});
    const auto packet = tests::encode_psvr2(t);
    headset.complete(std::span(packet).first(100));   // torn in two
    headset.complete(std::span(packet).subspan(100));
    ASSERT_EQ(poll(*d), PollStatus::sample);
    EXPECT_NEAR(azimuth(), 0.25, 1e-6);
    EXPECT_EQ(d->counters().malformed, 3u) << "the stall, the overlong and the short one";
}

TEST_F(UdevUsb, IsLostWhenUnpluggedInMidStreamAndFoundAgain) {
    const auto d = device();
    for (int round = 1; round <= 3; ++round) {
        Headset headset(*testbed);
        testbed->send_event(kSysPath, "add");
        auto opened = d->open();
        for (const Instant end = time.now() + 10s; !opened && time.now() < end; opened = d->open())
            std::this_thread::sleep_for(1ms);   // a thread of libusb's takes the event
        ASSERT_TRUE(opened) << opened.error().message();
        headset.look(0.1, 1);
        ASSERT_EQ(poll(*d), PollStatus::sample);
        headset.unplug();
        ASSERT_EQ(poll(*d), PollStatus::lost);
        EXPECT_STREQ(d->counters().last_loss, "unplugged");
        EXPECT_FALSE(d->open());
    }
}
