// Composes the window: the pictures of both eyes, and over them, if asked for, the levels, the gaze and a read-out.
//
//   eyes' textures -> (levels tinted) -> (text) -> (gaze markers) -> framebuffer of the surface
//
// What is not asked for issues no call. The texts are uploaded only when they change.
// Threads: the context's. Errors: create() says which shader does not compile; draw() cannot fail.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "render/density/plan.hpp"
#include "render/effects/lens_pass.hpp"
#include "render/gl/objects.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/layout.hpp"

namespace fovea::viewer {

struct Overlay {
    std::array<const density::Plan*, kEyes> levels{};   // blue 1, green 1/2, red 1/4, orange 1/8; null: none
    const Latched* predicted = nullptr;   // cross and dashed circle of 95 %; null: none
    const Latched* actual = nullptr;      // as last measured: dot; null: none
    const effects::LensPass* lens = nullptr;   // that the pictures were warped for: the gaze is shown where the panel shows it
};

class Screen {
public:
    [[nodiscard]] static Result<Screen> create();
    // Lower left corner; empty: none. Cheap when nothing has changed.
    void set_text(const std::vector<std::string>& lines, double scale);
    // pictures: textures of the places' size. Flushes nothing.
    void draw(const present::Surface& surface, const std::array<Place, kEyes>& places, const std::array<gl::Name, kEyes>& pictures, const Overlay& overlay) noexcept;

private:
    void draw_levels(const Place& place, const density::Plan& plan) noexcept;
    void draw_markers(const Place& place, const fovea_focal& focal, bool predicted, const effects::Lens* lens) noexcept;
    gl::Program picture_, tint_, marker_;
    gl::VertexArray nothing_;
    gl::Texture levels_, text_texture_;
    std::array<int, 2> levels_size_{};
    std::vector<std::uint8_t> level_bytes_;
    std::vector<std::string> lines_;
    double text_scale_ = 0;
    int text_width_ = 0, text_height_ = 0;
    int width_px_ = 0, height_px_ = 0;
};

}  // namespace fovea::viewer
