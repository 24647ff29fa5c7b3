#include "daemon/pipeline/head_motion.hpp"

#include <cmath>

namespace fovea::pipeline {
namespace {

constexpr std::int64_t kLastTime_ns = std::int64_t{1} << 61;  // beyond it no sample is used (validate.hpp)
constexpr double kFastest_rad_s = 17.5;      // 1000 deg/s: a head shaken hard reaches 600
constexpr std::int64_t kRepeat_ns = 20'000'000;  // poses of 50 Hz and more; an equal one later is a head that rests

bool usable(const Rotation<WorldFrame, HeadFrame>& q) noexcept {
    const double n = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    return n > 0.98 && n < 1.02;  // false for NaN
}

}  // namespace

void HeadMotion::update(std::int64_t t_ns, const HeadPose& head) noexcept {
    if (!head.valid || !usable(head.world_from_head) || t_ns > kLastTime_ns || t_ns < -kLastTime_ns) return;
    if (count_ > 0) {
        const Pose& newest = ring_[(count_ - 1) % kKept];
        const std::int64_t since = t_ns - newest.t_ns;
        if (since <= 0) return;  // an old sample
        if (since > kLongest_ns) {
            count_ = 0;
        } else {
            if (since < kRepeat_ns && newest.world_from_head == head.world_from_head) return;
            // Above 1000 Hz the newest takes the last one's place, so that the ring spans kSpan_ns.
            if (count_ > 1 && newest.t_ns - ring_[(count_ - 2) % kKept].t_ns < 1'000'000) --count_;
        }
    }
    ring_[count_++ % kKept] = {t_ns, head.world_from_head};
}

Vec3<HeadFrame> HeadMotion::angular_velocity(std::int64_t t_ns) const noexcept {
    if (count_ < 2 || t_ns > kLastTime_ns) return {};
    const Pose& b = ring_[(count_ - 1) % kKept];
    if (t_ns < b.t_ns || t_ns - b.t_ns > kLongest_ns) return {};  // in this order: the difference must exist
    const std::uint64_t oldest = count_ > kKept ? count_ - kKept : 0;
    std::uint64_t k = count_ - 1;
    while (k > oldest && b.t_ns - ring_[k % kKept].t_ns < kSpan_ns) --k;
    const Pose& a = ring_[k % kKept];
    const std::int64_t dt_ns = b.t_ns - a.t_ns;
    if (dt_ns <= 0 || dt_ns > kLongest_ns) return {};
    // head(a)_from_head(b), as a rotation vector.
    const auto &p = a.world_from_head, &q = b.world_from_head;
    double w = p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z;
    Vec3<HeadFrame> v{p.w * q.x - p.x * q.w - p.y * q.z + p.z * q.y, p.w * q.y - p.y * q.w - p.z * q.x + p.x * q.z,
                      p.w * q.z - p.z * q.w - p.x * q.y + p.y * q.x};
    if (w < 0) w = -w, v = -1.0 * v;
    const double s = length(v), dt = static_cast<double>(dt_ns) * 1e-9;
    const double rate = 2 * std::atan2(s, w) / dt;
    if (!(s > 1e-12) || !(rate < kFastest_rad_s)) return {};
    return (rate / s) * v;
}

Tangent against_head(Vec3<HeadFrame> head_rad_s, const Plane& gaze) noexcept {
    const Vec3<HeadFrame> v = cross(gaze.at.vec(), head_rad_s);
    return {dot(v, gaze.basis.u), dot(v, gaze.basis.v)};
}

}  // namespace fovea::pipeline
