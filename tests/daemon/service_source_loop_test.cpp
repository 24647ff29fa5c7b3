// The source loop with a scripted device: what is published, and how losses, ends and new settings are taken.
#include "daemon/service/source_loop.hpp"

#include <gmock/gmock.h>

#include <condition_variable>
#include <deque>
#include <mutex>

#include "tests/allocation/allocation_count.hpp"
#include "protocol/loss_policy.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea::service {
namespace {

using drivers::PollStatus;
using test::eventually;

// Each open() takes the next script: what its polls say, in order; then `after` for ever.
struct Script {
    bool opens = true;
    int samples = 0;
    Duration apart{};                         // the samples' arrivals, counted from a minute ago; 0: as they come
    PollStatus after = PollStatus::nothing;   // nothing: waits until wake()
    int sleeps_before = 0;                    // the machine sleeps for an hour before this sample is read; 0: never
};

using Scripts = std::deque<Script>;

// How long the machine of these tests has been asleep.
std::atomic<std::int64_t> asleep_ns{0};
Duration asleep() noexcept { return Duration{asleep_ns.load()}; }
void sleep_for(Duration d) { asleep_ns.fetch_add(d.count()); }

class ScriptedDevice final : public drivers::Device {
public:
    explicit ScriptedDevice(std::deque<Script> scripts) : scripts_{std::move(scripts)} {}

    drivers::DeviceInfo info() const override { return {"scripted", "a script", "here", 1000, true}; }
    Result<void> open() override {
        ++opens;
        if (scripts_.empty()) return fail("the script has ended");
        now_ = scripts_.front();
        scripts_.pop_front();
        given_ = 0;
        opened_at_ = MonotonicClock::now();
        if (!now_.opens) return fail("not plugged in", "here", "plug it in");
        return {};
    }
    PollStatus poll(GazeSample& out, Instant) noexcept override {
        if (given_ < now_.samples) {
            if (given_ + 1 == now_.sleeps_before) sleep_for(std::chrono::hours(1));
            out = {};
            out.id = static_cast<std::uint64_t>(++given_);
            out.exposed = out.received =
                now_.apart > Duration{} ? opened_at_ - std::chrono::minutes(1) + given_ * now_.apart : MonotonicClock::now();
            out.eye(Eye::combined).valid = true;
            out.eye(Eye::combined).gaze_dir_head = from_azimuth_elevation<HeadFrame>({1e-3 * given_, 0});
            if (allocations_at == 0) allocations_at = fovea::test::allocations();
            allocations_until = fovea::test::allocations();
            return PollStatus::sample;
        }
        if (now_.after != PollStatus::nothing) return now_.after;
        std::unique_lock lock(mutex_);
        condition_.wait(lock, [this] { return woken_; });
        woken_ = false;
        return PollStatus::nothing;
    }
    void wake() noexcept override {
        const std::lock_guard lock(mutex_);
        woken_ = true;
        condition_.notify_all();
    }
    void close() noexcept override { ++closes; }
    void rehearse() noexcept override { ++rehearsals; }

    std::atomic<int> opens{0}, closes{0}, rehearsals{0};
    std::size_t allocations_at = 0, allocations_until = 0;   // of the loop's own thread; read after stop()

private:
    std::deque<Script> scripts_;
    Script now_;
    int given_ = 0;
    Instant opened_at_;
    std::mutex mutex_;
    std::condition_variable condition_;
    bool woken_ = false;
};

// A loop with its publishers; `device` stays valid as long as the loop.
struct Stage {
    explicit Stage(std::deque<Script> scripts, bool may_come_later = true, Published before = {})
        : focus{FocusPublisher::create({}, MonotonicClock::now()).value()},
          samples{SamplesPublisher::create({}, focus.epoch()).value()},
          reader{SamplesReader::map(samples.fd()).value()},
          model_reader{FocusReader::map(focus.fd()).value()} {
        auto owned = std::make_unique<ScriptedDevice>(std::move(scripts));
        device = owned.get();
        loop = std::make_unique<SourceLoop>(std::move(owned), may_come_later,
                                            pipeline::Pipeline::create({}).value(), SourceLoop::Outputs{focus, samples}, time,
                                            [this] { changes.fetch_add(1); }, before, SourceCare{}, asleep);
    }
    [[nodiscard]] bool reaches(SourceState state) const {
        return eventually([&] { return loop->status().state == state; });
    }
    [[nodiscard]] bool publishes(std::uint64_t count) const {
        return eventually([&] { return loop->status().published >= count; });
    }

