#include "render/extrapolation/sources.hpp"

#include <atomic>
#include <cstring>

#include "render/extrapolation/luma.hpp"

namespace fovea::render::extrapolation {

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

void compare_tiles(const ConstImage& a, const ConstImage& b, const Image& output, TileMap& map, const Kernels& kernels, ThreadPool& pool, const LumaPair* luma) noexcept {
    const int pixel = bytes_per_pixel(a.format), tile_bytes = kTilePx * pixel;
    std::atomic<int> count{0};
    std::atomic<std::size_t> next_strip{0};
    constexpr int kRows = 8;
    const int strips = luma != nullptr ? static_cast<int>(luma->scratch->strips.size() / luma->scratch->strip_bytes) : 0;
    // With luma as many chunks as strips, so that each has one to itself.
    pool.run(map.rows, luma != nullptr ? (map.rows + strips - 1) / strips : kRows, [&](int row0, int row1) {
        std::byte* strip = luma != nullptr ? luma->scratch->strip(next_strip.fetch_add(1, std::memory_order_relaxed)) : nullptr;
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
            int first = map.columns, last = -1;   // that differ
            for (int column = 0; column < map.columns;) {
                int end = column;
                for (; end < map.columns && still[end] != 0; ++end)
                    if (is_even(a, end * kTilePx, y0, std::min(kTilePx, a.width_px - end * kTilePx), height)) still[end] = TileMap::kEven;
                if (end == column) {
                    first = std::min(first, column);
                    last = column++;
                    continue;
                }
                found += end - column;
                const auto from = static_cast<std::ptrdiff_t>(column) * tile_bytes;
                const auto bytes = static_cast<std::size_t>(std::min(end * kTilePx, a.width_px) - column * kTilePx) * static_cast<std::size_t>(pixel);
                for (int y = y0; y < y0 + height; ++y) std::memcpy(output.row(y) + from, a.row(y) + from, bytes);
                column = end;
            }
            if (luma == nullptr) continue;
            const int begin = std::max(first - kAroundTiles, 0), end = std::min(last + 1 + kAroundTiles, map.columns);
            luma->scratch->filled[static_cast<std::size_t>(row)] = last < 0 ? LumaScratch::Span{} : LumaScratch::Span{static_cast<std::int16_t>(begin), static_cast<std::int16_t>(end)};
            if (last >= 0) fill_tiles(*luma, map, row, begin, end, strip, kernels);
        }
        count.fetch_add(found, std::memory_order_relaxed);
    });
    map.still_count = count.load(std::memory_order_relaxed);
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
