// What the fuzz targets share: reading parameters from the input, and a check that stops the run.
//
// A target is one file with LLVMFuzzerTestOneInput. libFuzzer drives it (preset `fuzz`), or corpus_main.cpp with the
// stored inputs and fixed mutations of them (an ordinary test in every build). README.md says how to run them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>

namespace fovea::fuzz {

// Takes numbers off the front; zeros when nothing is left.
class Input {
public:
    Input(const std::uint8_t* data, std::size_t size) noexcept : rest_{data, size} {}
    template <class T>
    T take() noexcept {
        T value{};
        const std::size_t n = rest_.size() < sizeof value ? rest_.size() : sizeof value;
        if (n > 0) std::memcpy(&value, rest_.data(), n);
        rest_ = rest_.subspan(n);
        return value;
    }
    std::span<const std::uint8_t> take_bytes(std::size_t n) noexcept {
        const auto first = rest_.first(n < rest_.size() ? n : rest_.size());
        rest_ = rest_.subspan(first.size());
        return first;
    }
    [[nodiscard]] std::span<const std::uint8_t> rest() const noexcept { return rest_; }

private:
    std::span<const std::uint8_t> rest_;
};

}  // namespace fovea::fuzz

#define FOVEA_FUZZ_CHECK(condition)                                                            \
    do {                                                                                       \
        if (!(condition)) {                                                                    \
            std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
            std::abort();                                                                      \
        }                                                                                      \
    } while (false)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
