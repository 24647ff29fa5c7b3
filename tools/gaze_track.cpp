#include "tools/gaze_track.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "daemon/pipeline/validate.hpp"

namespace fovea::tools {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kGuardBefore_ns = 40 * kMs, kGuardAfter_ns = 60 * kMs, kHistory_ns = 40 * kMs;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

double median(std::vector<double> v) {
    if (v.empty()) return 0;
    const auto mid = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), mid, v.end());
    return *mid;
}

// The span of `spans` (sorted, disjoint) that holds t or is the last to begin before it; null if none.
template <class Spans>
auto* span_at(const Spans& spans, std::int64_t t) {
    auto after = std::upper_bound(spans.begin(), spans.end(), t, [](std::int64_t x, const auto& s) { return x < s.first; });
    return after == spans.begin() ? nullptr : &*std::prev(after);
}

}  // namespace

GazeTrack::GazeTrack(const replay::Recording& recording) {
    rate_hz_ = recording.info.nominal_rate_hz > 0 ? recording.info.nominal_rate_hz : replay::measured_rate_hz(recording);
    labelled_ = recording.info.has_labels;
    group_ = fmt::format("{} {:.0f} Hz", recording.info.device.empty() ? recording.info.format : recording.info.device, rate_hz_);
    collect(recording);
    find_saccades(recording);
    find_pursuit();
}

void GazeTrack::collect(const replay::Recording& recording) {
    pipeline::Validator validator;
    std::vector<double> intervals;
    std::int64_t bad_since = INT64_MAX, last = INT64_MIN;
    for (const auto& r : recording.samples) {
        EyeState eye = pipeline::combined_eye(r.sample);
        if (eye.openness < 0.3 || eye.pupil_mm <= 0 || eye.confidence < 0.6 || r.label == replay::Label::blink) eye.valid = false;
        const std::int64_t t = to_ns(r.sample.exposed);
        const auto c = validator.update(t, eye);
        if (c.verdict == pipeline::Verdict::duplicate || c.verdict == pipeline::Verdict::out_of_order) continue;
        if (c.verdict != pipeline::Verdict::good) {
            bad_since = std::min(bad_since, t);
            continue;
        }
        if (last != INT64_MIN && bad_since == INT64_MAX) {
            if (t - last > 100 * kMs) bad_since = last;  // nothing came: as good as invalid
            else intervals.push_back(static_cast<double>(t - last));
        }
        if (bad_since != INT64_MAX) {
            const Span span{bad_since - kGuardBefore_ns, t + kGuardAfter_ns};
            if (!blocked_.empty() && blocked_.back().second >= span.first) blocked_.back().second = span.second;
            else blocked_.push_back(span);
            bad_since = INT64_MAX;
        }
        // A synthetic recording knows where the eye really looked; else the raw gaze is all the truth there is.
        points_.push_back({t, r.truth_dir_head.value_or(c.gaze_dir_head), r.label == replay::Label::saccade, r.label == replay::Label::pursuit});
        last = t;
    }
    if (bad_since != INT64_MAX) blocked_.push_back({bad_since - kGuardBefore_ns, INT64_MAX});
    interval_ns_ = static_cast<std::int64_t>(median(intervals));
}

void GazeTrack::find_saccades(const replay::Recording& recording) {
    if (!recording.info.has_labels) {
        // Speeds over about 8 ms around each sample; onset at the median plus 5 robust deviations, and a peak of twice that.
        std::vector<double> speed(points_.size(), 0);
        for (std::size_t i = 1; i + 1 < points_.size(); ++i) {
            std::size_t a = i, b = i;
            while (a > 0 && points_[i].t_ns - points_[a].t_ns < 4 * kMs) --a;
            while (b + 1 < points_.size() && points_[b].t_ns - points_[i].t_ns < 4 * kMs) ++b;
            const std::int64_t dt = points_[b].t_ns - points_[a].t_ns;
            if (dt > 0 && dt < 100 * kMs)
                speed[i] = angle_between(points_[a].gaze, points_[b].gaze) * kDegreesPerRadian / (static_cast<double>(dt) * 1e-9);
        }
        const double middle = median(speed);
        std::vector<double> off(speed.size());
        for (std::size_t i = 0; i < off.size(); ++i) off[i] = std::fabs(speed[i] - middle);
        const double onset = std::max(20.0, middle + 5 * 1.4826 * median(off)), peak = std::max(40.0, 2 * onset - middle);
        for (std::size_t i = 0; i < points_.size();) {
            if (speed[i] < onset) { ++i; continue; }
            std::size_t j = i;
            double top = 0;
            for (; j < points_.size() && speed[j] >= onset; ++j) top = std::max(top, speed[j]);
            if (top >= peak && points_[j - 1].t_ns - points_[i].t_ns >= std::min<std::int64_t>(8 * kMs, interval_ns_))
                for (std::size_t k = i; k < j; ++k) points_[k].saccade = true;
            i = j;
        }
    }
    for (std::size_t i = 0; i < points_.size();) {
        if (!points_[i].saccade) { ++i; continue; }
        std::size_t j = i;
        while (j + 1 < points_.size() && points_[j + 1].saccade && points_[j + 1].t_ns - points_[j].t_ns < 100 * kMs) ++j;
        saccades_.push_back({points_[i].t_ns, points_[j].t_ns});
        i = j + 1;
    }
}

