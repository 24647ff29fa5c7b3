#include "daemon/pipeline/validate.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/pipeline/plane.hpp"

namespace fovea::pipeline {
namespace {

constexpr std::int64_t kFarthest_ns = std::int64_t{1} << 61;  // 73 years either way

}  // namespace

Validator::Checked Validator::update(std::int64_t t_ns, const EyeState& eye) noexcept {
    if (t_ns < -kFarthest_ns || t_ns > kFarthest_ns) return {Verdict::out_of_order, {}};
    if (any_) {
        if (t_ns == newest_ns_) return {Verdict::duplicate, {}};
        if (t_ns < newest_ns_) return {Verdict::out_of_order, {}};
    }
    any_ = true;
    newest_ns_ = t_ns;
    if (!eye.valid) return {Verdict::invalid, {}};
    // A direction that is off unit length by more than rounding is a wrong unit, but which way it points is still known.
    const auto direction = unit(eye.gaze_dir_head.vec());
    if (!direction) return {Verdict::not_finite, {}};
    if (any_good_ && eye.gaze_dir_head == values_) {
        if (t_ns - first_seen_ns_ <= kRepeatWindow_ns) return {Verdict::duplicate, {}};
    } else {
        any_good_ = true;
        values_ = eye.gaze_dir_head;
        first_seen_ns_ = t_ns;
    }
    return {Verdict::good, *direction};
}

EyeState combined_eye(const GazeSample& sample) noexcept {
    EyeState c = sample.eye(Eye::combined);
    const EyeState& l = sample.eye(Eye::left);
    const EyeState& r = sample.eye(Eye::right);
    if (!c.valid && (l.valid || r.valid)) {
        c.valid = true;
        const auto ld = Direction<HeadFrame>::from(l.gaze_dir_head.vec()), rd = Direction<HeadFrame>::from(r.gaze_dir_head.vec());
        if (l.valid && r.valid && ld && rd)
            c.gaze_dir_head = Direction<HeadFrame>::from(ld->vec() + rd->vec()).value_or(*ld);
        else
            c.gaze_dir_head = l.valid && (ld || !r.valid) ? l.gaze_dir_head : r.gaze_dir_head;
    }
    const auto larger = [](double a, double b) { return std::isnan(a) || a < b ? b : a; };   // ignores the eye that is NaN
    if (std::isnan(c.openness)) c.openness = larger(l.openness, r.openness);
    if (std::isnan(c.pupil_mm)) c.pupil_mm = larger(l.pupil_mm, r.pupil_mm);
    if (std::isnan(c.confidence)) c.confidence = larger(l.confidence, r.confidence);
    return c;
}

}  // namespace fovea::pipeline
