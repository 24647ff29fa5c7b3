// The engine as OpenGL ES passes: the same steps as on the processor, each a small kernel that runs as a fragment shader
// or, where the result is a storable image, as a compute shader.
//
//   src1, src2 -> tiles (still or not)          motion per patch, per level, coarse to fine, from near to far and back:
//              -> luma -> its levels     ->     search -> relax x n  ->  spread -> check -> smooth -> judge (blocks, cut)
//                                               -> background -> displacement -> gather -> output
//
// The steps are those of the processor's engine; their arithmetic is not: patches are sampled at 4x4 points, neighbours are
// asked all at once instead of in turn, and what cannot be scattered is looked for. The pictures agree to within 1.5 dB of
// each other's error, which extrapolation_gl_test holds them to; known motion and gaze are the processor's alone.
// Threads: the context's thread.
#pragma once

#include <memory>
#include <vector>

#include "protocol/error.hpp"
#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/gl_functions.hpp"
#include "render/extrapolation/tuning.hpp"

namespace fovea::render::extrapolation {

class GlPasses {
public:
    [[nodiscard]] static Result<std::unique_ptr<GlPasses>> create(const GlFunctions& gl, Preset preset, bool compute);
    ~GlPasses();

    // Whether an output of this internal format can be written at all by a pass.
    [[nodiscard]] bool writes(Format format) const noexcept;
    // `near` is moved by `step` frame times away from `far`. A GlStateGuard with passes is alive. False: out of memory.
    bool run(GLuint near, GLuint far, GLuint output, int output_level, int width_px, int height_px, Format format, float step) noexcept;

    // The base level of a texture that cannot be attached to a framebuffer, as four floats per pixel. A GlStateGuard with
    // passes is alive. False: the driver cannot draw to RGBA32F either.
    bool read_floats(GLuint texture, int width_px, int height_px, void* rgba) noexcept;

private:
    struct Level {
        GLuint luma_near = 0, luma_far = 0, motion[2] = {}, back[2] = {};
        int width = 0, height = 0, columns = 0, rows = 0;
    };
    explicit GlPasses(const GlFunctions& gl, Preset preset, bool compute) noexcept;
    [[nodiscard]] Result<void> build();
    bool prepare(int width_px, int height_px) noexcept;
    void release_images() noexcept;
    [[nodiscard]] GLuint make_image(int width, int height) noexcept;
    void use(int kernel, bool compute) noexcept;
    void bind(int unit, GLuint texture, GLuint sampler) noexcept;
    void set(const char* name, float value) noexcept;
    void set(const char* name, int x, int y) noexcept;
    void set(const char* name, int x) noexcept;
    void search_level(std::size_t l, bool back, int rounds) noexcept;
    // Runs a kernel of kKernels over an image in between.
    void pass(int kernel, GLuint target, int width, int height) noexcept;
    void write(GLuint texture, int level, int width, int height, bool compute, GLenum format) noexcept;

    const GlFunctions& gl_;
    Preset preset_;
    Tuning tuning_;
    bool compute_;
    int cell_px_ = 4;
    static constexpr int kKernelCount = 13;
    GLuint fragment_[kKernelCount] = {}, compute_programs_[kKernelCount] = {}, gather_compute_[3] = {}, fragment_gather_ = 0, copy_ = 0, current_ = 0;
    GLuint array_ = 0, framebuffer_ = 0, linear_ = 0, nearest_ = 0;
    GLuint tiles_ = 0, blocks_ = 0, verdict_ = 0, background_ = 0, dense_[3] = {};   // dense: motion per pixel of the finest level
    std::vector<Level> levels_;
    int width_px_ = 0, height_px_ = 0;
    bool float_outputs_ = false;
};

}  // namespace fovea::render::extrapolation
