// Where each point of a rendered frame was a frame ago, and will be at another moment: the frame's depth, drawn at half its width and height, and
// the motion of the camera and of the objects, all of which a renderer knows.
//
// Output: what extrapolation takes as known motion (KnownMotion: motion_px, ahead_px and depth), rows bottom first as in the textures.
// Cost: the scene's vertices once more, a quarter of the pixels with nothing shaded, and about 10 ns per pixel of these.
// Limits: a surface that is cut out by alpha counts as solid, one that is blended is left out.
// Threads: the context's. Errors: a target or a program that the driver refuses.
#pragma once

#include <span>
#include <vector>

#include "render/gl/command_list.hpp"
#include "render/scene/camera.hpp"
#include "render/scene/scene.hpp"

namespace fovea::viewer {

// Above this the second pass over the vertices costs more than the search for motion.
inline constexpr std::size_t kMostMotionTriangles = 300'000;

// How far the quickest of the objects moves in the picture from the frame before, pixels; 0: none does.
[[nodiscard]] double object_motion_px(std::span<const scene::ObjectMotion> objects, const scene::Pose& camera, const FieldOfView& fov, int width_px) noexcept;

// Extrapolation takes it for no motion at all.
inline constexpr float kNoMotion_px = 1e9f;

class MotionPass {
public:
    struct Cameras {
        scene::Pose before, now, then;   // a frame ago; of the frame; `factor` frame times after it
        double factor = 0;
    };
    // draws: a frame as recorded, whose buffers still hold it. eye: its view there. The objects go on as they did since the
    // frame before.
    [[nodiscard]] Result<void> draw(const gl::CommandList& draws, std::uint32_t eye, const scene::SceneView& view, int width_px, int height_px, const Cameras& cameras,
                                    std::span<const scene::ObjectMotion> objects);
    // Where each point is - where it was; kNoMotion_px where it was not before the camera.
    [[nodiscard]] const std::vector<float>& motion_px() const noexcept { return motion_; }
    [[nodiscard]] const std::vector<float>& ahead_px() const noexcept { return ahead_; }
    [[nodiscard]] const std::vector<float>& depth() const noexcept { return depth_; }
    [[nodiscard]] int columns() const noexcept { return target_.width(); }
    [[nodiscard]] int rows() const noexcept { return target_.height(); }

private:
    gl::Program plain_, placed_;   // without and with a transform per object
    gl::RenderTarget target_;
    gl::CommandList list_;
    std::vector<float> read_, motion_, ahead_, depth_;
};

}  // namespace fovea::viewer
