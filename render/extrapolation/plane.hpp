// A picture of floats with a border of repeated pixels, so that the search never asks whether it is inside.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "render/extrapolation/kernels.hpp"

namespace fovea::render::extrapolation {

class Plane {
public:
    void resize(int width, int height) {
        width_ = width;
        height_ = height;
        stride_ = (width + 2 * kPadPx + 7) / 8 * 8;
        storage_.assign(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height + 2 * kPadPx), 0.0f);
    }
    [[nodiscard]] int width() const noexcept { return width_; }
    [[nodiscard]] int height() const noexcept { return height_; }
    [[nodiscard]] std::ptrdiff_t stride() const noexcept { return stride_; }
    // y from -kPadPx to height + kPadPx - 1, x likewise.
    [[nodiscard]] float* row(int y) noexcept { return storage_.data() + (y + kPadPx) * stride_ + kPadPx; }
    [[nodiscard]] const float* row(int y) const noexcept { return storage_.data() + (y + kPadPx) * stride_ + kPadPx; }

    void pad_row(int y) noexcept {
        float* r = row(y);
        std::fill(r - kPadPx, r, r[0]);
        std::fill(r + width_, r - kPadPx + stride_, r[width_ - 1]);
    }
    // After the row at that edge is padded.
    void pad_above() noexcept {
        for (int y = 1; y <= kPadPx; ++y) std::copy_n(row(0) - kPadPx, stride_, row(-y) - kPadPx);
    }
    void pad_below() noexcept {
        for (int y = 1; y <= kPadPx; ++y) std::copy_n(row(height_ - 1) - kPadPx, stride_, row(height_ - 1 + y) - kPadPx);
    }

private:
    int width_ = 0, height_ = 0;
    std::ptrdiff_t stride_ = 0;
    std::vector<float> storage_;
};

// A part of a field, in cells: columns x0 to x1 - 1, rows y0 to y1 - 1.
struct Box {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    // What of it lies within `radius_px` along either axis; all of it if that is no number.
    [[nodiscard]] Box around(float x_px, float y_px, float radius_px, int cell_px) const noexcept {
        const float per_cell = 1.0f / static_cast<float>(cell_px);
        const float left = (x_px - radius_px) * per_cell, right = (x_px + radius_px) * per_cell, top = (y_px - radius_px) * per_cell, bottom = (y_px + radius_px) * per_cell;
        if (!(left <= right && top <= bottom)) return *this;
        const auto within = [](float v, int low, int high) { return static_cast<int>(std::clamp(v, static_cast<float>(low), static_cast<float>(high))); };
        return {within(left, x0, x1), within(top, y0, y1), within(right + 1, x0, x1), within(bottom + 1, y0, y1)};
    }
    [[nodiscard]] bool holds(const Box& b) const noexcept { return b.x1 <= b.x0 || b.y1 <= b.y0 || (b.x0 >= x0 && b.y0 >= y0 && b.x1 <= x1 && b.y1 <= y1); }
    [[nodiscard]] Box grown(int by, int width, int height) const noexcept {
        return {std::max(x0 - by, 0), std::max(y0 - by, 0), std::min(x1 + by, width), std::min(y1 + by, height)};
    }
};

// A motion per cell of the picture.
struct Field {
    int width = 0, height = 0;
    std::vector<float> u, v;
    void resize(int w, int h) {
        width = w;
        height = h;
        u.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0.0f);
        v.assign(u.size(), 0.0f);
    }
};

}  // namespace fovea::render::extrapolation
