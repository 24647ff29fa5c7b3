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
enum class RowOrder : std::uint8_t { bottom_first, top_first };   // of the picture; GL reads the bottom row first
// rgba: size x size. The PNG has the top row first. Empty if libpng refuses.
[[nodiscard]] std::string png_data_uri(std::span<const std::uint8_t> rgba, int size_px, const PixelWindow& window,
                                       RowOrder order = RowOrder::bottom_first);

}  // namespace fovea::tools
