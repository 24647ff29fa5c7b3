// What crossing the process boundary costs: latch, publish, frame report, and publish to visible in another process.
#include <benchmark/benchmark.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "protocol/client/client.hpp"
#include "tests/protocol/tiny_daemon.hpp"

using namespace fovea;

namespace {

MotionModel moving_model(std::uint8_t eyes) {
    MotionModel m;
    m.sequence = m.sample_id = 1;
    m.exposed = m.received = m.filtered = m.published = MonotonicClock::now();
    m.eyes_present = eyes;
    for (EyeMotion& e : m.eyes) {
        e.reference = m.exposed;
        e.gaze_dir_head = from_azimuth_elevation<HeadFrame>({0.2, -0.1});
        e.event = GazeEvent::pursuit;
        e.ever_valid = true;
        for (std::size_t i = 0; i < e.horizons.size(); ++i)
            e.horizons[i] = {0.01f * static_cast<float>(i), 0.005f * static_cast<float>(i), 0.01f, 0.02f};
    }
    return m;
}

struct LatchBench {
    fovea::test::SocketDir dir;
    fovea::test::TinyDaemon daemon{dir.path()};
    fovea_client* client = nullptr;
    fovea_view views[2];
    fovea_focal focals[2];
    fovea_latch_info info;

    explicit LatchBench(bool per_eye) {
        fovea_connect_info connect;
        FOVEA_INIT(&connect);
        const std::string path = dir.path();
        connect.socket_path = path.c_str();
        if (fovea_connect(&connect, &client) != FOVEA_OK) std::abort();
        FOVEA_INIT(&info);
        for (unsigned v = 0; v < 2; ++v) {
            FOVEA_INIT(&views[v]);
            FOVEA_INIT(&focals[v]);
            views[v].eye = per_eye ? FOVEA_EYE_LEFT + v : unsigned{FOVEA_EYE_COMBINED};
            views[v].tan_left = -1.2f, views[v].tan_right = 1.0f, views[v].tan_up = 1.1f, views[v].tan_down = -1.1f;
            views[v].head_from_view[0] = 1;
        }
        daemon.focus.publish(moving_model(per_eye ? kAllEyes : 1));
        daemon.focus.beat(MonotonicClock::now() + std::chrono::hours(1));
    }
    ~LatchBench() { fovea_disconnect(client); }
    LatchBench(const LatchBench&) = delete;
    LatchBench& operator=(const LatchBench&) = delete;

    void run(benchmark::State& state) {
        std::int64_t photon = fovea_now_ns();
        for (auto _ : state) {
            fovea_latch(client, ++photon, views, 2, focals, &info);   // a dozen ms ahead of the model, and on
            benchmark::DoNotOptimize(focals);
        }
        if ((info.flags & FOVEA_LATCH_LIVE) == 0) state.SkipWithError("the latch was not live");
    }
};

// Publishes on a thread of its own at about rate_hz, as fast as it can for 0.
class Writer {
public:
    Writer(FocusPublisher& focus, double rate_hz)
        : thread_([this, &focus, rate_hz] {
              const MotionModel model = moving_model(1);
              Instant next = MonotonicClock::now();
              while (!stop_.load(std::memory_order_relaxed)) {
                  focus.publish(model);
                  ++published_;
                  next += seconds(1 / rate_hz);
                  if (rate_hz < 1e5)
                      std::this_thread::sleep_for(next - MonotonicClock::now());
                  else
                      while (MonotonicClock::now() < next && !stop_.load(std::memory_order_relaxed)) {}
              }
          }) {}
    ~Writer() { stop(); }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    std::uint64_t stop() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
        return published_;
    }

private:
    std::atomic<bool> stop_{false};
    std::uint64_t published_ = 0;
    std::thread thread_;
};

// Two views, as an app calls it: clock, seqlock read, evaluation, projection.
void BM_Latch2Views(benchmark::State& state) {
    LatchBench bench(false);
    bench.run(state);
}
BENCHMARK(BM_Latch2Views);

// The same where each view follows its own eye: two eyes to read and evaluate.
void BM_Latch2ViewsPerEye(benchmark::State& state) {
    LatchBench bench(true);
    bench.run(state);
}
BENCHMARK(BM_Latch2ViewsPerEye);

void BM_Latch2ViewsWithWriter(benchmark::State& state) {
    LatchBench bench(false);
    const Instant start = MonotonicClock::now();
    Writer writer(bench.daemon.focus, static_cast<double>(state.range(0)));
    bench.run(state);
    const double published = static_cast<double>(writer.stop());
    state.counters["writer_hz"] = published / to_seconds(MonotonicClock::now() - start);
}
BENCHMARK(BM_Latch2ViewsWithWriter)->Arg(1000)->Arg(1000000)->ArgName("hz")->UseRealTime();

