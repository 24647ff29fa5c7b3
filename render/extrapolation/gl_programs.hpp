// The kernels of gl_shaders*.hpp as programs of a context.
//
// Errors: build() tells what the driver's compiler says.
// Threads: the context's thread.
#pragma once

#include "protocol/error.hpp"
#include "render/extrapolation/gl_functions.hpp"
#include "render/extrapolation/image.hpp"

namespace fovea::render::extrapolation {

// A linked program and where its uniforms are; -1: it has none of that name, and setting it does nothing.
struct GlProgram {
    GLuint name = 0;
    GLint size = -1, cell = -1, rounds = -1, step_px = -1, reach = -1, place = -1;
};

// In the order of their run; kCopy reads a texture that cannot be attached.
enum class Kernel : std::uint8_t { compare, still, moving, reached, blocks, runs, rectangles, row_count, prefix, list, args, key_columns, key, near_luma, far_luma, tiles, halve, search, balance, spread, smooth, judge, count, verdict, carry, background, span, widen, displacement, fill, edges, rims, vote, keep, near_edges, sides, copy };
inline constexpr int kKernels = 37;

class GlPrograms {
public:
    explicit GlPrograms(const GlFunctions& gl) noexcept : gl_(gl) {}
    ~GlPrograms();
    GlPrograms(const GlPrograms&) = delete;
    GlPrograms& operator=(const GlPrograms&) = delete;

    // `compute`: the kernels for which that pays as compute shaders, the others as fragment shaders.
    [[nodiscard]] Result<void> build(bool compute);

    [[nodiscard]] const GlProgram& of(Kernel k) const noexcept { return kernels_[static_cast<int>(k)]; }
    [[nodiscard]] bool computes(Kernel k) const noexcept { return compute_ && is_computed(k); }
    // Always drawn: no driver has to be able to store to every output that it can draw to.
    [[nodiscard]] const GlProgram& gather(Format format) const noexcept { return gathers_[is_float(format) ? 1 : 0]; }
    // The same for pixels at edges of motion.
    [[nodiscard]] const GlProgram& judged_gather(Format format) const noexcept { return gathers_[is_float(format) ? 3 : 2]; }

private:
    [[nodiscard]] static bool is_computed(Kernel k) noexcept;

    const GlFunctions& gl_;
    bool compute_ = false;
    GlProgram kernels_[kKernels], gathers_[4];
};

}  // namespace fovea::render::extrapolation
