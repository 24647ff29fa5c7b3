// Any USB transfers, whole, torn, overlong or none of ours: joined and decoded.
//
// Input: transfers, each two bytes of length and so many bytes.
#include <cmath>

#include "drivers/sample/sample_packet.hpp"
#include "drivers/usb/psvr2_packet.hpp"
#include "protocol/sphere.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fovea;
    fuzz::Input in(data, size);
    drivers::usb::PacketJoiner joiner;
    drivers::sample::TickClock ticks;
    const auto check = [](const EyeState& e) {
        if (e.valid) FOVEA_FUZZ_CHECK(std::fabs(length(e.gaze_dir_head.vec()) - 1) < 1e-6);
    };
    while (!in.rest().empty()) {
        const auto transfer = in.take_bytes(in.take<std::uint16_t>() & 0x3FF);
        if (const auto packet = joiner.take(transfer); !packet.empty()) {
            FOVEA_FUZZ_CHECK(packet.size() == drivers::usb::kPsvr2PacketBytes || packet[1] != 'S');
            GazeSample s;
            std::uint32_t frame = 0;
            (void)drivers::usb::decode_psvr2(packet, s, frame);
            for (const EyeState& e : s.eyes) check(e);
        }
        if (const auto packet = drivers::sample::decode(transfer)) {
            check(packet->gaze);
            (void)ticks.extend(packet->time_ticks);
        }
    }
    return 0;
}
