#include "render/extrapolation/sources.hpp"

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

}  // namespace

void TileMap::resize(int width_px, int height_px) {
    columns = (width_px + kTilePx - 1) / kTilePx;
    rows = (height_px + kTilePx - 1) / kTilePx;
    still.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
    still_count = 0;
}

void compare_tiles(const ConstImage& a, const ConstImage& b, TileMap& map, ThreadPool& pool) noexcept {
    const int pixel = bytes_per_pixel(a.format);
    std::atomic<int> count{0};
    pool.run(map.rows, 8, [&](int row0, int row1) {
        int found = 0;
        for (int row = row0; row < row1; ++row) {
            const int y0 = row * kTilePx, y1 = std::min(y0 + kTilePx, a.height_px);
            for (int column = 0; column < map.columns; ++column) {
                const int x0 = column * kTilePx, x1 = std::min(x0 + kTilePx, a.width_px);
                const auto from = static_cast<std::ptrdiff_t>(x0) * pixel;
                const auto bytes = static_cast<std::size_t>(x1 - x0) * static_cast<std::size_t>(pixel);
                bool same = true;
                for (int y = y0; y < y1 && same; ++y) same = std::memcmp(a.row(y) + from, b.row(y) + from, bytes) == 0;
                map.still[static_cast<std::size_t>(row) * static_cast<std::size_t>(map.columns) + static_cast<std::size_t>(column)] = same;
                found += same;
            }
        }
        count.fetch_add(found, std::memory_order_relaxed);
    });
    map.still_count = count.load(std::memory_order_relaxed);
}

void LumaScratch::resize(int width_px, int threads) {
    strip_bytes = static_cast<std::size_t>(width_px + kMaxCellPx) * 16 * kMaxCellPx;
    strips.assign(strip_bytes * static_cast<std::size_t>(threads), std::byte{0});
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

void make_luma(const ConstImage& image, int cell_px, float key, Plane& out, LumaScratch& scratch, const Kernels& kernels,
               ThreadPool& pool, const TileMap* known, const Plane* twin) noexcept {
    const bool floats = is_float(image.format);
    const bool direct = (image.format == Format::rgba8 && cell_px <= 4) || image.format == Format::rgba32f;
    const int pixel = floats ? 16 : 4;
    std::atomic<std::size_t> next_strip{0};
    const std::size_t strip_count = scratch.strips.size() / scratch.strip_bytes;
    // As many chunks as strips, so that each has one to itself.
    const int chunk = (out.height() + static_cast<int>(strip_count) - 1) / static_cast<int>(strip_count);
    pool.run(out.height(), chunk, [&](int row0, int row1) {
        std::byte* strip = scratch.strips.data() + scratch.strip_bytes * (next_strip.fetch_add(1, std::memory_order_relaxed) % strip_count);
        const std::ptrdiff_t strip_row = static_cast<std::ptrdiff_t>(out.width()) * cell_px * pixel;
        for (int row = row0; row < row1; ++row) {
            const int y0 = row * cell_px;
            const int whole = image.width_px / cell_px;
            int skip = 0;
            if (known != nullptr && known->still_count > 0) {
                // Still tiles at the left end, and all of a still row.
                int tiles = 0;
                while (tiles < known->columns && known->is_still(tiles, y0 / kTilePx)) ++tiles;
                skip = std::min(tiles * (kTilePx / cell_px), out.width());
                std::copy_n(twin->row(row), skip, out.row(row));
                if (skip == out.width()) {
                    out.pad_row(row);
                    continue;
                }
                int right = known->columns;
                while (right > tiles && known->is_still(right - 1, y0 / kTilePx)) --right;
                const int end = std::min(right * (kTilePx / cell_px), out.width());
                if (end < whole && direct && y0 + cell_px <= image.height_px) {
                    std::copy_n(twin->row(row) + end, out.width() - end, out.row(row) + end);
                    luma_strip(image.row(y0) + static_cast<std::ptrdiff_t>(skip) * cell_px * bytes_per_pixel(image.format), image.row_bytes, floats, cell_px, end - skip, key, out.row(row) + skip, kernels);
                    out.pad_row(row);
                    continue;
                }
            }
            int first = 0;   // cell from which on the strip is needed
            if (direct && y0 + cell_px <= image.height_px) {
                luma_strip(image.row(y0), image.row_bytes, floats, cell_px, whole, key, out.row(row), kernels);
                first = whole;
            }
            if (first < out.width()) {
                const int x0 = first * cell_px, count = image.width_px - x0, wanted = (out.width() - first) * cell_px;
                for (int r = 0; r < cell_px; ++r) {
                    std::byte* to = strip + r * strip_row;
                    unpack_row(image.row(std::min(y0 + r, image.height_px - 1)), image.format, x0, count, to);
                    for (int x = count; x < wanted; ++x) std::memcpy(to + static_cast<std::ptrdiff_t>(x) * pixel, to + static_cast<std::ptrdiff_t>(count - 1) * pixel, static_cast<std::size_t>(pixel));
                }
                luma_strip(strip, strip_row, floats, cell_px, out.width() - first, key, out.row(row) + first, kernels);
            }
            out.pad_row(row);
        }
    });
    out.pad_above_and_below();
}

void Gatherable::resize(int width_px, int height_px, Format format) {
    const std::size_t pixels_count = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    const bool borrowed = format == Format::rgba8 || format == Format::rgba32f;
    copy.assign(borrowed ? 0 : pixels_count * (is_float(format) ? 16 : 4), 0);
    copy.shrink_to_fit();
    flags.assign(is_float(format) ? pixels_count : 0, 1);
    flags.shrink_to_fit();
}

void make_gatherable(const ConstImage& image, Gatherable& out, ThreadPool& pool) noexcept {
    const bool floats = is_float(image.format);
    if (out.copy.empty()) {
        out.pixels = reinterpret_cast<const std::uint8_t*>(image.pixels);
        out.row_bytes = image.row_bytes;
    } else {
        out.pixels = out.copy.data();
        out.row_bytes = static_cast<std::ptrdiff_t>(image.width_px) * (floats ? 16 : 4);
    }
    out.finite = nullptr;
    if (out.copy.empty() && !floats) return;
    std::atomic<bool> all_finite{true};
    pool.run(image.height_px, 32, [&](int row0, int row1) {
        bool all = true;
        for (int y = row0; y < row1; ++y) {
            if (!out.copy.empty()) unpack_row(image.row(y), image.format, 0, image.width_px, out.copy.data() + y * out.row_bytes);
            if (!floats) continue;
            const auto* row = reinterpret_cast<const float*>(out.pixels + y * out.row_bytes);
            std::uint8_t* flags = out.flags.data() + static_cast<std::ptrdiff_t>(y) * image.width_px;
            std::uint8_t good = 1;
            for (int x = 0; x < image.width_px; ++x) {
                // x - x is 0 for every finite number and NaN for the others.
                const float zero = (row[4 * x] - row[4 * x]) + (row[4 * x + 1] - row[4 * x + 1]) + (row[4 * x + 2] - row[4 * x + 2]) + (row[4 * x + 3] - row[4 * x + 3]);
                flags[x] = zero == 0;
                good = good & flags[x];
            }
            all = all && good != 0;
        }
        if (!all) all_finite.store(false, std::memory_order_relaxed);
    });
    if (!all_finite.load(std::memory_order_relaxed)) out.finite = out.flags.data();
}

}  // namespace fovea::render::extrapolation
