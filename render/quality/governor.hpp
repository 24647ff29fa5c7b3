// Holds a frame-time budget by moving along a ladder of quality settings: the decision alone, with injected times.
//
//   0 best, dearest                                   down: the median of the last `window` frames is over the budget;
//   |  ^                                                    at once, as many settings as the ladder's costs say
//   v  | one at a time                                up:   the next better one has been predicted to fit into `up_at` of
//   n cheapest                                              the budget for `up_dwell`
//
// What keeps it still: the median (a spike does not move it), the two thresholds, the dwell, and what it learns: after
// every step up it measures what that step really costs. A ladder made on another scene may promise too much: such a step
// is taken back, tried once more after `retry`, and when that measures the same it is left alone until the load has
// changed by `load_changed`. So under a constant load it comes to rest.
// Source: measured costs of the ladder (`fovea tradeoff foveation`); thresholds: frame times of one scene vary by 5 to 10 %
// on a shared machine, the gap between the thresholds is 15 %.
// Reaction: after a jump of the load at most (window + 1) / 2 frames; within `settle` + `window` frames of a change, when
// these have passed.
// Threads: one at a time. Errors: create() names what cannot be. observe() is noexcept and does not allocate: changes go
// into a ring for whoever logs them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::quality {

inline constexpr std::size_t kMaxSettings = 32;

struct GovernorSettings {
    Duration budget = std::chrono::milliseconds(11);   // of a frame, 0.1 ms to 100 s
    double up_at = 0.85;        // 0.3 to 0.97: a better setting must be predicted to fit into this part of the budget
    Duration up_dwell = std::chrono::seconds(1);       // ... for this long, >= 0
    int window = 9;             // frames whose median counts, odd, 3 to 31
    int settle = 2;             // frames after a change that do not count, 0 to 100
    Duration retry = std::chrono::seconds(30);         // what a step up cost was measured once: it counts this long, >= 0
    double load_changed = 0.15; // 0 to 1: what was learned is forgotten when the load differs by more
};

enum class Reason : std::uint8_t {
    over_budget,     // the frames take longer than the budget
    headroom,        // a better setting fits
    cannot_hold,     // over the budget at the cheapest setting: nothing more to give (from == to)
};
[[nodiscard]] const char* to_string(Reason reason) noexcept;

struct Change {
    Instant at{};
    std::size_t from = 0, to = 0;
    Reason reason = Reason::over_budget;
    Duration measured{};    // median of the frames before it
    Duration predicted{};   // for the new setting
    Duration budget{};
};

class Governor {
public:
    // costs: of the settings against the first, best first, each positive and less than the one before; 1 to
    // kMaxSettings of them. start: the setting to begin with.
    [[nodiscard]] static Result<Governor> create(const GovernorSettings& settings, std::span<const double> costs, std::size_t start = 0);

    // The setting that the next frame is to be drawn with.
    [[nodiscard]] std::size_t setting() const noexcept { return setting_; }
    // A frame drawn with setting() took `cost` and ended `now`. Costs that are not positive are ignored.
    void observe(Instant now, Duration cost) noexcept;

    // The oldest change that was not taken yet. The ring keeps the last kKeptChanges; what was overwritten is counted.
    [[nodiscard]] std::optional<Change> take_change() noexcept;
    [[nodiscard]] std::uint64_t changes() const noexcept { return made_; }
    [[nodiscard]] std::uint64_t changes_lost() const noexcept { return lost_; }
    static constexpr std::size_t kKeptChanges = 64;

private:
    // What is known of the step from setting i + 1 up to i.
    struct Step {
        double ratio = 0;        // cost of i against i + 1 as measured; 0: not known, the ladder's counts
        double load_s = 0;       // cost at i + 1 when it was measured
        Instant at{};
        int agreed = 0;          // measurements in a row that say the same
    };
    Governor() = default;
    [[nodiscard]] double median_s() const noexcept;
    [[nodiscard]] double predicted_up_s(double median, Instant now) noexcept;
    void learn(double median, Instant now) noexcept;
    void move(std::size_t to, Reason reason, double median, double predicted, Instant now) noexcept;
    void note(const Change& change) noexcept;

    GovernorSettings settings_;
    std::array<double, kMaxSettings> costs_{};
    std::size_t count_ = 0, setting_ = 0;
    std::array<Step, kMaxSettings> steps_{};
    std::array<double, 31> recent_{};
    std::size_t seen_ = 0;                  // frames in this setting that count
    int settling_ = 0;
    bool came_up_ = false;                  // the last change was a step up whose cost is not yet measured
    double below_s_ = 0;                    // cost at the setting below before that step
    bool headroom_ = false, told_cannot_ = false;
    Instant headroom_since_{};
    std::array<Change, kKeptChanges> ring_{};
    std::uint64_t made_ = 0, taken_ = 0, lost_ = 0;
};

}  // namespace fovea::quality
