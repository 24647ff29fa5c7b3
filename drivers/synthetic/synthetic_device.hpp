// Driver `synthetic`: a synthetic eye in front of a synthetic tracker, in real time.
//
// The key `path` names a scenario (configs/scenarios; docs/synthetic_eye.md). Exposures are on CLOCK_MONOTONIC, exact; the first
// sample is exposed at the first poll(). It is due when it arrives: exposure and the scenario's latency.
// Threads, errors: as drivers/device.hpp; those of load_scenario.
#pragma once

#include "drivers/device.hpp"
#include "drivers/synthetic/scenario.hpp"

namespace fovea::drivers::synthetic {

[[nodiscard]] Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time);
[[nodiscard]] std::vector<DeviceKey> keys();

// The same for a scenario that is in memory. `time` must outlive it.
[[nodiscard]] std::unique_ptr<Device> make_device(const Scenario& scenario, std::string location, bool in_real_time, const TimeSource& time);

}  // namespace fovea::drivers::synthetic
