// Lamps' reflections: patches of pixels at or above a level, joined over sides and corners. The bright pixels of an eye are
// few, so only they cost anything: as runs of one row each, joined to the runs of the row above.
//
// Units: pixels of the picture given. Threads: one at a time per GlintFinder; allocates when there are more runs than ever
// before.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "drivers/camera/image.hpp"
#include "drivers/camera/pupil_detector.hpp"

namespace fovea::drivers::camera {

class GlintFinder {
public:
    // Every patch, in the order of its first row; valid until the next call.
    [[nodiscard]] std::span<const Glint> find(const GreyImage& image, double level);

private:
    struct Run {
        int y, from, to;       // to: one beyond
        std::size_t patch;     // an earlier run of the same patch, or itself
    };
    std::size_t root(std::size_t run) noexcept;
    std::vector<Run> runs_;
    std::vector<Glint> found_;
    std::vector<std::size_t> place_;   // of a patch's first run among the found
};

}  // namespace fovea::drivers::camera
