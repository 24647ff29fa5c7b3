// Where in the picture there is anything to do: made into lists of tiles in the driver, and never read back.
//
//   near, far -> tiles (still or not) -> moving  -> rectangles of tiles, to draw   -> counts -> args buffer: see gl_runner.hpp
//                                               \-> blocks of 4x4, to dispatch    /
//   what later passes find out of tiles that move or are moved into -> rectangles of tiles -> args buffer
//
// A tile is `moving` if anything differs in it or beside it. A still pair has none, and every later pass is empty.
// Cost: the compare reads both sources once; the rest are some twenty passes over a few thousand texels at most.
// Threads: the context's thread.
#pragma once

#include "render/extrapolation/gl_runner.hpp"

namespace fovea::render::extrapolation {

class GlRegions {
public:
    explicit GlRegions(GlRunner& runner) noexcept : runner_(runner) {}
    ~GlRegions();
    GlRegions(const GlRegions&) = delete;
    GlRegions& operator=(const GlRegions&) = delete;

    // `levels`: of the search; `finest_*`: cells of its finest level.
    void resize(int width_px, int height_px, int finest_width, int finest_height, int levels, bool compute) noexcept;
    void release() noexcept;
    // Compares, and gives the runner the list `moving`.
    void find_moving(GLuint near, GLuint far) noexcept;
    // Any other list. The kernel that makes its map, 1 where a tile belongs to it, is in use with all that it needs.
    void find(List which) noexcept;

    [[nodiscard]] int tile_px() const noexcept { return tile_px_; }
    [[nodiscard]] GLuint map(List l) const noexcept { return lister(l).map; }   // per tile: red 1 where it is in that list
    [[nodiscard]] int columns() const noexcept { return lister(List::moving).columns; }
    [[nodiscard]] int rows() const noexcept { return lister(List::moving).rows; }

    [[nodiscard]] GLuint same() const noexcept { return same_; }     // of kCompare
    [[nodiscard]] GLuint still() const noexcept { return still_; }   // per 16x16 pixels: red 1 where both sources are the same, bit for bit
    struct Counts {
        int moving = 0, reached = 0, edges = 0, all = 0;   // tiles; reached: calm and torn
    };
    // Of the last run. Waits for the driver.
    [[nodiscard]] Counts counts() noexcept;

private:
    struct Lister {   // what it takes to make a list of a map of tiles or blocks
        int columns = 0, rows = 0;
        GLuint map = 0, runs = 0, rectangles = 0, row_count = 0, prefix = 0, list = 0;
    };
    void make(Lister& l, int columns, int rows, bool blocks) noexcept;
    void list_rectangles(const Lister& l, const Over& where) noexcept;
    void list(const Lister& l, GLuint rectangles, const Over& where) noexcept;
    void write_args(GLuint args, int entries, List first) noexcept;
    [[nodiscard]] Lister& lister(List l) noexcept { return listers_[static_cast<std::size_t>(l)]; }
    [[nodiscard]] const Lister& lister(List l) const noexcept { return listers_[static_cast<std::size_t>(l)]; }

    GlRunner& runner_;
    bool compute_ = false;
    GLuint same_ = 0, still_ = 0, args_ = 0, later_args_ = 0, args_buffer_ = 0;
    std::array<Lister, kLists> listers_;
    Lister blocks_;
    int width_px_ = 0, height_px_ = 0, tile_px_ = 0, entries_ = 0,   // of the args from `moving` on
        finest_width_ = 0, finest_height_ = 0, cell_px_ = 0;
};

}  // namespace fovea::render::extrapolation
