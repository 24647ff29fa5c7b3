// How like two 8-bit pictures are.
//
// Source: OpenCV's quality module. PSNR over the three colours, peak 255. SSIM (Wang et al. 2004) on Rec. 601 luma, 11x11
// Gaussian window of sigma 1.5, K1 = 0.01, K2 = 0.03, mean over all pixels, borders mirrored.
// Threads: pure.
#pragma once

#include <cstdint>
#include <span>

namespace fovea::tools {

// Equal pictures: kSamePicturePsnr_db.
inline constexpr double kSamePicturePsnr_db = 99;
[[nodiscard]] double psnr_db(std::span<const std::uint8_t> rgba_a, std::span<const std::uint8_t> rgba_b);
[[nodiscard]] double ssim(std::span<const std::uint8_t> rgba_a, std::span<const std::uint8_t> rgba_b, int width_px, int height_px);

struct Similarity {
    double psnr_db = kSamePicturePsnr_db, ssim = 1;
};
// Over the pixels whose mask is not 0 (one byte a pixel); none: as equal pictures.
[[nodiscard]] Similarity similarity(std::span<const std::uint8_t> rgba_a, std::span<const std::uint8_t> rgba_b, int width_px, int height_px,
                                    std::span<const std::uint8_t> mask);

}  // namespace fovea::tools
