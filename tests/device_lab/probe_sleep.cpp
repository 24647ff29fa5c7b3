// The machine's clocks. Putting it to sleep, and what is seen of that: by an app, and in the daemon's recording.
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fcntl.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

#include "fovea/fovea.h"
#include "protocol/gaze_sample.hpp"
#include "replay/recording.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/probe.hpp"

namespace fovea::lab {
namespace {

volatile std::sig_atomic_t stop = 0;

std::int64_t boot_ns() {
    timespec t{};
    clock_gettime(CLOCK_BOOTTIME, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}
std::int64_t now_ns() { return to_ns(MonotonicClock::now()); }
std::int64_t asleep_ns() { return boot_ns() - now_ns(); }

void put(const char* file, const std::string& text) {
    const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
    if (fd < 0 || ::write(fd, text.data(), text.size()) != static_cast<ssize_t>(text.size())) die(std::string("cannot write ") + file);
    ::close(fd);
}

}  // namespace

// The lab's kernel would measure this at its start against emulated timers; on a busy machine it is off by as much as a
// factor of five, and all its clocks with it.
int print_tsc_khz() {
#if defined(__x86_64__)
    // The shortest of each pair of readings is the least disturbed by other programs.
    const auto both = [] {
        std::int64_t least = INT64_MAX, at = 0, ticks = 0;
        for (int i = 0; i < 1000; ++i) {
            const std::int64_t before = now_ns();
            const auto t = static_cast<std::int64_t>(__rdtsc());
            const std::int64_t after = now_ns();
            if (after - before < least) least = after - before, at = before + (after - before) / 2, ticks = t;
        }
        return std::pair{at, ticks};
    };
    const auto [from, from_ticks] = both();
    ::usleep(300'000);
    const auto [to, to_ticks] = both();
    std::printf("%lld\n", std::llround(static_cast<double>(to_ticks - from_ticks) * 1e6 / static_cast<double>(to - from)));
#endif
    return 0;
}

// Suspends to memory; the clock on the board wakes it up.
int sleep_machine(int argc, char** argv) {
    const Arguments args(argc, argv, {"--seconds"});
    constexpr const char* kAlarm = "/sys/class/rtc/rtc0/wakealarm";
    put(kAlarm, "0");
    put(kAlarm, "+" + std::to_string(args.number("--seconds", 4)));
    const std::int64_t from = now_ns(), from_boot = boot_ns();
    put("/sys/power/state", "mem");   // returns after waking up
    const std::int64_t to = now_ns(), to_boot = boot_ns();
    std::printf("sleep from_ns=%lld from_boot_ns=%lld to_ns=%lld to_boot_ns=%lld slept_ms=%lld awake_ms=%lld\n", static_cast<long long>(from),
                static_cast<long long>(from_boot), static_cast<long long>(to), static_cast<long long>(to_boot),
                static_cast<long long>(((to_boot - to) - (from_boot - from)) / 1'000'000), static_cast<long long>((to - from) / 1'000'000));
    return (to_boot - to) - (from_boot - from) > 1'000'000'000 ? 0 : 1;
}

// An app that looks at its focal point every 2 ms until it is told to end: how long it was shown gaze from before the
// sleep as live, and whether the gaze came back.
int watch_focus(int argc, char** argv) {
    const Arguments args(argc, argv, {"--socket"});
    std::signal(SIGTERM, [](int) { stop = 1; });
    const std::string socket = args.text("--socket", "/run/lab/fovea/focus.sock");
    fovea_connect_info info{sizeof info, FOVEA_CONNECT_WAIT, socket.c_str(), "lab_probe"};
    fovea_client* client = nullptr;
    if (fovea_connect(&info, &client) != FOVEA_OK) die(fovea_last_error(nullptr));
    const fovea_view view{sizeof view, FOVEA_EYE_COMBINED, -1, 1, 1, -1, {1, 0, 0, 0}};
    std::int64_t asleep = asleep_ns(), woke = 0, last_old = 0, back = 0;
    std::uint64_t live_before = 0, live_after = 0, static_after = 0;
    while (!stop) {
        const std::int64_t now = now_ns();
        if (const std::int64_t a = asleep_ns(); a - asleep > 1'000'000'000) {
            asleep = a;
            woke = now;
        }
        fovea_focal focal{};
        focal.struct_size = sizeof focal;
        fovea_latch_info latch{};
        latch.struct_size = sizeof latch;
        fovea_latch(client, now, &view, 1, &focal, &latch);
        const bool shown = (focal.flags & FOVEA_FOCAL_STATIC) == 0;
        if (woke == 0) live_before += shown ? 1 : 0;
        else if (!shown) ++static_after;
        else if (latch.received_ns < woke) last_old = now;
        else {
            if (back == 0) back = now;
            ++live_after;
        }
        ::usleep(2000);
    }
    fovea_disconnect(client);
    std::printf("focus live_before=%llu woke=%d old_gaze_ms=%.1f static_after=%llu back_ms=%.1f live_after=%llu\n", static_cast<unsigned long long>(live_before),
                woke != 0, last_old > 0 ? static_cast<double>(last_old - woke) * 1e-6 : 0, static_cast<unsigned long long>(static_after),
                back > 0 ? static_cast<double>(back - woke) * 1e-6 : -1, static_cast<unsigned long long>(live_after));
    return 0;
}

// The raw samples of a daemon that ran through a sleep, of a tracker that stamps CLOCK_BOOTTIME: which were from before, and
// whether the others' exposures are right by a clock that stood still.
int after_sleep(const std::string& session_file, int argc, char** argv) {
    const Arguments args(argc, argv, {"--to-ns", "--from-boot-ns", "--to-boot-ns"});
    const auto session = replay::load_recording(session_file);
    if (!session) die(session.error().message());
    const std::int64_t to = std::stoll(args.text("--to-ns", "0")), to_boot = std::stoll(args.text("--to-boot-ns", "0"));
    const std::int64_t night = std::stoll(args.text("--from-boot-ns", "0")) / 2 + to_boot / 2;   // in the middle of the sleep
    long before = 0, after = 0, late = 0, backwards = 0, future = 0, unmarked = 0;
    double worst_ms = 0;
    std::int64_t last = INT64_MIN, settled_from = INT64_MAX;
    for (const auto& r : session->samples) {
        const GazeSample& s = r.sample;
        const std::int64_t exposed = to_ns(s.exposed), received = to_ns(s.received);
        backwards += exposed < last ? 1 : 0;
        future += exposed > received ? 1 : 0;
        last = exposed;
        if (s.device_time.ns < night) {
            ++before;
            late += received > to ? 1 : 0;
            continue;
        }
        if (after++ == 0) settled_from = received + 900'000'000;
        if (received < settled_from) unmarked += s.exposed_estimated ? 0 : 1;
        worst_ms = std::max(worst_ms, std::fabs(static_cast<double>(exposed - (s.device_time.ns - (to_boot - to)))) * 1e-6);
    }
    std::printf("after-sleep before=%ld after=%ld late=%ld backwards=%ld future=%ld unmarked=%ld worst_off_ms=%.2f\n", before, after, late, backwards,
                future, unmarked, worst_ms);
    return 0;
}

}  // namespace fovea::lab
