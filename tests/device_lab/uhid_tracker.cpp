// An eye tracker in the kernel's HID layer, made by /dev/uhid and fed with a recording.
//
// It answers feature reports, sends only while somebody has it open, and can misbehave as asked:
//   --malformed-every N   every Nth report is cut short, overlong or of a foreign id
//   --cycles C --count N  C times: plug in, send N reports, pull out in mid-stream
//   --broken N            N devices one after the other, each with a descriptor that is damaged somewhere and reports of
//                         random bytes, until somebody has read for a fifth of a second, at most for one; nothing else
//   --silent-after N      stays plugged in and says nothing more after N reports
//   --stamps monotonic    device time is the monotonic clock when the report is handed to the kernel
//   --stamps boottime     the same of the clock that goes on while the machine sleeps, as a tracker's own does
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <linux/hid.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <random>
#include <unistd.h>

#include "drivers/hid/report_descriptor.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"

using namespace fovea;
using namespace fovea::lab;

namespace {

volatile std::sig_atomic_t stop = 0;

class Tracker {
public:
    Tracker(const tests::Shape& shape, const std::string& name, long product, double rate_hz)
        : descriptor_{drivers::hid::parse_report_descriptor(shape.descriptor).value()}, rate_hz_{rate_hz} {
        fd_ = ::open("/dev/uhid", O_RDWR | O_CLOEXEC);
        if (fd_ < 0) die("/dev/uhid");
        uhid_event e{};
        e.type = UHID_CREATE2;
        std::snprintf(reinterpret_cast<char*>(e.u.create2.name), sizeof e.u.create2.name, "%s", name.c_str());
        std::snprintf(reinterpret_cast<char*>(e.u.create2.uniq), sizeof e.u.create2.uniq, "LAB-%s", shape.name);
        e.u.create2.bus = BUS_USB;
        e.u.create2.vendor = 0x1d50;
        e.u.create2.product = static_cast<__u32>(product);
        e.u.create2.rd_size = static_cast<__u16>(shape.descriptor.size());
        std::memcpy(e.u.create2.rd_data, shape.descriptor.data(), shape.descriptor.size());
        write_event(e);
    }
    ~Tracker() {
        uhid_event e{};
        e.type = UHID_DESTROY;
        (void)!::write(fd_, &e, sizeof e);
        ::close(fd_);
    }

    void send(const std::vector<std::uint8_t>& report) {
        uhid_event e{};
        e.type = UHID_INPUT2;
        e.u.input2.size = static_cast<__u16>(report.size());
        std::memcpy(e.u.input2.data, report.data(), report.size());
        write_event(e);
    }

    // Serves what the kernel asks until `t`.
    void serve(Instant t) {
        while (!stop && wait_until(t, fd_)) {
            uhid_event e{};
            if (::read(fd_, &e, sizeof e) <= 0) die("uhid read");
            switch (e.type) {
                case UHID_OPEN: opened_ = true; break;
                case UHID_CLOSE: opened_ = false; break;
                case UHID_GET_REPORT: {
                    const auto report = tests::encode_feature(descriptor_, e.u.get_report.rnum, rate_hz_);
                    uhid_event a{};
                    a.type = UHID_GET_REPORT_REPLY;
                    a.u.get_report_reply.id = e.u.get_report.id;
                    a.u.get_report_reply.err = report.empty() ? EIO : 0;
                    a.u.get_report_reply.size = static_cast<__u16>(report.size());
                    std::memcpy(a.u.get_report_reply.data, report.data(), report.size());
                    write_event(a);
                    break;
                }
                case UHID_SET_REPORT: {
                    mode_ = e.u.set_report.size >= 2 ? e.u.set_report.data[1] : 0;
                    std::printf("tracker: mode request %d\n", mode_);
                    uhid_event a{};
                    a.type = UHID_SET_REPORT_REPLY;
                    a.u.set_report_reply.id = e.u.set_report.id;
                    write_event(a);
                    break;
                }
                default: break;
            }
        }
    }

    [[nodiscard]] bool opened() const { return opened_; }
    [[nodiscard]] const drivers::hid::ReportDescriptor& descriptor() const { return descriptor_; }

private:
    void write_event(const uhid_event& e) {
        if (::write(fd_, &e, sizeof e) != static_cast<ssize_t>(sizeof e)) die("uhid write");
    }

