// The executor with level masks: a level's bins are marked in its stencil (or depth) by one instanced draw, and the recorded
// draws are issued once, scissored to the box of the mask.
//
//   level 1 (1/2)          per level: clear, mask of its bins (plus the guard ring), the recorded draws once
//   +----------+           A mask of a single rectangle is the scissor alone.
//   |  ######  |           Draws whose bounds touch none of the rectangles are left out.
//   |  #    #  |
//   |  ######  |           Masks are depths nearer than anything where only the depth test rejects early
//   +----------+           (driver_traits.hpp), or where the app's framebuffer has no stencil.
//
// Source: measured to be the fastest way on processor rasterisers for most scenes (docs/render.md).
// Threads: the context's. Errors: a shader that does not build. draw() is noexcept and does not allocate.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "render/foveation/bins_view.hpp"

namespace fovea::foveation {

class LevelMasks {
public:
    [[nodiscard]] static Result<LevelMasks> create();
    // So that draw() may clear inside the mask of this view; built on first use for a shape and kept.
    [[nodiscard]] Result<void> prepare_clearing(BinsView& view);
    // over_finished: the level's box holds finished pixels outside the mask, which must stay.
    void draw(const BinsView& view, std::uint32_t index, const ViewTarget& target, const gl::CommandList& draws, int level, bool over_finished,
              bool count_fragments, FrameCost& cost) const noexcept;

private:
    LevelMasks() = default;
    gl::Program mask_;
    std::vector<std::pair<std::string, gl::Program>> clearing_;   // by source
};

}  // namespace fovea::foveation
