// An eye camera on the kernel's USB bus: UVC 1.1, 8-bit grey or motion JPEG, bulk streaming, made by vhci_hcd; the kernel's own uvcvideo
// binds to it. It shows rendered eyes that look where a recording looks, --pictures of them in turn.
//   --targets FILE     eyes that look at nine targets instead, 18 pictures each, then at the last; FILE gets when each was
//                      shown: start_ns,end_ns (monotonic clock),x,y,z
//   --mounted askew    the camera is not where the driver takes it to be: shifted, closer, rolled by 5 degrees
//   --silent-after N   stays plugged in and shows nothing more after N pictures
//   --readout PERCENT  of the time from one picture to the next goes by from a picture's first payload to its last, as the
//                      lines of a sensor are read out and sent one after the other; default 90. (uvcvideo stamps a
//                      picture with the arrival of the first.)
//
// Source: Universal Serial Bus Device Class Definition for Video Devices 1.1; payloads: Uncompressed,
// section 2.2; MJPEG, section 3.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include "drivers/synthetic/eye_image.hpp"
#include "protocol/sphere.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/vhci.hpp"
#include "tests/drivers/camera/jpeg_picture.hpp"

using namespace fovea;
using namespace fovea::lab;

namespace {

volatile std::sig_atomic_t stop = 0;
constexpr std::uint8_t kEndpoint = 0x81;
constexpr std::size_t kPayload = 4096;

void put16(std::vector<std::uint8_t>& b, std::size_t at, std::size_t v) {
    b[at] = static_cast<std::uint8_t>(v);
    b[at + 1] = static_cast<std::uint8_t>(v >> 8);
}
void put32(std::vector<std::uint8_t>& b, std::size_t at, std::size_t v) {
    put16(b, at, v & 0xFFFF);
    put16(b, at + 2, v >> 16);
}

UsbDescriptors camera_descriptors(std::size_t width, std::size_t height, std::size_t fps, bool jpeg) {
    UsbDescriptors d;
    d.strings = {"Fovea device lab", "Emulated eye camera", "LAB3"};
    d.device = {18, 1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x50, 0x1D, 0xE4, 0xE7, 0x00, 0x01, 1, 2, 3, 1};
    auto& c = d.configuration;
    const auto add = [&](std::initializer_list<std::uint8_t> bytes) {
        c.insert(c.end(), bytes);
        return c.size() - bytes.size();
    };
    add({9, 2, 0, 0, 2, 1, 0, 0x80, 250});
    add({8, 11, 0, 2, 0x0E, 3, 0, 2});                       // both interfaces form one video function
    add({9, 4, 0, 0, 0, 0x0E, 1, 0, 2});                     // video control
    add({13, 0x24, 1, 0x10, 1, 40, 0, 0x00, 0x6C, 0xDC, 2, 1, 1});
    add({18, 0x24, 2, 1, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0});   // camera terminal, no controls
    add({9, 0x24, 3, 2, 1, 1, 0, 1, 0});                     // output terminal
    add({9, 4, 1, 0, 1, 0x0E, 2, 0, 0});                     // video streaming
    add({14, 0x24, 1, 1, static_cast<std::uint8_t>(jpeg ? 61 : 77), 0, kEndpoint, 0, 2, 0, 0, 0, 1, 0});
    if (jpeg) add({11, 0x24, 6, 1, 1, 1, 1, 0, 0, 0, 0});
    else add({27, 0x24, 4, 1, 1, 'Y', '8', '0', '0', 0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71, 8, 1, 0, 0, 0, 0});
    const std::size_t f = add({30, 0x24, static_cast<std::uint8_t>(jpeg ? 7 : 5), 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
    put16(c, f + 5, width);
    put16(c, f + 7, height);
    put32(c, f + 9, width * height * 8 * fps);
    put32(c, f + 13, width * height * 8 * fps);
    put32(c, f + 17, width * height);
    put32(c, f + 21, 10'000'000 / fps);
    put32(c, f + 26, 10'000'000 / fps);
    add({6, 0x24, 0x0D, 1, 1, 4});
    add({7, 5, kEndpoint, 2, 0x00, 0x02, 0});
    put16(c, 2, c.size());
    return d;
}

// Where the pupil is in the picture of an eye that looks along dir.
void look_along(const Direction<HeadFrame>& dir, int side, bool askew, drivers::synthetic::EyeImageScene& scene) {
    constexpr double kRoll = 5 * 3.14159265358979 / 180;
    const double radius = (askew ? 0.38 : 0.45) * side, middle = (side - 1) / 2.0;   // 0.45: what the camera driver assumes
    const double x = -radius * dir.x, y = -radius * dir.y;
    const double turn = askew ? kRoll : 0;
    scene.pupil_x = middle + x * std::cos(turn) - y * std::sin(turn) + (askew ? 0.04 * side : 0);
    scene.pupil_y = middle + x * std::sin(turn) + y * std::cos(turn) - (askew ? 0.03 * side : 0);
}

constexpr std::size_t kPicturesPerTarget = 18;   // a fixation needs ten samples, less those that a slow reader misses

std::vector<FeedSample> nine_targets() {
    std::vector<FeedSample> all;
    for (const double up : {-9.0, 0.0, 9.0})
        for (const double right : {-14.0, 0.0, 14.0}) {
            FeedSample s;
            s.dir = from_azimuth_elevation<HeadFrame>({right * 3.14159265358979 / 180, up * 3.14159265358979 / 180});
            s.valid = true;
            all.push_back(s);
        }
    return all;
}

}  // namespace

int main(int argc, char** argv) {
    const Arguments args(argc, argv, {"--recording", "--rate", "--frames", "--cycles", "--truth", "--port", "--side", "--pictures", "--format", "--targets",
                                      "--mounted", "--silent-after", "--readout"});
    const bool jpeg = args.text("--format", "GREY") == "MJPG";
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::signal(SIGTERM, [](int) { stop = 1; });
    std::signal(SIGINT, [](int) { stop = 1; });
    const long fps = args.number("--rate", 60), frames = args.number("--frames", 0), cycles = args.number("--cycles", 1);
    const int side = static_cast<int>(args.number("--side", 192));
    const bool askew = args.text("--mounted", "straight") == "askew";
    const std::string targets_file = args.text("--targets", "");
    const auto silent_after = static_cast<unsigned long>(args.number("--silent-after", 0));
    const std::vector<FeedSample> targets = targets_file.empty() ? std::vector<FeedSample>{} : nine_targets();
    std::vector<std::pair<Instant, Instant>> when(targets.size());
    const Feed feed(args.text("--recording", "tests/data/recordings/eyelink_lookatpoint_s1.csv"), 4);
    std::vector<std::vector<std::uint8_t>> pictures;
    {
        TruthLog log(args.text("--truth", ""), static_cast<double>(fps));
        const std::size_t wanted = targets.empty() ? static_cast<std::size_t>(args.number("--pictures", 24)) : targets.size();
        for (std::uint64_t i = 0; pictures.size() < wanted; ++i) {
            const FeedSample s = targets.empty() ? feed.at(i) : targets[i];
            if (!s.valid) continue;
            drivers::synthetic::EyeImageScene scene;
            scene.width = scene.height = side;
            look_along(s.dir, side, askew, scene);
            scene.pupil_a = scene.pupil_b = 0.1 * side;
            scene.glints = 1;
            const auto pixels = drivers::synthetic::render_eye(scene);
            pictures.push_back(jpeg ? tests::as_jpeg(pixels, side, side) : pixels);
            log.add(s, MonotonicClock::now());
        }
    }
    std::printf("camera: ready\n");
    std::vector<std::uint8_t> probe(34, 0);
    probe[2] = probe[3] = 1;
    put32(probe, 4, 10'000'000 / static_cast<std::size_t>(fps));
    put32(probe, 18, static_cast<std::size_t>(side * side));
    put32(probe, 22, kPayload);
    put32(probe, 26, 48'000'000);
    unsigned long shown = 0;   // over all cycles
    for (long done = 0; done < cycles && !stop; ++done) {
        VhciDevice device(camera_descriptors(static_cast<std::size_t>(side), static_cast<std::size_t>(side), static_cast<std::size_t>(fps), jpeg),
                          static_cast<int>(args.number("--port", 0)));
        device.on_request = [&](const UsbSetup& s, std::span<const std::uint8_t>) -> std::optional<std::vector<std::uint8_t>> {
            const int selector = s.value >> 8;
            const bool streaming = (s.index & 0xFF) == 1 && (selector == 1 || selector == 2);   // probe, commit
            if (!streaming) return std::nullopt;
            if (s.type == 0x21) return std::vector<std::uint8_t>{};
            if (s.type != 0xA1) return std::nullopt;
            if (s.request == 0x85) return std::vector<std::uint8_t>{34, 0};   // GET_LEN
            if (s.request == 0x86) return std::vector<std::uint8_t>{3};       // GET_INFO
            return probe;
        };
        const Duration period{1'000'000'000 / fps};
        const Duration readout = period * std::clamp(args.number("--readout", 90), 0L, 95L) / 100;
        Instant due = MonotonicClock::now();
        std::uint8_t toggle = 0;
        for (long n = 0; !stop && (frames == 0 || n < frames);) {
            if (!device.serve(due)) break;
            if (device.waiting(kEndpoint) == 0) {
                due = MonotonicClock::now() + std::chrono::milliseconds(2);
                continue;
            }
            if (silent_after > 0 && shown >= silent_after) {
                due = MonotonicClock::now() + std::chrono::milliseconds(50);
                continue;
            }
            const std::size_t target = std::min<std::size_t>(shown / kPicturesPerTarget, pictures.size() - 1);
            const auto& picture = pictures[targets.empty() ? shown % pictures.size() : target];
            const Instant begun = MonotonicClock::now();
            for (std::size_t at = 0; at < picture.size() && !stop;) {
                while (!stop && device.waiting(kEndpoint) == 0)
                    if (!device.serve(MonotonicClock::now() + std::chrono::milliseconds(1))) break;
                if (device.waiting(kEndpoint) == 0) break;
                const std::size_t take = std::min(picture.size() - at, std::min(kPayload, device.room(kEndpoint)) - 2);
                // Sent when its last line has been read.
                const auto read_out = static_cast<double>(at + take) / static_cast<double>(picture.size()) * static_cast<double>(readout.count());
                if (!device.serve(begun + Duration{static_cast<std::int64_t>(read_out)}) || device.waiting(kEndpoint) == 0) break;
                const bool last = at + take == picture.size();
                std::vector<std::uint8_t> payload = {2, static_cast<std::uint8_t>(0x80 | toggle | (last ? 2 : 0))};
                payload.insert(payload.end(), picture.begin() + static_cast<std::ptrdiff_t>(at), picture.begin() + static_cast<std::ptrdiff_t>(at + take));
                device.complete(kEndpoint, payload);
                at += take;
            }
            toggle ^= 1;
            ++shown;
            if (!targets.empty()) {
                if (when[target].first == Instant{}) when[target].first = begun;
                when[target].second = MonotonicClock::now();
                if (shown == targets.size() * kPicturesPerTarget) std::printf("camera: all targets shown\n");
            }
            ++n;
            due += period;
            if (MonotonicClock::now() - due > std::chrono::milliseconds(300)) due = MonotonicClock::now();
        }
        if (!targets.empty()) {
            std::FILE* f = std::fopen(targets_file.c_str(), "w");
            if (f == nullptr) die("cannot write " + targets_file);
            for (std::size_t k = 0; k < targets.size(); ++k)
                if (when[k].first != Instant{})
                    std::fprintf(f, "%lld,%lld,%.17g,%.17g,%.17g\n", static_cast<long long>(to_ns(when[k].first)), static_cast<long long>(to_ns(when[k].second)),
                                 targets[k].dir.x, targets[k].dir.y, targets[k].dir.z);
            std::fclose(f);
        }
        std::printf("camera: unplugged after %lu frames\n", shown);
    }
    return 0;
}
