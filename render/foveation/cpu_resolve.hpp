// The resolve of scaled_bins on the processor: read the small levels back, enlarge them strip by strip in the cache, put
// the strips into the app's texture. On a processor rasteriser this costs a fifth of drawing textured rectangles.
//
// Threads: the context's; the enlarging is shared with threads of its own, which sleep otherwise. The picture does not depend
// on how many there are. Errors: none; can_resolve() says where it does not apply (then the GPU resolves).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/foveation/method.hpp"
#include "render/foveation/upsample.hpp"
#include "render/gl/framebuffer_shape.hpp"
#include "render/threads/thread_pool.hpp"

namespace fovea::foveation {

class CpuResolve {
public:
    // One colour image of RGBA8, not multisampled, a 2D texture or a layer of an array, and a picture that is a whole number
    // of texels of every level.
    [[nodiscard]] static bool can_resolve(const ViewTarget& target, const gl::FramebufferShape& shape, const density::Plan& plan);
    // Memory for images planned by `plan` (keeps the larger), and threads: 0 as many as processors (at most 4), 1 none.
    void reserve(const density::Plan& plan, int threads);

    struct Level {
        gl::Name framebuffer = 0;
        int x0 = 0, y0 = 0, x1 = 0, y1 = 0;   // texels of the level that were rendered
        int at_x = 0, at_y = 0;               // where the level lies in the framebuffer
    };
    // levels[i] of plan level i; [0] is not read. Waits for the GPU: for the levels, and for what it draws into the target,
    // which must not come after the upload. noexcept, no allocation.
    void run(const density::Plan& plan, const ViewTarget& target, const gl::FramebufferShape& shape, std::span<const Level> levels,
             gl::Filter filter) noexcept;

private:
    void enlarge_strip(const density::Plan& plan, std::span<const SmallImage> images, int row, std::size_t slot, gl::Filter filter) noexcept;

    std::array<std::vector<std::uint8_t>, density::kMaxLevels> small_;
    std::vector<std::uint8_t> strips_;        // by slot
    std::vector<std::uint16_t> rows_;         // scratch, by slot
    std::vector<float> cubic_rows_;
    std::size_t slots_ = 1;                   // strips that are made at a time
    std::unique_ptr<threads::ThreadPool> pool_;   // with slots_ > 1
};

}  // namespace fovea::foveation
