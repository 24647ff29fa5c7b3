// Counts every operator new of the test program that links allocation_count.cpp.
#pragma once

namespace fovea::pipeline::test {
[[nodiscard]] long allocations() noexcept;
}  // namespace fovea::pipeline::test
