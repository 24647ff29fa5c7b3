// The lab's measuring end.
//   probe watch DRIVER [--set k=v ...]   a device from the table, reopened when lost; counts, leaks, latencies
//   probe floor-hid NODE --count N       the bare read loop on the same kind of device
//   probe floor-usb --count N            a bare bulk or interrupt read loop on the headset's gaze endpoint
//   probe floor-camera NODE --count N    the same on a camera; --detect PRESET: and finds the pupil
//   probe published SESSION [--skip N]   from the device's stamp to the published model, of a daemon's recording
//   probe stages                         from the report's bytes to the published model: microseconds of each stage
//   probe session TRUTH SESSION          the same for the published models (filter none); and the latency to publishing
//   probe nearest TRUTH RECORDING        for cameras: each valid sample is one of the pictures shown, and they come in turn
//   probe compare TRUTH RECORDING        every sample of the recording against what the device sent
//   probe sleep --seconds N              suspends the machine to memory
//   probe focus [--socket PATH]          an app that looks at its focal point until SIGTERM; what it saw after a sleep
//   probe after-sleep SESSION --...      the samples of a daemon that ran through a sleep
//   probe tsc                            how fast the processor's time stamp counter runs, kHz; nothing where it has none
//   probe dma NODE [--format F]          a still picture by mapped memory, user pointers and DMA-BUFs: the same bytes
// Latencies are for devices that stamp the monotonic clock: from the hand-over to the kernel.
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cmath>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <malloc.h>
#include <map>
#include <optional>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <libusb-1.0/libusb.h>

#include "daemon/pipeline/pipeline.hpp"
#include "drivers/device.hpp"
#include "drivers/exposure_clock.hpp"
#include "drivers/hid/eye_tracker.hpp"
#include "drivers/usb/psvr2_packet.hpp"
#include "protocol/focus_region.hpp"
#include "protocol/samples_region.hpp"
#include "protocol/sphere.hpp"
#include "replay/recording.hpp"
#include "replay/session_file.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/probe.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"

using namespace fovea;
using namespace fovea::lab;

void fovea::lab::print_latencies(const char* what, std::vector<double> us) {
    if (us.empty()) return;
    std::ranges::sort(us);
    const auto at = [&](double q) { return us[static_cast<std::size_t>(q * static_cast<double>(us.size() - 1))]; };
    std::printf("%s latency_us p50=%.0f p90=%.0f p99=%.0f max=%.0f n=%zu\n", what, at(0.5), at(0.9), at(0.99), us.back(),
                us.size());
}

