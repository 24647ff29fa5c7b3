// The recent gaze of one eye, and what can be read off it: velocity at several time scales, and places in the past.
//
// Input/Output: exposure times in int64 nanoseconds, strictly rising (validate.hpp sees to it); directions in
// HeadFrame; velocities in rad/s in the tangent plane of the newest direction.
// Cost: a slope over n samples costs about 3 n ns. noexcept, no allocation. Threads: one at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/frames.hpp"
#include "protocol/sphere.hpp"

namespace fovea::pipeline {

// Where `d` lies as seen from `at`, in the plane that `basis` (the basis at `at`) spans. Within 1e-4 of log_map() up
// to 40 degrees and much cheaper; beyond 90 degrees it is pulled to the rim, so it stays finite and bounded by pi/2.
[[nodiscard]] Tangent nearby(const TangentBasis<HeadFrame>& basis, Direction<HeadFrame> at,
                             Direction<HeadFrame> d) noexcept;

struct Slope {
    Tangent velocity_rad_s;
    int samples = 0;          // that took part; below 2 the velocity is 0
    double span_s = 0;        // from the oldest of them to the newest
    double residual_rad = 0;  // per-axis scatter about the line; 0 with fewer than 3 samples
};

class History {
public:
    static constexpr std::size_t kCapacity = 128;  // 128 ms at 1000 Hz

    void clear() noexcept { size_ = 0; }
    void push(std::int64_t t_ns, Direction<HeadFrame> d) noexcept;
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    // i = 0 is the newest; i < size().
    [[nodiscard]] std::int64_t time_ns(std::size_t i) const noexcept { return ring_[(next_ + kCapacity - 1 - i) % kCapacity].t_ns; }
    [[nodiscard]] Direction<HeadFrame> direction(std::size_t i) const noexcept { return ring_[(next_ + kCapacity - 1 - i) % kCapacity].d; }

    // Least-squares line through the samples of the last window_ns, and never fewer than `at_least` of them when there
    // are so many. Skips the newest `skip` samples.
    [[nodiscard]] Slope slope(std::int64_t window_ns, int at_least, std::size_t skip = 0) const noexcept;

private:
    struct Entry {
        std::int64_t t_ns;
        Direction<HeadFrame> d;
    };
    std::array<Entry, kCapacity> ring_{};
    std::size_t next_ = 0, size_ = 0;
};

// A thinned history for what happened longer ago: one entry per `spacing`, 64 of them.
class Trail {
public:
    static constexpr std::size_t kCapacity = 64;

    explicit Trail(std::int64_t spacing_ns) noexcept : spacing_ns_{spacing_ns < 1 ? 1 : spacing_ns} {}
    void clear() noexcept { size_ = 0; }
    void push(std::int64_t t_ns, Direction<HeadFrame> d) noexcept;
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] std::int64_t time_ns(std::size_t i) const noexcept { return ring_[(next_ + kCapacity - 1 - i) % kCapacity].t_ns; }
    [[nodiscard]] Direction<HeadFrame> direction(std::size_t i) const noexcept { return ring_[(next_ + kCapacity - 1 - i) % kCapacity].d; }
    // The newest entry that is not later than t_ns, else the oldest; `otherwise` when empty.
    [[nodiscard]] Direction<HeadFrame> at_or_before(std::int64_t t_ns, Direction<HeadFrame> otherwise) const noexcept;

private:
    struct Entry {
        std::int64_t t_ns;
        Direction<HeadFrame> d;
    };
    std::array<Entry, kCapacity> ring_{};
    std::size_t next_ = 0, size_ = 0;
    std::int64_t spacing_ns_;
};

}  // namespace fovea::pipeline
