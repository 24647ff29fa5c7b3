#include "render/layer/pay_test.hpp"

#include <algorithm>
#include <ctime>

namespace fovea::layer {
namespace {

std::int64_t read_ns(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

std::int64_t second_smallest(std::array<std::int64_t, PayTest::kMeasured> times) {
    std::nth_element(times.begin(), times.begin() + 1, times.end());
    return times[1];
}

}  // namespace

FrameClocks read_frame_clocks() noexcept { return {read_ns(CLOCK_MONOTONIC), read_ns(CLOCK_PROCESS_CPUTIME_ID)}; }

void PayTest::frame_ended(std::int64_t now_ns, std::int64_t processor_ns) {
    const std::int64_t wall = now_ns - last_ns_, processor = processor_ns - last_processor_ns_;
    last_ns_ = now_ns;
    last_processor_ns_ = processor_ns;
    const int frame = frame_++;
    if (block_ == kBlocks) {
        if (frame_ >= hold_) block_ = frame_ = 0;
        return;
    }
    if (frame < kSettle) return;
    Times& times = times_[static_cast<std::size_t>(block_)];
    times.wall[static_cast<std::size_t>(frame - kSettle)] = wall;
    times.processor[static_cast<std::size_t>(frame - kSettle)] = processor;
    if (frame_ < kSettle + kMeasured) return;
    frame_ = 0;
    if (++block_ == kBlocks) decide();
}

bool PayTest::half_pays(const Times& whole, const Times& in_levels) const {
    const std::int64_t full = second_smallest(whole.wall), levels = second_smallest(in_levels.wall);
    constexpr std::int64_t kEqual = 50;  // 1/50: closer than that, the pace is set elsewhere
    const bool equal = std::max(full, levels) - std::min(full, levels) <= full / kEqual;
    return equal || processor_draws_ ? second_smallest(in_levels.processor) < second_smallest(whole.processor) : levels < full;
}

void PayTest::decide() {
    const bool pays = half_pays(times_[0], times_[1]) && half_pays(times_[3], times_[2]);
    hold_ = decided_ && pays == pays_ ? std::min(hold_ * 2, kMostHold) : std::max(hold_ / 2, kLeastHold);
    pays_ = pays;
    decided_ = true;
}

}  // namespace fovea::layer
