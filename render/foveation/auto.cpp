#include "render/foveation/auto.hpp"

#include <algorithm>

#include "render/foveation/full.hpp"
#include "render/foveation/scaled_bins.hpp"

namespace fovea::foveation {

void ExecutorChoice::observe(Duration duration) noexcept {
    const double cost = to_seconds(duration);
    if (!(cost > 0)) return;
    const Way way = next();
    if (!warm_[way]) {
        warm_[way] = true;
        return;   // the same again
    }
    if (!trial_) {
        recent_[count_++ % recent_.size()] = cost;
        if (++since_trial_ >= interval_ && count_ >= recent_.size()) trial_ = true;
        return;
    }
    trial_ = false;
    since_trial_ = 0;
    auto sorted = recent_;
    std::nth_element(sorted.begin(), sorted.begin() + 2, sorted.end());
    if (cost < sorted[2] * (1 - kHysteresis)) {
        since_trial_ = interval_ - 1;   // confirm at once
        if (++wins_ < kConfirmations) return;
        settled_ = other(settled_);
        interval_ = kFirstInterval;
        count_ = 0;
        since_trial_ = 0;
    } else {
        interval_ = std::min(interval_ * 2, kLastInterval);
    }
    wins_ = 0;
}

Result<std::unique_ptr<Method>> Auto::create(const MethodSettings& settings) {
    auto foveated = ScaledBins::create(settings);
    if (!foveated) return foveated;
    auto full = Full::create(settings);
    if (!full) return full;
    return std::unique_ptr<Method>(new Auto(*std::move(foveated), *std::move(full)));
}

Result<void> Auto::prepare(std::span<const ViewTarget> targets) {
    foveation_possible_ = methods_[ExecutorChoice::foveated]->prepare(targets).has_value();   // else: in full
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
