// The images that the levels of a pass are drawn into, and the layer's own drawing between them: masks, resolve, the
// way back to full resolution.
//
// Level 0 is drawn into the program's own colour images, with a depth and stencil buffer of the layer's; each lower
// level into images of its own, with the formats and samples of the program's. Of the default framebuffer (shape.in_place)
// level 0 is drawn into the framebuffer itself, depth too, and bounded by a scissor box instead of a mask. Images are kept for the next pass of the
// same description (at most kKeptTargets of them per context).
// Cost: measured by `tests/layer/measure.sh`. Threads: one at a time; belongs to a context, which must be
// current. Errors: create() says no (nullptr) when a format cannot be matched or memory is out; drawing is then at full
// density.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "layer_gl.hpp"
#include "render/density/plan.hpp"
#include "render/layer/auto_mode.hpp"
#include "render/layer/foveation_state.hpp"
#include "render/layer/graveyard.hpp"
#include "render/layer/replay.hpp"

namespace fovea::layer {

inline constexpr std::size_t kMaxColors = 8;
inline constexpr int kLevels = 3;
inline constexpr std::size_t kKeptTargets = 20;  // 16 views and some more

// What a pass draws into. Equal descriptions can use each other's images.
struct TargetShape {
    int width = 0, height = 0, samples = 0;  // samples 0: not multisampled
    std::array<GLenum, kMaxColors> color{};  // sized format; 0: no such attachment
    GLenum depth_stencil = 0;                // the layer's own: GL_DEPTH24_STENCIL8, GL_DEPTH32F_STENCIL8, GL_STENCIL_INDEX8
    bool has_depth = false, has_stencil = false;  // of the program's framebuffer
    bool layered = false;                    // all layers of an array attached at once: draws go to the first, clears to all
    bool in_place = false;                   // the default framebuffer: level 0 is drawn into it, within the bounds
    bool usable = false;                     // false: only full density can be drawn
    bool unknown_format = false;             // why: a colour image has a format that levels cannot have
    bool operator==(const TargetShape&) const = default;
};

// Of the framebuffer object bound for drawing, which is complete.
[[nodiscard]] std::vector<Attachment> read_attachments(GLenum framebuffer_target);
// Fills target, width and height. State is left as it was; errors of the driver are dropped.
void find_target(Attachment& attachment);
[[nodiscard]] TargetShape read_shape(std::vector<Attachment>& attachments);
// How the layer's shaders read a colour format texel by texel: 'n', 'i' or 'u' (OwnDrawing).
[[nodiscard]] char fetch_kind(GLenum format);
// The same of the default framebuffer, which is bound; without its size.
[[nodiscard]] TargetShape read_default_formats();
// What a pixel of a sized format takes, about.
[[nodiscard]] std::uint64_t bytes_of(GLenum format);
// The size of a surface as its next frame will have it: a round trip to the server of a window. False: it has none.
[[nodiscard]] bool read_default_size(EGLDisplay display, EGLSurface surface, TargetShape& shape);

// Programs and buffers of the layer's own drawing in one context.
class OwnDrawing {
public:
    ~OwnDrawing();
    void abandon(Graveyard& to);  // the context is gone
    // The bins of a level, each grown by grow_x, grow_y, where the viewport shows width x height; all in pixels of
    // full resolution.
    struct Rects {
        const density::Plan* plan = nullptr;
        int level = 0, width = 0, height = 0;
        float grow_x = 0, grow_y = 0;
    };
    [[nodiscard]] bool ready();  // compiles on first use; false: the driver would not
    void draw_mask(const Rects& rects);
    // A texture of the size of the framebuffer bound for drawing, pixel by pixel. stencil_bit: of kind 's', as below.
    void draw_copy(GLuint texture, char kind, int width, int height, GLuint stencil_bit = 0);
    [[nodiscard]] GLuint copy_framebuffer();  // one for the layer's copies, with nothing attached
    // From the texture of a level into the framebuffer bound for drawing. kind: 'f' filtered, 'n' nearest, 'i', 'u',
    // 'd' for depth, or 's' for fragments only where the stencil value has that bit.
    void draw_resolve(const Rects& rects, GLuint texture, char kind, int level_width, int level_height, GLuint stencil_bit = 0);

private:
    GLuint program(char kind);
    void draw(GLuint program, const Rects& rects);
    void draw_instances(GLuint program, const Rects& rects);
    GLuint array_ = 0, buffer_ = 0, copy_framebuffer_ = 0;
    std::array<GLuint, 128> programs_{};
    bool failed_ = false;
    std::vector<std::array<GLfloat, 4>> instances_;
};

class Targets {
public:
    // *out_of_memory: why not, where it returned nothing.
    [[nodiscard]] static std::unique_ptr<Targets> create(const TargetShape& shape, int level_count, bool* out_of_memory = nullptr);
    [[nodiscard]] static std::uint64_t bytes(const TargetShape& shape);  // that the images of all levels take, about
    ~Targets();
    void abandon(Graveyard& to);  // the context is gone, and its framebuffer objects with it
    Targets(const Targets&) = delete;
    Targets& operator=(const Targets&) = delete;

    [[nodiscard]] const TargetShape& shape() const noexcept { return shape_; }
    // Level 0 draws into these images from now on.
    void attach_level0(const std::vector<Attachment>& attachments);
    void bind_for_drawing(int level, const std::vector<GLenum>& draw_buffers);
    // The masks of all levels for this plan. State: the caller's to restore.
    void draw_masks(OwnDrawing& own, const density::Plan& plan);
    void clear_masks(const density::Plan& plan, GLint cleared_to);  // the program's value of that bit
    // The lower levels get what the program's images hold.
    void load_colors(const density::Plan& plan);
    // Lower levels into the program's images.
    void resolve_colors(OwnDrawing& own, const density::Plan& plan);
    // The first colour image as it is now, 8 bits per channel; for traces. Empty: not readable. State: the caller's to restore.
    [[nodiscard]] std::vector<std::uint8_t> read_color();
    // Depth of all levels into the framebuffer object of the program. False: multisampled, nothing done.
    bool resolve_depth(OwnDrawing& own, const density::Plan& plan, GLuint program_framebuffer);
    // The same for stencil. masked: the top bit is the layer's; the program's is that of cleared_to. State: the caller's to restore.
    bool resolve_stencil(OwnDrawing& own, const density::Plan& plan, GLuint program_framebuffer, bool masked, GLint cleared_to);

private:
    Targets() = default;
    struct Level {
        GLuint framebuffer = 0;
        std::array<GLuint, kMaxColors> color{};     // texture, or multisampled renderbuffer
        std::array<GLuint, kMaxColors> resolved{};  // texture of one sample, multisampled only
        GLuint depth_stencil = 0;                   // texture, or renderbuffer
        GLuint resolve_framebuffer = 0;             // multisampled only
        int width = 0, height = 0;
    };
    bool create_level(std::size_t level, GLenum& error);
    TargetShape shape_;
    std::vector<Level> levels_;
    std::vector<Attachment> level0_;
    bool depth_stencil_textures_ = false;  // else renderbuffers
    GLuint one_color_ = 0;  // framebuffer with one of the program's images, for the resolve of several
};

}  // namespace fovea::layer
