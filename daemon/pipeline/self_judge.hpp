// Judges the pipeline's own predictions once the truth has come, and learns two things from it: how much of the
// predicted movement to believe on this tracker and this person, and how wide the radii must be to hold what they say.
//
//   note(): prediction made at t -> pending -> observe(): the sample at t + h has come -> error -> belief, radius factors
//
// Belief: whether to start from the raw or from the filtered gaze, and which share of the displacement to add (0 is
// hold, 1 all of it): what had the smallest mean error so far, per phase of the movement and horizon, starting from a
// prior and forgetting slowly. Radius factors: stochastic approximation of
// the 68 % and 95 % quantile (Robbins and Monro 1951), bounded to [1/32, 32].
//
// Causal: only samples that have come are used. Cost: about 100 ns per sample. Threads: one at a time; noexcept, no
// allocation.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/fours.hpp"
#include "protocol/motion_model.hpp"

namespace fovea::pipeline {

// What a prediction is good for depends on where in a movement it is made.
// turning: no saccade, but the head turns, and its pose says how.
enum class Phase : std::uint8_t { quiet, stirring, pursuit, rising, falling, landed, turning };
inline constexpr std::size_t kPhases = 7;

inline constexpr std::size_t kAhead = kHorizons_ns.size() - 1;  // the horizons after the present
static_assert(kHorizonLanes >= kAhead);

// A prediction for the horizons after the present, in the tangent plane of the filtered gaze.
struct Ahead {
    Tangent raw_offset;  // raw gaze less filtered gaze
    PerHorizon du_rad{}, dv_rad{};
    PerHorizon radius68_rad{}, radius95_rad{};
};

class SelfJudge {
public:
    // adaptive false: belief is 1 throughout (the predictor is taken at its word); radii still adapt.
    explicit SelfJudge(bool adaptive) noexcept;

    // A new sample has come: judges every prediction that was due since the last one.
    [[gnu::noinline]] void observe(std::int64_t t_ns, Direction<HeadFrame> raw) noexcept;
    // Scales a prediction made now by belief and radius factors, and remembers it for judging.
    void apply(std::int64_t t_ns, Direction<HeadFrame> filtered, Phase phase, Ahead& ahead) noexcept;
    // No share of any displacement is believed in this phase.
    [[nodiscard]] bool holds(Phase phase) const noexcept { return learned_[static_cast<std::size_t>(phase)].none; }
    // For a prediction that apply() was shown without its displacement, because it holds: what that would have been.
    void complete(const Ahead& ahead) noexcept;
    // From now on as `other` does, as far as apply() goes.
    void believe_as(const SelfJudge& other) noexcept { learned_ = other.learned_; }
    // After a gap or blink: what was predicted across it will not be judged.
    [[gnu::noinline]] void forget_pending() noexcept;
    void reset() noexcept;
    // Asks for what the next apply() will read and write, if the phase is still the same.
    void prefetch() const noexcept;

    struct Belief {
        double share = 0;      // of the displacement
        bool from_raw = false;
    };
    [[nodiscard]] Belief belief(Phase phase, std::size_t ahead) const noexcept;

private:
    static constexpr std::array<double, 5> kShares = {0, 0.25, 0.5, 0.75, 1};
    static constexpr std::size_t kChoices = 2 * kShares.size();  // from the filtered gaze, then from the raw one
    static constexpr std::int64_t kSpacing_ns = 4'000'000;  // predictions closer together tell nothing new
    static constexpr std::size_t kPending = 64;             // > 150 ms / kSpacing

    struct Pending {
        std::int64_t t_ns;
        Direction<HeadFrame> from;
        Phase phase;
        Tangent raw_offset;
        std::array<std::uint8_t, kHorizonLanes> choice;
        PerHorizon full_u_rad, full_v_rad;        // before belief
        PerHorizon radius68_rad, radius95_rad;
    };
    // What was learned, per phase: as apply() uses it ...
    struct Learned {
        PerHorizon share, from_raw;               // of the choice; from_raw is 0 or 1
        PerHorizon factor68, factor95;
        bool none;                                // all shares are 0
        std::array<std::uint8_t, kHorizonLanes> choice;
    };
    // ... and what it was learned from, which only observe() needs.
    struct Cell {
        std::array<double, kChoices> error{};  // decayed sums, radians
        double weight = 0;
    };
    void judge(const Pending& p, std::size_t h, Tangent truth) noexcept;
    void choose(const Cell& cell, Phase phase, std::size_t h) noexcept;
    void set_choice(Learned& learned, std::size_t h, std::size_t choice) noexcept;

    bool adaptive_;
    std::array<Pending, kPending> ring_{};
    bool remembered_ = false;                      // the last apply() noted its prediction
    std::uint64_t noted_ = 0;                      // so many were ever noted; entry n lives at n % kPending
    std::array<std::uint64_t, kAhead> next_{};     // the next to be judged, per horizon
    std::array<Learned, kPhases> learned_{};
    std::array<std::array<Cell, kAhead>, kPhases> cells_{};
    bool any_ = false;
    std::int64_t last_ns_ = 0;
    Direction<HeadFrame> last_;
};

}  // namespace fovea::pipeline
