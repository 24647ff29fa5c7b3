#include "render/extrapolation/luma.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr int kMaxCellPx = 8;

// x / (x + key) of the luma of one float pixel, 0 to 255.
float mapped_luma(const float* p, float key) noexcept {
    float y = 0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2];
    if (!(y > 0)) y = 0;   // negative or NaN
    const float light = y > 3e38f ? (std::isinf(y) ? 0.0f : 1.0f) : y / (y + key);
    float alpha = p[3];
    if (!(alpha > 0)) alpha = 0;
    if (alpha > 1) alpha = 1;
    return 255.0f * (0.75f * light + 0.25f * alpha);
}

// The mean of one row of cells from `cell_px` rows of four channels.
void luma_strip(const std::byte* strip, std::ptrdiff_t row_bytes, bool floats, int cell_px, int cells, float key, float* out,
                const Kernels& kernels) noexcept {
    if (!floats && cell_px <= 4) {
        kernels.luma_rgba8(reinterpret_cast<const std::uint8_t*>(strip), row_bytes, cell_px, cells, out);
        return;
    }
    const float scale = 1.0f / static_cast<float>(cell_px * cell_px);
    for (int c = 0; c < cells; ++c) {
        float sum = 0;
        for (int r = 0; r < cell_px; ++r)
            for (int x = 0; x < cell_px; ++x) {
                const std::byte* p = strip + r * row_bytes + static_cast<std::ptrdiff_t>(c * cell_px + x) * (floats ? 16 : 4);
                if (floats) {
                    float px[4];
                    std::memcpy(px, p, sizeof px);
                    sum += mapped_luma(px, key);
                } else {
                    const auto* b = reinterpret_cast<const std::uint8_t*>(p);
                    sum += 0.75f * (0.299f * b[0] + 0.587f * b[1] + 0.114f * b[2]) + 0.25f * b[3];
                }
            }
        out[c] = sum * scale;
    }
}

// Cells begin to end - 1 of one row of cells.
void luma_row(const ConstImage& image, int cell_px, float key, Plane& out, int row, int begin, int end, std::byte* strip, const Kernels& kernels) noexcept {
    const bool floats = is_float(image.format);
    const bool direct = (image.format == Format::rgba8 && cell_px <= 4) || image.format == Format::rgba32f;
    const int pixel = floats ? 16 : 4, whole = image.width_px / cell_px, y0 = row * cell_px;
    int first = begin;   // cell from which on the strip is needed
    if (direct && y0 + cell_px <= image.height_px && begin < whole) {
        first = std::min(end, whole);
        luma_strip(image.row(y0) + static_cast<std::ptrdiff_t>(begin) * cell_px * pixel, image.row_bytes, floats, cell_px, first - begin, key, out.row(row) + begin, kernels);
    }
    if (first >= end) return;
    const std::ptrdiff_t strip_row = static_cast<std::ptrdiff_t>(out.width()) * cell_px * pixel;
    const int x0 = first * cell_px, wanted = (end - first) * cell_px, count = std::min(image.width_px - x0, wanted);
    for (int r = 0; r < cell_px; ++r) {
        std::byte* to = strip + r * strip_row;
        unpack_row(image.row(std::min(y0 + r, image.height_px - 1)), image.format, x0, count, to);
        for (int x = count; x < wanted; ++x) std::memcpy(to + static_cast<std::ptrdiff_t>(x) * pixel, to + static_cast<std::ptrdiff_t>(count - 1) * pixel, static_cast<std::size_t>(pixel));
    }
    luma_strip(strip, strip_row, floats, cell_px, end - first, key, out.row(row) + first, kernels);
}

}  // namespace

void LumaScratch::resize(int width_px, int height_px, int threads) {
    strip_bytes = static_cast<std::size_t>(width_px + kMaxCellPx) * 16 * kMaxCellPx;
    strips.assign(strip_bytes * static_cast<std::size_t>(threads), std::byte{0});
    filled.assign(static_cast<std::size_t>((height_px + kTilePx - 1) / kTilePx), Span{});
}

