#include "render/extrapolation/kernels.hpp"

namespace fovea::render::extrapolation {

namespace portable {
namespace {
#include "render/extrapolation/kernels_vector.hpp"
#include "render/extrapolation/kernels_search.hpp"
#include "render/extrapolation/kernels_field.hpp"
#include "render/extrapolation/kernels_warp.hpp"
#include "render/extrapolation/kernels_project.hpp"
#include "render/extrapolation/kernels_judge.hpp"
}  // namespace
extern const Kernels kKernels;
const Kernels kKernels = {"portable", search, balance, spread, smooth, halve, same_tiles, luma_rgba8, warp_rgba8_linear, warp_rgba8_cubic,
                          warp_float_linear, warp_float_cubic, carry, expand, fix, blend_rgba8, blend_float, ask, weigh_rgba8, sum_blocks};
}  // namespace portable

#ifdef FOVEA_HAS_AVX2_KERNELS
namespace avx2 {
extern const Kernels kKernels;
}
#endif

const Kernels& choose_kernels(bool vector_code) noexcept {
#ifdef FOVEA_HAS_AVX2_KERNELS
    if (vector_code && __builtin_cpu_supports("avx2")) return avx2::kKernels;
#endif
    static_cast<void>(vector_code);
    return portable::kKernels;
}

}  // namespace fovea::render::extrapolation
