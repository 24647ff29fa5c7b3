// When a real display will show a frame, from when it has shown the last ones.
//
//   done          done + lead           start = first scan-out of the display's grid that begins at or after done + lead
//    |----- lead ----->|.....|===        lead  = the least time seen between done and start: what the window system needs
//
// Where the instants told lie on no grid (a compositor without a display), a frame is taken to need as long as the last
// ones did in the median.
// Threads: plain objects, one thread at a time. noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>

#include "protocol/clock.hpp"

namespace fovea::present {

class VblankClock {
public:
    // period: between two scan-outs, > 0.
    explicit VblankClock(Duration period) noexcept : period_(period) {}
    void set_period(Duration period) noexcept;   // ignored unless it is between 1/1000 s and 1 s
    [[nodiscard]] Duration period() const noexcept { return period_; }

    // The scan-out that shows a frame done at `done` began at `start`. on_grid: by the display's own clock.
    void observe(Instant done, Instant start, bool on_grid) noexcept;
    // The start of the scan-out that will show a frame done at this instant. Never before it.
    [[nodiscard]] Instant predict(Instant done) const noexcept;
    // No sense in beginning a frame of this cost earlier: it would only wait. Long past where nothing is known.
    [[nodiscard]] Instant begin_no_sooner(Duration cost) const noexcept;

private:
    static constexpr std::size_t kKept = 9;
    [[nodiscard]] Duration lead() const noexcept;     // of what is kept: the least
    [[nodiscard]] Duration median() const noexcept;
    Duration period_;
    std::array<Duration, kKept> kept_{};   // start - done
    std::size_t seen_ = 0;
    Instant last_start_{};
    bool on_grid_ = false;
};

}  // namespace fovea::present
