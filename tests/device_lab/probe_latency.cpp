// How long after the kernel had it: a bare read loop on a camera, and what a daemon has published of a device whose stamps
// are on the monotonic clock.
#include <cstdio>
#include <map>
#include <poll.h>

#include "drivers/camera/pupil_detector.hpp"
#include "drivers/camera/v4l2_stream.hpp"
#include "replay/session_file.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/probe.hpp"

namespace fovea::lab {

// With --detect PRESET the pupil is looked for, as the camera driver does: what no reader of pupils can do without.
int floor_camera(const std::string& node, int argc, char** argv) {
    const Arguments args(argc, argv, {"--count", "--detect"});
    const std::string preset = args.text("--detect", "");
    const bool detect = !preset.empty();
    drivers::camera::V4l2Stream stream;
    drivers::camera::StreamSettings settings;
    settings.path = node;
    settings.format = "GREY";
    if (auto opened = stream.open(settings); !opened) die(opened.error().message());
    drivers::camera::PupilDetector detector{drivers::camera::PupilSettings{.preset = drivers::camera::preset_from(preset)}};
    std::vector<double> us;
    const Instant end = MonotonicClock::now() + std::chrono::seconds(60);
    for (long n = args.number("--count", 50); n > 0 && MonotonicClock::now() < end;) {
        pollfd p{stream.fd(), POLLIN, 0};
        ::poll(&p, 1, 1000);
        drivers::camera::Frame frame;
        if (stream.next(frame, MonotonicClock::now()) != drivers::camera::FrameEvent::frame) continue;
        if (detect) static_cast<void>(detector.detect({frame.bytes.data(), stream.width(), stream.height(), static_cast<std::ptrdiff_t>(stream.stride())}));
        us.push_back(static_cast<double>((MonotonicClock::now() - frame.captured).count()) * 1e-3);
        --n;
    }
    if (us.size() > 4) us.erase(us.begin(), us.begin() + 4);   // the first pictures waited while the camera was opened
    print_latencies("floor-camera", std::move(us));
    return 0;
}

int published(const std::string& session_file, int argc, char** argv) {
    const Arguments args(argc, argv, {"--skip"});
    const auto reader = replay::SessionReader::open(session_file);
    if (!reader) die(reader.error().message());
    std::map<std::uint64_t, std::int64_t> stamps;
    if (auto r = reader->samples([&](const replay::RecordedSample& s) { stamps[s.sample.id] = s.sample.device_time.ns; return true; }); !r)
        die(r.error().message());
    std::vector<double> us;
    long skip = args.number("--skip", 100);   // the first waited while the device was opened
    auto r = reader->models([&](const MotionModel& m) {
        if (const auto s = stamps.find(m.sample_id); s != stamps.end() && skip-- <= 0) us.push_back(static_cast<double>(to_ns(m.published) - s->second) * 1e-3);
        return true;
    });
    if (!r) die(r.error().message());
    print_latencies("published", std::move(us));
    return 0;
}

}  // namespace fovea::lab