    SystemTime time;
    FocusPublisher focus;
    SamplesPublisher samples;
    SamplesReader reader;
    FocusReader model_reader;
    std::atomic<int> changes{0};
    ScriptedDevice* device = nullptr;
    std::unique_ptr<SourceLoop> loop;
};

TEST(SourceLoop, WaitsUntilItIsToldToBegin) {
    Stage s(Scripts{{.samples = 1}});
    EXPECT_EQ(s.loop->status().state, SourceState::waiting);
    EXPECT_EQ(s.loop->status().device.name, "a script");
    s.loop->stop();
    EXPECT_EQ(s.device->opens, 0);
}

TEST(SourceLoop, PublishesOneModelPerSampleInOrder) {
    Stage s(Scripts{{.samples = 50, .after = PollStatus::ended}});
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::ended));
    EXPECT_EQ(s.device->closes, 1);
    SampleRecord record;
    for (std::uint64_t n = 1; n <= 50; ++n) {
        ASSERT_TRUE(s.reader.next_sample(record));
        EXPECT_EQ(record.raw.id, n);
        EXPECT_EQ(record.model.sequence, n);
        EXPECT_EQ(record.model.sample_id, n);
        EXPECT_LE(record.raw.received, record.model.filtered);
        EXPECT_LE(record.model.filtered, record.model.published);
    }
    EXPECT_FALSE(s.reader.next_sample(record));
    MotionModel newest;
    ASSERT_TRUE(s.model_reader.read(newest));
    EXPECT_EQ(newest.sequence, 50u);
    EXPECT_EQ(s.loop->status().pipeline.samples, 50u);
}

TEST(SourceLoop, OpensALostDeviceAgainAndKeepsIdsUnique) {
    Stage s(Scripts{{.samples = 3, .after = PollStatus::lost}, {.opens = false}, {.samples = 2, .after = PollStatus::ended}});
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::ended));
    const SourceStatus status = s.loop->status();
    EXPECT_EQ(status.opens, 2u);
    EXPECT_EQ(status.losses, 2u);   // gone once, not there once
    SampleRecord record;
    for (std::uint64_t n = 1; n <= 5; ++n) {
        ASSERT_TRUE(s.reader.next_sample(record));
        EXPECT_EQ(record.raw.id, n);
        EXPECT_EQ(record.model.sequence, n);
    }
}

TEST(SourceLoop, SaysWhyADeviceIsLost) {
    Stage s(Scripts{{.opens = false}, {.opens = false}, {.opens = false}, {.opens = false}, {.opens = false}, {.opens = false}});
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::lost));
    EXPECT_EQ(s.loop->status().error.way_out, "plug it in");
    s.loop->stop();   // also while it waits for the next attempt
}

TEST(SourceLoop, AFileThatCannotBeOpenedIsNotTriedAgain) {
    Stage s(Scripts{{.opens = false}, {.samples = 1}}, false);
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::failed));
    EXPECT_EQ(s.loop->status().error.what, "not plugged in");
    s.loop->stop();
    EXPECT_EQ(s.device->opens, 1);
}

TEST(SourceLoop, StopsWhileTheDeviceIsSilent) {
    Stage s(Scripts{{.samples = 1}});
    s.loop->begin();
    ASSERT_TRUE(s.publishes(1));
    s.loop->stop();
    EXPECT_EQ(s.device->closes, 1);
    EXPECT_EQ(s.loop->published().models, 1u);
}