    drivers::hid::ReportDescriptor descriptor_;
    double rate_hz_;
    int fd_ = -1, mode_ = 0;
    bool opened_ = false;
};

// Damaged as a bad cable or a bad maker damages: some bytes changed, the end cut off, or a part said twice.
std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> d, std::mt19937& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::ptrdiff_t>(random() % n); };
    switch (random() % 4) {
        case 0: d.resize(1 + static_cast<std::size_t>(below(d.size() - 1))); break;
        case 1: {
            const auto from = below(d.size() - 1);
            const std::vector<std::uint8_t> part(d.begin() + from, d.begin() + from + 1 + below(d.size() - static_cast<std::size_t>(from)));
            d.insert(d.begin() + below(d.size()), part.begin(), part.end());
            break;
        }
        default:
            // The first two bytes name the page, without which nobody looks at the device.
            for (auto n = 1 + below(6); n > 0; --n) d[2 + static_cast<std::size_t>(below(d.size() - 2))] = static_cast<std::uint8_t>(random());
    }
    if (d.size() > HID_MAX_DESCRIPTOR_SIZE) d.resize(HID_MAX_DESCRIPTOR_SIZE);
    return d;
}

void play_broken(const tests::Shape& shape, long devices) {
    std::mt19937 random(7);
    long accepted = 0, opened = 0;
    const auto put = [](int fd, const uhid_event& e) { static_cast<void>(!::write(fd, &e, sizeof e)); };   // the kernel may refuse it
    for (long i = 0; i < devices && !stop; ++i) {
        const auto descriptor = damaged(shape.descriptor, random);
        const int fd = ::open("/dev/uhid", O_RDWR | O_CLOEXEC);
        if (fd < 0) die("/dev/uhid");
        uhid_event e{};
        e.type = UHID_CREATE2;
        std::snprintf(reinterpret_cast<char*>(e.u.create2.name), sizeof e.u.create2.name, "Lab tracker, broken %ld", i);
        e.u.create2.bus = BUS_USB;
        e.u.create2.vendor = 0x1d50;
        e.u.create2.product = 0xe7e2;
        e.u.create2.rd_size = static_cast<__u16>(descriptor.size());
        std::memcpy(e.u.create2.rd_data, descriptor.data(), descriptor.size());
        put(fd, e);
        // Refused ones never get a node.
        Instant end = MonotonicClock::now() + std::chrono::milliseconds(300);
        bool there = false, read = false;
        while (!stop && MonotonicClock::now() < end) {
            if (!there && ::access("/dev/hidraw0", F_OK) == 0) {
                there = true;
                ++accepted;
                end = MonotonicClock::now() + std::chrono::milliseconds(900);
            }
            if (wait_until(MonotonicClock::now() + std::chrono::milliseconds(4), fd)) {
                uhid_event asked{};
                if (::read(fd, &asked, sizeof asked) <= 0) break;
                uhid_event a{};
                if (asked.type == UHID_OPEN && !read) {
                    read = true;
                    ++opened;
                    end = MonotonicClock::now() + std::chrono::milliseconds(200);
                }
                if (asked.type == UHID_GET_REPORT) {
                    a.type = UHID_GET_REPORT_REPLY;
                    a.u.get_report_reply.id = asked.u.get_report.id;
                    a.u.get_report_reply.size = static_cast<__u16>(1 + random() % 64);
                    for (int b = 0; b < 64; ++b) a.u.get_report_reply.data[b] = static_cast<__u8>(random());
                    put(fd, a);
                } else if (asked.type == UHID_SET_REPORT) {
                    a.type = UHID_SET_REPORT_REPLY;
                    a.u.set_report_reply.id = asked.u.set_report.id;
                    put(fd, a);
                }
                continue;
            }
            uhid_event r{};
            r.type = UHID_INPUT2;
            r.u.input2.size = static_cast<__u16>(1 + random() % 64);
            for (int b = 0; b < 64; ++b) r.u.input2.data[b] = static_cast<__u8>(random());
            if (random() % 2 == 0) r.u.input2.data[0] = static_cast<__u8>(1 + random() % 4);
            put(fd, r);
        }
        e = {};
        e.type = UHID_DESTROY;
        put(fd, e);
        ::close(fd);
    }
    std::printf("tracker: %ld broken devices, %ld taken by the kernel, %ld opened\n", devices, accepted, opened);
}

