// Gaze packets as the PlayStation VR2 sends them, for the unit tests and the device lab's emulated headset.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

#include "drivers/usb/psvr2_packet.hpp"

namespace fovea::tests {

struct Psvr2Truth {
    std::int64_t timestamp_us = 0;
    std::uint32_t frame = 0;
    bool valid = true;
    bool blink = false;
    Direction<HeadFrame> left, right, combined;
    float pupil_mm = 3.5f;
};

inline std::array<std::uint8_t, drivers::usb::kPsvr2PacketBytes> encode_psvr2(const Psvr2Truth& t) {
    namespace p = drivers::usb::psvr2;
    std::array<std::uint8_t, drivers::usb::kPsvr2PacketBytes> b{};
    const auto put = [&](std::size_t at, auto value) { std::memcpy(b.data() + at, &value, sizeof value); };
    const auto direction = [&](std::size_t valid_at, std::size_t at, const Direction<HeadFrame>& d) {
        put(valid_at, std::uint32_t{t.valid});
        put(at, static_cast<float>(-d.x));
        put(at + 4, static_cast<float>(d.y));
        put(at + 8, static_cast<float>(-d.z));
    };
    b[0] = 'G';
    b[1] = 'S';
    put(p::kVersion, std::uint16_t{1});
    put(p::kSize, std::uint32_t{328});
    put(p::kTimestamp, t.timestamp_us);
    put(p::kFrame, t.frame);
    for (const auto& [at, dir] : {std::pair{p::kLeftEye, t.left}, {p::kRightEye, t.right}}) {
        direction(at + p::kDirValid, at + p::kDir, dir);
        put(at + p::kPupilValid, std::uint32_t{t.valid});
        put(at + p::kPupilMm, t.pupil_mm);
        put(at + p::kBlinkValid, std::uint32_t{1});
        put(at + p::kBlink, std::uint32_t{t.blink});
    }
    direction(p::kCombinedDirValid, p::kCombinedDir, t.combined);
    return b;
}

}  // namespace fovea::tests
