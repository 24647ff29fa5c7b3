// When a tracker's next sample is due, from the arrivals so far.
//
// Arrivals come on a grid, each late by what the bus and the machine add. The grid's phase follows an early arrival at
// once and a late one slowly, its step the mean of the gaps. Nothing is foretold until kRegular arrivals in a row came
// within a quarter of the step, nor for gaps outside [kShortest, kLongest].
//
// Input: arrival times in their order. Cost: a few ns. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <optional>

#include "protocol/clock.hpp"

namespace fovea::service {

class Cadence {
public:
    static constexpr int kRegular = 8;
    static constexpr Duration kShortest = std::chrono::microseconds(1500);   // closer together, nothing cools down between
    static constexpr Duration kLongest = std::chrono::milliseconds(50);      // further apart, none of this matters

    void arrived(Instant received) noexcept;
    void reset() noexcept { *this = {}; }
    [[nodiscard]] std::optional<Instant> due() const noexcept;
    [[nodiscard]] Duration gap() const noexcept { return gap_; }   // while something is due; > 0

private:
    bool any_ = false;
    Instant last_, on_grid_;   // the newest arrival, as it was and as it should have been
    Duration gap_{};
    int regular_ = 0;
};

}  // namespace fovea::service
