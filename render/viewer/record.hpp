// What a run leaves in memory: the sums and medians of its frames.
#pragma once

#include <cstddef>
#include <vector>

#include "render/viewer/frame.hpp"
#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

// The last values, bounded however long the viewer runs.
class Kept {
public:
    void add(double v) {
        if (values_.size() < kMost) values_.push_back(v);
        else values_[next_++ % kMost] = v;
    }
    [[nodiscard]] double quantile(double q) const;   // q in [0, 1]; 0 without any
    [[nodiscard]] double median() const { return quantile(0.5); }

private:
    static constexpr std::size_t kMost = 4096;
    std::vector<double> values_;
    std::size_t next_ = 0;
};

class Record {
public:
    void rendered(const Frame& frame);
    void extrapolated(const Frame& frame);
    void reset() { ++summary_.resets; }
    [[nodiscard]] std::uint64_t resets() const noexcept { return summary_.resets; }
    void shown(const Frame& frame, const present::Feedback& feedback);   // also if it was never seen
    [[nodiscard]] std::uint64_t frames() const noexcept { return summary_.frames; }
    // Everything that frames tell; the rest is the caller's to fill in.
    [[nodiscard]] Summary summary() const;

private:
    Summary summary_;
    // Names and reasons live for ever: they are compared by text, and kept as they are.
    struct Way {
        const char *name = "", *why = "";
        std::uint64_t frames = 0, last = 0;
    };
    std::vector<Way> ways_;
    struct LatchTo {
        Kept submit_ms, gpu_done_ms, photon_ms;
        [[nodiscard]] Summary::LatchTo medians() const { return {submit_ms.median(), gpu_done_ms.median(), photon_ms.median()}; }
    };
    Kept frame_ms_, error_ms_, apart_deg_, motion_to_photon_ms_, between_ms_, between_photon_ms_;
    LatchTo late_, early_;
    double shaded_sum_ = 0, draws_sum_ = 0;
};

}  // namespace fovea::viewer
