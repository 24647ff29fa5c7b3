#include "tests/drivers/camera/jpeg_picture.hpp"

#include <cstdio>   // jpeglib.h wants FILE
#include <cstdlib>

#include <jpeglib.h>

namespace fovea::tests {

std::vector<std::uint8_t> as_jpeg(std::span<const std::uint8_t> pixels, int width, int height) {
    jpeg_compress_struct c{};
    jpeg_error_mgr error{};
    c.err = jpeg_std_error(&error);
    jpeg_create_compress(&c);
    unsigned char* out = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&c, &out, &size);
    c.image_width = static_cast<JDIMENSION>(width);
    c.image_height = static_cast<JDIMENSION>(height);
    c.input_components = 1;
    c.in_color_space = JCS_GRAYSCALE;
    jpeg_set_defaults(&c);
    jpeg_set_quality(&c, 90, TRUE);
    jpeg_start_compress(&c, TRUE);
    for (int y = 0; y < height; ++y) {
        auto* row = const_cast<JSAMPLE*>(pixels.data() + static_cast<std::ptrdiff_t>(y) * width);
        jpeg_write_scanlines(&c, &row, 1);
    }
    jpeg_finish_compress(&c);
    jpeg_destroy_compress(&c);
    std::vector<std::uint8_t> bytes(out, out + size);
    std::free(out);
    return bytes;
}

}  // namespace fovea::tests
