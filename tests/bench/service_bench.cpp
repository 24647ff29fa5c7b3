// From a sample's arrival in a real fovead to its focus in another process (this one), which looks all the time.
#include <benchmark/benchmark.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/focus_region.hpp"
#include "protocol/handshake.hpp"

namespace {

using namespace fovea;

// A fovead that plays the shipped 1000 Hz recording in real time, over and over.
class PlayingDaemon {
public:
    PlayingDaemon() {
        std::string name = (std::filesystem::temp_directory_path() / "fovea-bench-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
        const std::string source = "source.path=" FOVEA_SOURCE_DIR "/tests/data/recordings/eyelink_lookatpoint_s1.csv";
        const char* const argv[] = {FOVEA_BIN_DIR "/fovead", "--run-dir", folder_.c_str(), "--set", source.c_str(), "--set",
                                    "source.loop=true", "--set", "log.level=error", nullptr};
        pid_ = ::fork();
        if (pid_ == 0) {
            ::execv(argv[0], const_cast<char**>(argv));
            ::_exit(127);
        }
    }
    ~PlayingDaemon() {
        ::kill(pid_, SIGTERM);
        ::waitpid(pid_, nullptr, 0);
        std::filesystem::remove_all(folder_);
    }
    PlayingDaemon(const PlayingDaemon&) = delete;
    PlayingDaemon& operator=(const PlayingDaemon&) = delete;

    [[nodiscard]] std::expected<Connection, ConnectFailure> connect() const {
        const Instant deadline = MonotonicClock::now() + std::chrono::seconds(10);
        for (;;) {
            auto connection = connect_to_daemon(folder_ + "/focus.sock", {});
            if (connection || MonotonicClock::now() > deadline) return connection;
            ::usleep(1000);  // it is still starting
        }
    }

private:
    std::string folder_;
    pid_t pid_ = -1;
};

void report(benchmark::State& state, const char* name, std::vector<std::int64_t>& ns) {
    std::ranges::sort(ns);
    const auto at = [&](double share) { return static_cast<double>(ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))]) * 1e-3; };
    state.counters[std::string(name) + "_p50_us"] = at(0.5);
    state.counters[std::string(name) + "_p99_us"] = at(0.99);
    state.counters[std::string(name) + "_max_us"] = at(1);
}

// `received` is the instant at which the player's sample was due: the daemon's own wake-up (a timer here, an interrupt
// with a device) is part of it.
void BM_SampleReceivedToFocusVisible(benchmark::State& state) {
    const PlayingDaemon daemon;
    const auto connection = daemon.connect();
    if (!connection) return state.SkipWithError(connection.error().message().c_str());
    const Result<FocusReader> reader = FocusReader::map(connection->focus.get());
    if (!reader) return state.SkipWithError(reader.error().message().c_str());

    std::vector<std::int64_t> visible, publishing, pipeline;
    MotionModel model;
    std::uint64_t seen = reader->latest();
    for (auto _ : state) {
        std::uint64_t latest;
        while ((latest = reader->latest()) == seen) {}
        seen = latest;
        if (!reader->read(model, eye_bit(Eye::combined))) continue;
        const Instant now = MonotonicClock::now();
        visible.push_back((now - model.received).count());
        publishing.push_back((now - model.published).count());
        pipeline.push_back((model.filtered - model.received).count());
        state.SetIterationTime(to_seconds(now - model.received));
    }
    if (visible.empty()) return state.SkipWithError("nothing was published");
    report(state, "received_to_visible", visible);
    report(state, "received_to_filtered", pipeline);
    report(state, "published_to_visible", publishing);
}
BENCHMARK(BM_SampleReceivedToFocusVisible)->Iterations(5000)->UseManualTime();

}  // namespace
