#include "render/quality/governor.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::quality {
namespace {

constexpr double kAgree = 0.10;   // two measurements of a step that differ by less say the same
// A step down aims below the budget, so that the noise of the frames does not ask for another one at once.
constexpr double kDownAim = 0.95;

}  // namespace

const char* to_string(Reason reason) noexcept {
    switch (reason) {
        case Reason::over_budget: return "over the budget";
        case Reason::headroom: return "a better one fits";
        case Reason::cannot_hold: return "over the budget at the cheapest setting";
    }
    return "";
}

Result<Governor> Governor::create(const GovernorSettings& s, std::span<const double> costs, std::size_t start) {
    const auto bad = [](const char* what, const char* way_out) { return fail(what, "quality governor", way_out); };
    if (s.budget < std::chrono::microseconds(100) || s.budget > std::chrono::seconds(100)) return bad("a budget out of range", "use 0.1 ms to 100 s");
    if (!(s.up_at >= 0.3 && s.up_at <= 0.97)) return bad("up_at out of range", "use 0.3 to 0.97 of the budget");
    if (s.window < 3 || s.window > 31 || s.window % 2 == 0) return bad("a window that cannot be", "use an odd number of 3 to 31 frames");
    if (s.settle < 0 || s.settle > 100 || s.up_dwell < Duration{} || s.retry < Duration{} || !(s.load_changed >= 0 && s.load_changed <= 1))
        return bad("a time or share out of range", "durations are not negative, settle is 0 to 100 frames, load_changed 0 to 1");
    if (costs.empty() || costs.size() > kMaxSettings) return bad("a ladder without settings, or with more than 32", "give 1 to 32");
    for (std::size_t i = 0; i < costs.size(); ++i)
        if (!(costs[i] > 0) || !std::isfinite(costs[i]) || (i > 0 && !(costs[i] < costs[i - 1])))
            return bad("costs that do not fall from setting to setting", "order the settings from dear to cheap, costs positive");
    if (start >= costs.size()) return bad("a start that is not on the ladder", "0 is the best setting");
    Governor g;
    g.settings_ = s;
    std::ranges::copy(costs, g.costs_.begin());
    g.count_ = costs.size();
    g.setting_ = start;
    g.settling_ = s.settle;
    return g;
}

double Governor::median_s() const noexcept {
    std::array<double, 31> sorted = recent_;
    const auto middle = sorted.begin() + settings_.window / 2;
    std::nth_element(sorted.begin(), middle, sorted.begin() + settings_.window);
    return *middle;
}

// What the next better setting would cost now.
double Governor::predicted_up_s(double median, Instant now) noexcept {
    Step& step = steps_[setting_ - 1];
    if (step.ratio > 0) {
        if (std::abs(median - step.load_s) > settings_.load_changed * step.load_s) step = {};
        // Measured only once, and that long ago: perhaps by chance. Once more; the measurement stays, to be agreed with.
        else if (step.agreed >= 2 || now - step.at < settings_.retry) return median * step.ratio;
    }
    return median * costs_[setting_ - 1] / costs_[setting_];
}

// The first full window after a step up: what it really cost.
void Governor::learn(double median, Instant now) noexcept {
    Step& step = steps_[setting_];
    const double ratio = median / below_s_;
    const bool same = step.ratio > 0 && std::abs(ratio - step.ratio) <= kAgree * step.ratio;
    step = {ratio, below_s_, now, same ? step.agreed + 1 : 1};
}

void Governor::note(const Change& change) noexcept {
    if (made_ - taken_ == kKeptChanges) {
        ++taken_;
        ++lost_;
    }
    ring_[made_++ % kKeptChanges] = change;
}

std::optional<Change> Governor::take_change() noexcept {
    if (taken_ == made_) return std::nullopt;
    return ring_[taken_++ % kKeptChanges];
}

void Governor::move(std::size_t to, Reason reason, double median, double predicted, Instant now) noexcept {
    note({now, setting_, to, reason, seconds(median), seconds(predicted), settings_.budget});
    came_up_ = to < setting_;
    below_s_ = median;
    setting_ = to;
    seen_ = 0;
    settling_ = settings_.settle;
    headroom_ = told_cannot_ = false;
}

void Governor::observe(Instant now, Duration cost) noexcept {
    if (cost <= Duration{}) return;
    if (settling_ > 0) {
        --settling_;
        return;
    }
    const auto window = static_cast<std::size_t>(settings_.window);
    recent_[seen_++ % window] = to_seconds(cost);
    if (seen_ < window) return;
    const double median = median_s(), budget = to_seconds(settings_.budget);
    if (came_up_) {
        learn(median, now);
        came_up_ = false;
    }
    if (median > budget) {
        headroom_ = false;
        if (setting_ + 1 == count_) {
            if (!told_cannot_) note({now, setting_, setting_, Reason::cannot_hold, seconds(median), seconds(median), settings_.budget});
            told_cannot_ = true;
            return;
        }
        std::size_t to = setting_ + 1;
        const auto predicted = [&](std::size_t i) { return median * costs_[i] / costs_[setting_]; };
        while (to + 1 < count_ && predicted(to) > kDownAim * budget) ++to;
        return move(to, Reason::over_budget, median, predicted(to), now);
    }
    if (median <= settings_.up_at * budget) told_cannot_ = false;   // not at every dip of the noise
    if (setting_ == 0) return;
    const double up = predicted_up_s(median, now);
    if (!(up <= settings_.up_at * budget)) {
        headroom_ = false;
        return;
    }
    if (!headroom_) {
        headroom_ = true;
        headroom_since_ = now;
    }
    // Not on a frame that is itself over the budget: perhaps the first of many.
    if (now - headroom_since_ >= settings_.up_dwell && to_seconds(cost) <= budget) move(setting_ - 1, Reason::headroom, median, up, now);
}

}  // namespace fovea::quality
