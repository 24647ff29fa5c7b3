// A PlayStation VR2 on the kernel's USB bus, made by vhci_hcd and fed with a recording; with --device sample, the
// made-up tracker of drivers/sample.
//
// It streams only after the enable request has come --deaf more times, and stops two seconds after the last one. It can
// misbehave as asked: every Nth packet --stall-every, --torn-every (in two transfers), --short-every, --overlong-every
// (extra transfers, so that the good packets stay complete); --cycles C --count N pulls it out C times in mid-stream.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include "protocol/sphere.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/vhci.hpp"
#include "tests/drivers/usb/psvr2_encode.hpp"

using namespace fovea;
using namespace fovea::lab;

namespace {

volatile std::sig_atomic_t stop = 0;

UsbDescriptors headset_descriptors(bool interrupt) {
    UsbDescriptors d;
    d.strings = {"Fovea device lab", "Emulated headset", "LAB1"};
    d.device = {18, 1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x4C, 0x05, 0xDE, 0x0C, 0x00, 0x01, 1, 2, 3, 1};
    auto& c = d.configuration;
    c = {9, 2, 0, 0, 6, 1, 0, 0x80, 250};
    for (std::uint8_t i = 0; i < 6; ++i) {
        const bool gaze = i == 5;
        c.insert(c.end(), {9, 4, i, 0, static_cast<std::uint8_t>(gaze ? 1 : 0), 0xFF, 0, 0, 0});
        if (!gaze) continue;
        if (interrupt) c.insert(c.end(), {7, 5, 0x85, 3, 0x00, 0x02, 4});
        else c.insert(c.end(), {7, 5, 0x85, 2, 0x00, 0x02, 0});
    }
    c[2] = static_cast<std::uint8_t>(c.size());
    c[3] = static_cast<std::uint8_t>(c.size() >> 8);
    return d;
}

UsbDescriptors sample_descriptors() {
    UsbDescriptors d;
    d.strings = {"Fovea device lab", "Emulated sample tracker", "LAB2"};
    d.device = {18, 1, 0x00, 0x02, 0xFF, 0, 0, 64, 0x50, 0x1D, 0xE3, 0xE7, 0x00, 0x01, 1, 2, 3, 1};
    d.configuration = {9, 2, 25, 0, 1, 1, 0, 0x80, 50, 9, 4, 0, 0, 1, 0xFF, 0, 0, 0, 7, 5, 0x81, 3, 64, 0, 1};
    return d;
}

std::vector<std::uint8_t> sample_packet(const FeedSample& s, std::uint64_t index) {
    const auto a = to_azimuth_elevation(s.dir);
    const auto x = static_cast<std::int16_t>(std::lround(a.azimuth_rad * 5729.577951308232));
    const auto y = static_cast<std::int16_t>(std::lround(a.elevation_rad * 5729.577951308232));
    const auto ticks = static_cast<std::uint32_t>(s.time_us / 100);
    const auto low = [](auto v, int byte) { return static_cast<std::uint8_t>(static_cast<std::uint32_t>(v) >> (8 * byte)); };
    return {'F', 'S', low(index, 0), low(index, 1), low(ticks, 0), low(ticks, 1), low(ticks, 2), low(ticks, 3), low(x, 0),
            low(x, 1), low(y, 0), low(y, 1), static_cast<std::uint8_t>(s.valid ? 3 : 0), 70, 0, 0, 0, 0, 0, 0};
}

}  // namespace

