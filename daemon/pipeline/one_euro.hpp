// The 1-Euro filter on the sphere: a first-order low-pass whose cutoff rises with the eye's speed.
//
// Source: Casiez, Roussel, Vogel, "1 Euro Filter", CHI 2012. On the tangent plane of the last output; the smoothed
// velocity is carried along by parallel transport.
// Lag: about 1/(2 pi cutoff). Cost: about 100 ns. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <cstdint>

#include "daemon/pipeline/settings.hpp"
#include "protocol/sphere.hpp"

namespace fovea::pipeline {

class OneEuro {
public:
    explicit OneEuro(const OneEuroSettings& settings) noexcept : settings_{settings} {}

    // `t_ns` rises strictly. The first sample after reset() passes unchanged.
    Direction<HeadFrame> update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head) noexcept;
    void reset() noexcept { any_ = false; }

private:
    OneEuroSettings settings_;
    bool any_ = false;
    std::int64_t last_ns_ = 0;
    Direction<HeadFrame> raw_, out_;
    Tangent velocity_;  // rad/s, in the tangent plane of out_
};

}  // namespace fovea::pipeline
