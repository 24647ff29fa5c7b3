// The run of a log for one level: what the program says about viewport, scissor and stencil, turned into what the level
// needs.
//
// Native (full density, the program's own framebuffer): everything as the program said. For a level at 1/2^shift:
// viewport and scissor scaled, the scissor also cut to the level's bounds, and, if the stencil buffer is the layer's, its
// top bit tested, which is 1 in the bins of the level only.
// Threads: one at a time.
#pragma once

#include <array>

#include "layer_gl.hpp"
#include "render/density/plan.hpp"

namespace fovea::layer {

inline constexpr GLuint kMaskBit = 0x80;  // the top bit of 8 bits of stencil

struct LevelView {
    bool native = true;
    int view = -1;  // of a multiview framebuffer
    bool clears_only = false;  // draws are left out
    int x_shift = 0, y_shift = 0;
    density::PixelRect bounds;   // full-resolution pixels; the guard ring included
    bool masked = false;         // the stencil buffer holds the layer's mask
    bool float_viewport = false; // the driver has glViewportIndexedf
};

class Replay {
public:
    // Takes over the state that the driver has now as the program's, and applies the view to it.
    void begin(const LevelView& view);
    void viewport(GLint x, GLint y, GLsizei w, GLsizei h);
    void scissor(GLint x, GLint y, GLsizei w, GLsizei h);
    void set_enabled(GLenum capability, bool on);
    [[nodiscard]] const LevelView& view() const noexcept { return view_; }
    // The layer's mask owns the stencil state: recorded stencil calls are left out.
    [[nodiscard]] bool owns_stencil() const noexcept { return view_.masked; }

private:
    void apply_viewport() const;
    void apply_scissor() const;

    LevelView view_;
    std::array<GLint, 4> viewport_{}, scissor_{};
    bool scissor_on_ = false;
};

}  // namespace fovea::layer
