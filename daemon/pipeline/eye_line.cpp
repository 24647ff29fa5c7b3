#include "daemon/pipeline/eye_line.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/head_motion.hpp"
#include "daemon/pipeline/main_sequence.hpp"

namespace fovea::pipeline {
namespace {

// After a gap this long nothing that was known of the motion still holds: at 40 ms an eye may have made a saccade.
constexpr std::int64_t kForget_ns = 40'000'000;
constexpr float kOneDegree_rad = static_cast<float>(1 / kDegreesPerRadian);
constexpr double kHeadTurns_rad_s = 0.09;  // 5 deg/s: slower than that a head sways all the time
constexpr double kLongAgo_ms = 300;      // the networks do not look further back
constexpr float kWidest_rad = 1.5f;      // a radius that covers any display
constexpr double kNoiseSpan_s = 6e-3;    // over which the noise speed is measured (classifier.cpp)

}  // namespace

Result<EyeLine> EyeLine::create(const PipelineSettings& settings) {
    auto filter = Filter::create(settings);
    if (!filter) return std::unexpected(filter.error());
    auto predictor = Predictor::create(settings.predictor);
    if (!predictor) return std::unexpected(predictor.error());
    return EyeLine(settings, *std::move(filter), *std::move(predictor));
}

EyeLine::EyeLine(const PipelineSettings& s, Filter filter, Predictor predictor) noexcept
    : guard_before_ns_{seconds(s.blink.guard_before_ms * 1e-3).count()},
      gate_{s.blink},
      loss_{s.loss},
      shown_{std::max<std::int64_t>(guard_before_ns_ / 16, 1'000'000)},
      classifier_{s.classifier},
      filter_{std::move(filter)},
      predictor_{std::move(predictor)},
      judge_{predictor_.adaptive()} {}

void EyeLine::reset() noexcept {
    validator_.reset();
    gate_.reset();
    loss_.reset();
    forget_motion();
    classifier_.reset();
    judge_.reset();
    motion_ = {};
}

void EyeLine::forget_motion() noexcept {
    unjudged_ = unforeseen_ = false;
    raw_.clear();
    shown_.clear();
    classifier_.forget_motion();
    filter_.reset();
    predictor_.reset();
    judge_.forget_pending();
}

void EyeLine::settle() noexcept {
    if (!std::exchange(unjudged_, false)) return;
    if (std::exchange(unforeseen_, false)) {
        predictor_.update({raw_, classifier_.now(), features_, net_, Phase::quiet, filtered_}, ahead_);
        judge_.complete(ahead_);
    }
    judge_.observe(raw_.time_ns(0), raw_.direction(0));
}

void EyeLine::stand_in_for(const EyeLine& other, Instant exposed, const EyeState& eye, Vec3<HeadFrame> head_rad_s) noexcept {
    validator_ = other.validator_;
    gate_ = other.gate_;
    loss_ = other.loss_;
    raw_ = other.raw_;
    shown_ = other.shown_;
    classifier_ = other.classifier_;
    filter_ = other.filter_;
    predictor_ = other.predictor_;
    ahead_ = other.ahead_;
    unjudged_ = unforeseen_ = false;
    motion_ = other.motion_;
    judge_.believe_as(other.judge_);
    other.judge_.prefetch();
    update(exposed, eye, head_rad_s);
}

// One piece of code with all that is called from here, but for what is rare (gnu::noinline).
[[gnu::flatten]] Verdict EyeLine::update(Instant exposed, const EyeState& eye, Vec3<HeadFrame> head_rad_s) noexcept {
    settle();
    const Validator::Checked checked = validator_.update(to_ns(exposed), eye);
    if (checked.verdict == Verdict::duplicate || checked.verdict == Verdict::out_of_order) return checked.verdict;
    const GateState before = gate_.state();
    const GateState gate = gate_.update(to_ns(exposed), checked.verdict == Verdict::good, eye);
    switch (gate) {
        case GateState::open:
            use(exposed, checked.gaze_dir_head, head_rad_s);
            break;
        case GateState::drop_out:
            loss_.invalid();
            break;
        case GateState::blink:
            loss_.invalid();
            if (before != gate) ++blinks_;
            go_blind(GazeEvent::blink);
            break;
        case GateState::lost:
            loss_.invalid();
            if (before != gate) ++losses_;
            go_blind(GazeEvent::lost);
            break;
    }
    if (checked.verdict == Verdict::good && gate != GateState::open) return Verdict::invalid;
    return checked.verdict;
}

void EyeLine::use(Instant exposed, Direction<HeadFrame> gaze_dir_head, Vec3<HeadFrame> head_rad_s) noexcept {
    const std::int64_t t = to_ns(exposed);
    if (raw_.size() > 0 && t - raw_.time_ns(0) > kForget_ns) forget_motion();
    raw_.push(t, gaze_dir_head);
    const Classified& now = classifier_.update(raw_);
    const bool lid = now.lid && now.event == GazeEvent::saccade;
    const Direction<HeadFrame> smooth = filter_.update(t, gaze_dir_head, now);
    filtered_ = Plane(lid ? now.start_dir_head : smooth);
    const Plane& filtered = filtered_;
    shown_.push(t, filtered.at);
    predict(t, filtered, now, head_rad_s);

    motion_.reference = exposed;
    motion_.gaze_dir_head = filtered.at;
    motion_.velocity_rad_s = lid ? Tangent{} : carried(raw_.plane(), filtered, now.fast_rad_s);
    motion_.event = lid ? GazeEvent::blink : now.event;
    if (motion_.event == GazeEvent::saccade) fill_saccade(now, gaze_dir_head);
    loss_.valid(exposed, filtered.at);
    loss_.fill(motion_);
}

void EyeLine::predict(std::int64_t t, const Plane& filtered, const Classified& now, Vec3<HeadFrame> head_rad_s) noexcept {
    features_ = motion_features(raw_, now.fast_rad_s);
    net_ = net_input(features_, now.noise_deg_s, now.any_saccade ? static_cast<double>(t - now.onset_ns) * 1e-6 : kLongAgo_ms);
    Phase phase = phase_of(now, features_, t);
    const bool still = phase == Phase::quiet || phase == Phase::stirring || phase == Phase::pursuit;
    if (still && predictor_.adaptive() && dot(head_rad_s, head_rad_s) > kHeadTurns_rad_s * kHeadTurns_rad_s) phase = Phase::turning;
    const bool lid = now.lid && now.event == GazeEvent::saccade;
    // In most fixations nothing that the network says proved worth believing: then it is asked after publication, to learn.
    unforeseen_ = !lid && predictor_.adaptive() && phase != Phase::turning && judge_.holds(phase);
    if (!unforeseen_) predictor_.update({raw_, now, features_, net_, phase, filtered, head_rad_s}, ahead_);
    if (lid || unforeseen_) ahead_.du_rad.fill(0), ahead_.dv_rad.fill(0);
    const NetRadii radii = net_radii(net_);
    for (std::size_t h = 0; h < kHorizonLanes; h += 4) {
        store_four(&ahead_.radius68_rad[h], at_most(load_four(&radii.r68_deg[h]) * kOneDegree_rad, kWidest_rad));
        store_four(&ahead_.radius95_rad[h], at_most(load_four(&radii.r95_deg[h]) * kOneDegree_rad, kWidest_rad));
    }
    ahead_.raw_offset = lid ? Tangent{} : nearby(filtered, raw_.direction(0));
    unjudged_ = !lid;
    if (lid) judge_.forget_pending();  // nothing that was foreseen is judged by where the lid drags the gaze
    judge_.apply(t, filtered.at, phase, ahead_);
    // The present: the noise that is left in one sample.
    const float present = static_cast<float>(now.noise_deg_s * kNoiseSpan_s / kDegreesPerRadian);
    motion_.horizons[0] = {0, 0, std::min(present, ahead_.radius68_rad[0]), std::min(2 * present, ahead_.radius95_rad[0])};
    for (std::size_t h = 0; h < kAhead; ++h)
        motion_.horizons[h + 1] = {ahead_.du_rad[h], ahead_.dv_rad[h], std::min(ahead_.radius68_rad[h], kWidest_rad),
                                   std::min(ahead_.radius95_rad[h], kWidest_rad)};
}

void EyeLine::fill_saccade(const Classified& now, Direction<HeadFrame> gaze) noexcept {
    const Tangent travelled = log_map(now.start_dir_head, gaze);
    const double length_deg = length(travelled) * kDegreesPerRadian;
    const double amplitude_deg = std::clamp(std::max(length_deg, MainSequence::amplitude_deg(now.peak_deg_s)), 0.0,
                                            std::max(length_deg, MainSequence::kLargest_deg));
    motion_.saccade.onset = instant_from_ns(now.onset_ns);
    motion_.saccade.duration = seconds(MainSequence::duration_s(amplitude_deg));
    motion_.saccade.start_dir_head = now.start_dir_head;
    motion_.saccade.landing_dir_head =
        length_deg > 1e-6 ? exp_map(now.start_dir_head, (amplitude_deg / length_deg) * travelled) : gaze;
}

void EyeLine::go_blind(GazeEvent event) noexcept {
    if (motion_.event == event || !motion_.ever_valid) {
        motion_.event = event;
        return;
    }
    // The lid drags the measured gaze along before the eye counts as closed: go back to before that.
    if (motion_.event != GazeEvent::blink && motion_.event != GazeEvent::lost)
        motion_.gaze_dir_head = shown_.at_or_before(to_ns(motion_.reference) - guard_before_ns_, motion_.gaze_dir_head);
    forget_motion();
    motion_.event = event;
    motion_.velocity_rad_s = {};
    for (std::size_t i = 0; i < kHorizons_ns.size(); ++i) {
        const Radii r = blind_radii(kHorizons_ns[i]);
        motion_.horizons[i] = {0, 0, static_cast<float>(r.radius68_rad), static_cast<float>(r.radius95_rad)};
    }
    loss_.hold(motion_.gaze_dir_head);
}

}  // namespace fovea::pipeline