tests::Truth truth_of(const FeedSample& s) {
    tests::Truth t;
    const double x = tests::kScreenWidth / 2, y = tests::kScreenHeight / 2, z = 0.6;
    t.left[0] = x - 0.032, t.right[0] = x + 0.032;
    t.left[1] = t.right[1] = y;
    t.left[2] = t.right[2] = z;
    t.eyes_seen = s.valid;
    t.gaze_x = x + z * s.dir.x / -s.dir.z;
    t.gaze_y = y - z * s.dir.y / -s.dir.z;
    t.time_s = static_cast<double>(s.time_us) * 1e-6;
    return t;
}

}  // namespace

int main(int argc, char** argv) {
    const Arguments args(argc, argv, {"--recording", "--shape", "--rate", "--count", "--cycles", "--truth", "--stamps",
                                      "--malformed-every", "--silent-after", "--name", "--product", "--pause-ms", "--broken"});
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::signal(SIGTERM, [](int) { stop = 1; });
    std::signal(SIGINT, [](int) { stop = 1; });
    const long rate = args.number("--rate", 250), count = args.number("--count", 0), cycles = args.number("--cycles", 1);
    const long malformed_every = args.number("--malformed-every", 0), silent_after = args.number("--silent-after", 0);
    const std::string stamps = args.text("--stamps", "recording");
    const bool boottime = stamps == "boottime", live = boottime || stamps == "monotonic";
    const auto clock_us = [&](Instant now) {
        timespec t{};
        if (!boottime) return to_ns(now) / 1000;
        clock_gettime(CLOCK_BOOTTIME, &t);
        return std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
    };
    const tests::Shape& shape = tests::shape(args.text("--shape", "classic"));
    if (const long broken = args.number("--broken", 0); broken > 0) {
        play_broken(shape, broken);
        return 0;
    }
    const Feed feed(args.text("--recording", "tests/data/recordings/eyelink_lookatpoint_s1.csv"), static_cast<double>(rate));
    TruthLog log(args.text("--truth", ""), static_cast<double>(rate));
    std::uint64_t index = 0, sent = 0, malformed = 0;
    long done = 0;
    for (; done < cycles && !stop; ++done) {
        Tracker tracker(shape, args.text("--name", std::string("Lab tracker ") + shape.name), args.number("--product", 0xe7e2),
                        static_cast<double>(rate));
        while (!stop && !tracker.opened()) tracker.serve(MonotonicClock::now() + std::chrono::milliseconds(20));
        // The reader asks for feature reports right after opening; the stream starts when that is over.
        Instant due = MonotonicClock::now() + std::chrono::milliseconds(100);
        for (long n = 0; !stop && (count == 0 || n < count); ++n) {
            tracker.serve(due);
            if (stop) break;
            if (!tracker.opened()) { due = MonotonicClock::now() + std::chrono::milliseconds(5); --n; continue; }
            if (silent_after > 0 && n >= silent_after) { due += std::chrono::milliseconds(50); continue; }
            FeedSample s = feed.at(index++);
            if (live) s.time_us = clock_us(MonotonicClock::now());
            auto report = tests::encode_tracking(tracker.descriptor(), truth_of(s));
            if (malformed_every > 0 && n % malformed_every == malformed_every - 1) {
                // An extra report, so that the good ones stay complete. The kernel drops some of them by itself.
                auto bad = report;
                if (malformed % 3 == 0) bad.resize(bad.size() / 2);
                if (malformed % 3 == 1) bad.resize(bad.size() + 9, 0xEE);
                if (malformed % 3 == 2) bad[0] = 0x7B;
                tracker.send(bad);
                ++malformed;
            }
            const Instant now = MonotonicClock::now();
            if (live) {
                s.time_us = clock_us(now);
                report = tests::encode_tracking(tracker.descriptor(), truth_of(s));
            }
            tracker.send(report);
            log.add(s, now);
            ++sent;
            due += Duration{feed.period_ns()};
            if (MonotonicClock::now() - due > std::chrono::milliseconds(200)) due = MonotonicClock::now();
        }
        if (cycles == 1) tracker.serve(MonotonicClock::now() + std::chrono::milliseconds(args.number("--pause-ms", 300)));
        std::printf("tracker: unplugged\n");
    }
    std::printf("tracker: %llu reports, %llu malformed ones besides, %ld cycles\n", static_cast<unsigned long long>(sent),
                static_cast<unsigned long long>(malformed), done);
    return 0;
}
