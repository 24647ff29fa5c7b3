// What the engine takes from the two sources: which tiles do not change, and a four-channel copy to gather from.
#pragma once

#include <vector>

#include "render/extrapolation/image.hpp"
#include "render/extrapolation/plane.hpp"
#include "render/threads/thread_pool.hpp"

namespace fovea::render::extrapolation {

using threads::ThreadPool;

inline constexpr int kTilePx = 16;

struct TileMap {
    enum Tile : std::uint8_t {
        kChanged = 0,
        kAnchor = 1,   // both sources equal bit for bit, and textured enough to know it: it stands still
        kEven = 2,     // equal as well, but all of one colour: the inside of what moves may look like that
    };
    int columns = 0, rows = 0;
    std::vector<std::uint8_t> still;   // Tile
    int still_count = 0;               // anchors and even ones

    void resize(int width_px, int height_px);
    [[nodiscard]] bool is_still(int column, int row) const noexcept {
        return still[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)] != 0;
    }
    [[nodiscard]] bool is_anchor(int column, int row) const noexcept {
        return still[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)] == kAnchor;
    }
    [[nodiscard]] bool all_still() const noexcept { return still_count == columns * rows; }
};
struct LumaPair;
inline constexpr int kAroundTiles = 5;   // beyond what differs, where the finer levels of the search still look
// Still tiles are copied to the output in the same pass, while they are at hand: whatever comes of the rest, they show that. So is,
// unless it is null, the luma of what differs and of its surroundings made, row by row of tiles.
void compare_tiles(const ConstImage& a, const ConstImage& b, const Image& output, TileMap& map, const Kernels& kernels, ThreadPool& pool,
                   const LumaPair* luma = nullptr) noexcept;

// Four channels of 8 bits or four floats per pixel, to gather from; pixels of a format that is already so are borrowed.
struct Gatherable {
    const std::uint8_t* pixels = nullptr;
    std::ptrdiff_t row_bytes = 0;
    const std::uint8_t* finite = nullptr;   // one flag per pixel; null: all are finite
    std::vector<std::uint8_t> copy, flags;

    void resize(int width_px, int height_px, Format format);
};
void make_gatherable(const ConstImage& image, Gatherable& out, ThreadPool& pool) noexcept;

// Writes `count` pixels of four channels to a row of the picture's own format.
void pack_row(const void* four_channels, Format format, int count, std::byte* out) noexcept;
// Pixels x0 to x0+count of a row as four channels; absent ones are 0, absent alpha is 1.
void unpack_row(const std::byte* row, Format format, int x0, int count, void* four_channels) noexcept;

}  // namespace fovea::render::extrapolation
