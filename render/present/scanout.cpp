#include "render/present/scanout.hpp"

#include <algorithm>

namespace fovea::present {
namespace {
constexpr Duration kMargin = std::chrono::milliseconds(1);   // before a scan-out: of sleeping and of an uneven cost
}

Result<SimulatedScanout> SimulatedScanout::create(const ScanoutSettings& s, Instant epoch) {
    if (!(s.refresh_hz >= 1 && s.refresh_hz <= 1000))
        return fail("refresh rate of " + std::to_string(s.refresh_hz) + " Hz", "simulated display", "1 to 1000");
    const Duration period = seconds(1 / s.refresh_hz);
    // In numbers, not in durations: 1e300 seconds are no number of nanoseconds.
    if (!(s.scanout_ms > 0 && s.scanout_ms * 1e-3 <= 1 / s.refresh_hz))
        return fail("scan-out of " + std::to_string(s.scanout_ms) + " ms", "simulated display",
                    "more than 0 and at most one refresh period, " + std::to_string(to_seconds(period) * 1e3) + " ms");
    return SimulatedScanout(period, std::min(seconds(s.scanout_ms * 1e-3), period), epoch);
}

SimulatedScanout::Shown SimulatedScanout::predict(Instant done) const noexcept {
    const auto since = (done - epoch_).count(), period = period_.count();
    const auto index = since >= 0 ? since / period + 1 : -((-since) / period);   // the first start after `done`
    Instant start = epoch_ + Duration{index * period};
    if (start <= done) start += period_;
    if (shown_any_ && start <= last_start_) start = last_start_ + period_;
    return {start, start + scanout_ / 2};
}

SimulatedScanout::Shown SimulatedScanout::present(Instant done) noexcept {
    const Shown shown = predict(done);
    last_start_ = shown.start;
    shown_any_ = true;
    return shown;
}

Instant SimulatedScanout::begin_no_sooner(Duration cost) const noexcept {
    if (!shown_any_) return epoch_;
    return last_start_ + period_ - cost - kMargin;
}

RecentCost::RecentCost(Duration first_guess) noexcept { kept_.fill(first_guess); }

void RecentCost::add(Duration cost) noexcept {
    kept_[next_] = cost;
    next_ = (next_ + 1) % kKept;
}

Duration RecentCost::median() const noexcept {
    auto sorted = kept_;
    std::nth_element(sorted.begin(), sorted.begin() + kKept / 2, sorted.end());
    return sorted[kKept / 2];
}

}  // namespace fovea::present
