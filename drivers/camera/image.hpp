// Camera frames as 8-bit grey images, whatever format the camera speaks.
//
// Input: the bytes of one buffer as V4L2 hands them out; never trusted: a frame shorter than its format says is refused.
// Output: rows of width bytes, 0 black to 255 white.
// Threads: one converter per thread. convert() allocates only when the size grows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace fovea::drivers::camera {

// A view of pixels that somebody else owns.
struct GreyImage {
    const std::uint8_t* pixels = nullptr;
    int width = 0, height = 0;
    std::ptrdiff_t stride = 0;   // bytes from row to row
};

enum class PixelFormat : std::uint8_t { grey, y16, yuyv, mjpg };
[[nodiscard]] const char* to_string(PixelFormat format) noexcept;

inline constexpr int kMaxImageSide = 4096;

class GreyConverter {
public:
    GreyConverter();
    ~GreyConverter();
    // The view is valid until the next call, or as long as `bytes` (GREY is not copied). An image without pixels: the
    // bytes are no such frame. `stride` is the camera's bytes per line; 0: the least possible.
    [[nodiscard]] GreyImage convert(std::span<const std::uint8_t> bytes, PixelFormat format, int width, int height,
                                    std::size_t stride) noexcept;

private:
    struct Jpeg;
    std::unique_ptr<Jpeg> jpeg_;
    std::vector<std::uint8_t> grey_;
};

}  // namespace fovea::drivers::camera
