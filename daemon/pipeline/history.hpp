// The recent gaze of one eye, and what can be read off it: velocity at several time scales, and places in the past.
//
// Input/Output: exposure times in int64 nanoseconds, strictly rising (validate.hpp sees to it); directions in
// HeadFrame; velocities in rad/s in the tangent plane of the newest direction.
// Cost: a slope over n samples costs about 3 n ns. noexcept, no allocation. Threads: one at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "daemon/pipeline/plane.hpp"

namespace fovea::pipeline {

struct Slope {
    Tangent velocity_rad_s;
    int samples = 0;          // that took part; below 2 the velocity is 0
    double span_s = 0;        // from the oldest of them to the newest
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

    // The plane at the newest sample.
    [[nodiscard]] const Plane& plane() const noexcept { return plane_; }

    // So many samples lie within the last window_ns; never fewer than `at_least` when there are so many.
    [[nodiscard]] std::size_t within(std::int64_t window_ns, std::size_t at_least) const noexcept;
    // Least-squares line through the newest `samples`, of which there must be so many.
    [[nodiscard]] Slope slope(std::size_t samples) const noexcept;

private:
    struct Entry {
        std::int64_t t_ns;
        Direction<HeadFrame> d;
    };
    std::array<Entry, kCapacity> ring_{};
    std::size_t next_ = 0, size_ = 0;
    Plane plane_;
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
