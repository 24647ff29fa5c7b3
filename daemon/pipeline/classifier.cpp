#include "daemon/pipeline/classifier.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::pipeline {
namespace {

constexpr std::int64_t kFastWindow_ns = 6'000'000;       // longer smears the onset, shorter drowns it in noise; what predictors are fitted to
constexpr std::int64_t kQuickWindow_ns = 5'000'000;      // for onset and end: ends a saccade a millisecond sooner
constexpr std::int64_t kConfirm_ns = 1'500'000;          // a faster tracker must show a second sample above
constexpr double kTwoSamples = 0.8;                      // and may therefore ask less of each: share of noise_factor
constexpr double kAtOnce = 1.5;                          // or one sample this many times above
constexpr std::int64_t kLongestSaccade_ns = 150'000'000; // 40 degrees take 110 ms; what lasts longer is none
constexpr double kLearn_s = 0.15;                        // of noise before the first saccade can be told from it
// A closing lid drags the measured gaze 12 to 18 degrees down at 650 to 1450 deg/s; eyes end at 530 (main sequence).
constexpr double kLid_deg_s = 620;
constexpr std::int64_t kSwing_ns = 40'000'000;           // post-saccadic oscillation lasts 10 to 40 ms
constexpr double kSwing = 0.4;                           // and its speed is a fraction of the saccade's
constexpr double kPeakEnd = 0.15;                        // a saccade has ended at this share of its peak speed

}  // namespace

Classifier::Classifier(const ClassifierSettings& s) noexcept
    : settings_{s},
      pursuit_window_ns_{seconds(s.pursuit_window_ms * 1e-3).count()},
      trail_{pursuit_window_ns_ / 24} {}

void Classifier::forget_motion() noexcept {
    const double onset_noise = now_.noise_deg_s;
    now_ = {};
    now_.noise_deg_s = onset_noise;
    trail_.clear();
    above_ = 0;
    any_ = false;
}

void Classifier::track_noise(double speed_deg_s, double dt_s) noexcept {
    // A running median: up by a step when above, down when below. The step is a share of the estimate itself that
    // starts large and settles at 1 % per 10 ms.
    noise_age_s_ += dt_s;
    if (noise_median_deg_s_ <= 0) noise_median_deg_s_ = std::clamp(speed_deg_s, 1.0, 300.0);
    const double rate = std::clamp(0.2 / std::max(noise_age_s_, 1e-3), 1.0, 20.0);  // 1/s
    const double step = std::min(0.25, rate * dt_s);
    noise_median_deg_s_ *= speed_deg_s > noise_median_deg_s_ ? 1 + step : 1 - step;
    noise_median_deg_s_ = std::clamp(noise_median_deg_s_, 0.1, 1000.0);
    now_.noise_deg_s = noise_median_deg_s_;
}

void Classifier::update_slow(std::int64_t t_ns, const Plane& gaze) noexcept {
    trail_.push(t_ns, gaze.at);
    now_.slow_rad_s = {};
    if (trail_.size() < 6) return;
    // Two halves of the window must move, and move the same way.
    const Tangent mid = nearby(gaze, trail_.at_or_before(t_ns - pursuit_window_ns_ / 2, gaze.at));
    std::size_t old = 0;
    while (old + 1 < trail_.size() && t_ns - trail_.time_ns(old) < pursuit_window_ns_) ++old;
    const double span = static_cast<double>(t_ns - trail_.time_ns(old)) * 1e-9;
    if (span < 0.6e-9 * static_cast<double>(pursuit_window_ns_)) return;
    const Tangent first = mid - nearby(gaze, trail_.direction(old));
    const Tangent second = -1.0 * mid;
    const double lf = norm(first), ls = norm(second);
    const double speed_deg_s = norm(first + second) / span * kDegreesPerRadian;
    if (speed_deg_s < settings_.pursuit_min_deg_s || lf < 1e-9 || ls < 1e-9) return;
    const double agreement = (first.u * second.u + first.v * second.v) / (lf * ls);
    if (agreement < 0.7 || std::min(lf, ls) < 0.3 * std::max(lf, ls)) return;
    now_.slow_rad_s = (1 / span) * (first + second);
}

