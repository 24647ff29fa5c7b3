// Whether drawing in levels takes less time than full density, for a program whose scene nobody knows.
//
//   trial: full density, levels | levels, full density; each 2 frames to settle, 4 measured -> a way for `hold` frames
//   Levels pay only if both halves say so: what else the machine does may favour them once.
//   A trial that confirms the one before doubles `hold` (kLeastHold to kMostHold); one that does not, halves it.
//
// A frame's time is from swap to swap; where both ways are as fast (a display's refresh sets the pace), the processor
// time of the whole process decides. Where the processor draws the pixels (software renderers), it always decides: other
// programs change it least. The second smallest of the four counts: the smallest that one lucky frame cannot set.
// Cost: two clock readings per frame. Threads: belongs to a context. Errors: none.
#pragma once

#include <array>
#include <cstdint>

namespace fovea::layer {

// Time, and processor time of the whole process.
struct FrameClocks {
    std::int64_t now_ns = 0, processor_ns = 0;
};
[[nodiscard]] FrameClocks read_frame_clocks() noexcept;

class PayTest {
public:
    // How the next frame is to be drawn.
    [[nodiscard]] bool levels_now() const noexcept { return block_ == kBlocks ? pays_ : is_levels(block_); }
    void frame_ended(std::int64_t now_ns, std::int64_t processor_ns);

    void set_processor_draws(bool yes) noexcept { processor_draws_ = yes; }

    static constexpr int kSettle = 2, kMeasured = 4, kBlocks = 4;
    static constexpr int kLeastHold = 240, kMostHold = 7680;  // frames

private:
    struct Times {
        std::array<std::int64_t, kMeasured> wall{}, processor{};
    };
    [[nodiscard]] static constexpr bool is_levels(int block) noexcept { return block == 1 || block == 2; }
    [[nodiscard]] bool half_pays(const Times& full, const Times& levels) const;
    void decide();
    int block_ = 0;  // of the trial; kBlocks: it is over
    int frame_ = 0, hold_ = kLeastHold;
    bool pays_ = false, decided_ = false, processor_draws_ = false;
    std::int64_t last_ns_ = 0, last_processor_ns_ = 0;
    std::array<Times, kBlocks> times_;
};

}  // namespace fovea::layer
