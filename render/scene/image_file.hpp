// Decodes PNG and JPEG.
//
// Errors: what is no such picture, or is larger than allowed: judged by its header, before memory is taken for it.
// Threads: any.
#pragma once

#include <span>

#include "protocol/error.hpp"
#include "render/scene/model.hpp"

namespace fovea::scene {

// most_pixels: what is left to spend. where: for errors.
[[nodiscard]] Result<Image> decode_image(std::span<const std::uint8_t> file, std::size_t most_pixels, const std::string& where);

}  // namespace fovea::scene
