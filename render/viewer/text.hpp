// Lines of text as a picture, for the read-out in the window.
//
// Source: OpenCV's Hershey fonts: no font file is needed. Printable ASCII.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace fovea::viewer {

struct TextPicture {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgba;   // bottom row first, as GL takes it; on a translucent ground
};
// line_px: height of a line, 8 to 200. Throws std::bad_alloc only.
[[nodiscard]] TextPicture draw_text(std::span<const std::string> lines, int line_px);

}  // namespace fovea::viewer
