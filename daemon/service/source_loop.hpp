// The thread that turns a device's samples into published motion models: poll -> pipeline -> focus region and ring.
//
//                     +-- failed (a device that cannot come later: the error stands in status().error)
//                     |
//   waiting -> opening +-> running --> ended (a recording)          who moves: this thread, except
//    begin()      ^    |      |                                      begin() and stop(), from the owner
//                 |    v      v
//                 +-- lost <--+     retried after 100 ms, doubling to 5 s
//
// After the machine has slept, a device is lost and opened anew: what it has still to say may be from before, and its
// clock has gone on while ours stood still. Until it speaks again, readers are told that there is no gaze.
//
// Steady loop (running): noexcept, no allocation, no lock, no log. Its faults raise counters; status() reads them.
//
// Threads: create, begin, stop, set_pipeline and the destructor from the owner's thread; status() from any thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "daemon/pipeline/pipeline.hpp"
#include "daemon/service/cadence.hpp"
#include "daemon/service/sleep_watch.hpp"
#include "drivers/device.hpp"
#include "protocol/focus_region.hpp"
#include "protocol/samples_region.hpp"

namespace fovea::service {

enum class SourceState : std::uint8_t { waiting, opening, running, lost, ended, failed };
[[nodiscard]] const char* to_string(SourceState state) noexcept;

struct SourceStatus {
    SourceState state = SourceState::waiting;
    drivers::DeviceInfo device;
    Error error;                       // why it is lost or has failed; empty otherwise
    std::uint64_t opens = 0, losses = 0;
    std::uint64_t published = 0;       // models, over all opens
    std::int64_t newest_received_ns = 0;
    pipeline::PipelineCounters pipeline;
    drivers::DeviceCounters counters;
};

// What a daemon's loops have published so far: sequences and sample ids go on from there.
struct Published {
    std::uint64_t models = 0, sample_ids = 0;
};

// For hardware; a file, which may be played as fast as it can, gets none of it.
struct SourceCare {
    int realtime_priority = 0;   // 1 to 50; 0: none. Without the right to it the thread stays as it is
    bool rehearse = true;        // go the next sample's way shortly before it is due: it then meets warm caches
};

class SourceLoop {
public:
    // How long before the sample it is over: room for the bus's jitter, and little of what was warmed is cold again; 60 to
    // 250 us measured alike (docs/input_latency.md). What waking up and rehearsing take here is added.
    static constexpr Duration kRehearseBefore = std::chrono::microseconds(150);
    // Pauses between attempts to open a lost device.
    static constexpr Duration kFirstRetry = std::chrono::milliseconds(100);
    static constexpr Duration kLastRetry = std::chrono::seconds(5);

    struct Outputs {
        FocusPublisher& focus;         // publish() is this loop's alone
        SamplesPublisher& samples;     // publish_sample() likewise
    };
    // `state_changed` is called on the loop's thread at each arrow above, never from the steady loop.
    SourceLoop(std::unique_ptr<drivers::Device> device, bool may_come_later, pipeline::Pipeline pipeline,
               Outputs outputs, const TimeSource& time, std::function<void()> state_changed, Published before = {},
               SourceCare care = {}, AsleepClock asleep = time_asleep);
    ~SourceLoop();   // stops

    void begin();                      // waiting -> opening; once
    void stop() noexcept;              // joins the thread; the device is closed
    // The loop looks around soon, also when the device is silent. From the owner's thread, after begin().
    void look() noexcept { device_->wake(); }
    // The new pipeline takes over at the next sample, as after a reset.
    void set_pipeline(pipeline::Pipeline pipeline);
    [[nodiscard]] SourceStatus status() const;
    [[nodiscard]] Published published() const noexcept;   // after stop()

private:
    enum class Left : std::uint8_t { stopped, lost, slept, ended };

    void run();
    Left steady() noexcept;
    void publish(GazeSample& sample) noexcept;   // gives it its id
    void publish_nothing() noexcept;
    void show_device_counters() noexcept;
    void rehearse(Instant planned) noexcept;
    void enter(SourceState state, Error error = {});
    bool sleep(Duration pause);        // false: stop() was called

    std::unique_ptr<drivers::Device> device_;
    const bool may_come_later_;
    const SourceCare care_;
    pipeline::Pipeline pipeline_;
    const Outputs outputs_;
    const TimeSource& time_;
    const std::function<void()> state_changed_;

    SleepWatch sleep_watch_;
    Cadence cadence_;
    GazeSample last_;                  // the newest sample, for rehearse()
    bool rehearsed_ = false;           // for the one that is due
    Duration rehearsing_{};            // from the planned wake-up to the end: quick to rise, slow to fall
    std::uint64_t sequence_ = 0, id_base_ = 0, newest_id_ = 0;

    // From the owner to the loop. The loop swaps the new pipeline with its own and hands the old one back, so that
    // nothing is freed in the steady loop.
    std::atomic<pipeline::Pipeline*> incoming_{nullptr};
    std::atomic<pipeline::Pipeline*> retired_{nullptr};
    std::atomic<bool> stopping_{false};

    // From the loop to whoever asks; relaxed: each value stands for itself.
    struct Live {
        std::atomic<std::uint64_t> published{0}, samples{0}, invalid{0}, not_finite{0}, duplicates{0}, out_of_order{0},
            blinks{0}, losses{0};
        std::atomic<std::uint64_t> device_samples{0}, malformed{0}, dropped{0}, device_losses{0}, switches{0};
        std::atomic<const char*> last_loss{""};
        std::atomic<std::int64_t> newest_received_ns{0};
    } live_;

    mutable std::mutex mutex_;         // guards the rest; never taken in the steady loop
    std::condition_variable wake_;
    SourceState state_ = SourceState::waiting;
    Error error_;
    drivers::DeviceInfo info_;
    std::uint64_t opens_ = 0, losses_ = 0;

    std::thread thread_;
};

}  // namespace fovea::service
