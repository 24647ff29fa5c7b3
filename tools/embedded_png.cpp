#include "tools/embedded_png.hpp"

#include <png.h>

#include <vector>

namespace fovea::tools {
namespace {

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve(bytes.size() * 4 / 3 + 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t n = static_cast<std::uint32_t>(bytes[i]) << 16;
        if (i + 1 < bytes.size()) n |= static_cast<std::uint32_t>(bytes[i + 1]) << 8;
        if (i + 2 < bytes.size()) n |= bytes[i + 2];
        out += kDigits[n >> 18 & 63];
        out += kDigits[n >> 12 & 63];
        out += i + 1 < bytes.size() ? kDigits[n >> 6 & 63] : '=';
        out += i + 2 < bytes.size() ? kDigits[n & 63] : '=';
    }
    return out;
}

}  // namespace

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
    std::vector<std::uint8_t> png(bytes);
    if (png_image_write_to_memory(&image, png.data(), &bytes, 0, rgb.data(), 0, nullptr) == 0) return {};
    png.resize(bytes);
    return "data:image/png;base64," + base64(png);
}

}  // namespace fovea::tools
