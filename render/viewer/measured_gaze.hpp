// Where the eye was measured to be, for the marker of the actual gaze beside the predicted one.
//
// What the tracker saw is known some milliseconds after it happened: where the eye was at a frame's photon can be told only
// when a later sample has come.
// Input: latches for the exposure of their own sample, so that nothing in them is predicted; at most one per sample counts.
// Threads: one. Errors: none. Does not allocate.
#pragma once

#include <array>
#include <optional>

#include "protocol/frames.hpp"
#include "render/viewer/frame.hpp"

namespace fovea::viewer {

class MeasuredGaze {
public:
    using Points = std::array<NdcPoint, kEyes>;
    // measured: the answer to a latch for the instant at which its own sample was exposed.
    void add(const Latched& measured) noexcept;
    // Between the samples before and after this instant; nothing until the one after has come, or if they are further apart
    // than kGap.
    [[nodiscard]] std::optional<Points> at(Instant instant) const noexcept;

    static constexpr Duration kGap = std::chrono::milliseconds(100);

private:
    struct Sample {
        Instant exposed;
        Points points{};
    };
    std::array<Sample, 256> samples_{};   // a ring, oldest overwritten: some seconds of frames
    std::size_t count_ = 0;               // ever added
};

}  // namespace fovea::viewer
