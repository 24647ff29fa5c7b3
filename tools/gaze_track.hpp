// A recording made ready for judging predictions: what is true when, which samples count, and what the eye was doing.
//
// Protocol (docs/pipeline.md): a prediction is judged at every valid sample (every 4 ms at 250 Hz and more) with at
// least 40 ms of valid history; the truth is the recorded raw gaze (of a synthetic eye: its noise-free gaze), interpolated at the asked time; nothing within 40
// ms before and 60 ms after an invalid run counts. Saccades are the recording's own labels where it has them, else
// found by an adaptive velocity threshold that looks both ways.
//
// Nothing here is seen by a predictor. Threads: plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/sphere.hpp"
#include "replay/recording.hpp"

namespace fovea::tools {

enum GazeClass : unsigned {
    kAll = 1u << 0,
    kFixation = 1u << 1,     // no saccade within [t, t + h]
    kPursuit = 1u << 2,      // of those: t lies in smooth movement
    kInSaccade = 1u << 3,    // t + h lies in a saccade
    kOnsetSeen = 1u << 4,    // t lies in a saccade
    kOnsetUnseen = 1u << 5,  // a saccade begins within (t, t + h]
    kLanding = 1u << 6,      // a saccade ran within [t, t + h), and is over at t + h
};
struct GazeClassRow {
    GazeClass bit;
    const char* name;
};
inline constexpr GazeClassRow kGazeClasses[] = {
    {kAll, "all"},           {kFixation, "fixation"},        {kPursuit, "pursuit"}, {kInSaccade, "in_saccade"},
    {kOnsetSeen, "onset_seen"}, {kOnsetUnseen, "onset_unseen"}, {kLanding, "landing"}};

class GazeTrack {
public:
    explicit GazeTrack(const replay::Recording& recording);

    struct Point {
        std::int64_t t_ns;
        Direction<HeadFrame> gaze;
        bool saccade, pursuit;
    };
    [[nodiscard]] const std::string& group() const noexcept { return group_; }  // device and rate
    [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
    [[nodiscard]] bool labelled() const noexcept { return labelled_; }
    [[nodiscard]] double seconds() const noexcept;  // of usable gaze

    // Whether a prediction made at exposure t_ns is judged. Times must be asked for in rising order.
    [[nodiscard]] bool judged(std::int64_t t_ns) noexcept;
    // Nothing where the recording has no trustworthy gaze.
    [[nodiscard]] std::optional<Direction<HeadFrame>> truth(std::int64_t t_ns) const noexcept;
    [[nodiscard]] unsigned classes(std::int64_t t_ns, std::int64_t horizon_ns) const noexcept;  // GazeClass bits

private:
    using Span = std::pair<std::int64_t, std::int64_t>;
    void collect(const replay::Recording& recording);
    void find_saccades(const replay::Recording& recording);
    void find_pursuit();
    [[nodiscard]] std::size_t at(std::int64_t t_ns) const noexcept;  // last point not after t; npos if none
    [[nodiscard]] bool blocked(std::int64_t t_ns) const noexcept;

    std::string group_;
    double rate_hz_ = 0;
    bool labelled_ = false;
    std::int64_t interval_ns_ = 0;     // median
    std::vector<Point> points_;        // valid, in order, without repeats
    std::vector<Span> saccades_, blocked_;
    std::int64_t last_judged_ns_ = INT64_MIN;
};

}  // namespace fovea::tools