void Classifier::begin_saccade(const History& raw, double speed_deg_s, double span_s) noexcept {
    now_.event = GazeEvent::saccade;
    // The slope over the window passes the threshold about half a window after the eye has left.
    now_.onset_ns = above_since_ns_ - std::min<std::int64_t>(kFastWindow_ns / 2, seconds(span_s / 2).count());
    for (std::size_t i = 0; i < raw.size(); ++i) {
        now_.start_dir_head = raw.direction(i);
        if (raw.time_ns(i) <= now_.onset_ns) break;
    }
    now_.peak_deg_s = speed_deg_s;
    now_.any_saccade = true;
    now_.lid = false;
    now_.slow_rad_s = {};
    trail_.clear();
}

const Classified& Classifier::update(const History& raw) noexcept {
    if (raw.size() == 0) return now_;
    const std::int64_t t_ns = raw.time_ns(0);
    const double dt = any_ ? std::min(static_cast<double>(t_ns - last_ns_) * 1e-9, 0.1) : 0;
    any_ = true;
    last_ns_ = t_ns;
    const std::size_t within_fast = raw.within(kFastWindow_ns, 2), within_quick = raw.within(kQuickWindow_ns, 2);
    const Slope fast = raw.slope(within_fast);
    now_.fast_rad_s = fast.velocity_rad_s;
    if (fast.samples < 2) {
        now_.event = GazeEvent::fixation;
        return now_;
    }
    const Tangent quick_rad_s = within_quick == within_fast ? fast.velocity_rad_s : raw.slope(within_quick).velocity_rad_s;
    const double relative = norm(quick_rad_s - now_.slow_rad_s) * kDegreesPerRadian;
    const bool one_is_enough = dt * 1e9 > static_cast<double>(kConfirm_ns);
    const double factor = one_is_enough ? settings_.noise_factor : kTwoSamples * settings_.noise_factor;
    const double threshold = std::max(settings_.min_onset_deg_s, factor * noise_median_deg_s_);
    now_.speed_deg_s = relative;
    now_.threshold_deg_s = threshold;

    // Saccades take a tenth of the time: they hardly move a median, so it may see them, and noise of any size is learned.
    track_noise(relative, dt);
    if (now_.event != GazeEvent::saccade) {
        // After a landing the speed must first have come down, or a new saccade would begin in the tail of the old one.
        armed_ = armed_ || relative < threshold || relative > 0.5 * now_.peak_deg_s;
        // The lens goes on swinging for a while: what is small beside the saccade just over is no new one.
        const bool swinging = now_.any_saccade && t_ns - now_.end_ns < kSwing_ns && relative < kSwing * now_.peak_deg_s;
        if (relative > threshold && armed_ && !swinging && noise_age_s_ > kLearn_s) {
            if (above_++ == 0) above_since_ns_ = t_ns;
        } else {
            above_ = 0;
        }
        const bool confirmed = above_ >= 2 || (above_ == 1 && (one_is_enough || relative > kAtOnce * threshold));
        if (confirmed) {
            begin_saccade(raw, relative, fast.span_s);
        } else if (above_ == 0) {
            update_slow(t_ns, raw.plane());
            now_.event = norm(now_.slow_rad_s) > 0 ? GazeEvent::pursuit : GazeEvent::fixation;
        }
        return now_;
    }

    now_.peak_deg_s = std::max(now_.peak_deg_s, relative);
    // Only the speed onwards counts: a swing back is no longer the saccade.
    const Tangent come = -1.0 * nearby(raw.plane(), now_.start_dir_head);
    const double way = norm(come);
    const double onwards = way > 1e-6 ? (come.u * quick_rad_s.u + come.v * quick_rad_s.v) / way * kDegreesPerRadian : relative;
    now_.lid = now_.lid || (relative > kLid_deg_s && std::fabs(come.v) > 2 * std::fabs(come.u) && threshold < 0.25 * kLid_deg_s);
    const double end = std::max(settings_.end_ratio * threshold, kPeakEnd * now_.peak_deg_s);
    if (onwards < end || t_ns - now_.onset_ns > kLongestSaccade_ns) {
        now_.event = GazeEvent::fixation;
        now_.end_ns = t_ns;
        above_ = 0;
        armed_ = false;
    }
    return now_;
}

}  // namespace fovea::pipeline
