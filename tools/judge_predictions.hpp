// Runs pipelines over recordings and keeps every judged error, by device group, class of movement and horizon.
//
// Protocol: gaze_track.hpp. Groups weigh the same in every mean. Threads: one at a time.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.hpp"
#include "replay/recording.hpp"
#include "tools/gaze_track.hpp"

namespace fovea::tools {

inline constexpr std::size_t kClassCount = std::size(kGazeClasses);

struct Method {
    std::string name;
    pipeline::PipelineSettings settings;
};

struct Statistics {
    double mean = 0, median = 0, p95 = 0, p99 = 0;  // degrees; NaN where there is nothing
    double within68 = 0, within95 = 0;              // share of outcomes inside the stated radii
    std::size_t count = 0;
};

// One judged prediction.
struct Outcome {
    float error_deg, r68_deg, r95_deg;
};
// How large to make the sharp region, given the uncertainty: x times the 0.4th power of the 95 % radius, degrees.
[[nodiscard]] double sized(const Outcome& outcome, double x) noexcept;

struct LoadedRecording {
    std::string path;
    replay::Recording recording;
};
// Every file, and every readable recording below every directory. What cannot be read is an error for a file that was
// named, and is passed to `skipped` for one that was found.
[[nodiscard]] Result<std::vector<LoadedRecording>> load_recordings(
    const std::vector<std::string>& paths, const std::function<void(const Error&)>& skipped);

// Nanoseconds of processor time that the pipeline takes for the whole recording, after a warm-up that does not count.
[[nodiscard]] double timed_run(const pipeline::PipelineSettings& settings, const replay::Recording& recording);

class Judgement {
public:
    explicit Judgement(std::vector<std::int64_t> horizons_ns) : horizons_ns_{std::move(horizons_ns)} {}

    // Runs one method over one recording. Error: settings that Pipeline::create() refuses.
    [[nodiscard]] Result<void> run(const Method& method, const replay::Recording& recording);

    [[nodiscard]] const std::vector<std::int64_t>& horizons_ns() const noexcept { return horizons_ns_; }
    [[nodiscard]] std::vector<std::string> groups() const;
    // Of one group; "" is the mean of the statistics of all groups that have at least kLeast outcomes.
    [[nodiscard]] Statistics statistics(const std::string& group, std::size_t gaze_class, std::size_t horizon) const;
    [[nodiscard]] double nanoseconds_per_sample() const noexcept { return samples_ ? ns_ / static_cast<double>(samples_) : 0; }

    static constexpr std::size_t kLeast = 50;

    [[nodiscard]] const std::vector<Outcome>& outcomes(const std::string& group, std::size_t gaze_class, std::size_t horizon) const {
        return groups_.at(group)[gaze_class * horizons_ns_.size() + horizon];
    }

private:
    using Cells = std::vector<std::vector<Outcome>>;  // class * horizons + horizon
    [[nodiscard]] static Statistics reduce(std::vector<Outcome> outcomes);

    std::vector<std::int64_t> horizons_ns_;
    std::map<std::string, Cells> groups_;
    double ns_ = 0;
    std::uint64_t samples_ = 0;
};

}  // namespace fovea::tools
