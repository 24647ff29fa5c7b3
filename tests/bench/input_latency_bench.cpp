// From a HID report's arrival to the published focus, beside the floor: a bare poll-and-read loop on the same node.
//
// The node is a FIFO that a child process writes to at 250 Hz, each report stamped with the time of its writing; the
// two readers take turns, so that a busy machine slows both. The device lab measures the same on the kernel's hidraw.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.hpp"
#include "drivers/exposure_clock.hpp"
#include "drivers/hid/eye_tracker.hpp"
#include "drivers/hid/report_stream.hpp"
#include "protocol/focus_region.hpp"
#include "protocol/samples_region.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"

namespace {

using namespace fovea;
using drivers::hid::ReportEvent;

constexpr int kTurn = 100;   // reports that one reader takes before the other's turn

std::vector<std::uint8_t> report_now(const drivers::hid::ReportDescriptor& descriptor, int i) {
    tests::Truth t;
    t.gaze_x = 0.25 + 0.1 * std::sin(0.02 * i), t.gaze_y = 0.15 + (i / 75 % 2) * 0.05;
    t.left[0] = 0.22, t.right[0] = 0.28, t.left[1] = t.right[1] = 0.15, t.left[2] = t.right[2] = 0.6;
    t.time_s = static_cast<double>(to_ns(MonotonicClock::now()) / 1000) * 1e-6;
    return tests::encode_tracking(descriptor, t);
}

class Tracker {
public:
    Tracker() {
        std::string name = (std::filesystem::temp_directory_path() / "fovea-bench-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
        if (::mkfifo(node().c_str(), 0600) != 0) std::abort();
        pid_ = ::fork();
        if (pid_ == 0) play();
    }
    ~Tracker() {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
        std::filesystem::remove_all(folder_);
    }
    Tracker(const Tracker&) = delete;
    Tracker& operator=(const Tracker&) = delete;
    [[nodiscard]] std::string node() const { return folder_ + "/hidraw"; }

private:
    [[noreturn]] void play() const {
        const auto descriptor = drivers::hid::parse_report_descriptor(tests::shape("classic").descriptor).value();
        const int fd = ::open(node().c_str(), O_RDWR);
        for (int i = 0;; ++i) {
            ::usleep(4000);
            const auto report = report_now(descriptor, i);
            if (::write(fd, report.data(), report.size()) < 0) ::_exit(1);
        }
    }
    std::string folder_;
    pid_t pid_ = -1;
};

double us_since_written(std::span<const std::uint8_t> report, Instant now) {
    std::int64_t stamp_us = 0;   // the classic shape: id, then 64-bit microseconds
    std::memcpy(&stamp_us, report.data() + 1, 8);
    return static_cast<double>(to_ns(now) - stamp_us * 1000) * 1e-3;
}

void report(benchmark::State& state, const char* name, std::vector<double>& us) {
    std::ranges::sort(us);
    for (const auto& [label, share] : {std::pair{"_p50_us", 0.5}, {"_p99_us", 0.99}})
        state.counters[std::string(name) + label] = us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
}

void BM_HidReportToPublishedFocus(benchmark::State& state) {
    const Tracker tracker;
    const SystemTime time;
    auto decoder = drivers::hid::EyeTracker::create(tests::shape("classic").descriptor, {}, {tests::kScreenWidth, tests::kScreenHeight, 0.6}).value();
    auto pipe = pipeline::Pipeline::create({}).value();
    auto focus = FocusPublisher::create({}, time.now()).value();
    auto ring = SamplesPublisher::create({}, focus.epoch()).value();
    drivers::ExposureClock clock;
    drivers::hid::ReportStream stream(256);
    if (stream.open(tracker.node()) != 0) return state.SkipWithError("cannot open the node");
    const UniqueFd bare(::open(tracker.node().c_str(), O_RDWR | O_CLOEXEC));
    std::vector<double> floor, received_us, published;
    GazeSample sample;
    for (auto _ : state)
        for (int i = 0; i < 2 * kTurn; ++i) {
            if (i < kTurn) {
                pollfd p{bare.get(), POLLIN, 0};
                std::uint8_t bytes[256];
                ::poll(&p, 1, -1);
                const ssize_t got = ::read(bare.get(), bytes, sizeof bytes);
                const Instant now = MonotonicClock::now();
                if (got > 9) floor.push_back(us_since_written({bytes, static_cast<std::size_t>(got)}, now));
                continue;
            }
            std::span<const std::uint8_t> bytes;
            bool has_time = false;
            if (stream.next(bytes, sample.received, time.now() + std::chrono::seconds(1), time) != ReportEvent::report) continue;
            if (decoder.decode(bytes, sample, has_time) != drivers::hid::Decoded::sample) continue;
            ++sample.id;
            clock.stamp(sample, has_time);
            MotionModel model = pipe.update(sample);
            model.published = time.now();
            focus.publish(model);
            ring.publish_sample(sample, model);
            pipe.settle();
            received_us.push_back(us_since_written(bytes, sample.received));
            published.push_back(us_since_written(bytes, model.published));
        }
    if (floor.empty() || published.empty()) return state.SkipWithError("no report came");
    report(state, "bare_read", floor);
    report(state, "received", received_us);
    report(state, "published", published);
    state.counters["published_over_bare_p50"] = published[published.size() / 2] / floor[floor.size() / 2];
}
BENCHMARK(BM_HidReportToPublishedFocus)->Iterations(10)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
