// What the layer did, counted over the life of the process: passes, submissions by the call that caused them, and how
// often lateness was lost (drawing went on after a submission, so that the parameters of an earlier moment stayed).
//
// Written as JSON to the file named by FOVEA_LAYER_STATS when the process ends or the last display is terminated.
// Cost: one relaxed addition per event. Threads: all. Errors: a file that cannot be written is named on stderr.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "layer_gl.hpp"
#include "render/layer/auto_mode.hpp"

namespace fovea::layer {

// Causes of a submission that are no GL calls follow the GL calls.
inline constexpr Call kCallSwapBuffers = static_cast<Call>(static_cast<unsigned>(Call::count_of_gl) + 1);
inline constexpr Call kCallMakeCurrent = static_cast<Call>(static_cast<unsigned>(Call::count_of_gl) + 2);
inline constexpr Call kCallEglSync = static_cast<Call>(static_cast<unsigned>(Call::count_of_gl) + 3);
inline constexpr Call kCallLogFull = static_cast<Call>(static_cast<unsigned>(Call::count_of_gl) + 4);
inline constexpr Call kCallFullRateDraw = static_cast<Call>(static_cast<unsigned>(Call::count_of_gl) + 5);
inline constexpr unsigned kCallCount = static_cast<unsigned>(Call::count_of_gl) + 6;

[[nodiscard]] const char* call_name(Call call) noexcept;

struct Stats {
    std::atomic<std::uint64_t> contexts{0}, frames{0};
    std::atomic<std::uint64_t> submissions_native{0};  // drawn once at full density
    std::atomic<std::uint64_t> submissions_levels{0};  // drawn once per level
    std::atomic<std::uint64_t> draws_recorded{0}, resolves{0}, targets_created{0};
    std::atomic<std::uint64_t> pixels_full{0}, pixels_planned{0};  // per submission: at full density; in the plan
    std::atomic<std::uint64_t> depth_restored{0};  // depth of a foveated pass brought back to full resolution
    std::atomic<std::uint64_t> extrapolations{0}, contexts_lost{0};
    std::atomic<std::uint64_t> auto_native_by[static_cast<std::size_t>(FullRate::count)]{};  // submissions of auto mode
    std::atomic<std::uint64_t> submitted_by[kCallCount]{};
    std::atomic<std::uint64_t> lateness_lost_by[kCallCount]{};

    [[nodiscard]] std::string json() const;
    void write_if_asked() const;
    [[nodiscard]] static bool asked() noexcept;
    void write_once_a_second();  // as write_if_asked: a program that a signal ends leaves these

private:
    std::atomic<std::int64_t> last_written_s_{0};
};

extern Stats stats;

inline void count(std::atomic<std::uint64_t>& counter, std::uint64_t n = 1) noexcept {
    counter.fetch_add(n, std::memory_order_relaxed);  // counters are independent of each other
}

}  // namespace fovea::layer
