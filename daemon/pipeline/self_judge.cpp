#include "daemon/pipeline/self_judge.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::pipeline {
namespace {

// Prior belief per phase, and how many judgements it is worth. In a quiet fixation hold is right until proven wrong;
// in a saccade the network is.
constexpr std::array<double, kPhases> kPrior = {0, 0.5, 0.75, 1, 1, 0, 0.75};
constexpr double kPriorWeight = 100;   // 0.4 s of fixation, about ten saccades
constexpr double kPriorStrength = 0.3; // relative error that the prior charges a belief which is off by 1
constexpr double kPriorRaw = 0.5;       // how far off the filtered gaze counts as a start
constexpr double kMemory = 2000;       // judgements after which half is forgotten, nearly
constexpr float kFirstStep = 0.2f, kLastStep = 0.02f;  // share by which one judgement moves a radius factor, at most
constexpr float kFactorBound = 32;
constexpr std::int64_t kLongestGap_ns = 25'000'000;  // between samples: beyond it, the truth between them is a guess

double norm(Tangent t) noexcept { return std::sqrt(t.u * t.u + t.v * t.v); }

void step_quantile(float& factor, bool outside, float share_outside, float step) noexcept {
    factor *= 1 + step * ((outside ? 1.0f : 0.0f) - share_outside);
    factor = std::clamp(factor, 1 / kFactorBound, kFactorBound);
}

}  // namespace

SelfJudge::SelfJudge(bool adaptive) noexcept : adaptive_{adaptive} { reset(); }

void SelfJudge::reset() noexcept {
    forget_pending();
    for (std::size_t p = 0; p < kPhases; ++p)
        for (Cell& c : cells_[p]) {
            c = {};
            const auto prior = static_cast<std::uint8_t>(kShares.size() + static_cast<std::size_t>(kPrior[p] * 4));
            c.choice = adaptive_ ? prior : static_cast<std::uint8_t>(kShares.size() - 1);
        }
}

void SelfJudge::forget_pending() noexcept {
    next_.fill(noted_);
    any_ = false;
}

SelfJudge::Belief SelfJudge::belief(Phase phase, std::size_t ahead) const noexcept {
    const std::size_t c = cells_[static_cast<std::size_t>(phase)][ahead].choice;
    return {kShares[c % kShares.size()], c >= kShares.size()};
}

void SelfJudge::observe(std::int64_t t_ns, Direction<HeadFrame> raw) noexcept {
    const bool gap = !any_ || t_ns - last_ns_ > kLongestGap_ns;
    for (std::size_t h = 0; h < kAhead; ++h) {
        std::uint64_t& n = next_[h];
        if (noted_ - n > kPending) n = noted_ - kPending;  // overwritten before they were due
        for (; n < noted_; ++n) {
            const Pending& p = ring_[n % kPending];
            const std::int64_t due = p.t_ns + kHorizons_ns[h + 1];
            if (due > t_ns) break;
            if (gap || due < last_ns_) continue;
            const TangentBasis<HeadFrame> basis(p.from);
            const Tangent a = nearby(basis, p.from, last_), b = nearby(basis, p.from, raw);
            const double share = static_cast<double>(due - last_ns_) / static_cast<double>(t_ns - last_ns_);
            judge(cells_[static_cast<std::size_t>(p.phase)][h], p, h, a + share * (b - a));
        }
    }
    any_ = true;
    last_ns_ = t_ns;
    last_ = raw;
}

void SelfJudge::judge(Cell& c, const Pending& p, std::size_t h, Tangent truth) noexcept {
    const double keep = c.weight > kMemory ? 1 - 1 / kMemory : 1;
    c.weight = c.weight * keep + 1;
    double error = 0;  // of the choice that was made then
    const Tangent from_raw = truth - p.raw_offset;
    for (std::size_t s = 0; s < kChoices; ++s) {
        const double e = norm((s < kShares.size() ? truth : from_raw) - kShares[s % kShares.size()] * p.full[h]);
        c.error[s] = c.error[s] * keep + e;
        if (s == p.choice[h]) error = e;
    }
    const float step = std::max(kLastStep, kFirstStep / (1 + 0.05f * static_cast<float>(c.weight)));
    step_quantile(c.factor68, error > static_cast<double>(p.radius68_rad[h]), 0.32f, step);
    step_quantile(c.factor95, error > static_cast<double>(p.radius95_rad[h]), 0.05f, step);
    if (adaptive_) choose(c, p.phase);
}

void SelfJudge::choose(Cell& c, Phase phase) noexcept {
    const double typical = c.error[0] / c.weight;
    double best = 0;
    for (std::size_t s = 0; s < kChoices; ++s) {
        const double off = kShares[s % kShares.size()] - kPrior[static_cast<std::size_t>(phase)];
        const double off_raw = s < kShares.size() ? kPriorRaw : 0;
        const double cost = c.error[s] + kPriorWeight * kPriorStrength * typical * (off * off + off_raw * off_raw);
        if (s == 0 || cost < best) {
            best = cost;
            c.choice = static_cast<std::uint8_t>(s);
        }
    }
}

void SelfJudge::prefetch() const noexcept {
    constexpr std::size_t kLine = 64;
    const Pending& last = ring_[(noted_ + kPending - 1) % kPending];
    const auto ask = [](const void* at, std::size_t bytes) {
        for (std::size_t b = 0; b < bytes; b += kLine) __builtin_prefetch(static_cast<const char*>(at) + b, 1);
    };
    ask(&cells_[static_cast<std::size_t>(last.phase)], sizeof cells_[0]);
    ask(&ring_[noted_ % kPending], sizeof(Pending));
}

void SelfJudge::apply(std::int64_t t_ns, Direction<HeadFrame> filtered, Phase phase, Ahead& ahead) noexcept {
    const auto& cells = cells_[static_cast<std::size_t>(phase)];
    const bool remember = noted_ == 0 || next_[0] == noted_ || t_ns - ring_[(noted_ - 1) % kPending].t_ns >= kSpacing_ns;
    Pending& p = ring_[noted_ % kPending];
    for (std::size_t h = 0; h < kAhead; ++h) {
        const Cell& c = cells[h];
        const Tangent full = ahead.displacement[h];
        ahead.displacement[h] = kShares[c.choice % kShares.size()] * full;
        if (c.choice >= kShares.size()) ahead.displacement[h] = ahead.displacement[h] + ahead.raw_offset;
        ahead.radius68_rad[h] *= c.factor68;
        ahead.radius95_rad[h] *= c.factor95;
        ahead.radius95_rad[h] = std::max(ahead.radius95_rad[h], ahead.radius68_rad[h]);
        if (!remember) continue;
        p.full[h] = full;
        p.choice[h] = c.choice;
        p.radius68_rad[h] = ahead.radius68_rad[h];
        p.radius95_rad[h] = ahead.radius95_rad[h];
    }
    if (!remember) return;
    p.t_ns = t_ns;
    p.from = filtered;
    p.phase = phase;
    p.raw_offset = ahead.raw_offset;
    ++noted_;
}

}  // namespace fovea::pipeline
