// The images of a method that draws several views of its own: separate ones, parts of one, or layers of an array, so that
// each recorded draw can be issued once for all of them.
//
//   repeated: an image each      instanced: parts of one image      multiview2: layers of an array (equal sizes)
//   [0] [1] [ 2 ] [ 3 ]          [0][1][ 2 ][ 3 ]                   /0/1/  /2/3/   or /0/1/2/3/
//
// Images of different sizes make two groups in multiview2 (all views of a draw share a viewport). A list whose programs
// draw one view only is drawn into the same images view by view.
// MSAA: what the driver has of it (gl::samples_for()). GL_OVR_multiview2 has no multisampled images: with samples the views are drawn
// otherwise.
// Threads: the context's. Errors: create() says what the driver refused; the rest is noexcept and does not allocate.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/foveation/method.hpp"

namespace fovea::foveation {

class ViewImages {
public:
    struct Settings {
        gl::ColorFormat format = gl::ColorFormat::rgba8;
        int samples = 0;
        std::optional<gl::ViewDrawing> drawing;   // nothing: the best that the driver has
    };
    struct Size {
        int width_px = 0, height_px = 0;
        bool operator==(const Size&) const = default;
    };
    // sizes: of 1 to 16 images.
    [[nodiscard]] static Result<ViewImages> create(std::span<const Size> sizes, const Settings& settings);
    // How images of these settings are drawn on this driver: what was asked for where it can be had, else the next best.
    [[nodiscard]] static gl::ViewDrawing drawing_for(const Settings& settings) noexcept;

    // What a list's programs must be for it to be drawn at once.
    [[nodiscard]] const gl::ViewsAtOnce& at_once() const noexcept { return at_once_; }

    struct Image {
        gl::Name framebuffer = 0;   // to clear and mask it, alone
        int x_px = 0, y_px = 0, width_px = 0, height_px = 0;   // in there, and in the texture
        gl::Name picture = 0;       // the framebuffer to read from, after resolve(): of single samples
        gl::Name texture = 0;       // likewise: 2D, or a 2D array where layered() is set
        int layer = 0;
    };
    [[nodiscard]] std::size_t size() const noexcept { return images_.size(); }
    [[nodiscard]] const Image& operator[](std::size_t i) const noexcept { return images_[i]; }
    // Layers of arrays, or parts of larger images, by drawing_for() alone: whoever samples them needs no other shader when
    // sizes or the number of views forbid to draw them at once.
    [[nodiscard]] bool layered() const noexcept { return kind_ == gl::ViewDrawing::multiview2; }
    [[nodiscard]] bool parted() const noexcept { return kind_ == gl::ViewDrawing::instanced; }

    // What is drawn into an image; `part` is set here.
    using View = gl::ViewsPass::View;
    // Stencil and depth state as they are; sets viewport and framebuffer. How it was drawn is in cost.drawing.
    void draw(const gl::CommandList& draws, std::span<View> views, bool count_fragments, FrameCost& cost) const noexcept;
    void resolve() const noexcept;

private:
    struct Group {
        std::size_t first = 0, count = 0;
        gl::Name framebuffer = 0;   // of all its views
        Size size;                  // of that
    };
    struct Layers {
        gl::Texture color, depth_stencil;
        gl::Framebuffer all;
        std::vector<gl::Framebuffer> single;
    };
    [[nodiscard]] static Result<Layers> make_layers(Size size, std::size_t count, gl::ColorFormat format);
    [[nodiscard]] Result<void> make_targets(std::span<const Size> sizes, const Settings& settings);

    gl::ViewDrawing kind_ = gl::ViewDrawing::repeated;
    gl::ViewsAtOnce at_once_;
    std::vector<Image> images_;
    std::vector<Group> groups_;
    std::vector<gl::RenderTarget> targets_, resolved_;
    std::vector<Layers> layers_;
};

}  // namespace fovea::foveation
