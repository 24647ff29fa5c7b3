// Several trackers as one: the best that works, the next best when it is lost, and back again once it has proved itself.
//
//   devices in order of preference          active: the first that opens
//   active lost            -> the next that opens, at once; `lost` only when none does
//   a better one is back   -> opened every `retry`, watched beside the active one; when it has delivered valid samples
//                             without a break for `return_after`, it takes over (hysteresis: a loose plug does not
//                             toss the gaze back and forth)
//
// Sample ids go on over a change of device. Cost: that of the active device; while a better one is missing, one failed
// open() per `retry`, on the polling thread.
// Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers {

struct PrioritySettings {
    Duration retry = std::chrono::seconds(2);
    Duration return_after = std::chrono::seconds(1);
};

[[nodiscard]] std::unique_ptr<Device> make_priority_device(std::vector<std::unique_ptr<Device>> devices,
                                                           const PrioritySettings& settings, const TimeSource& time);

// The row "auto": the drivers of `rows` that its key `order` names. Keys of theirs are written DRIVER_KEY.
[[nodiscard]] DeviceRow priority_row(std::vector<DeviceRow> rows);

}  // namespace fovea::drivers
