#include "drivers/priority_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <semaphore>
#include <string>

using namespace fovea;
using namespace fovea::drivers;
using namespace std::chrono_literals;

namespace {

// A tracker that gives a sample every 5 ms of the test's clock, while it is plugged in.
struct Plug {
    bool in = true, valid = true, silent = false;
    int opens = 0, closes = 0;
};

class ScriptedDevice final : public Device {
public:
    ScriptedDevice(std::string name, Plug& plug, ManualTime& time) : name_{std::move(name)}, plug_{plug}, time_{time} {}
    DeviceInfo info() const override { return {"scripted", name_, "", 200, false}; }
    Result<void> open() override {
        if (!plug_.in) return fail(name_ + " is not plugged in");
        ++plug_.opens;
        due_ = time_.now() + 5ms;
        return {};
    }
    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (!plug_.in) {
            ++losses_;
            return PollStatus::lost;
        }
        if (plug_.silent) due_ = std::max(due_, deadline + 5ms);
        if (due_ > deadline) {
            if (time_.now() < deadline) time_.set(deadline);   // the wait
            return PollStatus::nothing;
        }
        if (time_.now() < due_) time_.set(due_);
        due_ += 5ms;
        out = {};
        out.eye(Eye::combined).valid = plug_.valid;
        out.received = time_.now();
        return PollStatus::sample;
    }
    void wake() noexcept override {}
    void close() noexcept override { ++plug_.closes; }
    DeviceCounters counters() const noexcept override { return {.losses = losses_, .last_loss = losses_ > 0 ? "unplugged" : ""}; }

private:
    std::string name_;
    Plug& plug_;
    ManualTime& time_;
    Instant due_;
    std::uint64_t losses_ = 0;
};

