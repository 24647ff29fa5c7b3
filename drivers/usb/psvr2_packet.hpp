// PlayStation VR2: the gaze packets of USB interface 5, decoded. No device is touched here.
//
// Source: layout and axes as found by BnuuySolutions/PSVR2Toolkit 9e24e6ef (include/hmd2_gaze.h); see
// docs/writing_a_driver.md for the table. All little-endian; a boolean takes 32 bits.
// Units: the device's microseconds, millimetres, unit vectors with +x to the wearer's left, +y up, +z forward.
// Threads: pure, or one at a time (PacketJoiner); noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/gaze_sample.hpp"

namespace fovea::drivers::usb {

inline constexpr std::size_t kPsvr2PacketBytes = 328;
inline constexpr std::uint16_t kPsvr2Vendor = 0x054C, kPsvr2Product = 0x0CDE;
inline constexpr std::uint8_t kPsvr2Interface = 5, kPsvr2Endpoint = 0x85;

// Where in the packet what stands; bytes from its start.
namespace psvr2 {
inline constexpr std::size_t kMagic = 0, kVersion = 2, kSize = 4, kTimestamp = 80, kFrame = 88, kLeftEye = 92,
                             kRightEye = 164, kCombinedOriginValid = 236, kCombinedDirValid = 252, kCombinedDir = 256;
// Within an eye.
inline constexpr std::size_t kDirValid = 16, kDir = 20, kPupilValid = 32, kPupilMm = 36, kBlinkValid = 64, kBlink = 68;
}  // namespace psvr2

enum class Psvr2Packet : std::uint8_t {
    gaze,        // `out` holds a sample
    other,       // calibration or raw data: well formed, no gaze
    malformed,
};

// Fills gaze, openness, pupil and device_time of `out`; id, exposed and received are the caller's. `frame` counts up by
// one per packet: gaps are packets lost on the way.
[[nodiscard]] Psvr2Packet decode_psvr2(std::span<const std::uint8_t> packet, GazeSample& out,
                                       std::uint32_t& frame) noexcept;

// Puts packets together that the bus delivered in pieces. A piece that starts with the magic starts a packet.
class PacketJoiner {
public:
    // Takes one transfer's bytes; returns the packet that is now whole (valid until the next call), or nothing.
    // A packet that another one cuts off, and bytes that belong to none, count as malformed.
    [[nodiscard]] std::span<const std::uint8_t> take(std::span<const std::uint8_t> transfer) noexcept;
    [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
    void reset() noexcept { size_ = 0; }

private:
    std::array<std::uint8_t, kPsvr2PacketBytes> bytes_{};
    std::size_t size_ = 0;
    std::uint64_t malformed_ = 0;
};

}  // namespace fovea::drivers::usb
