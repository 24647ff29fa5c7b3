#include "render/foveation/auto.hpp"

#include <algorithm>
#include <utility>

#include "render/foveation/full.hpp"

namespace fovea::foveation {

ExecutorChoice::ExecutorChoice(const Settings& s) noexcept : late_weight_(1 / (1 + s.late_allowance)) {
    possible_ = {true, true, s.late_allowance > 0, s.rectangles};
}

const char* ExecutorChoice::name(Way way) noexcept {
    switch (way) {
        case masks: return "level masks";
        case full: return "full";
        case late: return "late level 0";
        case rectangles: return "rectangle lists";
    }
    return "";
}

const char* ExecutorChoice::why() const noexcept {
    if (trial_) return "a trial of what it costs";
    for (std::size_t i = 0; i < kWays; ++i)
        if (possible_[i] && i != settled_ && !measured_[i]) return "not everything is measured yet";
    return settled_ == late ? "it latches last and costs little more" : "the cheapest by the last trials";
}

std::optional<ExecutorChoice::Switch> ExecutorChoice::take_switch() noexcept { return std::exchange(switch_, std::nullopt); }

void ExecutorChoice::choose_candidate() noexcept {
    // The others in turn.
    do candidate_ = static_cast<Way>((candidate_ + 1) % kWays);
    while (candidate_ == settled_ || !possible_[candidate_]);
}

double ExecutorChoice::median() const noexcept {
    auto sorted = recent_;
    std::nth_element(sorted.begin(), sorted.begin() + 2, sorted.end());
    return sorted[2];
}

void ExecutorChoice::observe(Duration duration) noexcept {
    const Way way = next();
    const double cost = to_seconds(duration) * weight(way);
    if (!(cost > 0)) return;
    if (!warm_[way]) {
        warm_[way] = true;
        return;   // the same again
    }
    if (!trial_) {
        recent_[count_++ % recent_.size()] = cost;
        if (interval_ > kFirstInterval && count_ >= recent_.size()) {   // another load: what was measured does not hold any more
            const double now = median();
            if (now > kOtherLoad * at_trial_ || kOtherLoad * now < at_trial_) interval_ = kFirstInterval;
        }
        if (++since_trial_ >= interval_ && count_ >= recent_.size()) {
            if (wins_ == 0) choose_candidate();
            trial_ = true;
        }
        return;
    }
    trial_ = false;
    since_trial_ = 0;
    measured_[way] = true;
    at_trial_ = median();
    if (cost < at_trial_ * (1 - kHysteresis)) {
        since_trial_ = interval_ - 1;   // confirm at once
        if (++wins_ < kConfirmations) return;
        switch_ = Switch{settled_, candidate_, seconds(at_trial_ / weight(settled_)), duration};
        measured_[settled_] = true;
        settled_ = candidate_;
        interval_ = kFirstInterval;
        count_ = 0;
        since_trial_ = 0;
    } else {
        interval_ = std::min(interval_ * 2, kLastInterval);
    }
    wins_ = 0;
}

Result<std::unique_ptr<Method>> Auto::create(const MethodSettings& settings) { return create_with(settings, 0); }

Result<std::unique_ptr<Method>> Auto::create_late(const MethodSettings& settings) {
    if (!(settings.late_allowance > 0 && settings.late_allowance <= 10))
        return fail("late_allowance is outside (0, 10]", "auto_late", "0.15 lets a late fovea cost 15 % more");
    return create_with(settings, settings.late_allowance);
}

Result<std::unique_ptr<Method>> Auto::create_with(const MethodSettings& settings, double late_allowance) {
    std::unique_ptr<Auto> chooser(new Auto);
    for (const auto& [into, create] : {std::pair{&chooser->bins_, &create_scaled_bins}, {&chooser->full_, &Full::create}, {&chooser->late_, &ScaledBins::create_late}}) {
        if (into == &chooser->late_ && late_allowance == 0) continue;
        auto method = create(settings);
        if (!method) return method;
        *into = *std::move(method);
    }
    chooser->own_bins_ = dynamic_cast<ScaledBins*>(chooser->bins_.get());
    chooser->choice_ = ExecutorChoice({.late_allowance = late_allowance, .rectangles = chooser->own_bins_ != nullptr});
    chooser->drawn_ = chooser->bins_.get();
    return std::unique_ptr<Method>(std::move(chooser));
}

Method& Auto::chosen() const noexcept {
    switch (way()) {
        case ExecutorChoice::full: return *full_;
        case ExecutorChoice::late: return *late_;
        default: return *bins_;
    }
}

std::string_view Auto::executor() const noexcept { return way() == ExecutorChoice::rectangles ? "scaled_bins, rectangle lists" : chosen().name(); }

std::optional<ExecutorSwitch> Auto::take_switch() noexcept {
    const auto s = choice_.take_switch();
    if (!s) return std::nullopt;
    return ExecutorSwitch{ExecutorChoice::name(s->from), ExecutorChoice::name(s->to), s->from_cost, s->to_cost};
}

Result<void> Auto::prepare(std::span<const ViewTarget> targets) {
    foveation_possible_ = true;
    for (Method* m : {bins_.get(), late_.get()})
        if (m != nullptr && !m->prepare(targets)) foveation_possible_ = false;   // else: in full
    return full_->prepare(targets);
}

FrameCost Auto::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                       std::span<const ViewFocus> focus) noexcept {
    drawn_ = &chosen();
    if (own_bins_ != nullptr) own_bins_->use(way() == ExecutorChoice::rectangles ? BinExecutor::rectangles : BinExecutor::masks);
    FrameCost cost = drawn_->submit(draws, targets, focus);
    if (!foveation_possible_) {
        cost.fell_back = true;
        cost.note = cost.why = "the targets of the levels could not be had";
    } else if (!cost.fell_back) {
        cost.why = choice_.why();
    }
    return cost;
}

void Auto::observe(Duration cost) noexcept {
    if (foveation_possible_) choice_.observe(cost);
}

}  // namespace fovea::foveation
