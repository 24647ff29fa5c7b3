// The engine as OpenGL ES passes: the same steps as on the processor, each a small kernel that runs as a fragment shader
// or, where the result is a storable image, as a compute shader.
//
//   src1, src2 -> compare: what moves -> luma of both -> levels       motion per patch, per level, coarse to fine, from near to
//              far and back: search -> balance x n  ->      spread and check -> smooth -> judge (blocks, cut) -> carry
//                                                   -> background, span -> displacement -> gather -> edges -> output
//   near -> output, where nothing moves
//
// The finest level, its motion and the output are worked on where anything moves (gl_regions.hpp); of a still pair, nothing is.
//
// The steps are those of the processor's engine; their order is not: neighbours are asked all at once instead of in turn, and
// what cannot be scattered is looked for. The pictures agree to within 0.5 dB of each other's error, which
// extrapolation_gl_quality_test holds them to; known motion and gaze are the processor's alone.
// Threads: the context's thread.
#pragma once

#include <memory>
#include <vector>

#include "protocol/error.hpp"
#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/gl_functions.hpp"
#include "render/extrapolation/gl_regions.hpp"
#include "render/extrapolation/tuning.hpp"

namespace fovea::render::extrapolation {

class GlPasses {
public:
    [[nodiscard]] static Result<std::unique_ptr<GlPasses>> create(const GlFunctions& gl, Preset preset, bool compute);
    ~GlPasses();

    // Whether an output of this internal format can be written at all by a pass.
    [[nodiscard]] bool writes(Format format) const noexcept;
    // `near` is moved by `step` frame times away from `far`. A GlStateGuard with passes is alive. False: out of memory.
    bool run(GLuint near, int near_level, GLuint far, GLuint output, int output_level, int width_px, int height_px, Format format, float step) noexcept;

    // The base level of a texture that cannot be attached to a framebuffer, as four floats per pixel. A GlStateGuard with
    // passes is alive. False: the driver cannot draw to RGBA32F either.
    bool read_floats(GLuint texture, int width_px, int height_px, void* rgba) noexcept;

    // Wild motion in whatever the next run has to write, so that it shows if it does not: for the probe. As run().
    void spoil() noexcept;

    // Of the last run. Waits for the driver.
    [[nodiscard]] GlRegions::Counts tile_counts() noexcept { return regions_.counts(); }

private:
    struct Level {
        GLuint near = 0, far = 0, patches = 0, motion[2] = {}, back[2] = {};   // luma; the search's result; motion: [0] the latest
        int width = 0, height = 0, columns = 0, rows = 0;
    };
    explicit GlPasses(const GlFunctions& gl, Preset preset) noexcept;
    [[nodiscard]] Result<void> build(bool compute);
    bool prepare(int width_px, int height_px) noexcept;
    void release_images() noexcept;
    [[nodiscard]] GLuint make_padded(int width, int height, GLenum format = GL_RGBA16F) noexcept;

    void make_levels(GLuint near, GLuint far, Format format) noexcept;
    void search_level(std::size_t l, bool back) noexcept;
    [[nodiscard]] GLuint find_motion() noexcept;                        // per cell: motion, trust
    [[nodiscard]] GLuint carry(GLuint motion, float step) noexcept;     // per cell: where the output comes from
    void give_verdict(GLuint squares, int columns, int rows, float most) noexcept;
    [[nodiscard]] GLuint find_sides(GLuint displacement) noexcept;      // per cell at an edge: which two displacements meet
    void find_rims(GLuint displacement, GLuint near, GLuint far, Format format, float step) noexcept;   // tiles of a window's rim, in kept_

    // Patches and cells where anything moves; a level is worked on as a whole but for the finest.
    [[nodiscard]] Over patches_of(std::size_t level) const noexcept;

    const GlFunctions& gl_;
    Tuning tuning_;
    int cell_px_;
    GlRunner runner_;
    GlRegions regions_;
    bool compute_ = false;
    GLuint key_columns_ = 0, key_ = 0, tiles_ = 0, blocks_[2] = {}, counts_ = 0, verdict_ = 0, background_ = 0, rims_ = 0, votes_ = 0, kept_ = 0, slopes_ = 0, spans_[2] = {}, dense_[3] = {};   // dense: per cell
    std::vector<Level> levels_;
    int width_px_ = 0, height_px_ = 0;
    bool float_outputs_ = false;
};

}  // namespace fovea::render::extrapolation
