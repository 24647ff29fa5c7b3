// SAMPLE: the packets of a made-up USB eye tracker, decoded. Copy this folder to start a driver of your own
// (docs/writing_a_driver.md); wire decoding stays in this file, device life in the other one.
//
// Packet, 20 bytes, little-endian:
//   0  'F' 'S'              magic
//   2  u16 counter          counts up by one per packet
//   4  u32 time             100 microseconds each, wraps
//   8  i16 x, i16 y         gaze, 1/100 degree; +x right, +y up
//  12  u8 flags             bit 0: gaze is valid, bit 1: the eye is open
//  13  u8 pupil             diameter, 1/20 mm; 0: not measured
//  14  6 bytes reserved
//
// Threads: pure; noexcept, no allocation.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "protocol/gaze_sample.hpp"

namespace fovea::drivers::sample {

inline constexpr std::size_t kPacketBytes = 20;

struct Packet {
    std::uint16_t counter = 0;
    std::uint32_t time_ticks = 0;   // 100 microseconds each
    EyeState gaze;
};

// Nothing for what is no packet: another magic or another length.
[[nodiscard]] std::optional<Packet> decode(std::span<const std::uint8_t> bytes) noexcept;

// Turns the 32-bit tick counter into a device time that goes on over wraps.
class TickClock {
public:
    [[nodiscard]] DeviceTime extend(std::uint32_t ticks) noexcept;
    void reset() noexcept { started_ = false; }

private:
    bool started_ = false;
    std::uint32_t last_ = 0;
    std::int64_t total_ = 0;
};

}  // namespace fovea::drivers::sample
