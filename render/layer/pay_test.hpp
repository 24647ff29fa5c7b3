// Whether drawing in levels takes less time than full density, for a program whose scene nobody knows.
//
//   trial: 2 frames to settle, 6 measured, at full density; the same in levels -> the faster way for `hold` frames
//   A trial that confirms the one before doubles `hold` (kLeastHold to kMostHold); one that does not, halves it.
//
// A frame's time is from swap to swap; where both ways are as fast (a display's refresh sets the pace), the processor
// time of the whole process decides. The second smallest of the six counts: the smallest that one lucky frame cannot set.
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
    [[nodiscard]] bool levels_now() const noexcept { return phase_ == Phase::try_levels || (phase_ == Phase::hold && pays_); }
    void frame_ended(std::int64_t now_ns, std::int64_t processor_ns);

    static constexpr int kSettle = 2, kMeasured = 6;
    static constexpr int kLeastHold = 240, kMostHold = 7680;  // frames

private:
    enum class Phase { try_full, try_levels, hold };
    struct Times {
        std::array<std::int64_t, kMeasured> wall{}, processor{};
    };
    void decide();
    Phase phase_ = Phase::try_full;
    int frame_ = 0, hold_ = kLeastHold;
    bool pays_ = false, decided_ = false;
    std::int64_t last_ns_ = 0, last_processor_ns_ = 0;
    Times full_, levels_;
};

}  // namespace fovea::layer
