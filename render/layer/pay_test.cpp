#include "render/layer/pay_test.hpp"

#include <algorithm>
#include <cstdio>
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

PaySums& pay_sums() noexcept {
    static PaySums sums;
    return sums;
}

double PaySums::felt() const noexcept {
    const auto full = static_cast<double>(frames_full.load()), levels = static_cast<double>(frames_levels.load());
    const auto full_ns = static_cast<double>(processor_full_ns.load()), levels_ns = static_cast<double>(processor_levels_ns.load());
    if (full == 0 || full_ns <= 0) return 0;
    return (full_ns + levels_ns) / (full + levels) / (full_ns / full);
}

std::string PaySums::json() const {
    char text[160];
    std::snprintf(text, sizeof text, "{\"trials\": %lld, \"frames_full\": %lld, \"frames_levels\": %lld, \"felt_processor\": %.4f}",
                  static_cast<long long>(trials.load()), static_cast<long long>(frames_full.load()),
                  static_cast<long long>(frames_levels.load()), felt());
    return text;
}

void PayTest::frame_ended(std::int64_t now_ns, std::int64_t processor_ns, PaySums& sums) {
    const std::int64_t wall = now_ns - last_ns_, processor = processor_ns - last_processor_ns_;
    const bool levels = levels_now();
    last_ns_ = now_ns;
    last_processor_ns_ = processor_ns;
    if (++frames_ > kSettle) {
        (levels ? sums.frames_levels : sums.frames_full).fetch_add(1, std::memory_order_relaxed);
        (levels ? sums.processor_levels_ns : sums.processor_full_ns).fetch_add(processor, std::memory_order_relaxed);
    }
    const int frame = frame_++;
    if (block_ == kBlocks) {
        if (frame_ >= held_) block_ = frame_ = 0;
        return;
    }
    if (frame >= kSettle) {
        Times& times = times_[static_cast<std::size_t>(block_)];
        times.wall[static_cast<std::size_t>(frame - kSettle)] = wall;
        times.processor[static_cast<std::size_t>(frame - kSettle)] = processor;
    }
    if (levels) note_levels(processor_draws_ ? processor : wall, frame);
    const bool lost = lost_ >= kLost || dear_ >= 2;
    if (frame_ < kSettle + kMeasured && !lost) return;
    frame_ = lost_ = dear_ = 0;
    if (block_ == 0) {
        full_ns_ = second_smallest(processor_draws_ ? times_[0].processor : times_[0].wall);
        cost_ = 0;
        sums.trials.fetch_add(1, std::memory_order_relaxed);
    }
    if (lost || (block_ == 1 && !half_pays(times_[0], times_[1]))) return decide(false);
    if (++block_ == kBlocks) decide(half_pays(times_[3], times_[2]));
}

// A frame that is no slower than the pace of a display may still win by processor time.
void PayTest::note_levels(std::int64_t time, int frame) {
    const std::int64_t most = processor_draws_ ? full_ns_ - full_ns_ / kLeastGain - 1 : full_ns_ + full_ns_ / kLeastGain;
    // Of the first half only: the other has its frames at full density still to come.
    if (frame >= kSettle && block_ == 1 && time > most) ++lost_;
    dear_ = frame > 0 && time > kDear * full_ns_ ? dear_ + 1 : 0;
    constexpr double kOnce = 8;  // a frame longer than that made something that later trials find
    if (full_ns_ > 0) cost_ += std::clamp(static_cast<double>(time - full_ns_) / static_cast<double>(full_ns_), -1.0, kOnce);
}

bool PayTest::half_pays(const Times& whole, const Times& in_levels) const {
    const auto gains = [](std::int64_t full, std::int64_t levels) { return levels < full - full / kLeastGain; };
    const std::int64_t full = second_smallest(whole.wall), levels = second_smallest(in_levels.wall);
    const bool equal = std::max(full, levels) - std::min(full, levels) <= full / kLeastGain;  // the pace is set elsewhere
    return equal || processor_draws_ ? gains(second_smallest(whole.processor), second_smallest(in_levels.processor)) : gains(full, levels);
}

void PayTest::decide(bool pays) {
    hold_ = decided_ && pays == pays_ ? std::min(hold_ * 2, kMostHold) : std::max(hold_ / 2, kLeastHold);
    held_ = pays ? hold_ : std::clamp(static_cast<int>(cost_ / kMostCost), hold_, kMostHold);
    block_ = kBlocks;
    pays_ = pays;
    decided_ = true;
}

}  // namespace fovea::layer
