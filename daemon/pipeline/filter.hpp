// The filter stage: one of several, by name.
//
// Input: strictly rising exposure times, unit directions, what the classifier sees. Output: the smoothed direction.
// Threads: one at a time; update() is noexcept and allocates nothing.
#pragma once

#include <variant>

#include "daemon/pipeline/classifier.hpp"
#include "daemon/pipeline/kalman.hpp"
#include "daemon/pipeline/one_euro.hpp"
#include "daemon/pipeline/saccade_aware.hpp"
#include "daemon/pipeline/settings.hpp"
#include "protocol/error.hpp"

namespace fovea::pipeline {

class Filter {
public:
    // Error: a name that is not in filter_names().
    [[nodiscard]] static Result<Filter> create(const PipelineSettings& settings);

    // The first sample after reset() passes unchanged.
    Direction<HeadFrame> update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, const Classified& now) noexcept;
    void reset() noexcept;

private:
    struct None {
        Direction<HeadFrame> update(std::int64_t, Direction<HeadFrame> d, const Classified&) noexcept { return d; }
        void reset() noexcept {}
    };
    struct Euro {
        OneEuro filter;
        Direction<HeadFrame> update(std::int64_t t, Direction<HeadFrame> d, const Classified&) noexcept { return filter.update(t, d); }
        void reset() noexcept { filter.reset(); }
    };
    struct Kalman {
        KalmanCv filter;
        NoiseEstimate noise;
        std::array<Direction<HeadFrame>, 2> before;  // newest first
        std::array<std::int64_t, 2> before_ns{};
        int count = 0;
        Direction<HeadFrame> update(std::int64_t t, Direction<HeadFrame> d, const Classified&) noexcept;
        void reset() noexcept;
    };
    std::variant<None, Euro, Kalman, SaccadeAware> filter_;
};

}  // namespace fovea::pipeline