TEST(SourceLoop, GoesOnCountingWhereAnEarlierLoopStopped) {
    Stage s(Scripts{{.samples = 2, .after = PollStatus::ended}}, true, Published{.models = 100, .sample_ids = 300});
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::ended));
    SampleRecord record;
    ASSERT_TRUE(s.reader.next_sample(record));
    EXPECT_EQ(record.model.sequence, 101u);
    EXPECT_EQ(record.raw.id, 301u);
    s.loop->stop();
    EXPECT_EQ(s.loop->published().models, 102u);
    EXPECT_EQ(s.loop->published().sample_ids, 302u);
}

TEST(SourceLoop, ANewPipelineTakesOverWithoutLosingASample) {
    Stage s(Scripts{{.samples = 60'000, .after = PollStatus::nothing}});
    s.loop->begin();
    for (int i = 0; i < 50; ++i) {
        const std::uint64_t seen = s.loop->status().published;
        pipeline::PipelineSettings settings;
        settings.filter = i % 2 == 0 ? "none" : "one_euro";
        s.loop->set_pipeline(pipeline::Pipeline::create(settings).value());
        ASSERT_TRUE(eventually([&] { const auto p = s.loop->status().published; return p > seen || p == 60'000; }));
    }
    ASSERT_TRUE(s.publishes(60'000));
    s.loop->stop();
    EXPECT_LT(s.loop->status().pipeline.samples, 60'000u) << "the last pipeline counts only its own samples";
}

TEST(SourceLoop, OpensTheDeviceAnewAfterTheMachineHasSlept) {
    Stage s(Scripts{{.samples = 20, .sleeps_before = 4}, {.samples = 2, .after = PollStatus::ended}});
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::ended));
    EXPECT_EQ(s.device->opens, 2);
    EXPECT_EQ(s.device->closes, 2);
    EXPECT_EQ(s.loop->status().losses, 1u);
    SampleRecord record;
    for (std::uint64_t n = 1; n <= 5; ++n) {
        ASSERT_TRUE(s.reader.next_sample(record)) << n;
        EXPECT_EQ(record.model.sequence, n) << "none is missing";
        EXPECT_EQ(record.raw.id, n);
        if (n > 3) {
            EXPECT_FLOAT_EQ(static_cast<float>(record.raw.eye(Eye::combined).gaze_dir_head.x),
                            static_cast<float>(from_azimuth_elevation<HeadFrame>({1e-3 * static_cast<double>(n - 3), 0}).x))
                << "what the device had still to say from before is not published";
        }
    }
    EXPECT_FALSE(s.reader.next_sample(record));
}

TEST(SourceLoop, PublishesNoGazeAfterTheMachineHasSlept) {
    Stage s(Scripts{{.samples = 3}, {.opens = false}, {.opens = false}, {.opens = false}, {.opens = false}, {.opens = false}});
    s.loop->begin();
    ASSERT_TRUE(s.publishes(3));
    MotionModel newest;
    ASSERT_TRUE(s.model_reader.read(newest));
    EXPECT_EQ(newest.sequence, 3u);
    EXPECT_TRUE(newest.eye(Eye::combined).ever_valid);
    sleep_for(std::chrono::seconds(1));
    s.loop->look();   // as the heartbeat does
    ASSERT_TRUE(s.reaches(SourceState::lost));
    ASSERT_TRUE(s.model_reader.read(newest));
    EXPECT_FALSE(newest.eye(Eye::combined).ever_valid);
    EXPECT_EQ(evaluate(newest.eye(Eye::combined), LossPolicy{}, MonotonicClock::now()).tracked, 0)
        << "by our clock the gaze is still fresh";
    s.loop->stop();
}

TEST(SourceLoop, ARecordingDoesNotMindASleep) {
    Stage s(Scripts{{.samples = 20, .after = PollStatus::ended, .sleeps_before = 4}}, false);
    s.loop->begin();
    ASSERT_TRUE(s.reaches(SourceState::ended));
    EXPECT_EQ(s.loop->status().published, 20u);
    EXPECT_EQ(s.loop->status().losses, 0u);
}

TEST(SleepWatch, TellsOfEachSleepOnceAndOfNothingElse) {
    SleepWatch watch(asleep);
    EXPECT_FALSE(watch.slept());
    sleep_for(SleepWatch::kShortest - Duration{1});
    EXPECT_FALSE(watch.slept()) << "two readings of the clocks may differ";
    sleep_for(Duration{1});
    EXPECT_TRUE(watch.slept());
    EXPECT_FALSE(watch.slept());
    sleep_for(std::chrono::hours(24 * 365));
    EXPECT_TRUE(watch.slept());
    EXPECT_FALSE(watch.slept());
}

TEST(SleepWatch, ReadsTheKernelsClocks) {
    const Duration first = time_asleep();
    EXPECT_GE(first, -std::chrono::milliseconds(1));
    EXPECT_GE(time_asleep() - first, -SleepWatch::kShortest) << "time asleep never shrinks";
}

TEST(SourceLoop, TellsOfEachChangeOfState) {
    Stage s(Scripts{{.samples = 1, .after = PollStatus::ended}});
    s.loop->begin();
    ASSERT_TRUE(eventually([&] { return s.changes.load() == 3; }));   // opening, running, ended
}

TEST(SourceLoop, RehearsesOncePerSampleOfARegularTracker) {
    using namespace std::chrono_literals;
    Stage regular(Scripts{{.samples = 500, .apart = 4ms, .after = PollStatus::ended}});
    regular.loop->begin();
    ASSERT_TRUE(regular.reaches(SourceState::ended));
    EXPECT_EQ(regular.device->rehearsals, 500 - 1 - Cadence::kRegular) << "from when the rhythm is known";
    EXPECT_EQ(regular.device->allocations_until - regular.device->allocations_at, 0u);
    Stage fast(Scripts{{.samples = 500, .apart = 1ms, .after = PollStatus::ended}});
    fast.loop->begin();
    ASSERT_TRUE(fast.reaches(SourceState::ended));
    EXPECT_EQ(fast.device->rehearsals, 0) << "nothing cools down between";
    Stage file(Scripts{{.samples = 500, .apart = 4ms, .after = PollStatus::ended}}, false);
    file.loop->begin();
    ASSERT_TRUE(file.reaches(SourceState::ended));
    EXPECT_EQ(file.device->rehearsals, 0) << "a recording has nobody to hurry for";
}

TEST(Cadence, ForetellsARegularTrackerDespiteJitter) {
    using namespace std::chrono_literals;
    Cadence c;
    EXPECT_FALSE(c.due());
    const Instant start = instant_from_ns(1'000'000'000);
    int i = 0;
    for (; i < 200; ++i) c.arrived(start + i * 4ms + std::chrono::microseconds(i * 7919 % 300));   // up to 0.3 ms late
    ASSERT_TRUE(c.due());
    EXPECT_GT(*c.due(), start + i * 4ms - 200us);
    EXPECT_LT(*c.due(), start + i * 4ms + 300us);
    EXPECT_NEAR(to_seconds(c.gap()), 4e-3, 1e-4);
}

TEST(Cadence, ForetellsNothingWithoutARhythm) {
    using namespace std::chrono_literals;
    const Instant start = instant_from_ns(1'000'000'000);
    Cadence c;
    for (int i = 0; i < Cadence::kRegular + 1; ++i) {
        c.arrived(start + i * 4ms);
        EXPECT_FALSE(c.due()) << i;
    }
    c.arrived(start + 9 * 4ms);
    EXPECT_TRUE(c.due());
    c.arrived(start + 12 * 4ms);   // two are missing
    EXPECT_FALSE(c.due());
    Cadence slow, backwards;
    for (int i = 0; i < 50; ++i) slow.arrived(start + i * 60ms), backwards.arrived(start - i * 4ms);
    EXPECT_FALSE(slow.due());
    EXPECT_FALSE(backwards.due());
}

TEST(SteadyLoop, OfTheDaemonDoesNotAllocate) {
    Stage s(Scripts{{.samples = 20'000, .after = PollStatus::ended}});
    s.loop->begin();
    // Nothing but this loop may allocate meanwhile, so the count of state changes is all that is looked at.
    ASSERT_TRUE(eventually([&] { return s.changes.load() == 3; }));
    s.loop->stop();
    EXPECT_EQ(s.device->allocations_until - s.device->allocations_at, 0u);
}

}  // namespace
}  // namespace fovea::service
