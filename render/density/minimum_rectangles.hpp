// The fewest disjoint rectangles that make up each level of a grid of bins: exact, not a heuristic.
//
//      # # # # #        Wherever three of the four bins at a grid point are of the level (a concave corner, o), a cut must
//      # # o-o # #      begin. A chord is a cut between two such corners that lies inside the level: it settles both. So
//      # # |   # #      the most chords that do not touch each other are cut first, then one horizontal cut from every
//      # # o-o # #      corner that is left, up to the next cut or edge.
//      # # # # # #
//
// The chords that meet form a bipartite graph (horizontal, vertical); its largest independent set comes out of a largest
// matching (Koenig). Where two bins touch only at a corner there is no concave corner, and they stay apart.
//
// Sources: T. Ohtsuki, "Minimum dissection of rectilinear regions", ISCAS 1982; L. Ferrari, P. V. Sankar, J. Sklansky,
// "Minimal rectangular partitions of digitized blobs", Computer Vision, Graphics, and Image Processing 28, 1984; H. Imai,
// T. Asano, "Efficient algorithms for geometric graph search problems", SIAM Journal on Computing 15, 1986.
// Cost: linear in the bins but for the matching, which is linear in the crossings of chords for each of its few rounds.
// Threads: one at a time. make() is noexcept and does not allocate; it cannot fail.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fovea::density {

inline constexpr int kMaxLevels = 8;

// Half-open, in bins.
struct BinRect {
    std::uint16_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    bool operator==(const BinRect&) const = default;
    [[nodiscard]] bool empty() const noexcept { return x0 >= x1 || y0 >= y1; }
};

class MinimumRectangles {
public:
    MinimumRectangles() = default;
    MinimumRectangles(int columns, int rows);   // 1 to 65535 each

    // levels: of every bin, row 0 first, each below level_count. Level i's rectangles are out[first[i]] to out[first[i + 1]],
    // ordered by y0, then x0. `out` must have room for one rectangle for each bin.
    void make(std::span<const std::uint8_t> levels, int level_count, std::span<BinRect> out,
              std::array<std::size_t, kMaxLevels + 1>& first) noexcept;

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    // A grid point has the index of the bin above and to the right of it. A chord goes right or up from `from`.
    struct Chord {
        std::uint32_t from, length, mate;   // mate: the chord of the other direction that it is matched with
    };
    struct Reached {
        std::uint32_t round, by;            // last round of the search in which a vertical chord was reached, and from where
    };
    struct Corner {
        std::uint32_t at;
        bool right;                         // its horizontal cut goes right, else left
    };

    void find_chords(std::span<const std::uint8_t> levels) noexcept;
    void match() noexcept;
    bool extend(std::uint32_t start) noexcept;
    void cut_chords() noexcept;
    void cut_corners(std::span<const std::uint8_t> levels) noexcept;

    std::uint32_t columns_ = 0, rows_ = 0;
    std::vector<Corner> corners_;
    std::vector<Chord> across_, upward_;
    std::vector<Reached> reached_;             // of each upward_
    std::vector<std::uint32_t> queue_;
    std::vector<std::uint32_t> upward_at_;     // by grid point: the vertical chord through it, kNone outside make()
    std::vector<std::uint8_t> cuts_;           // by bin
    std::uint32_t round_ = 0;
};

}  // namespace fovea::density
