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

void step_quantile(float& factor, bool outside, float share_outside, float step) noexcept {
    factor *= 1 + step * ((outside ? 1.0f : 0.0f) - share_outside);
    factor = std::clamp(factor, 1 / kFactorBound, kFactorBound);
}

}  // namespace

SelfJudge::SelfJudge(bool adaptive) noexcept : adaptive_{adaptive} { reset(); }

void SelfJudge::set_choice(Learned& learned, std::size_t h, std::size_t choice) noexcept {
    learned.choice[h] = static_cast<std::uint8_t>(choice);
    learned.share[h] = static_cast<float>(kShares[choice % kShares.size()]);
    learned.from_raw[h] = choice < kShares.size() ? 0.0f : 1.0f;
    learned.none = std::ranges::all_of(learned.share, [](float share) { return share == 0; });
}

void SelfJudge::reset() noexcept {
    forget_pending();
    cells_ = {};
    for (std::size_t p = 0; p < kPhases; ++p) {
        learned_[p] = {};
        learned_[p].factor68.fill(1);
        learned_[p].factor95.fill(1);
        const std::size_t prior = kShares.size() + static_cast<std::size_t>(kPrior[p] * 4);
        for (std::size_t h = 0; h < kAhead; ++h) set_choice(learned_[p], h, adaptive_ ? prior : kShares.size() - 1);
    }
}

void SelfJudge::forget_pending() noexcept {
    next_.fill(noted_);
    any_ = false;
}

SelfJudge::Belief SelfJudge::belief(Phase phase, std::size_t ahead) const noexcept {
    const std::size_t c = learned_[static_cast<std::size_t>(phase)].choice[ahead];
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
            const Plane from(p.from);
            const Tangent a = nearby(from, last_), b = nearby(from, raw);
            const double share = static_cast<double>(due - last_ns_) / static_cast<double>(t_ns - last_ns_);
            judge(p, h, a + share * (b - a));
        }
    }
    any_ = true;
    last_ns_ = t_ns;
    last_ = raw;
}

void SelfJudge::judge(const Pending& p, std::size_t h, Tangent truth) noexcept {
    Cell& c = cells_[static_cast<std::size_t>(p.phase)][h];
    Learned& learned = learned_[static_cast<std::size_t>(p.phase)];
    const double keep = c.weight > kMemory ? 1 - 1 / kMemory : 1;
    c.weight = c.weight * keep + 1;
    double error = 0;  // of the choice that was made then
    const Tangent from_raw = truth - p.raw_offset, full{static_cast<double>(p.full_u_rad[h]), static_cast<double>(p.full_v_rad[h])};
    for (std::size_t s = 0; s < kChoices; ++s) {
        const double e = norm((s < kShares.size() ? truth : from_raw) - kShares[s % kShares.size()] * full);
        c.error[s] = c.error[s] * keep + e;
        if (s == p.choice[h]) error = e;
    }
    const float step = std::max(kLastStep, kFirstStep / (1 + 0.05f * static_cast<float>(c.weight)));
    step_quantile(learned.factor68[h], error > static_cast<double>(p.radius68_rad[h]), 0.32f, step);
    step_quantile(learned.factor95[h], error > static_cast<double>(p.radius95_rad[h]), 0.05f, step);
    if (adaptive_) choose(c, p.phase, h);
}

void SelfJudge::choose(const Cell& c, Phase phase, std::size_t h) noexcept {
    const double typical = c.error[0] / c.weight;
    double best = 0;
    std::size_t choice = 0;
    for (std::size_t s = 0; s < kChoices; ++s) {
        const double off = kShares[s % kShares.size()] - kPrior[static_cast<std::size_t>(phase)];
        const double off_raw = s < kShares.size() ? kPriorRaw : 0;
        const double cost = c.error[s] + kPriorWeight * kPriorStrength * typical * (off * off + off_raw * off_raw);
        if (s == 0 || cost < best) {
            best = cost;
            choice = s;
        }
    }
    set_choice(learned_[static_cast<std::size_t>(phase)], h, choice);
}

void SelfJudge::prefetch() const noexcept {
    constexpr std::size_t kLine = 64;
    const Pending& last = ring_[(noted_ + kPending - 1) % kPending];
    const auto ask = [](const void* at, std::size_t bytes) {
        for (std::size_t b = 0; b < bytes; b += kLine) __builtin_prefetch(static_cast<const char*>(at) + b, 1);
    };
    ask(&learned_[static_cast<std::size_t>(last.phase)], sizeof learned_[0]);
    ask(&ring_[noted_ % kPending], sizeof(Pending));
}

void SelfJudge::complete(const Ahead& ahead) noexcept {
    if (!remembered_) return;
    Pending& p = ring_[(noted_ - 1) % kPending];
    p.full_u_rad = ahead.du_rad;
    p.full_v_rad = ahead.dv_rad;
}

void SelfJudge::apply(std::int64_t t_ns, Direction<HeadFrame> filtered, Phase phase, Ahead& ahead) noexcept {
    const Learned& learned = learned_[static_cast<std::size_t>(phase)];
    const bool remember = noted_ == 0 || next_[0] == noted_ || t_ns - ring_[(noted_ - 1) % kPending].t_ns >= kSpacing_ns;
    Pending& p = ring_[noted_ % kPending];
    remembered_ = remember;
    if (remember) {
        ++noted_;
        p.t_ns = t_ns;
        p.from = filtered;
        p.phase = phase;
        p.raw_offset = ahead.raw_offset;
        p.choice = learned.choice;
        p.full_u_rad = ahead.du_rad;
        p.full_v_rad = ahead.dv_rad;
    }
    const Four offset_u = all_four(static_cast<float>(ahead.raw_offset.u)), offset_v = all_four(static_cast<float>(ahead.raw_offset.v));
    for (std::size_t h = 0; h < kHorizonLanes; h += 4) {
        const Four share = load_four(&learned.share[h]), from_raw = load_four(&learned.from_raw[h]);
        store_four(&ahead.du_rad[h], share * load_four(&ahead.du_rad[h]) + from_raw * offset_u);
        store_four(&ahead.dv_rad[h], share * load_four(&ahead.dv_rad[h]) + from_raw * offset_v);
        const Four r68 = load_four(&ahead.radius68_rad[h]) * load_four(&learned.factor68[h]);
        store_four(&ahead.radius68_rad[h], r68);
        store_four(&ahead.radius95_rad[h], larger(r68, load_four(&ahead.radius95_rad[h]) * load_four(&learned.factor95[h])));
    }
    if (!remember) return;
    p.radius68_rad = ahead.radius68_rad;
    p.radius95_rad = ahead.radius95_rad;
}

}  // namespace fovea::pipeline
