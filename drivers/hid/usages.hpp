// The usages of HID page 0x12, "Eye and Head Trackers", by number and in words.
//
// Source: HID Usage Tables 1.x, section 17 (review request HUTRR74).
// Threads: constants.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/hid/report_descriptor.hpp"

namespace fovea::drivers::hid {

inline constexpr std::uint16_t kEyeTrackerPage = 0x12;

// Ids on kEyeTrackerPage.
namespace usage {
inline constexpr std::uint16_t kEyeTracker = 0x01, kHeadTracker = 0x02;
inline constexpr std::uint16_t kTrackingData = 0x10, kCapabilities = 0x11, kConfiguration = 0x12, kStatus = 0x13,
                               kControl = 0x14;
inline constexpr std::uint16_t kSensorTimestamp = 0x20, kPositionX = 0x21, kPositionY = 0x22, kPositionZ = 0x23;
inline constexpr std::uint16_t kGazePoint = 0x24, kLeftEyePosition = 0x25, kRightEyePosition = 0x26,
                               kHeadPosition = 0x27, kHeadDirection = 0x28;
inline constexpr std::uint16_t kRotationX = 0x29, kRotationY = 0x2A, kRotationZ = 0x2B;
inline constexpr std::uint16_t kTrackerQuality = 0x100, kMinDistance = 0x101, kOptimumDistance = 0x102,
                               kMaxDistance = 0x103, kMaxScreenWidth = 0x104, kMaxScreenHeight = 0x105;
inline constexpr std::uint16_t kDisplayManufacturer = 0x200, kDisplayProduct = 0x201, kDisplaySerial = 0x202,
                               kDisplayDate = 0x203, kScreenWidth = 0x204, kScreenHeight = 0x205;
inline constexpr std::uint16_t kSamplingFrequency = 0x300, kConfigurationStatus = 0x301;
inline constexpr std::uint16_t kModeRequest = 0x400;
}  // namespace usage

// "Gaze Point", or "usage 0x0012:0x0042" for what this table does not name.
[[nodiscard]] std::string usage_name(Usage usage);

}  // namespace fovea::drivers::hid
