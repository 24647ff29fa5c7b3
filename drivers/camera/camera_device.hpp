// An eye camera, or two, behind V4L2: frames in, pupils found, gaze out.
//
// `exposed` is the driver's timestamp (of the clock that this project uses) moved back by half of the exposure time
// where that is set by hand; a driver without such a stamp leaves the arrival, marked as estimated.
// An eye whose pupil is not found is not valid; its openness is 0 only when nothing dark is found in 3 frames in a row.
// Cost: one detection per frame (docs/pupil_detection.md). Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/camera/v4l2_calls.hpp"
#include "drivers/device.hpp"

namespace fovea::drivers::camera {

[[nodiscard]] Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time);
// The same on another table of calls (v4l2_calls.hpp), which must outlive the device.
[[nodiscard]] Result<std::unique_ptr<Device>> create_on(V4l2Calls& calls, const DeviceSettings& settings, const TimeSource& time);
[[nodiscard]] std::vector<DeviceKey> keys();
[[nodiscard]] std::vector<FoundDevice> list(bool with_details);

}  // namespace fovea::drivers::camera
