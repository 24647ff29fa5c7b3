// What the engine takes from the two sources: which tiles do not change, luma, and a four-channel copy to gather from.
//
// Luma is 3/4 of Rec. 601 luma and 1/4 alpha, 0 to 255. Float pictures are first mapped to x / (x + key), where key is the
// geometric mean of src2's positive luma: light of any range then has gradients of about the size that 8 bits have.
// What is not finite counts as black there.
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
// Still tiles are copied to the output in the same pass, while they are at hand: whatever comes of the rest, they show that.
void compare_tiles(const ConstImage& a, const ConstImage& b, const Image& output, TileMap& map, const Kernels& kernels, ThreadPool& pool) noexcept;

// Room for the rows of a few cells, one per chunk that may run at a time; sized once.
struct LumaScratch {
    std::vector<std::byte> strips;
    std::size_t strip_bytes = 0;
    void resize(int width_px, int threads);
};

// The key of a float picture; 1 if nothing in it is positive.
[[nodiscard]] float luma_key(const ConstImage& image) noexcept;

// Fills `part` of `out`, sized ceil(picture / cell_px), with its padding where `part` reaches it. `known`: still tiles are taken
// from `twin`, the other picture's luma; null: none are.
void make_luma(const ConstImage& image, int cell_px, float key, Plane& out, const Box& part, LumaScratch& scratch, const Kernels& kernels,
               ThreadPool& pool, const TileMap* known = nullptr, const Plane* twin = nullptr) noexcept;

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
