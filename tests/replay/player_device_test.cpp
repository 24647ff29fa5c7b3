#include "replay/player_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "replay/import/fovea_csv.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;
using drivers::PollStatus;
using ::testing::HasSubstr;

namespace {

constexpr Instant kStart = instant_from_ns(77'000'000'000);

// Exposures at the given nanoseconds past an epoch above 2^53, each received 3 ms later.
Recording recording_at(const std::vector<std::int64_t>& exposures_ns) {
    Recording r;
    for (const std::int64_t t : exposures_ns) {
        RecordedSample s;
        s.sample.id = 100 + r.samples.size();
        s.sample.device_time.ns = 1'650'316'509'598'345'895 + t;
        s.sample.exposed = instant_from_ns(s.sample.device_time.ns);
        s.sample.received = s.sample.exposed + std::chrono::milliseconds(3);
        r.samples.push_back(s);
    }
    return r;
}

std::unique_ptr<drivers::Device> player(Recording r, const PlayerSettings& settings, const TimeSource& time) {
    auto device = make_player(std::move(r), settings, "memory", time);
    EXPECT_TRUE(device);
    EXPECT_TRUE((*device)->open());
    return std::move(*device);
}

Result<std::unique_ptr<drivers::Device>> from_settings(std::map<std::string, std::string> values,
                                                       const TimeSource& time) {
    drivers::DeviceSettings settings;
    settings.values = std::move(values);
    settings.where = "fovead.toml:3";
    return player_row().create(settings, time);
}

}  // namespace

TEST(Player, ShiftsAllTimesByOneConstant) {
    const ManualTime time(kStart);
    const auto device = player(recording_at({0, 1'000'001, 2'000'003, 2'000'003, 1'999'999}), {.speed = 0}, time);
    std::vector<GazeSample> out;
    GazeSample s;
    while (device->poll(s, kStart) == PollStatus::sample) out.push_back(s);
    ASSERT_EQ(out.size(), 5u);
    EXPECT_EQ(out[0].received, kStart) << "the first sample is due at the start";
    EXPECT_EQ(out[0].exposed, kStart - std::chrono::milliseconds(3));
    EXPECT_EQ((out[1].exposed - out[0].exposed).count(), 1'000'001);
    EXPECT_EQ((out[2].exposed - out[1].exposed).count(), 1'000'002);
    EXPECT_EQ((out[4].exposed - out[3].exposed).count(), -4);
    EXPECT_EQ(out[1].device_time.ns, 1'650'316'509'598'345'895 + 1'000'001) << "device time stays the device's";
    for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i].id, i + 1);
    EXPECT_EQ(device->poll(s, kStart), PollStatus::ended);
    EXPECT_EQ(device->poll(s, kStart), PollStatus::ended);
}

TEST(Player, DeliversASampleWhenItIsDueAndNotBefore) {
    ManualTime time(kStart);
    const auto device = player(recording_at({0, 10'000'000, 9'000'000}), {}, time);
    GazeSample s;
    EXPECT_EQ(device->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ(device->poll(s, kStart), PollStatus::nothing);
    time.advance(Duration{9'999'999});
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::nothing);
    time.advance(Duration{1});
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::sample);
    EXPECT_EQ(s.id, 2u);
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::sample) << "out of order in the file: at once";
    EXPECT_EQ(s.id, 3u);
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::ended);
}

TEST(Player, HalfSpeedStretchesTime) {
    ManualTime time(kStart);
    const auto device = player(recording_at({0, 10'000'000}), {.speed = 0.5}, time);
    GazeSample s;
    EXPECT_EQ(device->poll(s, kStart), PollStatus::sample);
    const Instant first = s.exposed;
    time.advance(std::chrono::milliseconds(19));
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::nothing);
    time.advance(std::chrono::milliseconds(1));
    EXPECT_EQ(device->poll(s, time.now()), PollStatus::sample);
    EXPECT_EQ(s.exposed - first, std::chrono::milliseconds(20));
}

