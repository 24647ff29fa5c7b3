// The same loops as kernels_portable.cpp; this file alone is compiled for AVX2.
#include "render/extrapolation/kernels.hpp"

namespace fovea::render::extrapolation::avx2 {
namespace {
#include "render/extrapolation/kernels_vector.hpp"
#include "render/extrapolation/kernels_search.hpp"
#include "render/extrapolation/kernels_field.hpp"
#include "render/extrapolation/kernels_warp.hpp"
#include "render/extrapolation/kernels_project.hpp"
#include "render/extrapolation/kernels_judge.hpp"
}  // namespace
extern const Kernels kKernels;
const Kernels kKernels = {"avx2", search, balance, spread, smooth, halve, same_tiles, luma_rgba8, warp_rgba8_linear, warp_rgba8_cubic,
                          warp_float_linear, warp_float_cubic, carry, expand, fix, blend_rgba8, blend_float, ask, weigh_rgba8, sum_blocks};
}  // namespace fovea::render::extrapolation::avx2
