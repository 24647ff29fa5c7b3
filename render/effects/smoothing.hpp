// Temporal smoothing of the periphery: what coarse levels lose is seen to crawl and flicker when the eye or the picture
// moves; each picture is mixed with those before it, outside the fovea only.
//
//   result = now                                     where the picture is at full resolution: bit for bit
//          = mix(now, clamp(before, around), 0.75)   elsewhere; `before` is the last result, found by the camera's rotation
//
// The clamp keeps the history between the least and the most of the texels around, a coarse texel away, so that what has
// come to light or gone does not stay as a ghost. Reprojection knows the camera's rotation; translation and objects are
// left to the clamp. In 8 bits the mixture stops up to 2/255 short of a still picture.
// Cost: one pass over the view; six texture reads a pixel outside the fovea.
// Threads: the context's. Errors: create() and prepare() say what the driver refused; draw() cannot fail.
#pragma once

#include <array>
#include <vector>

#include "render/foveation/method.hpp"
#include "render/scene/camera.hpp"

namespace fovea::effects {

inline constexpr float kHistoryShare = 0.75f;   // of the last result; half-life 2.4 frames

// NDC of the frame before from NDC of this one, homogeneous, row by row: both looked the same way but for the rotation.
// w <= 0: it was behind the view.
[[nodiscard]] std::array<double, 9> before_from_now(const FieldOfView& fov, const scene::Pose& before, const scene::Pose& now) noexcept;

class Smoothing {
public:
    [[nodiscard]] static Result<Smoothing> create();
    // Cheap when nothing changes; forgets the history otherwise.
    [[nodiscard]] Result<void> prepare(int width_px, int height_px, std::size_t views);
    void forget() noexcept;
    // picture: of `view`, drawn by the method whose last submit left this plan (null: none) and region of full resolution.
    // False: all of it is at full resolution, nothing was done, and the picture is the result.
    bool draw(std::size_t view, gl::Name picture, const density::Plan* plan, const foveation::Method::Region& region, const FieldOfView& fov,
              const scene::Pose& pose) noexcept;
    // Of the last draw() that was true.
    [[nodiscard]] const gl::RenderTarget& result(std::size_t view) const noexcept { return views_[view].results[views_[view].newest]; }

private:
    struct View {
        std::array<gl::RenderTarget, 2> results;
        std::size_t newest = 0;
        bool has_history = false;
        scene::Pose pose;
        gl::Texture levels;
        int columns = 0, rows = 0;
    };
    gl::Program by_region_, by_levels_;
    gl::VertexArray arrays_;
    std::vector<View> views_;
    std::vector<std::uint8_t> level_bytes_;
};

}  // namespace fovea::effects
