// Whether drawing in levels takes less time than full density, for a program whose scene nobody knows.
//
//   trial: full density, levels | levels, full density; each 2 frames to settle, 4 measured -> a way for `hold` frames
//   Levels pay only if both halves say so, by kLeastGain: what else the machine does may favour them once.
//   A trial ends as soon as it is lost: by 3 measured frames in levels that are no faster, by 2 in a row (from the second on)
//   that take more than kDear times as long, or by its first half.
//   A trial that confirms the one before doubles `hold` (kLeastHold to kMostHold); one that does not, halves it. A lost trial
//   is followed by at least so many frames that it made them dearer by kMostCost at most.
//
// A frame's time is from swap to swap; where both ways are as fast (a display's refresh sets the pace), the processor
// time of the whole process decides. Where the processor draws the pixels (software renderers), it always decides: other
// programs change it least. The second smallest of the four counts: the smallest that one lucky frame cannot set.
// Cost: two clock readings per frame. Threads: belongs to a context; its sums may be read by any. Errors: none.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace fovea::layer {

// Time, and processor time of the whole process.
struct FrameClocks {
    std::int64_t now_ns = 0, processor_ns = 0;
};
[[nodiscard]] FrameClocks read_frame_clocks() noexcept;

// What the choice came to: all frames but the first kSettle of a program, which load things.
struct PaySums {
    std::atomic<std::int64_t> trials{0};
    std::atomic<std::int64_t> frames_full{0}, frames_levels{0};
    std::atomic<std::int64_t> processor_full_ns{0}, processor_levels_ns{0};
    // Processor time of a frame, trials included, as a ratio to one at full density; 0: not known.
    [[nodiscard]] double felt() const noexcept;
    [[nodiscard]] std::string json() const;
};
// Of all contexts of the process.
[[nodiscard]] PaySums& pay_sums() noexcept;

class PayTest {
public:
    // How the next frame is to be drawn.
    [[nodiscard]] bool levels_now() const noexcept { return block_ == kBlocks ? pays_ : is_levels(block_); }
    void frame_ended(std::int64_t now_ns, std::int64_t processor_ns, PaySums& sums = pay_sums());

    void set_processor_draws(bool yes) noexcept { processor_draws_ = yes; }

    static constexpr int kSettle = 2, kMeasured = 4, kBlocks = 4;
    static constexpr int kLeastHold = 240, kMostHold = 7680;  // frames
    static constexpr std::int64_t kLeastGain = 50;            // 1/50
    static constexpr int kLost = 3, kDear = 2;
    static constexpr double kMostCost = 0.01;

private:
    struct Times {
        std::array<std::int64_t, kMeasured> wall{}, processor{};
    };
    [[nodiscard]] static constexpr bool is_levels(int block) noexcept { return block == 1 || block == 2; }
    [[nodiscard]] bool half_pays(const Times& full, const Times& levels) const;
    void note_levels(std::int64_t time, int frame);  // of a frame of the trial
    void decide(bool pays);
    int block_ = 0;  // of the trial; kBlocks: it is over
    int frame_ = 0, hold_ = kLeastHold, held_ = 0;
    int lost_ = 0, dear_ = 0;     // frames of the block
    double cost_ = 0;             // of the trial, in frames at full density
    std::int64_t full_ns_ = 0;    // a frame of the first block, by the clock that decides
    std::int64_t frames_ = 0;
    bool pays_ = false, decided_ = false, processor_draws_ = false;
    std::int64_t last_ns_ = 0, last_processor_ns_ = 0;
    std::array<Times, kBlocks> times_;
};

}  // namespace fovea::layer
