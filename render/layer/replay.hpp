// The run of a log for one level: what the program says about viewport, scissor and stencil, turned into what the level
// needs.
//
// Native (full density, the program's own framebuffer): everything as the program said. For a level at 1/2^shift:
// viewport and scissor scaled, the scissor also cut to the level's bounds, and, if the stencil buffer is the layer's, its
// top bit tested, which is 1 in the bins of the level only. The program's own stencil test goes on in the other bits: a
// comparison for equal, less or less-or-equal gets the top bit on both sides; others cannot be joined with the mask, and
// run unmasked (what they draw outside the bins is not resolved).
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

// The stencil state of one face.
struct StencilFace {
    GLenum func = GL_ALWAYS;
    GLint ref = 0;
    GLuint value_mask = ~0u, write_mask = ~0u;
    GLenum fail = GL_KEEP, depth_fail = GL_KEEP, pass = GL_KEEP;
    [[nodiscard]] static StencilFace of_driver(bool back);
    // Whether it reads or writes the top bit in a way that shows, if that bit is 0 in the buffer.
    [[nodiscard]] bool leaves_top_bit() const noexcept;
};

class Replay {
public:
    // Takes over the state that the driver has now as the program's, and applies the view to it.
    void begin(const LevelView& view);
    void viewport(GLint x, GLint y, GLsizei w, GLsizei h);
    void scissor(GLint x, GLint y, GLsizei w, GLsizei h);
    void set_enabled(GLenum capability, bool on);
    [[nodiscard]] const LevelView& view() const noexcept { return view_; }
    void stencil_func(GLenum face, GLenum func, GLint ref, GLuint mask);
    void stencil_mask(GLenum face, GLuint mask);
    void stencil_op(GLenum face, GLenum fail, GLenum depth_fail, GLenum pass);

private:
    void apply_viewport() const;
    void apply_scissor() const;
    void apply_stencil() const;
    template <class Change>
    void change_stencil(GLenum face, Change change);

    LevelView view_;
    std::array<GLint, 4> viewport_{}, scissor_{};
    bool scissor_on_ = false, stencil_on_ = false;
    std::array<StencilFace, 2> stencil_{};  // the program's: front, back
};

}  // namespace fovea::layer
