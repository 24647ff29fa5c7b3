// What the tracker makes of the eye, one class per effect: each is a function of time or of the sample's number, and of
// its own random stream alone.
//
// Times: nanoseconds since the scenario's start, never falling; indices: the sample's number from 0, never falling.
// Sources: docs/synthetic_eye.md. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/synthetic/eye_movements.hpp"

namespace fovea::drivers::synthetic {

class BlinkTrain {
public:
    BlinkTrain(const Blinks& settings, RandomStream random) noexcept;
    [[nodiscard]] double openness(std::int64_t t_ns) noexcept;  // 0 closed to 1 open
    [[nodiscard]] bool running(std::int64_t t_ns) noexcept;     // from the lid's first movement to its last

private:
    void advance(std::int64_t t_ns) noexcept;
    void plan() noexcept;
    Blinks s_;
    RandomStream random_;
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, end_ns_ = 0;
};

class SlipTrain {
public:
    SlipTrain(const Slip& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) noexcept;

private:
    [[nodiscard]] std::int64_t pause_ns(std::uint64_t index) const noexcept;
    Slip s_;
    RandomStream random_;
    Offset creep_deg_s_, from_, to_;
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, next_ns_ = 0;
};

// Gaussian with a spectrum of 1/f^colour from half the rate down to rate/256; its deviation is exact for every colour.
// Source: Kasdin, Proc. IEEE 83(5), 1995: fractional differencing, as a filter of finite length, so that it is stationary.
class ColouredNoise {
public:
    static constexpr std::size_t kTaps = 256;

    ColouredNoise(const Noise& settings, RandomStream random, std::uint32_t lane) noexcept;
    [[nodiscard]] Offset at(std::uint64_t index) noexcept;
    // What the filter's own numbers say: root mean square from sample to sample over the deviation.
    [[nodiscard]] double step_ratio() const noexcept;

private:
    void push(std::uint64_t source) noexcept;
    double std_deg_;
    RandomStream random_;
    std::uint32_t lane_;
    bool white_;
    std::array<double, kTaps> taps_{};
    std::array<Offset, kTaps> drawn_{};  // by source index modulo kTaps
    std::uint64_t next_ = 0;             // source index; sample i uses i + kTaps - 1 and those before
};

[[nodiscard]] Offset quantised(const Quantisation& s, Offset o) noexcept;
[[nodiscard]] Offset miscalibrated(const Miscalibration& s, Offset o) noexcept;

// Exposure of a sample against its even time; pure, any order.
[[nodiscard]] std::int64_t jitter_ns(const RateJitter& s, const RandomStream& random, std::uint64_t index, double interval_ns) noexcept;
[[nodiscard]] std::int64_t latency_ns(const Latency& s, const RandomStream& random, std::uint64_t index) noexcept;

class DropOutTrain {
public:
    enum class State : std::uint8_t { none, invalid, missing };
    DropOutTrain(const DropOuts& settings, RandomStream random) noexcept;
    [[nodiscard]] State at(std::int64_t t_ns) noexcept;

private:
    void plan() noexcept;
    DropOuts s_;
    RandomStream random_;
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, end_ns_ = 0;
    State kind_ = State::invalid;
};

}  // namespace fovea::drivers::synthetic
