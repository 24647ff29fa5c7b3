#include "drivers/camera/image.hpp"

#include <csetjmp>
#include <cstdio>   // jpeglib.h wants FILE

#include <jpeglib.h>

namespace fovea::drivers::camera {

// libjpeg reports errors by longjmp; nothing with a destructor lives in the frames it jumps over.
struct GreyConverter::Jpeg {
    jpeg_decompress_struct decoder{};
    jpeg_error_mgr errors{};
    std::jmp_buf escape;

    Jpeg() {
        decoder.err = jpeg_std_error(&errors);
        decoder.client_data = this;
        errors.error_exit = [](j_common_ptr d) { std::longjmp(static_cast<Jpeg*>(d->client_data)->escape, 1); };
        errors.emit_message = [](j_common_ptr, int) {};
        errors.output_message = [](j_common_ptr) {};
        jpeg_create_decompress(&decoder);
    }
    ~Jpeg() { jpeg_destroy_decompress(&decoder); }

    // The luminance alone, into width * height bytes. False: not a JPEG of this size.
    bool decode(std::span<const std::uint8_t> bytes, int width, int height, std::uint8_t* out) noexcept {
        if (setjmp(escape) != 0) {
            jpeg_abort_decompress(&decoder);
            return false;
        }
        jpeg_mem_src(&decoder, bytes.data(), static_cast<unsigned long>(bytes.size()));
        if (jpeg_read_header(&decoder, TRUE) != JPEG_HEADER_OK) {
            jpeg_abort_decompress(&decoder);
            return false;
        }
        if (decoder.image_width != static_cast<unsigned>(width) || decoder.image_height != static_cast<unsigned>(height)) {
            jpeg_abort_decompress(&decoder);
            return false;
        }
        decoder.out_color_space = JCS_GRAYSCALE;
        decoder.dct_method = JDCT_IFAST;
        jpeg_start_decompress(&decoder);
        if (decoder.output_components != 1) {
            jpeg_abort_decompress(&decoder);
            return false;
        }
        while (decoder.output_scanline < decoder.output_height) {
            JSAMPROW row = out + static_cast<std::size_t>(decoder.output_scanline) * static_cast<std::size_t>(width);
            jpeg_read_scanlines(&decoder, &row, 1);
        }
        jpeg_finish_decompress(&decoder);
        return true;
    }
};

GreyConverter::GreyConverter() : jpeg_{std::make_unique<Jpeg>()} {}
GreyConverter::~GreyConverter() = default;

const char* to_string(PixelFormat format) noexcept {
    switch (format) {
        case PixelFormat::grey: return "GREY";
        case PixelFormat::y16: return "Y16";
        case PixelFormat::yuyv: return "YUYV";
        case PixelFormat::mjpg: return "MJPG";
    }
    return "unknown";
}

GreyImage GreyConverter::convert(std::span<const std::uint8_t> bytes, PixelFormat format, int width, int height,
                                 std::size_t stride) noexcept {
    if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide) return {};
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    const std::size_t least = format == PixelFormat::y16 || format == PixelFormat::yuyv ? 2 * w : w;
    if (format != PixelFormat::mjpg) {
        if (stride == 0) stride = least;
        if (stride < least || stride > (1u << 24) || bytes.size() < stride * (h - 1) + least) return {};
    }
    if (format == PixelFormat::grey) return {bytes.data(), width, height, static_cast<std::ptrdiff_t>(stride)};
    if (grey_.size() < w * h) grey_.resize(w * h);
    if (format == PixelFormat::mjpg) {
        if (!jpeg_->decode(bytes, width, height, grey_.data())) return {};
    } else {
        // The luminance byte: the first of each pair in YUYV, the high one (little-endian) in Y16.
        const std::size_t first = format == PixelFormat::y16 ? 1 : 0;
        for (std::size_t y = 0; y < h; ++y) {
            const std::uint8_t* in = bytes.data() + y * stride + first;
            std::uint8_t* out = grey_.data() + y * w;
            for (std::size_t x = 0; x < w; ++x) out[x] = in[2 * x];
        }
    }
    return {grey_.data(), width, height, static_cast<std::ptrdiff_t>(w)};
}

}  // namespace fovea::drivers::camera
