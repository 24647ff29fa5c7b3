// Counts every operator new of the test binary that links allocation_count.cpp, to prove that a steady loop allocates
// nothing.
#pragma once

#include <cstdint>

namespace fovea::test {

[[nodiscard]] std::uint64_t allocation_count() noexcept;   // since the start, all threads

}  // namespace fovea::test
