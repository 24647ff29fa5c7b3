// Gives a sample its exposure time: from the device's clock where there is one, else from its arrival, marked.
//
// Threads: one at a time; noexcept, no allocation.
#pragma once

#include "drivers/clock_sync.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::drivers {

class ExposureClock {
public:
    // `min_delay`: the least time from exposure to arrival, where the device's maker or a measurement tells it.
    explicit ExposureClock(Duration min_delay = {}) noexcept : sync_{min_delay} {}

    // `out.received` is set, and `out.device_time` when `has_device_time`. Sets `exposed` and its mark: estimated
    // without a device clock, and for the first second with one, until the transport's least delay is known.
    void stamp(GazeSample& out, bool has_device_time) noexcept {
        if (!has_device_time) {
            out.device_time = {};
            out.exposed = out.received;
            out.exposed_estimated = true;
            return;
        }
        const ClockSync::Mapped mapped = sync_.update(out.device_time, out.received);
        out.exposed = mapped.exposed;
        out.exposed_estimated = !mapped.settled;
    }
    // For a device that was opened anew.
    void reset() noexcept { sync_.reset(); }

private:
    ClockSync sync_;
};

}  // namespace fovea::drivers