TEST(Player, ALoopGoesOnWithRisingTimesAndIds) {
    const ManualTime time(kStart);
    const auto device = player(recording_at({0, 4'000'000, 8'000'000}), {.speed = 0, .loop = true}, time);
    GazeSample s, last;
    for (std::uint64_t i = 1; i <= 10; ++i) {
        ASSERT_EQ(device->poll(s, kStart), PollStatus::sample);
        EXPECT_EQ(s.id, i);
        if (i > 1) {
            EXPECT_EQ(s.exposed - last.exposed, std::chrono::milliseconds(4));
            EXPECT_EQ(s.device_time.ns - last.device_time.ns, 4'000'000);
        }
        last = s;
    }
}

TEST(Player, OpeningAgainStartsAgain) {
    const ManualTime time(kStart);
    const auto device = player(recording_at({0, 1}), {.speed = 0}, time);
    GazeSample s;
    EXPECT_EQ(device->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ(device->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ(device->poll(s, kStart), PollStatus::ended);
    device->close();
    ASSERT_TRUE(device->open());
    EXPECT_EQ(device->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ(s.id, 1u);
}

TEST(Player, WakeEndsAWaitOnAnotherThread) {
    const SystemTime time;
    const auto device = player(recording_at({0, 3'600'000'000'000}), {}, time);
    GazeSample s;
    ASSERT_EQ(device->poll(s, time.now()), PollStatus::sample);
    std::thread waker([&] { device->wake(); });
    EXPECT_EQ(device->poll(s, time.now() + std::chrono::hours(1)), PollStatus::nothing);
    waker.join();
}

TEST(Player, RealTimeKeepsThePaceOfTheRecording) {
    const SystemTime time;
    const auto device = player(recording_at({0, 20'000'000, 40'000'000}), {}, time);
    GazeSample s;
    for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(device->poll(s, time.now() + std::chrono::hours(1)), PollStatus::sample);
        EXPECT_LE(s.received, time.now()) << "never before it is due";
    }
}

TEST(Player, TheSteadyLoopAllocatesNothing) {
    const ManualTime time(kStart);
    std::vector<std::int64_t> times;
    for (std::int64_t i = 0; i < 1000; ++i) times.push_back(i * 1'000'000);
    const auto device = player(recording_at(times), {.speed = 0, .loop = true}, time);
    GazeSample s;
    (void)device->poll(s, kStart);
    const std::size_t before = fovea::test::allocations();
    for (int i = 0; i < 5000; ++i) (void)device->poll(s, kStart);
    EXPECT_EQ(fovea::test::allocations(), before);
}

TEST(Player, PlaysThePartThatWasAskedFor) {
    const TempDir dir;
    ASSERT_TRUE(write_csv(dir / "a.csv", recording_at({0, 1'000'000'000, 2'000'000'000, 3'000'000'000})));
    const ManualTime time(kStart);
    auto device = from_settings(
        {{"path", (dir / "a.csv").string()}, {"speed", "max"}, {"start_s", "1"}, {"duration_s", "2"}}, time);
    ASSERT_TRUE(device) << device.error().message();
    ASSERT_TRUE((*device)->open());
    GazeSample s;
    ASSERT_EQ((*device)->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ(s.device_time.ns, 1'650'316'510'598'345'895);
    ASSERT_EQ((*device)->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ((*device)->poll(s, kStart), PollStatus::ended);
    EXPECT_EQ((*device)->info().driver, "replay");
    EXPECT_TRUE((*device)->info().exact_exposure);
}

TEST(Player, RefusesWhatCannotBe) {
    const ManualTime time(kStart);
    EXPECT_THAT(from_settings({}, time).error().message(), HasSubstr("needs a path"));
    for (const auto& [key, value] : std::vector<std::pair<std::string, std::string>>{
             {"speed", "0"}, {"speed", "fast"}, {"loop", "yes"}, {"start_s", "-1"}, {"duration_s", "nan"}, {"colour", "1"}}) {
        const auto device = from_settings({{"path", "x"}, {key, value}}, time);
        ASSERT_FALSE(device) << key;
        EXPECT_THAT(device.error().message(), HasSubstr(key));
        EXPECT_THAT(device.error().where, HasSubstr("fovead.toml:3"));
        EXPECT_FALSE(device.error().way_out.empty());
    }
    auto missing = from_settings({{"path", "/nonexistent.csv"}}, time);
    ASSERT_TRUE(missing);
    EXPECT_THAT((*missing)->open().error().message(), HasSubstr("/nonexistent.csv"));
    const TempDir dir;
    ASSERT_TRUE(write_csv(dir / "a.csv", recording_at({0, 1})));
    auto beyond = from_settings({{"path", (dir / "a.csv").string()}, {"start_s", "9"}}, time);
    ASSERT_TRUE(beyond);
    EXPECT_THAT((*beyond)->open().error().message(), HasSubstr("leave no sample"));
}

TEST(Player, ARecordingOfCenturiesIsRefused) {
    const ManualTime time(kStart);
    auto device = make_player(recording_at({0, 2'900'000'000'000'000'000}), {}, "memory", time);
    ASSERT_TRUE(device);
    EXPECT_THAT((*device)->open().error().message(), HasSubstr("10 years"));
}

constexpr std::int64_t kDay_ns = 86'400'000'000'000;

TEST(Player, WhatWouldPlayForCenturiesIsRefused) {
    const ManualTime time(kStart);
    auto slow = make_player(recording_at({0, 107 * kDay_ns}), {.speed = 0.001}, "memory", time);
    ASSERT_TRUE(slow);
    const auto refused = (*slow)->open();
    ASSERT_FALSE(refused) << "107 days are 293 years at a thousandth of the speed, which 64 bits of nanoseconds do not hold";
    EXPECT_THAT(refused.error().message(), HasSubstr("speed"));
    // An exposure far from every arrival counts as well.
    Recording torn = recording_at({0, 1'000'000});
    torn.samples[1].sample.exposed += Duration{107 * kDay_ns};
    slow = make_player(torn, {.speed = 0.001}, "memory", time);
    EXPECT_FALSE((*slow)->open());
    // What takes a little less is played.
    auto fits = make_player(recording_at({0, 3'500'000 * (kDay_ns / 1'000'000)}), {.speed = 0.001}, "memory", time);
    ASSERT_TRUE((*fits)->open());
    GazeSample s;
    ASSERT_EQ((*fits)->poll(s, kStart), PollStatus::sample);
    EXPECT_EQ((*fits)->poll(s, kStart), PollStatus::nothing) << "it is not due for ten years";
}

TEST(Player, ALoopOfYearsEndsBeforeTheClockDoes) {
    const ManualTime time(kStart);
    const auto device = player(recording_at({0, 3000 * kDay_ns}), {.speed = 0, .loop = true}, time);
    GazeSample s;
    Instant last = kStart - std::chrono::hours(1);
    int n = 0;
    for (PollStatus status; (status = device->poll(s, kStart)) != PollStatus::ended; ++n) {
        ASSERT_EQ(status, PollStatus::sample);
        ASSERT_GT(s.received, last) << "turn " << n / 2;
        ASSERT_LT(n, 100);
        last = s.received;
    }
    EXPECT_GT(n, 10);
}

TEST(Player, EveryKeyOfTheRowIsUnderstood) {
    const ManualTime time(kStart);
    for (const auto& key : player_row().keys) {
        std::string value = key.default_toml;
        std::erase(value, '"');
        if (std::string(key.name) == "path") value = "x";
        EXPECT_TRUE(from_settings({{"path", "x"}, {key.name, value}}, time)) << key.name;
    }
}
