// The pictures that the extrapolation engine reads and writes: borrowed memory with a format.
//
// Source: the formats are those of table 8.28 of GL_QCOM_frame_extrapolation.
// Input/Output: rows may run in either order, as long as it is the same in all pictures of one call.
// Threads: plain values.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fovea::render::extrapolation {

enum class Format : std::uint8_t { rgba8, rgb8, r8, rgba16f, rgb16f, rgba32f, rgb32f };
inline constexpr int kFormatCount = 7;

[[nodiscard]] constexpr int channel_count(Format f) noexcept {
    return f == Format::r8 ? 1 : f == Format::rgb8 || f == Format::rgb16f || f == Format::rgb32f ? 3 : 4;
}
[[nodiscard]] constexpr int bytes_per_channel(Format f) noexcept {
    return f == Format::rgba16f || f == Format::rgb16f ? 2 : f == Format::rgba32f || f == Format::rgb32f ? 4 : 1;
}
[[nodiscard]] constexpr int bytes_per_pixel(Format f) noexcept { return channel_count(f) * bytes_per_channel(f); }
[[nodiscard]] constexpr bool is_float(Format f) noexcept { return bytes_per_channel(f) > 1; }
[[nodiscard]] const char* format_name(Format f) noexcept;

inline constexpr int kMaxEdgePx = 16384;

struct ConstImage {
    const std::byte* pixels = nullptr;  // first row; aligned to bytes_per_channel
    int width_px = 0, height_px = 0;    // 1 to kMaxEdgePx
    std::ptrdiff_t row_bytes = 0;       // from one row to the next; at least width_px * bytes_per_pixel
    Format format = Format::rgba8;

    [[nodiscard]] const std::byte* row(int y) const noexcept { return pixels + y * row_bytes; }
};

struct Image {
    std::byte* pixels = nullptr;
    int width_px = 0, height_px = 0;
    std::ptrdiff_t row_bytes = 0;
    Format format = Format::rgba8;

    [[nodiscard]] std::byte* row(int y) const noexcept { return pixels + y * row_bytes; }
    operator ConstImage() const noexcept { return {pixels, width_px, height_px, row_bytes, format}; }
};

}  // namespace fovea::render::extrapolation
