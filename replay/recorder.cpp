#include "replay/recorder.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace fovea::replay {

struct Recorder::State {
    SessionWriter writer;
    SamplesReader source;
    Duration drain_every;

    std::mutex mutex;  // guards `stopping`
    std::condition_variable stop_asked;
    bool stopping = false;
    // Relaxed: each is a count of its own that readers only show.
    std::atomic<std::uint64_t> samples{0}, frames{0}, samples_lost{0}, frames_lost{0};
    std::thread thread;

    State(SessionWriter w, SamplesReader s, Duration every)
        : writer(std::move(w)), source(std::move(s)), drain_every(every) {}
    ~State() { (void)stop(); }

    void drain() {
        SampleRecord sample;
        while (source.next_sample(sample)) {
            writer.add_sample(sample.raw);
            writer.add_model(sample.model);
            samples.fetch_add(1, std::memory_order_relaxed);
        }
        FrameRecord frame;
        while (source.next_frame(frame)) {
            writer.add_frame({frame.client_id, frame.timing});
            frames.fetch_add(1, std::memory_order_relaxed);
        }
        report_loss("recorder.samples_lost", samples_lost, source.lost_samples());
        report_loss("recorder.frames_lost", frames_lost, source.lost_frames());
    }

    // At once when it happens, so that a session whose writer is killed tells it too.
    void report_loss(const char* name, std::atomic<std::uint64_t>& known, std::uint64_t now) {
        if (known.exchange(now, std::memory_order_relaxed) != now)
            writer.add_counter({MonotonicClock::now(), name, static_cast<std::int64_t>(now)});
    }

    void run() {
        std::unique_lock lock(mutex);
        while (!stopping) {
            lock.unlock();
            drain();
            lock.lock();
            stop_asked.wait_for(lock, drain_every, [&] { return stopping; });
        }
        lock.unlock();
        drain();
        const RecorderStatus s = status();
        for (const auto& [name, value] : {std::pair{"recorder.samples", s.samples}, {"recorder.frames", s.frames},
                                          {"recorder.samples_lost", s.samples_lost},
                                          {"recorder.frames_lost", s.frames_lost}})
            writer.add_counter({MonotonicClock::now(), name, static_cast<std::int64_t>(value)});
    }

    [[nodiscard]] RecorderStatus status() const noexcept {
        constexpr auto relaxed = std::memory_order_relaxed;
        return {samples.load(relaxed), frames.load(relaxed), samples_lost.load(relaxed), frames_lost.load(relaxed),
                writer.dropped()};
    }

    Result<RecorderStatus> stop() {
        {
            const std::lock_guard lock(mutex);
            stopping = true;
        }
        stop_asked.notify_all();
        if (thread.joinable()) thread.join();
        if (auto closed = writer.close(); !closed) return std::unexpected(closed.error());
        return status();
    }
};

Recorder::Recorder(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() = default;

Result<Recorder> Recorder::start(const std::filesystem::path& path, SamplesReader source,
                                 const RecorderOptions& options) {
    SessionWriterOptions writing;
    writing.overwrite = options.overwrite;
    auto writer = SessionWriter::create(path, writing);
    if (!writer) return std::unexpected(writer.error());
    writer->set_info(options.info);
    for (const auto& [key, value] : options.meta) writer->set_meta(key, value);
    if (!options.from_oldest) source.skip_to_newest();
    auto state = std::make_unique<State>(std::move(*writer), std::move(source), options.drain_every);
    state->thread = std::thread([s = state.get()] { s->run(); });
    return Recorder(std::move(state));
}

void Recorder::add_event(SessionEvent event) { state_->writer.add_event(std::move(event)); }
RecorderStatus Recorder::status() const noexcept { return state_->status(); }
std::optional<Error> Recorder::error() const { return state_->writer.error(); }
Result<RecorderStatus> Recorder::stop() { return state_->stop(); }

}  // namespace fovea::replay
