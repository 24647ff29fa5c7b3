// Any descriptor, then any feature and input reports: what comes out as gaze is a direction, whatever the device says.
//
// Input: two bytes n, n bytes of descriptor, then reports: a length byte, an id or payload of that length.
#include <cmath>

#include "drivers/hid/eye_tracker.hpp"
#include "protocol/sphere.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fovea;
    using namespace fovea::drivers::hid;
    fuzz::Input in(data, size);
    const auto descriptor = in.take_bytes(in.take<std::uint16_t>());
    auto tracker = EyeTracker::create(descriptor, {}, {0.5, 0.3, 0.6});
    if (!tracker) return 0;
    (void)tracker->check_geometry();
    FOVEA_FUZZ_CHECK(tracker->mode_request().size() <= kMaxReportBits / 8 + 2);
    GazeSample s;
    for (int i = 0; i < 64 && !in.rest().empty(); ++i) {
        const auto head = in.take<std::uint8_t>();
        const auto report = in.take_bytes(head & 0x7F);
        if ((head & 0x80) != 0) tracker->take_feature(report);
        bool has_time = false;
        if (tracker->decode(report, s, has_time) != Decoded::sample) continue;
        for (const EyeState& e : s.eyes)
            if (e.valid) FOVEA_FUZZ_CHECK(std::fabs(fovea::length(e.gaze_dir_head.vec()) - 1) < 1e-9);
    }
    return 0;
}
