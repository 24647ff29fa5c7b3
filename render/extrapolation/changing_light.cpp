#include "render/extrapolation/changing_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/extrapolation/kernels.hpp"

namespace fovea::render::extrapolation {

namespace {

constexpr float kLeast = 1.0f;        // levels of 255 per frame: less is noise
constexpr float kLargePart = 0.25f;   // of the picture: light that changes there changes all over it
constexpr float kCoherent = 0.8f;     // of a cell's differences, all one way: texture that is a little off is not
constexpr float kSampled = ChangingLight::kCellPx * ChangingLight::kCellPx / ChangingLight::kEveryRow, kPart = 1 / kSampled;

}  // namespace

void ChangingLight::resize(int width_px, int height_px) {
    width_ = width_px;
    height_ = height_px;
    columns_ = (width_px + kCellPx - 1) / kCellPx;
    rows_ = (height_px + kCellPx - 1) / kCellPx;
    const std::size_t cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    sums_.assign(cells * kDifferenceLanes, 0);
    mean_.assign(3 * cells, 0.0f);
    certain_.assign(cells, 0.0f);
    asked_.assign(cells, 0);
    change_.assign(3 * cells, 0.0f);
}

void ChangingLight::clear() noexcept { std::fill(sums_.begin(), sums_.end(), 0); }

std::int16_t* ChangingLight::differences(int x, int y) noexcept {
    if (y % kEveryRow != 0) return nullptr;
    return sums_.data() + (static_cast<std::ptrdiff_t>(y / kCellPx) * columns_ + x / kCellPx) * kDifferenceLanes;
}

bool ChangingLight::find(float step) noexcept {
    step = std::clamp(step, -1.0f, 1.0f);   // for longer than one frame time nobody knows
    const std::size_t cells = certain_.size();
    std::size_t changing = 0;
    std::fill(asked_.begin(), asked_.end(), std::uint8_t{0});
    std::fill(change_.begin(), change_.end(), 0.0f);
    for (std::size_t i = 0; i < cells; ++i) {
        const std::int16_t* s = sums_.data() + i * kDifferenceLanes;
        int sum[4] = {};   // three channels, their sizes
        for (int lane = 0; lane < 16; lane += 2) {
            sum[0] += s[lane];
            sum[1] += s[16 + lane];
            sum[2] += s[lane + 1];
            sum[3] += s[17 + lane];
        }
        certain_[i] = 0;
        for (std::size_t c = 0; c < 3; ++c) mean_[3 * i + c] = 0;
        if (static_cast<float>(sum[3]) < 3 * kLeast * kSampled) continue;
        float one_way = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            mean_[3 * i + c] = static_cast<float>(sum[c]) * kPart;
            one_way += std::fabs(mean_[3 * i + c]);
        }
        const float size = static_cast<float>(sum[3]) * kPart;
        if (!(one_way >= kLeast * 3)) continue;
        certain_[i] = std::clamp((one_way / size - kCoherent) / (1 - kCoherent) * 2, 0.0f, 1.0f);
        if (!(certain_[i] > 0)) continue;
        ++changing;
        const int x = static_cast<int>(i) % columns_, y = static_cast<int>(i) / columns_;
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, rows_ - 1); ++j) {
            const int first = std::max(x - 1, 0), last = std::min(x + 1, columns_ - 1);
            std::fill_n(asked_.begin() + static_cast<std::ptrdiff_t>(j) * columns_ + first, last - first + 1, std::uint8_t{1});
        }
    }
    if (changing == 0 || static_cast<float>(changing) > kLargePart * static_cast<float>(cells)) return false;
    for (int y = 0; y < rows_; ++y)
        for (int x = 0; x < columns_; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
            if (asked_[i] == 0) continue;
            float* change = change_.data() + 3 * i;
            // Smooth: about the mean of its neighbours.
            float around[3] = {}, trust = 0;
            int n = 0;
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, rows_ - 1); ++j)
                for (int k = std::max(x - 1, 0); k <= std::min(x + 1, columns_ - 1); ++k) {
                    const std::size_t other = static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(k);
                    for (std::size_t c = 0; c < 3; ++c) around[c] += mean_[3 * other + c];
                    trust += certain_[other];
                    ++n;
                }
            float off = 0, size = 0, most = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                around[c] /= static_cast<float>(n);
                off += std::fabs(around[c] - mean_[3 * i + c]);
                size += std::max(std::fabs(around[c]), std::fabs(mean_[3 * i + c]));
                most = std::max(most, std::fabs(mean_[3 * i + c]));
            }
            const float smooth = std::clamp(2 - 4 * off / std::max(size, 1e-3f), 0.0f, 1.0f) * std::min(1.0f, 1.5f * trust / static_cast<float>(n));
            // What the blend has added of the farther source is taken back: BlendRow.
            const float blended = std::clamp((kSecondOnly - most) / kSecondOnly, 0.0f, 0.5f);
            for (std::size_t c = 0; c < 3; ++c) change[c] = -smooth * (step + blended) * mean_[3 * i + c];
        }
    return true;
}

void ChangingLight::apply(const Image& output, threads::ThreadPool& pool) const noexcept {
    const int channels = channel_count(output.format), colours = std::min(channels, 3);
    constexpr float kPerCell = 1.0f / kCellPx;
    pool.run(rows_, 8, [&](int row0, int row1) {
        for (int y = row0 * kCellPx; y < std::min(row1 * kCellPx, height_); ++y) {
            const float fy = (static_cast<float>(y) + 0.5f) * kPerCell - 0.5f;
            const int j0 = std::clamp(static_cast<int>(std::floor(fy)), 0, rows_ - 1), j1 = std::min(j0 + 1, rows_ - 1);
            const float ty = std::clamp(fy - static_cast<float>(j0), 0.0f, 1.0f);
            const float *upper = change_.data() + 3 * static_cast<std::ptrdiff_t>(j0) * columns_, *lower = change_.data() + 3 * static_cast<std::ptrdiff_t>(j1) * columns_;
            const std::uint8_t *above = asked_.data() + static_cast<std::ptrdiff_t>(j0) * columns_, *below = asked_.data() + static_cast<std::ptrdiff_t>(j1) * columns_;
            auto* out = reinterpret_cast<std::uint8_t*>(output.row(y));
            // From the centre of one cell to that of the next.
            for (int i = -1; i < columns_; ++i) {
                const int left = std::max(i, 0), right = std::min(i + 1, columns_ - 1), a = 3 * left, b = 3 * right;
                if ((above[left] | above[right] | below[left] | below[right]) == 0) continue;
                float from[3], to[3], any = 0;
                for (int c = 0; c < 3; ++c) {
                    from[c] = upper[a + c] + ty * (lower[a + c] - upper[a + c]);
                    to[c] = upper[b + c] + ty * (lower[b + c] - upper[b + c]);
                    any += std::fabs(from[c]) + std::fabs(to[c]);
                }
                if (!(any > 0)) continue;
                const int x0 = i * kCellPx + kCellPx / 2;
                for (int x = std::max(x0, 0); x < std::min(x0 + kCellPx, width_); ++x) {
                    const float t = (static_cast<float>(x - x0) + 0.5f) * kPerCell;
                    for (int c = 0; c < colours; ++c) {
                        std::uint8_t& level = out[channels * x + c];
                        level = static_cast<std::uint8_t>(std::clamp(static_cast<float>(level) + from[c] + t * (to[c] - from[c]) + 0.5f, 0.0f, 255.0f));
                    }
                }
            }
        }
    });
}

}  // namespace fovea::render::extrapolation
