#include "tools/image_quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace fovea::tools {

double psnr_db(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
    std::uint64_t sum = 0, count = 0;
    for (std::size_t i = 0; i < a.size(); i += 4)
        for (std::size_t k = 0; k < 3; ++k, ++count) {
            const int d = a[i + k] - b[i + k];
            sum += static_cast<std::uint64_t>(d * d);
        }
    if (sum == 0) return kSamePicturePsnr_db;
    return std::min(kSamePicturePsnr_db, 10 * std::log10(255.0 * 255.0 * static_cast<double>(count) / static_cast<double>(sum)));
}

double ssim(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height) {
    constexpr int kRadius = 5;
    const int radius = std::min({kRadius, (width - 1) / 2, (height - 1) / 2});
    std::array<double, 2 * kRadius + 1> window{};
    double total = 0;
    for (int k = -radius; k <= radius; ++k) total += window[static_cast<std::size_t>(k + radius)] = std::exp(-k * k / (2 * 1.5 * 1.5));
    for (double& w : window) w /= total;
    const auto luma = [](std::span<const std::uint8_t> p, std::size_t i) { return 0.299 * p[4 * i] + 0.587 * p[4 * i + 1] + 0.114 * p[4 * i + 2]; };
    // The five moments, filtered along rows, then along columns.
    const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::array<std::vector<double>, 5> rows;
    for (auto& r : rows) r.assign(size, 0);
    std::vector<double> la(static_cast<std::size_t>(width)), lb(la);
    const auto w = static_cast<std::size_t>(width), r = static_cast<std::size_t>(radius);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        for (std::size_t x = 0; x < w; ++x) {
            la[x] = luma(a, y * w + x);
            lb[x] = luma(b, y * w + x);
        }
        for (std::size_t x = r; x + r < w; ++x) {
            std::array<double, 5> s{};
            for (std::size_t k = 0; k <= 2 * r; ++k) {
                const double p = la[x + k - r], q = lb[x + k - r], g = window[k];
                s[0] += g * p;
                s[1] += g * q;
                s[2] += g * p * p;
                s[3] += g * q * q;
                s[4] += g * p * q;
            }
            for (std::size_t m = 0; m < 5; ++m) rows[m][y * w + x] = s[m];
        }
    }
    constexpr double kC1 = 0.01 * 255 * 0.01 * 255, kC2 = 0.03 * 255 * 0.03 * 255;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t y = r; y + r < static_cast<std::size_t>(height); ++y)
        for (std::size_t x = r; x + r < w; ++x) {
            std::array<double, 5> s{};
            for (std::size_t k = 0; k <= 2 * r; ++k)
                for (std::size_t m = 0; m < 5; ++m) s[m] += window[k] * rows[m][(y + k - r) * w + x];
            const double va = s[2] - s[0] * s[0], vb = s[3] - s[1] * s[1], cov = s[4] - s[0] * s[1];
            sum += (2 * s[0] * s[1] + kC1) * (2 * cov + kC2) / ((s[0] * s[0] + s[1] * s[1] + kC1) * (va + vb + kC2));
            ++count;
        }
    return count == 0 ? 1.0 : sum / static_cast<double>(count);
}

}  // namespace fovea::tools
