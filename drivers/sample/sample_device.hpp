// SAMPLE: a driver to copy. It speaks to a made-up USB eye tracker (1d50:e7e3, interface 0) and works: the device lab
// plugs one in. docs/writing_a_driver.md goes through it line by line.
//
// Threads, errors: as drivers/device.hpp.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers::sample {

[[nodiscard]] Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time);
[[nodiscard]] std::vector<DeviceKey> keys();
[[nodiscard]] std::vector<FoundDevice> list(bool with_details);

}  // namespace fovea::drivers::sample
