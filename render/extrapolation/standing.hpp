// What stands still in front of what moves: a window whose content scrolls keeps its rim.
//
//   farther   . . | a b c d | . .      the window's contrast is at `|` in both sources: its content ends there, and goes under.
//   nearer    . . | o a b c | . .      A thing that moves has its contrast one motion further back in the farther source
//   output    . . | o o a b | . .      (a b c d without `|`), and goes over what stands still beyond.
//
// Asked of every pixel on a leading edge, decided by the sums over a tile and its neighbours. Where it is a window, what is
// equal bit for bit in both sources stays as it is. Searched motion only: one that the renderer tells comes with depth.
// Threads: one; about as long as comparing the tiles at the rims of what stands still.
#pragma once

#include "render/extrapolation/gather.hpp"

namespace fovea::render::extrapolation {

class StandingRims {
public:
    void resize(int columns, int rows);   // tiles

    using Job = Gathered;
    // Whether any tile may hold a rim: one that moves, or is moved into, beside one that stands still.
    [[nodiscard]] bool find(const Job& job) noexcept;
    // After find(), which needs no far_source.
    void run(const Job& job) noexcept;

private:
    struct Votes {
        float here, back, pixels;   // contrast at the edge and one motion further back; how many were asked
    };
    template <class Channel>
    void vote(const Job& job, int column, int row) noexcept;
    static void keep(const Job& job, int column, int row) noexcept;

    int columns_ = 0, rows_ = 0;
    std::vector<std::uint8_t> candidate_, sure_;   // per tile; sure: stands still, with all tiles around it
    std::vector<Votes> votes_;
};

}  // namespace fovea::render::extrapolation
