// The resolve of scaled_bins on the processor: read the small levels back, enlarge them strip by strip in the cache, put
// the strips into the app's texture. On a processor rasteriser this costs a third of drawing textured rectangles.
//
// Threads: the context's. Errors: none; can_resolve() says where it does not apply (then the GPU resolves).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/foveation/method.hpp"

namespace fovea::foveation {

class CpuResolve {
public:
    // A plain 2D texture of RGBA8 in the framebuffer, and an image that is a whole number of texels of every level.
    [[nodiscard]] static bool can_resolve(const ViewTarget& target, const density::Plan& plan);
    // Memory for images planned by `plan`; keeps the larger.
    void reserve(const density::Plan& plan);

    struct Level {
        gl::Name framebuffer = 0;
        int x0 = 0, y0 = 0, x1 = 0, y1 = 0;   // texels that were rendered
    };
    // levels[i] of plan level i; [0] is not read. Waits for the GPU. noexcept, no allocation.
    void run(const density::Plan& plan, const ViewTarget& target, std::span<const Level> levels) noexcept;

private:
    std::array<std::vector<std::uint8_t>, density::kMaxLevels> small_;
    std::vector<std::uint8_t> strip_;
    std::vector<std::uint16_t> row_;
};

}  // namespace fovea::foveation
