#include "daemon/service/source_loop.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>

#include <algorithm>
#include <utility>

#include "protocol/signals_blocked.hpp"

namespace fovea::service {
namespace {

// How long one poll may wait. wake() ends it early; this only bounds a wake-up that came just before the wait.
constexpr Duration kPollAtMost = std::chrono::milliseconds(500);

}  // namespace

const char* to_string(SourceState state) noexcept {
    switch (state) {
        case SourceState::waiting: return "waiting";
        case SourceState::opening: return "opening";
        case SourceState::running: return "running";
        case SourceState::lost: return "lost";
        case SourceState::ended: return "ended";
        case SourceState::failed: return "failed";
    }
    return "unknown";
}

SourceLoop::SourceLoop(std::unique_ptr<drivers::Device> device, bool may_come_later, pipeline::Pipeline pipeline,
                       Outputs outputs, const TimeSource& time, std::function<void()> state_changed, Published before,
                       SourceCare care, AsleepClock asleep)
    : device_{std::move(device)},
      may_come_later_{may_come_later},
      care_{may_come_later ? care : SourceCare{.realtime_priority = 0, .rehearse = false}},
      pipeline_{std::move(pipeline)},
      outputs_{outputs},
      time_{time},
      state_changed_{std::move(state_changed)},
      sleep_watch_{asleep},
      sequence_{before.models},
      newest_id_{before.sample_ids},
      info_{device_->info()} {
    live_.published.store(before.models, std::memory_order_relaxed);
}

SourceLoop::~SourceLoop() {
    stop();
    delete incoming_.load(std::memory_order_acquire);
    delete retired_.load(std::memory_order_acquire);
}

void SourceLoop::begin() {
    FOVEA_REQUIRE(!thread_.joinable());
    const SignalsBlocked for_the_new_thread;
    thread_ = std::thread([this] {
        pthread_setname_np(pthread_self(), "fovead-source");
        // A wait that ends at a time (a recording's next sample) is otherwise up to 50 us late by the kernel's default.
        prctl(PR_SET_TIMERSLACK, 1);
        if (care_.realtime_priority > 0) {
            // A report that has come is worth more than what else runs just then; the thread sleeps nearly all the time.
            // Threads that a driver's library starts are not to inherit it.
            const sched_param p{.sched_priority = care_.realtime_priority};
            static_cast<void>(::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &p));
        }
        run();
    });
}

void SourceLoop::stop() noexcept {
    {
        const std::lock_guard lock(mutex_);
        stopping_.store(true, std::memory_order_release);
    }
    wake_.notify_all();
    if (!thread_.joinable()) return;
    device_->wake();
    thread_.join();
}

void SourceLoop::set_pipeline(pipeline::Pipeline pipeline) {
    delete retired_.exchange(nullptr, std::memory_order_acquire);  // acquire: the loop is done with it
    // release: the loop sees a whole pipeline; acquire: one that it never took is ours again
    delete incoming_.exchange(new pipeline::Pipeline(std::move(pipeline)), std::memory_order_acq_rel);
}

SourceStatus SourceLoop::status() const {
    constexpr auto relaxed = std::memory_order_relaxed;
    SourceStatus s;
    s.published = live_.published.load(relaxed);
    s.newest_received_ns = live_.newest_received_ns.load(relaxed);
    s.pipeline = {.samples = live_.samples.load(relaxed),
                  .invalid = live_.invalid.load(relaxed),
                  .not_finite = live_.not_finite.load(relaxed),
                  .duplicates = live_.duplicates.load(relaxed),
                  .out_of_order = live_.out_of_order.load(relaxed),
                  .blinks = live_.blinks.load(relaxed),
                  .losses = live_.losses.load(relaxed)};
    s.counters = {.samples = live_.device_samples.load(relaxed),
                  .malformed = live_.malformed.load(relaxed),
                  .dropped = live_.dropped.load(relaxed),
                  .losses = live_.device_losses.load(relaxed),
                  .switches = live_.switches.load(relaxed),
                  .last_loss = live_.last_loss.load(relaxed)};
    const std::lock_guard lock(mutex_);
    s.state = state_;
    s.error = error_;
    s.device = info_;
    s.opens = opens_;
    s.losses = losses_;
    return s;
}

Published SourceLoop::published() const noexcept { return {sequence_, newest_id_}; }

void SourceLoop::enter(SourceState state, Error error) {
    {
        const std::lock_guard lock(mutex_);
        state_ = state;
        error_ = std::move(error);
        if (state == SourceState::running) ++opens_;
        if (state == SourceState::lost) ++losses_;
        if (state == SourceState::running) info_ = device_->info();
    }
    state_changed_();
}

bool SourceLoop::sleep(Duration pause) {
    std::unique_lock lock(mutex_);
    return !wake_.wait_for(lock, pause, [this] { return stopping_.load(std::memory_order_acquire); });
}

