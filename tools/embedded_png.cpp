#include "tools/embedded_png.hpp"

#include <png.h>

#include <vector>

#include "tools/html_text.hpp"

namespace fovea::tools {

std::string png_data_uri(std::span<const std::uint8_t> rgba, int size, const PixelWindow& w, RowOrder order) {
    std::vector<std::uint8_t> rgb;
    for (int row = 0; row < w.edge; ++row) {
        const int y = order == RowOrder::top_first ? w.y + row : w.y + w.edge - 1 - row;
        for (int x = w.x; x < w.x + w.edge; ++x)
            for (int c = 0; c < 3; ++c) rgb.push_back(rgba[static_cast<std::size_t>(4 * (y * size + x) + c)]);
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = image.height = static_cast<png_uint_32>(w.edge);
    image.format = PNG_FORMAT_RGB;
    png_alloc_size_t bytes = 0;
    if (png_image_write_to_memory(&image, nullptr, &bytes, 0, rgb.data(), 0, nullptr) == 0) return {};
    std::string png(bytes, '\0');
    if (png_image_write_to_memory(&image, png.data(), &bytes, 0, rgb.data(), 0, nullptr) == 0) return {};
    png.resize(bytes);
    return "data:image/png;base64," + base64(png);
}

}  // namespace fovea::tools
