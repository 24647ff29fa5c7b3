// Writes images as PNG.
//
// Errors: names the file and the reason. A file appears complete or not at all: it is written beside its place and
// renamed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "protocol/error.hpp"

namespace fovea::gl {

struct PngImage {
    int width_px = 0, height_px = 0;
    std::span<const std::uint8_t> rgb;   // 3 bytes a pixel, top row first
};

[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const PngImage& image);

}  // namespace fovea::gl