// The parts of a latch, to see what it is made of.
void BM_Clock(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(MonotonicClock::now());
}
BENCHMARK(BM_Clock);

void BM_FocusRead(benchmark::State& state) {
    FocusPublisher focus = FocusPublisher::create(LossPolicy{}, MonotonicClock::now()).value();
    focus.publish(moving_model(kAllEyes));
    const FocusReader reader = FocusReader::map(focus.fd()).value();
    const auto eyes = static_cast<std::uint8_t>(state.range(0));
    MotionModel model;
    for (auto _ : state) benchmark::DoNotOptimize(reader.read(model, eyes));
}
BENCHMARK(BM_FocusRead)->Arg(1)->Arg(7)->ArgName("eyes");

void BM_Evaluate(benchmark::State& state) {
    const MotionModel model = moving_model(1);
    const LossPolicy policy;
    Instant t = model.exposed;
    for (auto _ : state) benchmark::DoNotOptimize(evaluate(model.eyes[0], policy, t += Duration{1}));
}
BENCHMARK(BM_Evaluate);

void BM_Publish(benchmark::State& state) {
    FocusPublisher focus = FocusPublisher::create(LossPolicy{}, MonotonicClock::now()).value();
    const MotionModel model = moving_model(static_cast<std::uint8_t>(state.range(0)));
    for (auto _ : state) focus.publish(model);
}
BENCHMARK(BM_Publish)->Arg(1)->Arg(7)->ArgName("eyes");

void BM_SubmitFrame(benchmark::State& state) {
    FrameCollector collector = FrameCollector::create().value();
    LatchBench bench(false);
    fovea_latch(bench.client, fovea_now_ns(), bench.views, 2, bench.focals, &bench.info);
    fovea_frame frame;
    FOVEA_INIT(&frame);
    frame.frame = 1;
    frame.pixels_full = frame.pixels_shaded = 100;
    frame.view_count = 2;
    frame.latch = bench.info;
    for (unsigned v = 0; v < 2; ++v) frame.views[v] = bench.views[v], frame.foveas[v] = {0, 0, 0.3f, 0.3f};
    frame.submitted_ns = frame.gpu_done_ns = frame.photon_ns = fovea_now_ns();
    std::uint64_t submitted = 0;
    for (auto _ : state) {
        if (fovea_submit_frame(bench.client, &frame) != FOVEA_OK) state.SkipWithError(fovea_last_error(bench.client));
        if (++submitted % kFrameSlots == 0) {   // nobody else drains
            state.PauseTiming();
            while (bench.daemon.frames.next(MonotonicClock::now())) {}
            state.ResumeTiming();
        }
    }
    fovea_status status;
    FOVEA_INIT(&status);
    fovea_get_status(bench.client, &status);
    state.counters["dropped"] = static_cast<double>(status.frames_dropped);
}
BENCHMARK(BM_SubmitFrame);

// From publish() to a whole model in another process that looks all the time; one model per millisecond.
void BM_PublishToOtherProcess(benchmark::State& state) {
    constexpr std::size_t kMost = 1 << 20;
    FocusPublisher focus = FocusPublisher::create(LossPolicy{}, MonotonicClock::now()).value();
    auto* seen_ns = static_cast<std::int64_t*>(
        mmap(nullptr, kMost * sizeof(std::int64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    const pid_t child = fork();
    if (child == 0) {
        const FocusReader reader = FocusReader::map(focus.fd()).value();
        MotionModel model;
        for (std::uint64_t seen = 0; seen + 1 < kMost;) {
            if (reader.latest() == seen || !reader.read(model, 1)) continue;
            seen = reader.latest();
            seen_ns[model.sequence] = to_ns(MonotonicClock::now()) - to_ns(model.published);
        }
        _exit(0);
    }
    MotionModel model = moving_model(1);
    model.sequence = 0;
    for (auto _ : state) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++model.sequence;
        model.published = MonotonicClock::now();
        focus.publish(model);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    std::vector<std::int64_t> all(seen_ns + 1, seen_ns + 1 + model.sequence);
    std::erase(all, 0);   // overtaken by the next model before the reader got the processor
    std::ranges::sort(all);
    const auto quantile = [&](double q) {
        return all.empty() ? std::nan("") : static_cast<double>(all[static_cast<std::size_t>(q * static_cast<double>(all.size() - 1))]);
    };
    state.counters["seen"] = static_cast<double>(all.size()) / static_cast<double>(model.sequence);
    state.counters["p50_ns"] = quantile(0.5);
    state.counters["p99_ns"] = quantile(0.99);
    munmap(seen_ns, kMost * sizeof(std::int64_t));
}
BENCHMARK(BM_PublishToOtherProcess)->Iterations(3000)->UseRealTime();

}  // namespace
