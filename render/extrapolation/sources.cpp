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

namespace {

// All pixels of a tile are the same.
bool is_even(const ConstImage& i, int x0, int y0, int width, int height) noexcept {
    const auto pixel = static_cast<std::size_t>(bytes_per_pixel(i.format)), bytes = static_cast<std::size_t>(width) * pixel;
    const std::byte* first = i.row(y0) + static_cast<std::ptrdiff_t>(x0) * static_cast<std::ptrdiff_t>(pixel);
    if (std::memcmp(first, first + pixel, bytes - pixel) != 0) return false;
    for (int y = 1; y < height; ++y)
        if (std::memcmp(first, first + y * i.row_bytes, bytes) != 0) return false;
    return true;
}

}  // namespace

void compare_tiles(const ConstImage& a, const ConstImage& b, const Image& output, TileMap& map, const Kernels& kernels, ThreadPool& pool) noexcept {
    const int pixel = bytes_per_pixel(a.format), tile_bytes = kTilePx * pixel;
    std::atomic<int> count{0};
    pool.run(map.rows, 8, [&](int row0, int row1) {
        int found = 0;
        for (int row = row0; row < row1; ++row) {
            const int y0 = row * kTilePx, height = std::min(kTilePx, a.height_px - y0);
            std::uint8_t* still = map.still.data() + static_cast<std::ptrdiff_t>(row) * map.columns;
            const int whole = tile_bytes % 32 == 0 ? a.width_px / kTilePx : 0;
            kernels.same_tiles(reinterpret_cast<const std::uint8_t*>(a.row(y0)), a.row_bytes, reinterpret_cast<const std::uint8_t*>(b.row(y0)), b.row_bytes, height, whole, tile_bytes, still);
            for (int column = whole; column < map.columns; ++column) {
                const auto from = static_cast<std::ptrdiff_t>(column) * tile_bytes;
                const auto bytes = static_cast<std::size_t>(std::min(kTilePx, a.width_px - column * kTilePx)) * static_cast<std::size_t>(pixel);
                bool same = true;
                for (int y = y0; y < y0 + height && same; ++y) same = std::memcmp(a.row(y) + from, b.row(y) + from, bytes) == 0;
                still[column] = same;
            }
            for (int column = 0; column < map.columns;) {
                int end = column;
                for (; end < map.columns && still[end] != 0; ++end)
                    if (is_even(a, end * kTilePx, y0, std::min(kTilePx, a.width_px - end * kTilePx), height)) still[end] = TileMap::kEven;
                if (end == column) {
                    ++column;
                    continue;
                }
                found += end - column;
                const auto from = static_cast<std::ptrdiff_t>(column) * tile_bytes;
                const auto bytes = static_cast<std::size_t>(std::min(end * kTilePx, a.width_px) - column * kTilePx) * static_cast<std::size_t>(pixel);
                for (int y = y0; y < y0 + height; ++y) std::memcpy(output.row(y) + from, a.row(y) + from, bytes);
                column = end;
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

void make_luma(const ConstImage& image, int cell_px, float key, Plane& out, const Box& part, LumaScratch& scratch, const Kernels& kernels,
               ThreadPool& pool, const TileMap* known, const Plane* twin) noexcept {
    const bool floats = is_float(image.format);
    const bool direct = (image.format == Format::rgba8 && cell_px <= 4) || image.format == Format::rgba32f;
    const int pixel = floats ? 16 : 4;
    const int whole = image.width_px / cell_px, per_tile = kTilePx / cell_px;
    std::atomic<std::size_t> next_strip{0};
    const std::size_t strip_count = scratch.strips.size() / scratch.strip_bytes;
    // As many chunks as strips, so that each has one to itself.
    const int rows = part.y1 - part.y0, chunk = (rows + static_cast<int>(strip_count) - 1) / static_cast<int>(strip_count);
    pool.run(rows, chunk, [&](int row0, int row1) {
        std::byte* strip = scratch.strips.data() + scratch.strip_bytes * (next_strip.fetch_add(1, std::memory_order_relaxed) % strip_count);
        const std::ptrdiff_t strip_row = static_cast<std::ptrdiff_t>(out.width()) * cell_px * pixel;
        const auto compute = [&](int row, int cell0, int cell1) {
            const int y0 = row * cell_px;
            int first = cell0;   // cell from which on the strip is needed
            if (direct && y0 + cell_px <= image.height_px && cell0 < whole) {
                first = std::min(cell1, whole);
                luma_strip(image.row(y0) + static_cast<std::ptrdiff_t>(cell0) * cell_px * pixel, image.row_bytes, floats, cell_px, first - cell0, key, out.row(row) + cell0, kernels);
            }
            if (first >= cell1) return;
            const int x0 = first * cell_px, wanted = (cell1 - first) * cell_px, count = std::min(image.width_px - x0, wanted);
            for (int r = 0; r < cell_px; ++r) {
                std::byte* to = strip + r * strip_row;
                unpack_row(image.row(std::min(y0 + r, image.height_px - 1)), image.format, x0, count, to);
                for (int x = count; x < wanted; ++x) std::memcpy(to + static_cast<std::ptrdiff_t>(x) * pixel, to + static_cast<std::ptrdiff_t>(count - 1) * pixel, static_cast<std::size_t>(pixel));
            }
            luma_strip(strip, strip_row, floats, cell_px, cell1 - first, key, out.row(row) + first, kernels);
        };
        // One row of tiles at a time: what is known is known for all of their cells.
        for (int row = part.y0 + row0, end = part.y0 + row1; row < end;) {
            const int tile_row = row / per_tile, next = std::min((tile_row + 1) * per_tile, end);
            const bool asked = known != nullptr && known->still_count > 0;
            for (int cell = part.x0; cell < part.x1;) {
                const bool still = asked && known->is_still(cell / per_tile, tile_row);
                int cell1 = asked ? cell : part.x1;
                while (cell1 < part.x1 && known->is_still(cell1 / per_tile, tile_row) == still) cell1 = std::min((cell1 / per_tile + 1) * per_tile, part.x1);
                for (int y = row; y < next; ++y) {
                    if (still)
                        std::copy_n(twin->row(y) + cell, cell1 - cell, out.row(y) + cell);
                    else
                        compute(y, cell, cell1);
                }
                cell = cell1;
            }
            for (; row < next; ++row) out.pad_row(row);
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
