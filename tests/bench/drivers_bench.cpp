// What the drivers cost per report, packet and frame.
#include <benchmark/benchmark.h>

#include "drivers/camera/pupil_detector.hpp"
#include "drivers/hid/eye_tracker.hpp"
#include "drivers/synthetic/eye_image.hpp"
#include "drivers/usb/psvr2_packet.hpp"
#include "protocol/sphere.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"
#include "tests/drivers/usb/psvr2_encode.hpp"

namespace {

using namespace fovea;

void hid_decode(benchmark::State& state, const char* name) {
    const tests::Shape& shape = tests::shape(name);
    const auto descriptor = drivers::hid::parse_report_descriptor(shape.descriptor).value();
    auto tracker = drivers::hid::EyeTracker::create(shape.descriptor, {}, {tests::kScreenWidth, tests::kScreenHeight, 0.6}).value();
    tests::Truth t;
    t.gaze_x = 0.3, t.gaze_y = 0.1;
    t.left[0] = 0.22, t.left[1] = 0.15, t.left[2] = 0.6;
    t.right[0] = 0.28, t.right[1] = 0.15, t.right[2] = 0.6;
    const auto report = tests::encode_tracking(descriptor, t);
    GazeSample s;
    bool has_time = false;
    for (auto _ : state) {
        benchmark::DoNotOptimize(tracker.decode(report, s, has_time));
        benchmark::ClobberMemory();
    }
}
void BM_HidDecodeClassic(benchmark::State& state) { hid_decode(state, "classic"); }
void BM_HidDecodePacked(benchmark::State& state) { hid_decode(state, "packed"); }
BENCHMARK(BM_HidDecodeClassic);
BENCHMARK(BM_HidDecodePacked);

void BM_HidParseDescriptor(benchmark::State& state) {
    const auto& bytes = tests::shape("classic").descriptor;
    for (auto _ : state) benchmark::DoNotOptimize(drivers::hid::parse_report_descriptor(bytes));
}
BENCHMARK(BM_HidParseDescriptor);

void BM_Psvr2Decode(benchmark::State& state) {
    tests::Psvr2Truth t;
    t.left = t.right = t.combined = from_azimuth_elevation<HeadFrame>({0.2, 0.1});
    const auto packet = tests::encode_psvr2(t);
    GazeSample s;
    std::uint32_t frame = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(drivers::usb::decode_psvr2(packet, s, frame));
        benchmark::ClobberMemory();
    }
}
BENCHMARK(BM_Psvr2Decode);

// Argument: picture side. Error and rate against time for all presets: fovea tradeoff pupil.
void BM_PupilBalanced(benchmark::State& state) {
    drivers::synthetic::EyeImageScene scene;
    scene.width = scene.height = static_cast<int>(state.range(0));
    scene.pupil_x = scene.pupil_y = 0.5 * scene.width + 3.3;
    scene.pupil_a = scene.pupil_b = 0.1 * scene.width;
    scene.glints = 2;
    scene.noise = 4;
    const auto pixels = drivers::synthetic::render_eye(scene);
    drivers::camera::PupilDetector detector({});
    for (auto _ : state) benchmark::DoNotOptimize(detector.detect({pixels.data(), scene.width, scene.height, scene.width}));
}
BENCHMARK(BM_PupilBalanced)->Arg(192)->Arg(400)->Unit(benchmark::kMicrosecond);

}  // namespace
