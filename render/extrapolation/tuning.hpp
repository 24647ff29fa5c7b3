// What each preset does. Every number is a measured trade between error and time: `fovea tradeoff extrapolation`.
#pragma once

#include "render/extrapolation/extrapolation.hpp"

namespace fovea::render::extrapolation {

struct Tuning {
    int cell_px = 4;             // edge of the pixels of the finest luma level, and of the cells of the motion field: 2, 4 or 8
    int iterations = 8;          // most steps of the search per patch and level
    int passes = 1;              // over the patches of a level but the finest, which gets one; every second one goes from the other
                                 // corner, and spreads good motion the other way
    int balance_rounds = 8;      // how often the patches of a level exchange what they know
    float stiffness = 200;       // how much neighbours count: see BalanceJob
    int backward_level = -1;     // the search is repeated from src1 to src2 down to this level, to check; -1: never
    int smoothing_passes = 1;    // edge-aware, over the motion field
    bool cubic = false;          // the gather: cubic, else linear
};

[[nodiscard]] Tuning tuning_of(Preset preset) noexcept;

}  // namespace fovea::render::extrapolation
