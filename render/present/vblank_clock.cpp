#include "render/present/vblank_clock.hpp"

#include <algorithm>

namespace fovea::present {
namespace {
constexpr Duration kShortest = std::chrono::milliseconds(1), kLongest = std::chrono::seconds(1);
constexpr Duration kMargin = std::chrono::milliseconds(1);   // of an uneven cost
}

void VblankClock::set_period(Duration period) noexcept {
    if (period >= kShortest && period <= kLongest) period_ = period;
}

void VblankClock::observe(Instant done, Instant start, bool on_grid) noexcept {
    kept_[seen_++ % kKept] = std::clamp(start - done, Duration{0}, kLongest);   // two clocks: it may seem to be shown early
    last_start_ = start;
    on_grid_ = on_grid;
}

Duration VblankClock::lead() const noexcept {
    return *std::min_element(kept_.begin(), kept_.begin() + static_cast<std::ptrdiff_t>(std::min(seen_, kKept)));
}

Duration VblankClock::median() const noexcept {
    auto sorted = kept_;
    const auto n = static_cast<std::ptrdiff_t>(std::min(seen_, kKept));
    std::nth_element(sorted.begin(), sorted.begin() + n / 2, sorted.begin() + n);
    return sorted[static_cast<std::size_t>(n / 2)];
}

Instant VblankClock::predict(Instant done) const noexcept {
    if (seen_ == 0) return done + period_;
    if (!on_grid_) return done + median();
    const auto ahead = (done + lead() - last_start_).count(), period = period_.count();
    // The grid's instants jitter by microseconds: what misses a start by less than that is meant for it.
    const auto slack = std::min<std::int64_t>(period / 16, (lead().count() + 1) / 2);
    auto steps = (ahead - slack) > 0 ? (ahead - slack + period - 1) / period : 1;
    while (last_start_ + Duration{steps * period} < done) ++steps;
    return last_start_ + Duration{std::max<std::int64_t>(steps, 1) * period};
}

Instant VblankClock::begin_no_sooner(Duration cost) const noexcept {
    if (seen_ == 0 || !on_grid_) return Instant{};
    return last_start_ + period_ - lead() - cost - kMargin;
}

}  // namespace fovea::present
