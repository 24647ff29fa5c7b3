// When a frame's light reaches the eye: a simulated display that scans out at a fixed rate, and the estimate of how long
// the next frame will take.
//
//   scan-out k            k+1                 k+2             photon of a frame = middle of the scan-out that shows it
//   |=====photon====|.....|=====photon====|...|=====          = first start after the GPU was done, one frame each
//        gpu_done ^ shown here ^
//
// There is no display here: every photon instant that comes from this clock is to be marked simulated wherever it is shown.
// Threads: plain objects, one thread at a time. noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::present {

struct ScanoutSettings {
    double refresh_hz = 90;    // 1 to 1000
    double scanout_ms = 8;     // time the display takes to emit one frame; > 0, at most one refresh period
};

class SimulatedScanout {
public:
    // epoch: the start of some scan-out. Errors: settings out of range.
    [[nodiscard]] static Result<SimulatedScanout> create(const ScanoutSettings& settings, Instant epoch);

    struct Shown {
        Instant start;    // of the scan-out
        Instant photon;   // its middle
    };
    // What would show a frame that is done at this instant. An instant long past is answered for the next free scan-out.
    [[nodiscard]] Shown predict(Instant gpu_done) const noexcept;
    // Shows it: each scan-out shows at most one frame.
    Shown present(Instant gpu_done) noexcept;
    // No sense in beginning a frame of this cost earlier: it would only wait. The least latency for one frame per refresh.
    [[nodiscard]] Instant begin_no_sooner(Duration cost) const noexcept;
    [[nodiscard]] Duration period() const noexcept { return period_; }

private:
    SimulatedScanout(Duration period, Duration scanout, Instant epoch) noexcept : period_(period), scanout_(scanout), epoch_(epoch) {}
    Duration period_, scanout_;
    Instant epoch_;
    Instant last_start_{};      // of the last frame shown
    bool shown_any_ = false;
};

// The median of the last durations: one slow frame does not move it.
class RecentCost {
public:
    explicit RecentCost(Duration first_guess) noexcept;
    void add(Duration cost) noexcept;
    [[nodiscard]] Duration median() const noexcept;

private:
    static constexpr std::size_t kKept = 9;
    std::array<Duration, kKept> kept_;
    std::size_t next_ = 0;
};

}  // namespace fovea::present
