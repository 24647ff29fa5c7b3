// The picture for the panel behind a lens: a warped mesh over the rendered one, each colour from its own place.
//
// Input: a rendered picture (2D texture). Output: one of the same size. What the lens does not show is black.
// Cost: one draw of a 96 x 96 mesh a view, three texture reads a pixel; the mesh is within 1 px of the equation at
// 2048 px (tested). After the method's resolve, at present time: density is planned in the rendered view, where the gaze
// is a direction and needs no lens (docs/scenes.md).
// Threads: the context's. Errors: create() and prepare() say what the driver refused; draw() cannot fail.
#pragma once

#include <vector>

#include "render/effects/lens.hpp"
#include "render/gl/objects.hpp"

namespace fovea::effects {

inline constexpr int kLensMesh = 96;   // cells along each axis

class LensPass {
public:
    [[nodiscard]] static Result<LensPass> create(const Lens& lens);
    // Cheap when nothing changes.
    [[nodiscard]] Result<void> prepare(int width_px, int height_px, std::size_t views);
    // view 0: left eye, 1: right eye, whose lens is mirrored.
    void draw(std::size_t view, gl::Name picture) const noexcept;
    [[nodiscard]] const gl::RenderTarget& result(std::size_t view) const noexcept { return results_[view]; }
    [[nodiscard]] const Lens& lens(std::size_t view) const noexcept { return lenses_[view % 2]; }
    [[nodiscard]] double aspect() const noexcept { return aspect_; }

private:
    std::array<Lens, 2> lenses_;
    double aspect_ = 1;
    gl::Program warp_;
    gl::VertexArray arrays_;
    std::vector<gl::RenderTarget> results_;
};

}  // namespace fovea::effects