void GazeTrack::find_pursuit() {
    if (labelled_ && std::any_of(points_.begin(), points_.end(), [](const Point& p) { return p.pursuit; })) return;
    // Smooth movement: 60 ms on either side go the same way at 4 to 80 deg/s, with no saccade between.
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const std::int64_t t = points_[i].t_ns;
        const auto a = truth(t - 60 * kMs), b = truth(t + 60 * kMs);
        if (!a || !b) continue;
        const Span* s = span_at(saccades_, t + 70 * kMs);
        if (s && s->second > t - 70 * kMs) continue;
        const Tangent before = -1.0 * log_map(points_[i].gaze, *a), after = log_map(points_[i].gaze, *b);
        const double la = length(before), lb = length(after);
        const double speed = length(before + after) * kDegreesPerRadian / 0.12;
        if (speed < 4 || speed > 80 || std::min(la, lb) < 0.4 * std::max(la, lb)) continue;
        points_[i].pursuit = (before.u * after.u + before.v * after.v) > 0.85 * la * lb;
    }
}

double GazeTrack::seconds() const noexcept { return static_cast<double>(points_.size()) * static_cast<double>(interval_ns_) * 1e-9; }

std::size_t GazeTrack::at(std::int64_t t_ns) const noexcept {
    const auto it = std::upper_bound(points_.begin(), points_.end(), t_ns, [](std::int64_t x, const Point& p) { return x < p.t_ns; });
    return it == points_.begin() ? kNone : static_cast<std::size_t>(it - points_.begin()) - 1;
}

bool GazeTrack::blocked(std::int64_t t_ns) const noexcept {
    const Span* s = span_at(blocked_, t_ns);
    return s && t_ns <= s->second;
}

std::optional<Direction<HeadFrame>> GazeTrack::truth(std::int64_t t_ns) const noexcept {
    const std::size_t i = at(t_ns);
    if (i == kNone || i + 1 >= points_.size() || blocked(t_ns)) return std::nullopt;
    const Point &p = points_[i], &q = points_[i + 1];
    if (q.t_ns - p.t_ns > std::max<std::int64_t>(4 * interval_ns_, 20 * kMs)) return std::nullopt;
    return slerp(p.gaze, q.gaze, static_cast<double>(t_ns - p.t_ns) / static_cast<double>(q.t_ns - p.t_ns));
}

bool GazeTrack::judged(std::int64_t t_ns) noexcept {
    const std::size_t i = at(t_ns);
    if (i == kNone || points_[i].t_ns != t_ns || blocked(t_ns)) return false;
    if (points_[0].t_ns > t_ns - kHistory_ns || blocked(t_ns - kHistory_ns)) return false;
    if (last_judged_ns_ != INT64_MIN && t_ns - last_judged_ns_ < 4 * kMs && rate_hz_ >= 240) return false;
    last_judged_ns_ = t_ns;
    return true;
}

unsigned GazeTrack::classes(std::int64_t t_ns, std::int64_t horizon_ns) const noexcept {
    const std::int64_t target = t_ns + horizon_ns;
    const Span* now = span_at(saccades_, t_ns);
    const Span* then = span_at(saccades_, target);
    const bool seen = now && t_ns <= now->second;
    const bool inside = then && target <= then->second;
    const bool between = seen || (then && then->first > t_ns);
    unsigned c = kAll;
    if (seen) c |= kOnsetSeen;
    if (inside) c |= kInSaccade;
    if (then && then->first > t_ns && !seen) c |= kOnsetUnseen;
    if (between && !inside) c |= kLanding;
    if (!between) {
        c |= kFixation;
        const std::size_t i = at(t_ns);
        if (i != kNone && points_[i].pursuit) c |= kPursuit;
    }
    return c;
}

}  // namespace fovea::tools
