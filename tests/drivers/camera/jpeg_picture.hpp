// A grey picture as a motion-JPEG camera would send it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace fovea::tests {

// pixels: width * height bytes, row by row. Quality 90, one component.
[[nodiscard]] std::vector<std::uint8_t> as_jpeg(std::span<const std::uint8_t> pixels, int width, int height);

}  // namespace fovea::tests
