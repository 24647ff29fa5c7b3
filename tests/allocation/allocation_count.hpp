// Counts heap allocations of the calling thread, by whatever way: malloc and its kin are replaced in this binary.
#pragma once

#include <cstddef>

namespace fovea::test {

// Allocations of this thread so far. With a sanitizer, which brings its own malloc, always 0: see counts_allocations().
[[nodiscard]] std::size_t allocations() noexcept;
[[nodiscard]] bool counts_allocations() noexcept;
// Bytes that this thread asked for so far; never falls. 0 with a sanitizer.
[[nodiscard]] std::size_t allocated_bytes() noexcept;

}  // namespace fovea::test
