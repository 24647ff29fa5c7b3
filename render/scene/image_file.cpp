#include "render/scene/image_file.hpp"

#include <cstdio>   // jpeglib.h wants FILE

#include <csetjmp>
#include <cstring>
#include <jpeglib.h>
#include <png.h>

namespace fovea::scene {
namespace {

constexpr const char* kWayOut = "save it as PNG or JPEG (baseline or progressive, grey or colour)";

Result<void> check_size(std::uint64_t width, std::uint64_t height, std::size_t most, const std::string& where) {
    if (width == 0 || height == 0 || width > kMaxImageEdge || height > kMaxImageEdge || width * height > most)
        return fail("a picture of " + std::to_string(width) + "x" + std::to_string(height) + " pixels", where,
                    "at most " + std::to_string(kMaxImageEdge) + " along an edge, and 128 million in all pictures of a file: scale it down");
    return {};
}

Result<Image> decode_png(std::span<const std::uint8_t> file, std::size_t most, const std::string& where) {
    // The first chunk has the size: judged before libpng reads on.
    if (file.size() < 24) return fail("broken PNG: cut off", where, "save it anew");
    const auto big_endian = [&](std::size_t at) { return std::uint32_t{file[at]} << 24 | std::uint32_t{file[at + 1]} << 16 | std::uint32_t{file[at + 2]} << 8 | file[at + 3]; };
    if (auto ok = check_size(big_endian(16), big_endian(20), most, where); !ok) return std::unexpected(ok.error());
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&png, file.data(), file.size()) == 0)
        return fail(std::string("broken PNG: ") + png.message, where, "save it anew");
    if (auto ok = check_size(png.width, png.height, most, where); !ok) {
        png_image_free(&png);
        return std::unexpected(ok.error());
    }
    png.format = PNG_FORMAT_RGBA;
    Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    image.rgba.resize(PNG_IMAGE_SIZE(png));
    if (png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr) == 0) {
        png_image_free(&png);
        return fail(std::string("broken PNG: ") + png.message, where, "save it anew");
    }
    return image;
}

struct JpegErrors {
    jpeg_error_mgr base;
    std::jmp_buf back;
    char text[JMSG_LENGTH_MAX];
};
[[noreturn]] void jpeg_failed(j_common_ptr info) {
    auto* e = reinterpret_cast<JpegErrors*>(info->err);
    info->err->format_message(info, e->text);
    std::longjmp(e->back, 1);
}

// Nothing with a destructor is made here: libjpeg leaves by longjmp. Null: failed, errors.text says why.
// size_only: stops after the header.
bool read_jpeg(std::span<const std::uint8_t> file, JpegErrors& errors, jpeg_decompress_struct& jpeg, std::uint8_t* rgb) {
    jpeg.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = jpeg_failed;
    errors.base.emit_message = [](j_common_ptr, int) {};
    if (setjmp(errors.back) != 0) {
        jpeg_destroy_decompress(&jpeg);
        return false;
    }
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, file.data(), file.size());
    jpeg_read_header(&jpeg, TRUE);
    if (rgb != nullptr) {
        jpeg.out_color_space = JCS_RGB;
        jpeg_start_decompress(&jpeg);
        while (jpeg.output_scanline < jpeg.output_height) {
            JSAMPROW row = rgb + static_cast<std::size_t>(jpeg.output_scanline) * jpeg.output_width * 3;
            jpeg_read_scanlines(&jpeg, &row, 1);
        }
    }
    jpeg_destroy_decompress(&jpeg);
    return true;
}

Result<Image> decode_jpeg(std::span<const std::uint8_t> file, std::size_t most, const std::string& where) {
    JpegErrors errors{};
    jpeg_decompress_struct jpeg{};
    if (!read_jpeg(file, errors, jpeg, nullptr)) return fail(std::string("broken JPEG: ") + errors.text, where, kWayOut);
    if (auto ok = check_size(jpeg.image_width, jpeg.image_height, most, where); !ok) return std::unexpected(ok.error());
    Image image{static_cast<int>(jpeg.image_width), static_cast<int>(jpeg.image_height), {}};
    const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    std::vector<std::uint8_t> rgb(pixels * 3);
    if (!read_jpeg(file, errors, jpeg, rgb.data())) return fail(std::string("broken JPEG: ") + errors.text, where, kWayOut);
    image.rgba.resize(pixels * 4);
    for (std::size_t i = 0; i < pixels; ++i) {
        std::memcpy(&image.rgba[i * 4], &rgb[i * 3], 3);
        image.rgba[i * 4 + 3] = 255;
    }
    return image;
}

}  // namespace

Result<Image> decode_image(std::span<const std::uint8_t> file, std::size_t most_pixels, const std::string& where) {
    constexpr std::uint8_t kPng[] = {0x89, 'P', 'N', 'G'}, kJpeg[] = {0xff, 0xd8, 0xff};
    const auto starts = [&](std::span<const std::uint8_t> magic) { return file.size() > magic.size() && std::memcmp(file.data(), magic.data(), magic.size()) == 0; };
    if (starts(kPng)) return decode_png(file, most_pixels, where);
    if (starts(kJpeg)) return decode_jpeg(file, most_pixels, where);
    return fail("a picture that is neither PNG nor JPEG", where, kWayOut);
}

}  // namespace fovea::scene
