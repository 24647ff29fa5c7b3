// What the layer costs a program that is running: blocks of frames drawn straight by the driver, recorded and replayed at full
// density, and foveated, in turns within one process.
//
//   straight recorded levels | levels recorded straight | straight ...    a block: 1 frame to settle, kMeasured that count
//
// Neighbouring blocks make a pair, so that what the machine and the program do meanwhile falls on both alike; the median of
// the pairs' ratios is the result. A block's time is the median of its frames, from swap to swap: processor time of the whole
// process, and time. The first kWarmCycles cycles (shaders are compiled for new states) do not count.
// Cost: two clock readings and 24 bytes per cycle; after kMostCycles nothing more is kept. Threads: locks itself. Errors: none.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace fovea::layer {

// How a frame of auto mode is drawn.
enum class Way : std::uint8_t { straight, recorded, levels };

class Comparison {
public:
    [[nodiscard]] Way way() const noexcept { return way_; }
    void frame_ended(std::int64_t now_ns, std::int64_t processor_ns);

    // low, high: the middle half of the pairs.
    struct Ratio {
        double median = 0, low = 0, high = 0;
    };
    struct Result {
        std::size_t pairs = 0;
        double processor_ms = 0, time_ms = 0;  // of a straight frame
        Ratio recorded_processor, recorded_time, levels_processor, levels_time;
    };
    [[nodiscard]] std::optional<Result> result() const;  // nullopt: no whole cycle yet

    static constexpr int kMeasured = 5, kWarmCycles = 2;
    static constexpr std::size_t kMostCycles = 100'000;

private:
    struct Times {
        float processor_ms = 0, time_ms = 0;
    };
    using Cycle = std::array<Times, 3>;  // by Way
    mutable std::mutex mutex_;
    std::vector<Cycle> cycles_;
    Cycle cycle_{};
    std::array<Times, kMeasured> block_{};
    Way way_ = Way::straight;
    int frame_ = 0, block_of_cycle_ = 0, warm_ = 0;
    bool backwards_ = false;
    std::int64_t last_ns_ = 0, last_processor_ns_ = 0;
};

// One that lives as long as the process, as its contexts and its exit handlers may still use it.
[[nodiscard]] Comparison* new_comparison();
// The result of the one with the most pairs as an object of JSON: low, median, high of each ratio. "null" without a result.
[[nodiscard]] std::string comparison_json();

}  // namespace fovea::layer