float luma_key(const ConstImage& image) noexcept {
    if (!is_float(image.format)) return 1;
    constexpr int kSamples = 64;   // along each axis
    double sum = 0;
    int count = 0;
    for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) {
            float p[4];
            const auto x = static_cast<int>((2LL * i + 1) * image.width_px / (2 * kSamples));
            const auto y = static_cast<int>((2LL * j + 1) * image.height_px / (2 * kSamples));
            unpack_row(image.row(y), image.format, x, 1, p);
            const double l = 0.299 * static_cast<double>(p[0]) + 0.587 * static_cast<double>(p[1]) + 0.114 * static_cast<double>(p[2]);
            if (!(l > 1e-30) || !std::isfinite(l)) continue;
            sum += std::log(l);
            ++count;
        }
    return count == 0 ? 1.0f : static_cast<float>(std::exp(sum / count));
}

void fill_tiles(const LumaPair& luma, const TileMap& tiles, int row, int begin, int end, std::byte* strip, const Kernels& kernels) noexcept {
    const int per_tile = kTilePx / luma.cell_px, width = luma.near_luma->width();
    const int y0 = row * per_tile, y1 = std::min(y0 + per_tile, luma.near_luma->height()), x0 = begin * per_tile, x1 = std::min(end * per_tile, width);
    for (int y = y0; y < y1; ++y) luma_row(*luma.near, luma.cell_px, luma.key, *luma.near_luma, y, x0, x1, strip, kernels);
    for (int column = begin; column < end;) {
        const bool still = tiles.is_still(column, row);
        const int from = column * per_tile;
        while (column < end && tiles.is_still(column, row) == still) ++column;
        const int to = std::min(column * per_tile, width);
        for (int y = y0; y < y1; ++y) {
            if (still)
                std::copy_n(luma.near_luma->row(y) + from, to - from, luma.far_luma->row(y) + from);
            else
                luma_row(*luma.far, luma.cell_px, luma.key, *luma.far_luma, y, from, to, strip, kernels);
        }
    }
}

void fill_luma(const LumaPair& luma, const TileMap& tiles, const Box& part, bool begun, const Kernels& kernels, ThreadPool& pool) noexcept {
    const int per_tile = kTilePx / luma.cell_px;
    std::atomic<std::size_t> next_strip{0};
    const int rows = part.y1 - part.y0, strips = static_cast<int>(luma.scratch->strips.size() / luma.scratch->strip_bytes);
    // As many chunks as strips, so that each has one to itself.
    pool.run(rows, (rows + strips - 1) / strips, [&](int row0, int row1) {
        std::byte* strip = luma.scratch->strip(next_strip.fetch_add(1, std::memory_order_relaxed));
        for (int row = part.y0 + row0; row < part.y0 + row1; ++row) {
            const LumaScratch::Span done = begun ? luma.scratch->filled[static_cast<std::size_t>(row)] : LumaScratch::Span{};
            if (done.begin < done.end) {
                if (part.x0 < done.begin) fill_tiles(luma, tiles, row, part.x0, done.begin, strip, kernels);
                if (done.end < part.x1) fill_tiles(luma, tiles, row, done.end, part.x1, strip, kernels);
            } else {
                fill_tiles(luma, tiles, row, part.x0, part.x1, strip, kernels);
            }
            for (int y = row * per_tile; y < std::min((row + 1) * per_tile, luma.near_luma->height()); ++y) {
                luma.near_luma->pad_row(y);
                luma.far_luma->pad_row(y);
            }
        }
    });
    for (Plane* plane : {luma.near_luma, luma.far_luma}) {
        if (part.y0 == 0) plane->pad_above();
        if (part.y1 == tiles.rows) plane->pad_below();
    }
}

}  // namespace fovea::render::extrapolation
