// Whether the machine has been asleep (suspended): by how much CLOCK_BOOTTIME, which goes on through that, has gained on
// CLOCK_MONOTONIC, which stands still. To the project's one clock a night of sleep is no time at all, so gaze from before it
// would count as milliseconds old.
//
// Source: clock_getres(2), Linux. Cost: three clock readings, about 70 ns. Threads: one at a time. noexcept, no allocation.
#pragma once

#include "protocol/clock.hpp"

namespace fovea::service {

// Since boot; exact to half a millisecond, better when nobody interrupts.
[[nodiscard]] Duration time_asleep() noexcept;
using AsleepClock = Duration (*)() noexcept;

class SleepWatch {
public:
    // A machine that goes to sleep and wakes up again needs more; two readings of the clocks differ by less.
    static constexpr Duration kShortest = std::chrono::milliseconds(20);

    explicit SleepWatch(AsleepClock clock) noexcept : clock_{clock}, known_{clock()} {}
    // True once after each sleep since the last call.
    [[nodiscard]] bool slept() noexcept {
        const Duration now = clock_();
        if (now - known_ < kShortest) return false;
        known_ = now;
        return true;
    }

private:
    AsleepClock clock_;
    Duration known_;
};

}  // namespace fovea::service
