// What an eye tracker delivers: one sample, its instants, and which eye said what.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "protocol/clock.hpp"
#include "protocol/frames.hpp"

namespace fovea {

// Index into GazeSample::eyes and MotionModel::eyes. `combined` is the cyclopean gaze.
enum class Eye : std::uint8_t { combined = 0, left = 1, right = 2 };
inline constexpr std::size_t kEyeCount = 3;

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();  // a value the device did not give

struct EyeState {
    bool valid = false;             // the device vouches for gaze_dir_head
    Direction<HeadFrame> gaze_dir_head;
    double openness = kUnknown;     // 0 closed to 1 open
    double pupil_mm = kUnknown;     // diameter
    double confidence = kUnknown;   // 0 to 1
};

struct HeadPose {
    bool valid = false;
    Rotation<WorldFrame, HeadFrame> world_from_head;
};

// Instants: `exposed` is the exposure midpoint and stays with the sample for life; `received` is when the first byte
// reached this process. An estimated exposure (no device clock) stays marked for ever.
struct GazeSample {
    std::uint64_t id = 0;           // 1, 2, 3 ... per opened source; 0 is no sample
    DeviceTime device_time;
    Instant exposed;
    Instant received;
    bool exposed_estimated = false;
    std::array<EyeState, kEyeCount> eyes;  // by Eye
    HeadPose head;

    [[nodiscard]] const EyeState& eye(Eye e) const noexcept { return eyes[static_cast<std::size_t>(e)]; }
    [[nodiscard]] EyeState& eye(Eye e) noexcept { return eyes[static_cast<std::size_t>(e)]; }
};

// What the eye is doing. The numbers are part of the shared-memory ABI and of the session file.
enum class GazeEvent : std::uint8_t { lost = 0, blink = 1, fixation = 2, pursuit = 3, saccade = 4 };
[[nodiscard]] const char* to_string(GazeEvent e) noexcept;

}  // namespace fovea
