#include "drivers/sample/sample_packet.hpp"

#include <numbers>

#include "protocol/sphere.hpp"

namespace fovea::drivers::sample {

namespace {

std::uint32_t little(std::span<const std::uint8_t> bytes, std::size_t at, int count) noexcept {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value |= std::uint32_t{bytes[at + static_cast<std::size_t>(i)]} << (8 * i);
    return value;
}

double degrees(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
    return static_cast<std::int16_t>(little(bytes, at, 2)) / 100.0;
}

}  // namespace

std::optional<Packet> decode(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() != kPacketBytes || bytes[0] != 'F' || bytes[1] != 'S') return std::nullopt;
    constexpr double kRadians = std::numbers::pi / 180;
    Packet p;
    p.counter = static_cast<std::uint16_t>(little(bytes, 2, 2));
    p.time_ticks = little(bytes, 4, 4);
    const double x = degrees(bytes, 8), y = degrees(bytes, 10);
    // What the device claims is checked before it is believed: 90 degrees and more is no gaze at a screen.
    p.gaze.valid = (bytes[12] & 1) != 0 && x > -90 && x < 90 && y > -90 && y < 90;
    if (p.gaze.valid) p.gaze.gaze_dir_head = from_azimuth_elevation<HeadFrame>({x * kRadians, y * kRadians});
    p.gaze.openness = (bytes[12] & 2) != 0 ? 1 : 0;
    if (bytes[13] != 0) p.gaze.pupil_mm = bytes[13] / 20.0;
    return p;
}

DeviceTime TickClock::extend(std::uint32_t ticks) noexcept {
    // The difference modulo 2^32, read as signed, is right over a wrap and for a packet out of order.
    total_ = started_ ? total_ + static_cast<std::int32_t>(ticks - last_) : ticks;
    started_ = true;
    last_ = ticks;
    return DeviceTime{total_ * 100'000};
}

}  // namespace fovea::drivers::sample
