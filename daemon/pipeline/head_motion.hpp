// How fast the head turns, from the poses that come with the samples, and what the eyes do about it.
//
// While a person fixates, the vestibulo-ocular reflex turns the eyes against the head: the gaze in the head's frame moves
// with minus the head's angular velocity. Measured gain and gain of prediction: docs/pipeline.md.
//
// Output: rad/s in the head's frame. Lag: half of kSpan_ns. Threads: one at a time; noexcept, no allocation.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/pipeline/plane.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::pipeline {

class HeadMotion {
public:
    static constexpr std::int64_t kSpan_ns = 25'000'000;      // over which the turn is measured, at least
    static constexpr std::int64_t kLongest_ns = 120'000'000;  // a pose older than this tells nothing about now

    // `t_ns`: the sample's exposure. A pose that repeats the last one (a runtime slower than the tracker) is not new.
    void update(std::int64_t t_ns, const HeadPose& head) noexcept;
    void reset() noexcept { *this = HeadMotion{}; }

    // Zero when no pose is known, at least two are not yet, or the head turns faster than a head can (1000 deg/s).
    [[nodiscard]] Vec3<HeadFrame> angular_velocity(std::int64_t t_ns) const noexcept;

private:
    static constexpr std::size_t kKept = 32;  // 25 ms at 1000 Hz; further apart at lower rates
    struct Pose {
        std::int64_t t_ns;
        Rotation<WorldFrame, HeadFrame> world_from_head;
    };
    std::array<Pose, kKept> ring_{};
    std::uint64_t count_ = 0;
};

// The velocity of a gaze that stays in space while the head turns; in the tangent plane of the gaze.
[[nodiscard]] Tangent against_head(Vec3<HeadFrame> head_rad_s, const Plane& gaze) noexcept;

}  // namespace fovea::pipeline
