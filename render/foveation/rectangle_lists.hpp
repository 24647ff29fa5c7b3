// The executor with rectangle lists: each level is a few disjoint rectangles, and every recorded draw is issued once for each
// rectangle that its bounds touch, under the scissor alone.
//
//   level 2                 +--------------+     a draw whose bounds lie within the hole, or touch two rectangles of five,
//   +--------------+        |      1       |     is issued never, or twice; one without bounds five times
//   |     ####     |        |----+    +----|
//   |    ######    |   ->   | 2  |    |  3 |     nothing is rasterised in the hole, where a mask has to reject fragment by
//   |     ####     |        |----+    +----|     fragment; a fragment that cannot be rejected early (it writes its depth, an
//   +--------------+        |  4           |     image or a counter) is not shaded there at all
//                           +--------------+
//
// The picture is that of the level masks, bit for bit: rectangles cover at least the masks' texels, in the same viewport.
// Draws carry conservative bounds (gl::Draw::bounds); the default bounds are the whole view, and are never left out.
// Source: measured on scenes of many small draws (docs/render.md).
// Threads: the context's. noexcept, no allocation after create().
#pragma once

#include <array>
#include <vector>

#include "render/density/rectangle_cover.hpp"
#include "render/foveation/bins_view.hpp"

namespace fovea::foveation {

class RectangleLists {
public:
    // texels_per_rectangle: see RectangleCover; views: how many there are.
    void prepare(std::size_t views, double texels_per_rectangle);
    // The lists of a view's plan; nothing if it is the last one's.
    void update(const BinsView& view, std::size_t index) noexcept;
    // False: the level has too many rectangles, nothing was drawn.
    bool draw(const BinsView& view, std::uint32_t index, const ViewTarget& target, const gl::CommandList& draws, int level, bool count_fragments, FrameCost& cost) const noexcept;

private:
    struct View {
        std::array<density::RectangleCover, density::kMaxLevels> covers;
        std::array<bool, density::kMaxLevels> possible{};
        std::uint64_t made_for = ~std::uint64_t{0};   // plan generation
    };
    std::vector<View> views_;
    double texels_per_rectangle_ = 0;
};

}  // namespace fovea::foveation
