// PlayStation VR2 over USB: the gaze stream of interface 5.
//
// The headset streams only while it is told to: the enable request goes out at once, every 500 ms until the first
// packet arrives, and every second from then on (the headset stops by itself when the requests stop).
//
//   closed -> open() -> asking --first packet--> streaming -> (unplugged | silent | faults) -> lost
//
// Source: PSVR2Toolkit 9e24e6ef for requests and packets. Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers::usb {

[[nodiscard]] Result<std::unique_ptr<Device>> create_psvr2(const DeviceSettings& settings, const TimeSource& time);
[[nodiscard]] std::vector<DeviceKey> psvr2_keys();
[[nodiscard]] std::vector<FoundDevice> list_psvr2(bool with_details);

}  // namespace fovea::drivers::usb
