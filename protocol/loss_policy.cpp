#include "protocol/loss_policy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fovea {
namespace {

using Dir = Direction<HeadFrame>;

constexpr std::int64_t kLongest_ns = 3'600'000'000'000;   // an hour: longer policies mean "for ever"

// Nanoseconds from a to b. Models and policies cross a process boundary, so nothing may overflow.
std::int64_t span_ns(Instant a, Instant b) noexcept {
    std::int64_t ns = 0;
    if (__builtin_sub_overflow(to_ns(b), to_ns(a), &ns))
        return b > a ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
    return ns;
}

std::int64_t legal(Duration d) noexcept { return std::clamp<std::int64_t>(d.count(), 0, kLongest_ns); }

// 0 until `from`, 1 from `from + length` on, between them a smooth step: no kink that the eye could catch.
double step(std::int64_t age, std::int64_t from, std::int64_t length) noexcept {
    if (age < from || (age == from && length > 0)) return 0;
    const std::int64_t into = age - from;   // no overflow: from >= 0
    if (into >= length) return 1;
    const double x = static_cast<double>(into) / static_cast<double>(length);
    return x * x * (3 - 2 * x);
}

// From 1 to 0 as the gaze of `age` is held and then let go.
double held_share(std::int64_t age, std::int64_t hold, std::int64_t ease) noexcept {
    return age <= hold ? 1 : 1 - step(age, hold, ease);
}

Dir unit(Dir d) noexcept {
    return std::abs(dot(d.vec(), d.vec()) - 1) < 1e-9 ? d : Dir::from(d.vec()).value_or(Dir{});
}

Dir part_way(Dir a, Dir b, double share_of_b) noexcept {
    if (share_of_b <= 0) return a;
    if (share_of_b >= 1) return b;
    return slerp(a, b, share_of_b);
}

}  // namespace

GazeEstimate evaluate(const EyeMotion& motion, const LossPolicy& policy, Instant t) noexcept {
    const std::int64_t hold = legal(policy.hold), ease = legal(policy.ease), recover = legal(policy.recover);
    const std::int64_t age = span_ns(motion.reference, t);

    // Tracked, and no loss before that still shows: by far the most frequent case.
    const bool coming_back =
        motion.lost_before && span_ns(motion.lost_since, motion.valid_since) > hold;
    if (motion.ever_valid && !coming_back && age <= hold) return evaluate(motion, t);

    const Dir static_dir = unit(policy.static_dir_head);
    const double static_radius = std::isfinite(policy.static_radius_rad)
                                     ? std::clamp(policy.static_radius_rad, 0.0, std::numbers::pi) : std::numbers::pi;
    if (!motion.ever_valid) return {static_dir, static_radius, static_radius, GazeEvent::lost, 0};

    GazeEstimate estimate = evaluate(motion, t);
    if (age > hold) estimate.event = GazeEvent::lost;

    if (coming_back) {
        // Until `recover` of valid data have come, the gaze held through the loss goes on easing out; from then on it
        // eases from where it is to the live prediction. The data count as valid up to t while a live gaze is
        // reported, but never further than `hold` past the last sample (a gap that short leaves no trace); a run that
        // broke off before `recover` counts only as far as its last sample.
        const bool broken = motion.event == GazeEvent::lost || motion.event == GazeEvent::blink;
        const std::int64_t run = span_ns(motion.valid_since, motion.reference);
        const std::int64_t so_far = span_ns(motion.valid_since, t);
        std::int64_t limit = run;
        if (!(broken && run < recover) && __builtin_add_overflow(run, hold, &limit))
            limit = std::numeric_limits<std::int64_t>::max();
        const std::int64_t counted = std::min(so_far, limit);
        const double back = step(counted, recover, ease);

        const std::int64_t since_loss = span_ns(motion.lost_since, t);
        std::int64_t at_recovery = 0;   // age of the held gaze when it starts to ease back
        if (__builtin_add_overflow(span_ns(motion.lost_since, motion.valid_since), recover, &at_recovery))
            at_recovery = std::numeric_limits<std::int64_t>::max();
        const double held = held_share(counted >= recover ? std::min(since_loss, at_recovery) : since_loss, hold, ease);
        const Dir from = part_way(static_dir, unit(motion.held_dir_head), held);
        estimate.gaze_dir_head = part_way(from, estimate.gaze_dir_head, back);
        estimate.tracked = held + (1 - held) * back;
    }

    const double share = held_share(age, hold, ease);
    estimate.gaze_dir_head = part_way(static_dir, estimate.gaze_dir_head, share);
    estimate.tracked *= share;
    const auto widen = [&](double radius) { return radius + (1 - estimate.tracked) * (static_radius - radius); };
    estimate.radius68_rad = widen(estimate.radius68_rad);
    estimate.radius95_rad = widen(estimate.radius95_rad);
    return estimate;
}

}  // namespace fovea
