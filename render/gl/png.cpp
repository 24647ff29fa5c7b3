#include "render/gl/png.hpp"

#include <png.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace fovea::gl {
namespace {

// The only function that libpng's longjmp passes through: no object with a destructor lives in it.
bool encode(png_structp png, png_infop info, std::FILE* file, const PngImage& image, png_bytep* rows) noexcept {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    png_set_compression_level(png, 4);
    png_set_IHDR(png, info, static_cast<png_uint_32>(image.width_px), static_cast<png_uint_32>(image.height_px), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_write_image(png, rows);
    png_write_end(png, nullptr);
    return true;
}

}  // namespace

Result<void> write_png(const std::filesystem::path& path, const PngImage& image) {
    FOVEA_REQUIRE(image.width_px > 0 && image.height_px > 0 &&
                  image.rgb.size() >= static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px) * 3);
    const std::string temporary = path.string() + ".part" + std::to_string(::getpid());
    std::FILE* file = std::fopen(temporary.c_str(), "wb");
    if (file == nullptr)
        return fail_errno("cannot write", errno, path.string(), "choose a directory that exists and that you may write to");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    std::vector<png_bytep> rows(static_cast<std::size_t>(image.height_px));
    for (std::size_t y = 0; y < rows.size(); ++y)
        rows[y] = const_cast<png_bytep>(image.rgb.data() + y * static_cast<std::size_t>(image.width_px) * 3);
    bool ok = info != nullptr && encode(png, info, file, image, rows.data());
    png_destroy_write_struct(&png, &info);
    ok = std::fclose(file) == 0 && ok;
    if (ok && std::rename(temporary.c_str(), path.c_str()) == 0) return {};
    const int code = errno;
    std::remove(temporary.c_str());
    return fail_errno("cannot write the image", code, path.string(), "is the disk full?");
}

}  // namespace fovea::gl
