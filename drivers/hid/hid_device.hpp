// Any eye tracker of HID usage page 0x12 behind the kernel's hidraw, through hidapi.
//
// States: closed -> open() -> streaming -> (unplugged | silent) -> lost; open() looks for the device again.
// hidapi finds the trackers and speaks their feature reports; the stream of reports is report_stream.hpp.
// Cost: one read per report; sleeps in the kernel until a report, the deadline or wake() comes.
// Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers::hid {

[[nodiscard]] Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time);
[[nodiscard]] std::vector<DeviceKey> keys();
[[nodiscard]] std::vector<FoundDevice> list(bool with_details);

}  // namespace fovea::drivers::hid
