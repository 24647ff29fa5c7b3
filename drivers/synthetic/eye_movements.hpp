// What the eye itself does, one class per effect: each is a function of time and of its own random stream alone.
//
// Output: an offset of the gaze in degrees, x right and y up (azimuth and elevation), which adds to the others'.
// Times: nanoseconds since the scenario's start, asked for in an order that never falls (except where said).
// Sources: docs/synthetic_eye.md. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/synthetic/random_stream.hpp"
#include "drivers/synthetic/saccade_profile.hpp"
#include "drivers/synthetic/scenario.hpp"

namespace fovea::drivers::synthetic {

struct Offset {
    double x_deg = 0, y_deg = 0;
    friend constexpr Offset operator+(Offset a, Offset b) noexcept { return {a.x_deg + b.x_deg, a.y_deg + b.y_deg}; }
    friend constexpr Offset operator-(Offset a, Offset b) noexcept { return {a.x_deg - b.x_deg, a.y_deg - b.y_deg}; }
    friend constexpr Offset operator*(double s, Offset a) noexcept { return {s * a.x_deg, s * a.y_deg}; }
    bool operator==(const Offset&) const = default;
};
[[nodiscard]] inline double length(Offset a) noexcept { return std::hypot(a.x_deg, a.y_deg); }

// One change of the place that is looked at.
struct GazeShift {
    std::uint64_t index = 0;       // 0 is the place at the start: no shift
    std::int64_t start_ns = 0;     // when the eye sets off
    Offset from, to;
    bool operator==(const GazeShift&) const = default;
};

class FixationTrain {
public:
    FixationTrain(const Fixations& settings, RandomStream random) noexcept;
    [[nodiscard]] const GazeShift& at(std::int64_t t_ns) noexcept;  // the newest shift that began by t
    [[nodiscard]] std::int64_t next_ns() const noexcept { return next_ns_; }
    [[nodiscard]] Offset next_place() const noexcept { return next_; }

private:
    [[nodiscard]] Offset choose(std::uint64_t index, Offset from) const noexcept;
    [[nodiscard]] std::int64_t dwell_ns(std::uint64_t index) const noexcept;

    Fixations s_;
    RandomStream random_;
    GazeShift now_;
    std::int64_t next_ns_ = 0;
    Offset next_;
};

class SaccadeTrain {
public:
    SaccadeTrain(const Saccades& settings, RandomStream random) noexcept : s_{settings}, random_{random} {}
    // What a saccade still lacks of a shift that the fixations count as done.
    [[nodiscard]] Offset at(const GazeShift& shift, std::int64_t t_ns) noexcept;
    [[nodiscard]] std::int64_t end_ns() const noexcept { return end_ns_; }  // of the shift that was asked for last

private:
    Saccades s_;
    RandomStream random_;
    std::uint64_t index_ = 0;
    std::int64_t end_ns_ = 0;
    double duration_ns_ = 0;
    SaccadeProfile profile_;
};

// Seen by a tracker of the pupil; no turn of the eyeball.
[[nodiscard]] Offset post_saccadic_swing(const PostSaccadicOscillation& s, const GazeShift& shift, std::int64_t end_ns, std::int64_t t_ns) noexcept;

class MicrosaccadeTrain {
public:
    MicrosaccadeTrain(const Microsaccades& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) noexcept;

private:
    [[nodiscard]] std::int64_t pause_ns(std::uint64_t index) const noexcept;
    Microsaccades s_;
    RandomStream random_;
    SaccadeProfile profile_{1.6, 0.48};
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, next_ns_ = 0;
    Offset from_, to_;
};

// Source: Engbert, Mergenthaler, Sinn and Pikovsky, PNAS 108(39), 2011: a walk on a lattice that avoids where it has
// been and is drawn to the middle.
class DriftWalk {
public:
    DriftWalk(const Drift& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) noexcept;

private:
    static constexpr int kSide = 51, kMiddle = 25;
    void step() noexcept;
    [[nodiscard]] double cost(int i, int j) const noexcept;
    double step_deg_, step_ns_;
    RandomStream random_;
    std::array<std::array<double, kSide>, kSide> visited_{};  // decayed counts, at the scale of `scale_`
    double scale_ = 1;        // what one visit weighs now; rises instead of all counts falling
    std::uint64_t steps_ = 0;
    int i_ = kMiddle, j_ = kMiddle, i_before_ = kMiddle, j_before_ = kMiddle;
};

class TremorWave {
public:
    TremorWave(const Tremor& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) const noexcept;  // any order

private:
    static constexpr std::size_t kWaves = 6;
    struct Wave {
        double hz, phase;
    };
    double amplitude_deg_;
    std::array<std::array<Wave, kWaves>, 2> waves_{};
};

class PursuitTrain {
public:
    PursuitTrain(const Pursuit& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) noexcept;

private:
    void next_segment() noexcept;
    Pursuit s_;
    RandomStream random_;
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, segment_ns_;
    Offset place_, speed_at_start_, speed_;  // degrees; deg/s
};

// Half the angle between the eyes: the left eye turns right by it, the right eye left.
class VergenceTrain {
public:
    VergenceTrain(const Vergence& settings, RandomStream random) noexcept;
    [[nodiscard]] double half_angle_deg(std::int64_t t_ns) noexcept;

private:
    [[nodiscard]] double draw_deg(std::uint64_t index) const noexcept;
    Vergence s_;
    RandomStream random_;
    std::uint64_t index_ = 0;
    std::int64_t start_ns_ = 0, next_ns_ = 0;
    double from_deg_ = 0, to_deg_ = 0;
};

// Where the head points: azimuth (+ right) and elevation (+ up). Jumps by minimum jerk between random rests.
class HeadTurns {
public:
    HeadTurns(const Head& settings, RandomStream random) noexcept;
    [[nodiscard]] Offset at(std::int64_t t_ns) noexcept;  // may be up to 200 ms before the newest time asked for

private:
    static constexpr std::size_t kKept = 8;
    struct Turn {
        std::int64_t start_ns = 0;
        Offset from, to;
    };
    Head s_;
    RandomStream random_;
    std::array<Turn, kKept> turns_{};  // the newest, by index modulo kKept; the last one may lie ahead
    std::uint64_t count_ = 0;
};

}  // namespace fovea::drivers::synthetic