void SourceLoop::run() {
    Duration retry = kFirstRetry;
    for (;;) {
        enter(SourceState::opening);
        static_cast<void>(sleep_watch_.slept());   // a sleep from here on counts, one that is over does not
        if (Result<void> opened = device_->open(); !opened) {
            if (!may_come_later_) return enter(SourceState::failed, std::move(opened.error()));
            enter(SourceState::lost, std::move(opened.error()));
        } else {
            id_base_ = newest_id_;
            pipeline_.reset();
            enter(SourceState::running);
            const std::uint64_t before = sequence_;
            const Left left = steady();
            device_->close();
            if (left == Left::stopped) return;
            if (left == Left::ended) return enter(SourceState::ended);
            if (left == Left::slept) {
                publish_nothing();
                enter(SourceState::lost, Error{"the machine has slept", info_.location, "the device is opened anew"});
                retry = kFirstRetry;
                continue;
            }
            if (sequence_ != before) retry = kFirstRetry;  // it did work: try again soon
            enter(SourceState::lost, Error{"the device is gone or silent", info_.location, "it is opened again when it is back"});
        }
        if (!sleep(retry)) return;
        retry = std::min(2 * retry, kLastRetry);
    }
}

SourceLoop::Left SourceLoop::steady() noexcept {
    GazeSample sample;
    cadence_.reset();
    rehearsed_ = false;
    while (!stopping_.load(std::memory_order_acquire)) {
        const Instant now = time_.now();
        Instant until = now + kPollAtMost;
        if (care_.rehearse && !rehearsed_)
            if (const auto due = cadence_.due()) {
                const Instant at = *due - kRehearseBefore - std::min(rehearsing_, cadence_.gap() / 2);
                if (now >= at) rehearse(at);
                else until = std::min(until, at);
            }
        const drivers::PollStatus polled = device_->poll(sample, until);
        if (incoming_.load(std::memory_order_relaxed) != nullptr && retired_.load(std::memory_order_relaxed) == nullptr) {
            // acquire: pairs with set_pipeline(); release: the owner may free what it finds in retired_ (which is empty
            // here, so that nothing that it has yet to free is lost)
            if (pipeline::Pipeline* next = incoming_.exchange(nullptr, std::memory_order_acquire)) {
                std::swap(pipeline_, *next);
                retired_.store(next, std::memory_order_release);
            }
        }
        // Before anything is published. A recording does not mind: its times are its own.
        if (may_come_later_ && polled != drivers::PollStatus::ended && sleep_watch_.slept()) return Left::slept;
        if (polled == drivers::PollStatus::sample) publish(sample);
        show_device_counters();
        switch (polled) {
            case drivers::PollStatus::sample:
            case drivers::PollStatus::nothing: break;
            case drivers::PollStatus::lost: return Left::lost;
            case drivers::PollStatus::ended: return Left::ended;
        }
    }
    return Left::stopped;
}

void SourceLoop::rehearse(Instant planned) noexcept {
    rehearsed_ = true;
    device_->rehearse();
    pipeline_.rehearse(last_, cadence_.gap());
    outputs_.focus.prefetch();
    const Duration took = time_.now() - planned;
    rehearsing_ += took > rehearsing_ ? (took - rehearsing_) / 4 : (took - rehearsing_) / 64;
    rehearsing_ = std::min(rehearsing_, Cadence::kLongest);
}

// The device's counters belong to the thread that polls it; this makes them readable from others.
void SourceLoop::show_device_counters() noexcept {
    constexpr auto relaxed = std::memory_order_relaxed;
    const drivers::DeviceCounters c = device_->counters();
    live_.device_samples.store(c.samples, relaxed);
    live_.malformed.store(c.malformed, relaxed);
    live_.dropped.store(c.dropped, relaxed);
    live_.device_losses.store(c.losses, relaxed);
    live_.switches.store(c.switches, relaxed);
    live_.last_loss.store(c.last_loss, relaxed);
}

// As before the first sample: readers go to the static focal point at once, for the gaze that they would hold is of unknown
// age. Sequence 0: it stands for no sample, and none is missing from a recording.
void SourceLoop::publish_nothing() noexcept {
    outputs_.focus.publish(MotionModel{});
}

void SourceLoop::publish(GazeSample& sample) noexcept {
    sample.id += id_base_;  // a device counts from 1 after each open(); in a recording of this daemon ids are unique
    MotionModel& model = pipeline_.update(sample);
    model.sequence = ++sequence_;
    newest_id_ = sample.id;
    model.filtered = model.published = time_.now();   // nothing lies between the two
    outputs_.focus.publish(model);
    outputs_.samples.publish_sample(sample, model);
    pipeline_.settle();
    if (care_.rehearse) {
        cadence_.arrived(sample.received);
        last_ = sample;
        rehearsed_ = false;
    }

    constexpr auto relaxed = std::memory_order_relaxed;
    const pipeline::PipelineCounters& c = pipeline_.counters();
    live_.published.store(sequence_, relaxed);
    live_.newest_received_ns.store(to_ns(sample.received), relaxed);
    live_.samples.store(c.samples, relaxed);
    live_.invalid.store(c.invalid, relaxed);
    live_.not_finite.store(c.not_finite, relaxed);
    live_.duplicates.store(c.duplicates, relaxed);
    live_.out_of_order.store(c.out_of_order, relaxed);
    live_.blinks.store(c.blinks, relaxed);
    live_.losses.store(c.losses, relaxed);
}

}  // namespace fovea::service