namespace {

volatile std::sig_atomic_t stop = 0;

int open_files() {
    int n = 0;
    if (DIR* d = ::opendir("/proc/self/fd")) {
        while (::readdir(d) != nullptr) ++n;
        ::closedir(d);
    }
    return n;
}

// What a leak makes grow: bytes of the heap in use, and mappings. Not the resident set, which the kernel counts in batches per
// thread and lets huge pages swell by hundreds of kilobytes at a time.
long heap_bytes() {
    const struct mallinfo2 m = ::mallinfo2();
    return static_cast<long>(m.uordblks + m.hblkhd);
}
long mappings() {
    long n = 0;
    if (std::FILE* f = std::fopen("/proc/self/maps", "r")) {
        for (int c = std::fgetc(f); c != EOF; c = std::fgetc(f)) n += c == '\n' ? 1 : 0;
        std::fclose(f);
    }
    return n;
}

int watch(const std::string& driver, int argc, char** argv) {
    const Arguments args(argc, argv, {"--set", "--set2", "--set3", "--count", "--losses", "--seconds", "--latency", "--switches"});
    drivers::DeviceSettings settings;
    for (const char* key : {"--set", "--set2", "--set3"})
        if (const std::string s = args.text(key, ""); !s.empty()) settings.values[s.substr(0, s.find('='))] = s.substr(s.find('=') + 1);
    const SystemTime time;
    std::unique_ptr<drivers::Device> device;
    for (const auto& row : drivers::device_table())
        if (driver == row.driver) {
            auto created = row.create(settings, time);
            if (!created) die(created.error().message());
            device = std::move(*created);
        }
    if (!device) die("no driver " + driver);
    const long count = args.number("--count", 0), losses = args.number("--losses", 0);
    const bool latency = args.text("--latency", "no") == "yes";
    const Instant end = time.now() + std::chrono::seconds(args.number("--seconds", 60));
    std::vector<double> us;
    us.reserve(1 << 16);
    long samples = 0, valid = 0, opens = 0;
    int files_early = 0;
    long heap_middle = 0, mappings_middle = 0;
    std::string last_error;
    const long switches_wanted = args.number("--switches", 0);
    std::uint64_t switches = 0;
    GazeSample s;
    while (!stop && time.now() < end && (count == 0 || samples < count) &&
           (losses == 0 || static_cast<long>(device->counters().losses) < losses)) {
        if (auto opened = device->open(); !opened) {
            if (opened.error().message() != last_error) std::printf("not open: %s\n", opened.error().message().c_str());
            last_error = opened.error().message();
            ::usleep(20'000);
            continue;
        }
        ++opens;
        if (opens == 1) std::printf("watch open: %s\n", device->info().name.c_str());
        for (;;) {
            const auto status = device->poll(s, std::min(end, time.now() + std::chrono::milliseconds(500)));
            if (status == drivers::PollStatus::lost || status == drivers::PollStatus::ended) break;
            if (status == drivers::PollStatus::sample) {
                ++samples;
                valid += s.eye(Eye::combined).valid ? 1 : 0;
                if (latency) us.push_back(static_cast<double>(to_ns(time.now()) - s.device_time.ns) * 1e-3);
            }
            if (const auto now = device->counters().switches; now != switches) {
                switches = now;
                std::printf("watch switch %llu: %s\n", static_cast<unsigned long long>(now), device->info().name.c_str());
            }
            if (switches_wanted > 0 && static_cast<long>(switches) >= switches_wanted) stop = 1;
            if (stop || time.now() >= end || (count > 0 && samples >= count)) break;
        }
        device->close();
        if (opens == 3) files_early = open_files();
        if (opens == 25) {
            heap_middle = heap_bytes();
            mappings_middle = mappings();
        }
    }
    const auto c = device->counters();
    std::printf("watch samples=%ld valid=%ld opens=%ld losses=%llu malformed=%llu dropped=%llu switches=%llu last_loss='%s'\n",
                samples, valid, opens, static_cast<unsigned long long>(c.losses), static_cast<unsigned long long>(c.malformed),
                static_cast<unsigned long long>(c.dropped), static_cast<unsigned long long>(c.switches), c.last_loss);
    if (files_early > 0)
        std::printf("watch files=%d files_at_third_open=%d heap_grown_bytes=%ld mappings_grown=%ld\n", open_files(), files_early,
                    heap_middle > 0 ? heap_bytes() - heap_middle : 0, heap_middle > 0 ? mappings() - mappings_middle : 0);
    print_latencies("watch", std::move(us));
    rusage u{};
    ::getrusage(RUSAGE_SELF, &u);
    std::printf("watch cpu_ms=%ld\n", (u.ru_utime.tv_sec + u.ru_stime.tv_sec) * 1000 + (u.ru_utime.tv_usec + u.ru_stime.tv_usec) / 1000);
    if ((count > 0 && samples < count) || (losses > 0 && static_cast<long>(c.losses) < losses)) return 1;
    return 0;
}

int floor_hid(const std::string& node, int argc, char** argv) {
    const Arguments args(argc, argv, {"--count"});
    const int fd = ::open(node.c_str(), O_RDWR | O_CLOEXEC);
    if (fd < 0) die(node);
    std::vector<double> us;
    for (long n = args.number("--count", 1000); n > 0; --n) {
        pollfd p{fd, POLLIN, 0};
        std::uint8_t report[256];
        if (::poll(&p, 1, 5000) <= 0) break;
        const ssize_t got = ::read(fd, report, sizeof report);
        const Instant now = MonotonicClock::now();
        if (got < 9) break;
        std::int64_t stamp_us;   // the classic shape: id, then 64-bit microseconds
        std::memcpy(&stamp_us, report + 1, 8);
        us.push_back(static_cast<double>(to_ns(now) - stamp_us * 1000) * 1e-3);
    }
    ::close(fd);
    print_latencies("floor-hid", std::move(us));
    return 0;
}

int floor_usb(int argc, char** argv) {
    const Arguments args(argc, argv, {"--count"});
    libusb_context* context = nullptr;
    if (libusb_init(&context) != 0) die("libusb_init");
    libusb_device_handle* h =
        libusb_open_device_with_vid_pid(context, drivers::usb::kPsvr2Vendor, drivers::usb::kPsvr2Product);
    if (h == nullptr) die("no headset");
    libusb_claim_interface(h, drivers::usb::kPsvr2Interface);
    std::vector<double> us;
    Instant ask{};
    for (long n = args.number("--count", 1000); n > 0; --n) {
        if (MonotonicClock::now() >= ask) {
            unsigned char enable[8] = {0x0C, 0, 1, 0, 0, 0, 0, 0};
            libusb_control_transfer(h, 0x42, 9, 0x0C, 0, enable, 8, 200);
            ask = MonotonicClock::now() + std::chrono::seconds(1);
        }
        unsigned char b[1024];
        int got = 0;
        if (libusb_bulk_transfer(h, drivers::usb::kPsvr2Endpoint, b, sizeof b, &got, 3000) != 0 || got != 328) continue;
        const Instant now = MonotonicClock::now();
        std::int64_t stamp_us;
        std::memcpy(&stamp_us, b + drivers::usb::psvr2::kTimestamp, 8);
        us.push_back(static_cast<double>(to_ns(now) - stamp_us * 1000) * 1e-3);
    }
    libusb_close(h);
    libusb_exit(context);
    print_latencies("floor-usb", std::move(us));
    return 0;
}

// What the daemon does with a report, stage by stage, as cold as it is there: once every 4 ms.
int stages(int argc, char** argv) {
    const Arguments args(argc, argv, {"--count"});
    const tests::Shape& shape = tests::shape("classic");
    const auto descriptor = drivers::hid::parse_report_descriptor(shape.descriptor).value();
    auto tracker = drivers::hid::EyeTracker::create(shape.descriptor, {}, {tests::kScreenWidth, tests::kScreenHeight, 0.6}).value();
    auto pipe = pipeline::Pipeline::create({}).value();
    auto focus = FocusPublisher::create({}, MonotonicClock::now()).value();
    auto ring = SamplesPublisher::create({}, focus.epoch()).value();
    drivers::ExposureClock clock;
    const Feed feed("tests/data/recordings/eyelink_lookatpoint_s1.csv", 250);
    std::vector<std::vector<double>> us(6);
    const long count = args.number("--count", 1000);
    GazeSample sample;
    for (long i = 0; i < count; ++i) {
        ::usleep(4000);
        const FeedSample f = feed.at(static_cast<std::uint64_t>(i));
        tests::Truth t;
        t.left[0] = 0.22, t.right[0] = 0.28, t.left[1] = t.right[1] = 0.15, t.left[2] = t.right[2] = 0.6;
        t.eyes_seen = f.valid;
        t.gaze_x = 0.25 + 0.6 * f.dir.x / -f.dir.z, t.gaze_y = 0.15 - 0.6 * f.dir.y / -f.dir.z;
        t.time_s = static_cast<double>(to_ns(MonotonicClock::now())) * 1e-9;
        const auto report = tests::encode_tracking(descriptor, t);
        std::int64_t at[7];
        const auto now = [&](int k) { at[k] = to_ns(MonotonicClock::now()); };
        bool has_time = false;
        now(0);
        const Instant received = MonotonicClock::now();
        if (tracker.decode(report, sample, has_time) != drivers::hid::Decoded::sample) die("stages: not decoded");
        sample.id = static_cast<std::uint64_t>(i) + 1;
        sample.received = received;
        now(1);
        clock.stamp(sample, has_time);
        now(2);
        MotionModel model = pipe.update(sample);
        now(3);
        model.published = MonotonicClock::now();
        now(4);
        focus.publish(model);
        now(5);
        ring.publish_sample(sample, model);
        now(6);
        pipe.settle();
        for (int k = 0; k < 6; ++k) us[static_cast<std::size_t>(k)].push_back(static_cast<double>(at[k + 1] - at[k]) * 1e-3);
    }
    const char* names[] = {"decode", "clock", "pipeline", "stamp", "focus", "ring"};
    for (std::size_t k = 0; k < 6; ++k) print_latencies(names[k], us[k]);
    return 0;
}

// A sample belongs to the truth with the nearest device time; the two must agree to --tolerance-us and --tolerance-mdeg.
int compare(const std::string& truth_file, const std::string& recording_file, int argc, char** argv) {
    const Arguments args(argc, argv, {"--tolerance-us", "--tolerance-mdeg", "--least"});
    const auto truth = replay::load_recording(truth_file), seen = replay::load_recording(recording_file);
    if (!truth) die(truth.error().message());
    if (!seen) die(seen.error().message());
    const std::int64_t tolerance = args.number("--tolerance-us", 0) * 1000;
    std::map<std::int64_t, const GazeSample*> by_time;
    for (const auto& r : truth->samples) by_time[r.sample.device_time.ns] = &r.sample;
    long matched = 0, strangers = 0, wrong = 0, invalid = 0;
    double worst_deg = 0;
    std::int64_t first = INT64_MAX, last = INT64_MIN;
    for (const auto& r : seen->samples) {
        const std::int64_t t = r.sample.device_time.ns;
        auto it = by_time.lower_bound(t - tolerance);
        if (it == by_time.end() || it->first > t + tolerance) { ++strangers; continue; }
        first = std::min(first, it->first);
        last = std::max(last, it->first);
        const EyeState &a = it->second->eye(Eye::combined), &b = r.sample.eye(Eye::combined);
        ++matched;
        if (a.valid != b.valid) { ++wrong; continue; }
        if (!a.valid) { ++invalid; continue; }
        const double deg = angle_between(a.gaze_dir_head, b.gaze_dir_head) * 57.29577951308232;
        worst_deg = std::max(worst_deg, deg);
        if (deg > static_cast<double>(args.number("--tolerance-mdeg", 1)) * 1e-3) ++wrong;
    }
    long sent_between = 0;
    for (const auto& [t, s] : by_time) sent_between += t >= first && t <= last ? 1 : 0;
    const long missing = sent_between - matched;
    std::printf("compare matched=%ld missing=%ld strangers=%ld wrong=%ld invalid=%ld worst_mdeg=%.4f\n", matched, missing,
                strangers, wrong, invalid, worst_deg * 1e3);
    return matched >= args.number("--least", 1) && missing == 0 && strangers == 0 && wrong == 0 ? 0 : 1;
}

int nearest(const std::string& truth_file, const std::string& recording_file, int argc, char** argv) {
    const Arguments args(argc, argv, {"--tolerance-mdeg", "--least", "--models"});
    const auto truth = replay::load_recording(truth_file);
    if (!truth) die(truth.error().message());
    std::vector<std::optional<Direction<HeadFrame>>> seen;
    std::vector<double> us;   // from the camera's stamp to publishing
    if (args.text("--models", "no") == "yes") {
        const auto reader = replay::SessionReader::open(recording_file);
        if (!reader) die(reader.error().message());
        const auto read = reader->models([&](const MotionModel& m) {
            const auto& e = m.eye(Eye::combined);
            const bool own = e.reference == m.exposed && e.event != GazeEvent::blink;   // else an older gaze is held
            seen.push_back(own ? std::optional(e.gaze_dir_head) : std::nullopt);
            us.push_back(static_cast<double>((m.published - m.exposed).count()) * 1e-3);
            return true;
        });
        if (!read) die(read.error().message());
    } else {
        const auto recording = replay::load_recording(recording_file);
        if (!recording) die(recording.error().message());
        for (const auto& r : recording->samples) {
            const EyeState& e = r.sample.eye(Eye::combined);
            seen.push_back(e.valid ? std::optional(e.gaze_dir_head) : std::nullopt);
        }
    }
    long valid = 0, close = 0, in_turn = 0, pairs = 0;
    std::vector<double> off;
    std::size_t last = 0;
    bool has_last = false;
    for (const auto& dir : seen) {
        if (!dir) { has_last = false; continue; }
        ++valid;
        // Neighbouring pictures may look the same way: the one that is due is asked first.
        std::size_t best = 0;
        double best_deg = 1e9;
        const std::size_t n = truth->samples.size();
        for (std::size_t k = 0; k < n; ++k) {
            const std::size_t i = ((has_last ? last + 1 : 0) + k) % n;
            const double deg = angle_between(*dir, truth->samples[i].sample.eye(Eye::combined).gaze_dir_head) * 57.29577951308232;
            if (deg < best_deg - 0.05) { best_deg = deg; best = i; }
        }
        off.push_back(best_deg);
        close += best_deg * 1e3 <= static_cast<double>(args.number("--tolerance-mdeg", 300)) ? 1 : 0;
        if (has_last) {
            ++pairs;
            in_turn += (best + n - last) % n <= 4 ? 1 : 0;   // frames may be dropped between
        }
        last = best;
        has_last = true;
    }
    std::ranges::sort(off);
    std::printf("nearest valid=%ld of %zu close=%ld in_turn=%ld of %ld median_mdeg=%.1f worst_mdeg=%.1f\n", valid, seen.size(), close,
                in_turn, pairs, off.empty() ? 0 : off[off.size() / 2] * 1e3, off.empty() ? 0 : off.back() * 1e3);
    print_latencies("published", std::move(us));
    return valid >= args.number("--least", 1) && close == valid && in_turn * 10 >= pairs * 8 ? 0 : 1;
}

// Published models of a daemon that ran with filter "none": where a model used its sample, its gaze is the device's.
int session(const std::string& truth_file, const std::string& file, int argc, char** argv) {
    const Arguments args(argc, argv, {"--tolerance-mdeg", "--least", "--latency"});
    const auto truth = replay::load_recording(truth_file);
    if (!truth) die(truth.error().message());
    std::map<std::int64_t, const GazeSample*> by_time;
    for (const auto& r : truth->samples) by_time[r.sample.device_time.ns] = &r.sample;
    const auto reader = replay::SessionReader::open(file);
    if (!reader) die(reader.error().message());
    std::map<std::uint64_t, GazeSample> samples;
    if (auto r = reader->samples([&](const replay::RecordedSample& s) { samples[s.sample.id] = s.sample; return true; }); !r)
        die(r.error().message());
    long models = 0, used = 0, wrong = 0, unknown = 0, estimated = 0;
    double worst_deg = 0, worst_clock_us = 0;
    std::vector<double> us, received_us;
    const bool latency = args.text("--latency", "no") == "yes";
    auto r = reader->models([&](const MotionModel& m) {
        ++models;
        const auto s = samples.find(m.sample_id);
        const auto t = s == samples.end() ? by_time.end() : by_time.find(s->second.device_time.ns);
        if (t == by_time.end()) { ++unknown; return true; }
        estimated += m.exposed_estimated ? 1 : 0;
        if (latency && models > 100) {   // the first waited while the device was opened
            us.push_back(static_cast<double>(to_ns(m.published) - t->first) * 1e-3);
            received_us.push_back(static_cast<double>(to_ns(m.received) - t->first) * 1e-3);
            if (models > 500) worst_clock_us = std::max(worst_clock_us, std::abs(static_cast<double>(to_ns(m.exposed) - t->first)) * 1e-3);
        }
        if (m.eye(Eye::combined).reference != m.exposed || m.eye(Eye::combined).event == GazeEvent::blink)
            return true;   // blink, closing lid or invalid: an older gaze is held
        ++used;
        const double deg = angle_between(m.eye(Eye::combined).gaze_dir_head, t->second->eye(Eye::combined).gaze_dir_head) * 57.29577951308232;
        worst_deg = std::max(worst_deg, deg);
        if (deg > static_cast<double>(args.number("--tolerance-mdeg", 1)) * 1e-3) ++wrong;
        return true;
    });
    if (!r) die(r.error().message());
    std::printf("session models=%ld used=%ld wrong=%ld unknown=%ld estimated=%ld worst_mdeg=%.4f\n", models, used, wrong,
                unknown, estimated, worst_deg * 1e3);
    print_latencies("received", std::move(received_us));
    print_latencies("published", std::move(us));
    if (latency) std::printf("session exposed_off_us_worst=%.0f\n", worst_clock_us);
    return used >= args.number("--least", 1) && wrong == 0 && unknown == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::signal(SIGTERM, [](int) { stop = 1; });
    std::signal(SIGINT, [](int) { stop = 1; });
    const std::string command = argc > 1 ? argv[1] : "";
    if (command == "watch" && argc > 2) return watch(argv[2], argc - 2, argv + 2);
    if (command == "floor-hid" && argc > 2) return floor_hid(argv[2], argc - 2, argv + 2);
    if (command == "floor-usb") return floor_usb(argc - 1, argv + 1);
    if (command == "stages") return stages(argc - 1, argv + 1);
    if (command == "compare" && argc > 3) return compare(argv[2], argv[3], argc - 3, argv + 3);
    if (command == "nearest" && argc > 3) return nearest(argv[2], argv[3], argc - 3, argv + 3);
    if (command == "session" && argc > 3) return session(argv[2], argv[3], argc - 3, argv + 3);
    if (command == "floor-camera" && argc > 2) return floor_camera(argv[2], argc - 2, argv + 2);
    if (command == "published" && argc > 2) return published(argv[2], argc - 2, argv + 2);
    if (command == "tsc") return print_tsc_khz();
    if (command == "sleep") return sleep_machine(argc - 1, argv + 1);
    if (command == "focus") return watch_focus(argc - 1, argv + 1);
    if (command == "after-sleep" && argc > 2) return after_sleep(argv[2], argc - 2, argv + 2);
    if (command == "dma" && argc > 2) return dma_frames(argv[2], argc - 2, argv + 2);
    errno = 0;
    die("usage: probe watch|floor-hid|floor-usb|stages|compare|nearest|session|sleep|focus|after-sleep|dma ... (see the source's first lines)");
}
