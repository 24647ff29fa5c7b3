// Several trackers as one: the best that works, the next best when it is lost, and back again once it has proved itself.
//
//   devices in order of preference          active: the first that opens
//   active lost            -> the next that opens, at once; `lost` only when none does
//   a better one is back   -> opened every `retry`, watched beside the active one; when it has delivered valid samples
//                             without a break for `return_after`, it takes over (hysteresis: a loose plug does not
//                             toss the gaze back and forth)
//
// Sample ids go on over a change of device. Devices are opened and closed by a thread of the driver's own, so that a
// bus that takes its time holds up no gaze; open() and close() themselves wait for it.
//
//   closed -> wanted -> open          who moves: the poller to `wanted` and `unwanted`, the thread onward from there;
//     ^         |         |           each touches a device only in its own states
//     +- failed-+ unwanted+
//
// Cost: that of the active device, and a look at a better one every 4 ms while it proves itself.
// Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers {

struct PrioritySettings {
    Duration retry = std::chrono::seconds(2);
    Duration return_after = std::chrono::seconds(1);
    bool own_thread = true;   // false: devices are opened where they are polled; for tests with a clock of their own
};

[[nodiscard]] std::unique_ptr<Device> make_priority_device(std::vector<std::unique_ptr<Device>> devices,
                                                           const PrioritySettings& settings, const TimeSource& time);

// The row "auto": the drivers of `rows` that its key `order` names. Keys of theirs are written DRIVER_KEY.
[[nodiscard]] DeviceRow priority_row(std::vector<DeviceRow> rows);

}  // namespace fovea::drivers
