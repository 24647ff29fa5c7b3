// From a HID report's arrival to the published focus, beside the floor: a bare poll-and-read loop on the same node.
//
// The node is a FIFO that a child process writes to at 250 Hz, each report stamped with the time of its writing. A bare
// loop, the daemon's source loop and the same with rehearsal take turns, so that a busy machine slows all three. The
// device lab measures the same on the kernel's hidraw.
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
#include "daemon/service/source_loop.hpp"
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

double us_between(std::int64_t from_ns, Instant to) { return static_cast<double>(to_ns(to) - from_ns) * 1e-3; }

void report(benchmark::State& state, const std::string& name, std::vector<double>& us) {
    std::ranges::sort(us);
    for (const auto& [label, share] : {std::pair{"_p50_us", 0.5}, {"_p99_us", 0.99}})
        state.counters[name + label] = us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
}

// The HID driver's way of a report on the FIFO: as drivers/hid/hid_device.cpp, less the search for the device.
class FifoDevice final : public drivers::Device {
public:
    FifoDevice(std::string node, const TimeSource& time) : node_{std::move(node)}, time_{time} {}
    drivers::DeviceInfo info() const override { return {"fifo", "a report every 4 ms", node_, 250, false}; }
    Result<void> open() override {
        if (stream_.open(node_) != 0) return fail("cannot open the node", node_);
        return {};
    }
    drivers::PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        bool has_time = false;
        if (stream_.next(last_, out.received, deadline, time_) != ReportEvent::report) return drivers::PollStatus::nothing;
        if (tracker_.decode(last_, out, has_time) != drivers::hid::Decoded::sample) return drivers::PollStatus::nothing;
        ++out.id;
        clock_.stamp(out, has_time);
        return drivers::PollStatus::sample;
    }
    void wake() noexcept override { stream_.wake(); }
    void close() noexcept override { stream_.close(); }
    void rehearse() noexcept override {
        GazeSample sample;
        tracker_.rehearse(last_, sample);
        drivers::ExposureClock clock = clock_;
        clock.stamp(sample, true);
    }

private:
    std::string node_;
    const TimeSource& time_;
    drivers::hid::ReportStream stream_{256};
    drivers::hid::EyeTracker tracker_ = drivers::hid::EyeTracker::create(tests::shape("classic").descriptor, {}, {tests::kScreenWidth, tests::kScreenHeight, 0.6}).value();
    drivers::ExposureClock clock_;
    std::span<const std::uint8_t> last_;
};

struct Latencies {
    std::vector<double> received, published;
    double cpu_s = 0, wall_s = 0;   // of the whole process, which does nothing else meanwhile
};

double cpu_seconds() {
    timespec t{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// One turn of the daemon's own loop, for `count` reports after the first `skip`, which tell it the tracker's rhythm.
void turn(Latencies& out, const Tracker& tracker, bool rehearse, int skip, int count) {
    const SystemTime time;
    auto focus = FocusPublisher::create({}, time.now()).value();
    auto ring = SamplesPublisher::create({}, focus.epoch()).value();
    auto reader = SamplesReader::map(ring.fd()).value();
    const double cpu = cpu_seconds();
    const Instant begin = time.now();
    {
        service::SourceLoop loop(std::make_unique<FifoDevice>(tracker.node(), time), true, pipeline::Pipeline::create({}).value(),
                                 {focus, ring}, time, [] {}, {}, {.realtime_priority = 10, .rehearse = rehearse});
        loop.begin();
        ::usleep(static_cast<unsigned>(skip + count) * 4150);   // asleep, so as not to keep the processor warm
    }
    out.cpu_s += cpu_seconds() - cpu;
    out.wall_s += to_seconds(time.now() - begin);
    SampleRecord r;
    for (int i = 0; i < skip + count && reader.next_sample(r); ++i) {
        if (i < skip) continue;
        out.received.push_back(us_between(r.raw.device_time.ns, r.raw.received));
        out.published.push_back(us_between(r.raw.device_time.ns, r.model.published));
    }
}

void BM_HidReportToPublishedFocus(benchmark::State& state) {
    const Tracker tracker;
    const UniqueFd bare(::open(tracker.node().c_str(), O_RDWR | O_CLOEXEC));
    std::vector<double> floor;
    Latencies as_it_comes, rehearsed;
    for (auto _ : state) {
        for (int i = 0; i < kTurn; ++i) {
            pollfd p{bare.get(), POLLIN, 0};
            std::uint8_t bytes[256];
            ::poll(&p, 1, -1);
            const ssize_t got = ::read(bare.get(), bytes, sizeof bytes);
            const Instant now = MonotonicClock::now();
            std::int64_t stamp_us = 0;   // the classic shape: id, then 64-bit microseconds
            std::memcpy(&stamp_us, bytes + 1, 8);
            if (got > 9 && i > 0) floor.push_back(us_between(stamp_us * 1000, now));
        }
        turn(as_it_comes, tracker, false, 20, kTurn);
        turn(rehearsed, tracker, true, 20, kTurn);
    }
    if (floor.empty() || as_it_comes.published.empty() || rehearsed.published.empty()) return state.SkipWithError("no report came");
    report(state, "bare_read", floor);
    const auto p50 = [](const std::vector<double>& sorted) { return sorted[(sorted.size() - 1) / 2]; };
    for (auto& [name, l] : {std::pair{"", &rehearsed}, {"unrehearsed_", &as_it_comes}}) {
        report(state, std::string(name) + "received", l->received);
        report(state, std::string(name) + "published", l->published);
        state.counters[std::string(name) + "published_over_bare_p50"] = p50(l->published) / p50(floor);
        state.counters[std::string(name) + "cpu_percent"] = 100 * l->cpu_s / l->wall_s;
    }
}
BENCHMARK(BM_HidReportToPublishedFocus)->Iterations(10)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
