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
enum class Kernel : std::uint8_t { compare, still, moving, reached, blocks, runs, rectangles, row_count, prefix, list, args, key_columns, key, luma_bytes, luma_floats, tiles, halve, search, balance_first, balance, rough, glide, spread, smooth, judge, judge_finest, count, verdict, carry, background, span, widen, hem, slope, alike, displacement, fill, edges, rims, any, vote, keep, near_edges, sides, stand, copy };
inline constexpr int kKernels = 46;

// Of tiles where all moves alike, of others, and of pixels at edges of motion, one by one.
enum class Gathered : std::uint8_t { calm, torn, judged };

class GlPrograms {
public:
    explicit GlPrograms(const GlFunctions& gl) noexcept : gl_(gl) {}
    ~GlPrograms();
    GlPrograms(const GlPrograms&) = delete;
    GlPrograms& operator=(const GlPrograms&) = delete;

    // `compute`: the kernels for which that pays as compute shaders, the others as fragment shaders.
    // `cell_px`: the pixels of a cell of the finest level, along its edge; `cubic`: the gather.
    [[nodiscard]] Result<void> build(bool compute, int cell_px, bool cubic);

    [[nodiscard]] const GlProgram& of(Kernel k) const noexcept { return kernels_[static_cast<int>(k)]; }
    [[nodiscard]] bool computes(Kernel k) const noexcept { return compute_ && is_computed(k); }
    // Always drawn: no driver has to be able to store to every output that it can draw to.
    [[nodiscard]] const GlProgram& of(Gathered which, Format format) const noexcept { return gathers_[2 * static_cast<int>(which) + (is_float(format) ? 1 : 0)]; }

private:
    [[nodiscard]] static bool is_computed(Kernel k) noexcept;

    const GlFunctions& gl_;
    bool compute_ = false;
    GlProgram kernels_[kKernels], gathers_[6];
};

}  // namespace fovea::render::extrapolation