struct Two {
    ManualTime time{instant_from_ns(1'000'000'000)};
    Plug good, spare;
    std::unique_ptr<Device> device;
    std::uint64_t last_id = 0;

    Two() {
        std::vector<std::unique_ptr<Device>> devices;
        devices.push_back(std::make_unique<ScriptedDevice>("good", good, time));
        devices.push_back(std::make_unique<ScriptedDevice>("spare", spare, time));
        device = make_priority_device(std::move(devices), {.retry = 2s, .return_after = 1s, .own_thread = false}, time);
    }
    // Polls for so long; every sample must come, and ids must go on by one.
    void run(Duration span) {
        const Instant end = time.now() + span;
        while (time.now() < end) {
            GazeSample s;
            const PollStatus status = device->poll(s, std::min(end, time.now() + 100ms));
            ASSERT_NE(status, PollStatus::lost);
            if (status == PollStatus::sample) {
                ASSERT_EQ(s.id, ++last_id);
            }
        }
    }
    std::string active() const { return device->info().name; }
};

}  // namespace

TEST(PriorityDevice, TakesTheFirstThatOpens) {
    Two t;
    t.good.in = false;
    ASSERT_TRUE(t.device->open());
    EXPECT_EQ(t.active(), "spare");
    Two u;
    ASSERT_TRUE(u.device->open());
    EXPECT_EQ(u.active(), "good");
    EXPECT_EQ(u.spare.opens, 0);
}

TEST(PriorityDevice, FallsBackAtOnceAndReturnsOnlyAfterASecondOfValidGaze) {
    Two t;
    ASSERT_TRUE(t.device->open());
    t.run(100ms);
    t.good.in = false;
    t.run(100ms);
    EXPECT_EQ(t.active(), "spare");
    t.good.in = true;
    t.run(1950ms);    // found at the next retry, 2 s after the loss; then it has to prove itself
    EXPECT_EQ(t.active(), "spare");
    t.run(900ms);
    EXPECT_EQ(t.active(), "spare");
    t.run(300ms);
    EXPECT_EQ(t.active(), "good");
    EXPECT_EQ(t.device->counters().switches, 2u);
    EXPECT_EQ(t.spare.closes, 1) << "the spare is let go";
}

TEST(PriorityDevice, DoesNotReturnToATrackerThatSeesNoEyeOrComesAndGoes) {
    Two t;
    t.good.in = false;
    ASSERT_TRUE(t.device->open());
    t.good.in = true;
    t.good.valid = false;
    t.run(10s);
    EXPECT_EQ(t.active(), "spare");
    for (int i = 0; i < 20; ++i) {   // a loose plug: never a whole second of gaze
        t.good.valid = true;
        t.run(700ms);
        t.good.valid = false;
        t.run(50ms);
    }
    EXPECT_EQ(t.active(), "spare");
    for (int i = 0; i < 20; ++i) {
        t.good.valid = true;
        t.good.in = true;
        t.run(600ms);
        t.good.in = false;
        t.run(100ms);
    }
    EXPECT_EQ(t.active(), "spare");
    EXPECT_EQ(t.device->counters().switches, 0u);
}

TEST(PriorityDevice, DoesNotReturnToATrackerThatSaysNothingBetweenItsSamples) {
    Two t;
    t.good.in = false;
    ASSERT_TRUE(t.device->open());
    t.good.in = true;
    t.run(4s);   // it is open again, and valid
    ASSERT_EQ(t.active(), "good");
    t.good.in = false;
    t.run(1s);
    t.good.in = true;
    for (int i = 0; i < 20; ++i) {   // valid whenever it speaks, but never for a second on end
        t.good.silent = false;
        t.run(300ms);
        t.good.silent = true;
        t.run(700ms);
    }
    EXPECT_EQ(t.active(), "spare");
    t.good.silent = false;
    t.run(2s);
    EXPECT_EQ(t.active(), "good");
}

TEST(PriorityDevice, IsLostOnlyWhenAllAreAndOpensAgain) {
    Two t;
    ASSERT_TRUE(t.device->open());
    t.good.in = t.spare.in = false;
    GazeSample s;
    EXPECT_EQ(t.device->poll(s, t.time.now() + 1s), PollStatus::lost);
    EXPECT_EQ(t.device->poll(s, t.time.now() + 1s), PollStatus::lost);
    EXPECT_THAT(t.device->open().error().message(), testing::HasSubstr("spare is not plugged in"));
    t.spare.in = true;
    ASSERT_TRUE(t.device->open());
    t.last_id = 0;
    t.run(50ms);
    EXPECT_EQ(t.active(), "spare");
}

// A tracker whose open() and close() take as long as the test says, as a bus that does not answer.
class SlowDevice final : public Device {
public:
    explicit SlowDevice(std::atomic<int>& opens, std::binary_semaphore& gate) : opens_{opens}, gate_{gate} {}
    DeviceInfo info() const override { return {"slow", "slow", "", 0, false}; }
    Result<void> open() override {
        if (++opens_ == 1) return fail("not yet");   // so that the other one becomes active
        gate_.acquire();
        return {};
    }
    PollStatus poll(GazeSample& out, Instant) noexcept override {
        out = {};
        out.eye(Eye::combined).valid = true;
        return PollStatus::sample;
    }
    void wake() noexcept override {}
    void close() noexcept override {}

private:
    std::atomic<int>& opens_;
    std::binary_semaphore& gate_;
};

TEST(PriorityDevice, ATrackerThatTakesItsTimeToOpenHoldsUpNoGaze) {
    ManualTime time{instant_from_ns(1'000'000'000)};
    Plug spare;
    std::atomic<int> opens{0};
    std::binary_semaphore gate{0};
    std::vector<std::unique_ptr<Device>> devices;
    devices.push_back(std::make_unique<SlowDevice>(opens, gate));
    devices.push_back(std::make_unique<ScriptedDevice>("spare", spare, time));
    const auto device = make_priority_device(std::move(devices), {.retry = 2s, .return_after = 0s}, time);
    ASSERT_TRUE(device->open());
    GazeSample s;
    for (int i = 0; i < 1000 || opens < 2; ++i) {   // 5 s and more of the test's clock; the other hangs in open() meanwhile
        ASSERT_EQ(device->poll(s, time.now() + 100ms), PollStatus::sample);
        ASSERT_EQ(device->info().name, "spare");
    }
    EXPECT_EQ(opens, 2);
    gate.release();
    while (device->info().name != "slow") ASSERT_EQ(device->poll(s, time.now() + 100ms), PollStatus::sample);
    EXPECT_EQ(device->counters().switches, 1u);
    gate.release();   // for a second open(), should there be one
}

TEST(PriorityDevice, FallsBackOnItsOwnThreadToo) {
    const SystemTime time;
    ManualTime scripted{instant_from_ns(1'000'000'000)};
    Plug good, spare;
    std::vector<std::unique_ptr<Device>> devices;
    devices.push_back(std::make_unique<ScriptedDevice>("good", good, scripted));
    devices.push_back(std::make_unique<ScriptedDevice>("spare", spare, scripted));
    const auto device = make_priority_device(std::move(devices), {.retry = 600s, .return_after = 1s}, time);
    ASSERT_TRUE(device->open());
    good.in = false;
    GazeSample s;
    PollStatus status = PollStatus::nothing;
    while (status == PollStatus::nothing) status = device->poll(s, time.now() + 10s);
    EXPECT_EQ(status, PollStatus::sample);
    EXPECT_EQ(device->info().name, "spare");
    spare.in = false;
    do status = device->poll(s, time.now() + 10s);
    while (status == PollStatus::nothing);
    EXPECT_EQ(status, PollStatus::lost);
}

TEST(PriorityRow, HandsEachDriverItsOwnKeysAndRefusesUnknownDrivers) {
    std::string got;
    DeviceRow a;
    a.driver = "a";
    a.keys = {{"path", "\"\"", "where"}};
    a.create = [&](const DeviceSettings& s, const TimeSource&) -> Result<std::unique_ptr<Device>> {
        got = s.values.at("path") + " from " + s.where_is("path");
        return fail("enough");
    };
    const DeviceRow row = priority_row({a});
    EXPECT_STREQ(row.keys.back().name, "a_path");
    const SystemTime time;
    DeviceSettings s{{{"order", "a"}, {"a_path", "x"}}, "f:1", {{"a_path", "f:3:10"}}};
    EXPECT_FALSE(row.create(s, time));
    EXPECT_EQ(got, "x from f:3:10");
    s.values["order"] = "a b";
    s.values.erase("a_path");
    s.values["order"] = "b";
    EXPECT_THAT(row.create(s, time).error().message(), testing::HasSubstr("legal: a"));
    s.values["order"] = " ";
    EXPECT_FALSE(row.create(s, time));
}
