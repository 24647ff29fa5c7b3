// Few disjoint rectangles that cover a level's bins and guard ring, in texels of the level: what an executor draws that
// limits a level by the scissor instead of a mask.
//
//   the plan's list     with its guard ring, disjoint     merged while it pays
//      ######                ########                        ########
//    ##########            ##|      |##                    ############      a merge may cover texels that are not of the
//    ##########            ##|      |##                    ############      level, `texels_per_rectangle` for each rectangle
//      ######                ########                        ########        that it saves
//
// With 0 texels per rectangle the union is exact. Rectangles never overlap: a draw that blends is drawn once everywhere.
// Cost: some 0.1 ms for a disc of 64 x 64 bins, 0.5 ms for 128 x 128; nothing when the plan has not changed.
// Threads: one at a time. noexcept, no allocation after create().
#pragma once

#include <vector>

#include "render/density/plan.hpp"

namespace fovea::density {

class RectangleCover {
public:
    // The plan's rectangles of a level; a level with more cannot be covered: masks do better there.
    static constexpr std::size_t kMost = 256;

    RectangleCover();
    // False: too many rectangles.
    bool update(const Plan& plan, int level, double texels_per_rectangle) noexcept;
    // Half-open, in texels of the level's image, from bottom to top. Valid until the next update().
    [[nodiscard]] std::span<const PixelRect> rectangles() const noexcept { return rectangles_; }
    [[nodiscard]] std::uint64_t texels() const noexcept;

private:
    void cut_into_bands() noexcept;
    void merge(double texels_per_rectangle) noexcept;

    std::vector<PixelRect> wide_, rectangles_;   // the plan's with their guard ring; the result
    std::vector<int> edges_;
    std::vector<std::pair<int, int>> runs_;
};

}  // namespace fovea::density
