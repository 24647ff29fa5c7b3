// Random numbers without state: a number is a function of (seed, effect, index, lane), so that no effect can disturb
// another and any of them can be left out.
//
// Source: Philox4x32-10, Salmon et al., "Parallel Random Numbers: As Easy as 1, 2, 3", SC 2011; normal deviates by Box
// and Muller, 1958.
// Cost: about 20 ns per block of four words. Threads: pure functions.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace fovea::drivers::synthetic {

using PhiloxBlock = std::array<std::uint32_t, 4>;

[[nodiscard]] constexpr PhiloxBlock philox4x32(PhiloxBlock counter, std::array<std::uint32_t, 2> key) noexcept {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = std::uint64_t{0xD2511F53} * counter[0], b = std::uint64_t{0xCD9E8D57} * counter[2];
        counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
                   static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
        key[0] += 0x9E3779B9;
        key[1] += 0xBB67AE85;
    }
    return counter;
}

struct NormalPair {
    double first, second;
};

// One effect's numbers. `lane` separates what one index needs several of.
class RandomStream {
public:
    RandomStream(std::uint64_t seed, std::uint32_t effect) noexcept : seed_{seed}, effect_{effect} {}

    // In (0, 1), never 0 or 1.
    [[nodiscard]] double uniform(std::uint64_t index, std::uint32_t lane = 0) const noexcept {
        const PhiloxBlock b = block(index, lane);
        return unit(b[0], b[1]);
    }
    // Mean 0, deviation 1, independent; beyond 8.6 deviations never.
    [[nodiscard]] NormalPair normal(std::uint64_t index, std::uint32_t lane = 0) const noexcept {
        const PhiloxBlock b = block(index, lane);
        const double radius = std::sqrt(-2 * std::log(unit(b[0], b[1])));
        const double angle = 2 * std::numbers::pi * unit(b[2], b[3]);
        return {radius * std::cos(angle), radius * std::sin(angle)};
    }
    // Mean 1.
    [[nodiscard]] double exponential(std::uint64_t index, std::uint32_t lane = 0) const noexcept {
        return -std::log(uniform(index, lane));
    }

private:
    [[nodiscard]] PhiloxBlock block(std::uint64_t index, std::uint32_t lane) const noexcept {
        return philox4x32({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32), lane, effect_},
                          {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
    }
    [[nodiscard]] static double unit(std::uint32_t a, std::uint32_t b) noexcept {
        const std::uint64_t bits = (std::uint64_t{a} << 32 | b) >> 12;
        return (static_cast<double>(bits) + 0.5) * 0x1p-52;
    }

    std::uint64_t seed_;
    std::uint32_t effect_;
};

}  // namespace fovea::drivers::synthetic