int main(int argc, char** argv) {
    const Arguments args(argc, argv, {"--recording", "--rate", "--count", "--cycles", "--truth", "--stamps", "--deaf",
                                      "--stall-every", "--torn-every", "--short-every", "--overlong-every", "--port",
                                      "--endpoint", "--device"});
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::signal(SIGTERM, [](int) { stop = 1; });
    std::signal(SIGINT, [](int) { stop = 1; });
    const bool sample = args.text("--device", "psvr2") == "sample";
    const std::uint8_t endpoint = sample ? 0x81 : drivers::usb::kPsvr2Endpoint;
    const long rate = args.number("--rate", 120), count = args.number("--count", 0), cycles = args.number("--cycles", 1);
    const long stall = args.number("--stall-every", 0), torn = args.number("--torn-every", 0);
    const long cut = args.number("--short-every", 0), overlong = args.number("--overlong-every", 0);
    const bool monotonic = args.text("--stamps", "recording") == "monotonic";
    const Feed feed(args.text("--recording", "tests/data/recordings/eyelink_lookatpoint_s1.csv"), static_cast<double>(rate));
    TruthLog log(args.text("--truth", ""), static_cast<double>(rate));
    std::uint64_t index = 0, faults = 0;
    unsigned cleared = 0;
    long done = 0;
    for (; done < cycles && !stop; ++done) {
        VhciDevice device(sample ? sample_descriptors() : headset_descriptors(args.text("--endpoint", "bulk") == "interrupt"),
                          static_cast<int>(args.number("--port", 0)));
        long requests = 0;
        Instant enabled_until = sample ? Instant::max() : Instant{};
        device.on_request = [&](const UsbSetup& s, std::span<const std::uint8_t> out)
            -> std::optional<std::vector<std::uint8_t>> {
            if (s.type != 0x42 || s.request != 9 || s.value != 0x0C || out.size() != 8 || out[0] != 0x0C || out[2] != 1)
                return std::nullopt;
            if (++requests > args.number("--deaf", 0)) enabled_until = MonotonicClock::now() + std::chrono::seconds(2);
            return std::vector<std::uint8_t>{};
        };
        Instant due = MonotonicClock::now();
        bool told = false;
        for (long n = 0; !stop && (count == 0 || n < count);) {
            if (!device.serve(due)) break;
            if (enabled_until < MonotonicClock::now() || device.waiting(endpoint) == 0) {
                due = MonotonicClock::now() + std::chrono::milliseconds(1);
                continue;
            }
            if (!told) std::printf("headset: streaming after %ld requests\n", requests);
            told = true;
            const auto fault = [&](long every) { return every > 0 && n % every == every - 1; };
            FeedSample s = feed.at(index);
            tests::Psvr2Truth t;
            t.frame = static_cast<std::uint32_t>(index);
            t.valid = s.valid;
            t.left = t.right = t.combined = s.dir;
            if (monotonic) s.time_us = to_ns(MonotonicClock::now()) / 1000;
            t.timestamp_us = s.time_us;
            const auto encoded = tests::encode_psvr2(t);
            const std::vector<std::uint8_t> packet =
                sample ? sample_packet(s, index) : std::vector<std::uint8_t>(encoded.begin(), encoded.end());
            // Each fault takes a transfer of its own; the transfers are awaited as they are needed.
            const auto await = [&] {
                while (!stop && device.waiting(endpoint) == 0)
                    if (!device.serve(MonotonicClock::now() + std::chrono::milliseconds(1))) return false;
                return !stop;
            };
            if (fault(stall)) {
                // A halted endpoint moves no data until the host has cleared it.
                const unsigned before = device.halts_cleared();
                device.stall(endpoint);
                ++faults;
                while (!stop && device.halts_cleared() == before)
                    if (!device.serve(MonotonicClock::now() + std::chrono::milliseconds(1))) break;
                if (!await()) break;
            }
            if (fault(cut)) {
                device.complete(endpoint, {packet.data() + 50, 60});
                ++faults;
                if (!await()) break;
            }
            if (fault(overlong)) {
                std::vector<std::uint8_t> big(device.room(endpoint) + 100, 'x');
                device.complete(endpoint, big);
                ++faults;
                if (!await()) break;
            }
            const Instant now = MonotonicClock::now();
            if (fault(torn)) {
                device.complete(endpoint, {packet.data(), 200});
                ++faults;
                if (!await()) break;
                device.complete(endpoint, {packet.data() + 200, packet.size() - 200});
            } else {
                device.complete(endpoint, packet);
            }
            log.add(s, now);
            ++index;
            ++n;
            due += Duration{feed.period_ns()};
            if (MonotonicClock::now() - due > std::chrono::milliseconds(200)) due = MonotonicClock::now();
        }
        if (cycles == 1 && !stop) device.serve(MonotonicClock::now() + std::chrono::milliseconds(500));
        cleared += device.halts_cleared();
        std::printf("headset: unplugged\n");
    }
    std::printf("headset: %llu packets, %llu faults besides, %u halts cleared, %ld cycles\n",
                static_cast<unsigned long long>(index), static_cast<unsigned long long>(faults), cleared, done);
    return 0;
}
