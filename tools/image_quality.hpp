// How like two 8-bit pictures are.
//
// Source: PSNR over the three colours, peak 255. SSIM: Wang et al. 2004 on Rec. 601 luma, 11x11 Gaussian window of sigma
// 1.5, K1 = 0.01, K2 = 0.03, mean over all whole windows (pictures smaller than the window: over the whole picture).
// Threads: pure.
#pragma once

#include <cstdint>
#include <span>

namespace fovea::tools {

// Equal pictures: kSamePicturePsnr_db.
inline constexpr double kSamePicturePsnr_db = 99;
[[nodiscard]] double psnr_db(std::span<const std::uint8_t> rgba_a, std::span<const std::uint8_t> rgba_b);
[[nodiscard]] double ssim(std::span<const std::uint8_t> rgba_a, std::span<const std::uint8_t> rgba_b, int width_px, int height_px);

}  // namespace fovea::tools
