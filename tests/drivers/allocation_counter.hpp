// Counts every allocation of the test program, so that a test can say how much hostile input may take, or that a steady
// loop takes nothing.
#pragma once

#include <cstddef>

namespace fovea::tests {

// Bytes asked for since the program began; never falls.
[[nodiscard]] std::size_t allocated_bytes() noexcept;

}  // namespace fovea::tests
