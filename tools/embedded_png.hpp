// A part of a picture as a PNG inside a page: "data:image/png;base64,...".
//
// Threads: pure.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace fovea::tools {

struct PixelWindow {
    int x = 0, y = 0, edge = 0;   // inside the picture
};
// rgba: size x size, bottom row first, as GL reads it; the PNG has the top row first. Empty if libpng refuses.
[[nodiscard]] std::string png_data_uri(std::span<const std::uint8_t> rgba, int size_px, const PixelWindow& window);

}  // namespace fovea::tools
