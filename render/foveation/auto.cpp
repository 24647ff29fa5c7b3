#include "render/foveation/auto.hpp"

#include <algorithm>
#include <utility>

#include "render/foveation/full.hpp"
#include "render/foveation/scaled_bins.hpp"

namespace fovea::foveation {

void ExecutorChoice::choose_candidate() noexcept {
    // The others in turn.
    do candidate_ = static_cast<Way>((candidate_ + 1) % ways_);
    while (candidate_ == settled_);
}

void ExecutorChoice::observe(Duration duration) noexcept {
    const Way way = next();
    const double cost = to_seconds(duration) * (way == late ? late_weight_ : 1);
    if (!(cost > 0)) return;
    if (!warm_[way]) {
        warm_[way] = true;
        return;   // the same again
    }
    if (!trial_) {
        recent_[count_++ % recent_.size()] = cost;
        if (++since_trial_ >= interval_ && count_ >= recent_.size()) {
            if (wins_ == 0) choose_candidate();
            trial_ = true;
        }
        return;
    }
    trial_ = false;
    since_trial_ = 0;
    auto sorted = recent_;
    std::nth_element(sorted.begin(), sorted.begin() + 2, sorted.end());
    if (cost < sorted[2] * (1 - kHysteresis)) {
        since_trial_ = interval_ - 1;   // confirm at once
        if (++wins_ < kConfirmations) return;
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
    std::array<std::unique_ptr<Method>, 3> methods;
    for (const auto& [way, create] : {std::pair{ExecutorChoice::foveated, &create_scaled_bins}, {ExecutorChoice::full, &Full::create}, {ExecutorChoice::late, &ScaledBins::create_late}}) {
        if (way == ExecutorChoice::late && late_allowance == 0) continue;
        auto method = create(settings);
        if (!method) return method;
        methods[way] = *std::move(method);
    }
    return std::unique_ptr<Method>(new Auto(std::move(methods), late_allowance));
}

Result<void> Auto::prepare(std::span<const ViewTarget> targets) {
    foveation_possible_ = true;
    for (const auto way : {ExecutorChoice::foveated, ExecutorChoice::late})
        if (methods_[way] && !methods_[way]->prepare(targets)) foveation_possible_ = false;   // else: in full
    return methods_[ExecutorChoice::full]->prepare(targets);
}

FrameCost Auto::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                       std::span<const ViewFocus> focus) noexcept {
    drawn_ = &chosen();
    FrameCost cost = drawn_->submit(draws, targets, focus);
    cost.fell_back = cost.fell_back || !foveation_possible_;
    return cost;
}

void Auto::observe(Duration cost) noexcept {
    if (foveation_possible_) choice_.observe(cost);
}

}  // namespace fovea::foveation
