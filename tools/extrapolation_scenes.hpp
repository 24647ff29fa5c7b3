// Small analytic scenes with the exact frame at any time, for measuring extrapolation: rays against rectangles and
// spheres with mip-mapped procedural textures, four rays per pixel.
//
// Input/Output: time in frames (src1 is 0, src2 is 1); one unit of speed is about 7 pixels per frame at 1024x1024.
// Cost: about 0.3 s per frame of 1024x1024 on one core.
// Threads: const after construction.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace fovea::tools {

struct SceneRow {
    const char* name;
    const char* what;
};
// rotation, translation, object, occlusion, thin, specular, repetitive, flicker, cut.
[[nodiscard]] std::span<const SceneRow> extrapolation_scenes();

struct SceneFrame {
    int size_px = 0;
    std::vector<std::uint8_t> rgba;      // size_px * size_px * 4, top row first
    std::vector<float> motion_px;        // two per pixel: position now - position one frame ago; only if asked for
    std::vector<float> ahead_px;         // two per pixel: position `ahead` frames later - position now; with motion_px
    std::vector<float> depth;            // one per pixel
};

// What a head-tracked reprojection knows: the camera's rotation between two times, as a 3x3 matrix (rows) that turns a
// direction seen at `from` into one seen at `to`.
struct CameraTurn {
    double m[3][3];
};

class ExtrapolationScene {
public:
    // A name of the table. `variant`: 0 is the scene that everything was tuned on; every other number is another one of the same
    // kind, with textures, places, sizes, directions and paces of its own.
    ExtrapolationScene(const std::string& name, double speed, int variant = 0);
    ~ExtrapolationScene();
    [[nodiscard]] SceneFrame render(double time, int size_px, bool with_motion, double ahead = 0.5) const;
    [[nodiscard]] CameraTurn turn(double from, double to) const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

}  // namespace fovea::tools
