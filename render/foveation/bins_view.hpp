// One view of scaled_bins: its plan, the targets of its levels, and its rectangles on the GPU.
//
//   rectangles:  exact ones of all levels | those of levels 1.. widened by the guard ring      boxes: the same, here
//                first_exact[level]         first_mask[level]                                  (first_mask[0] = first_exact[0])
//
// Every executor draws from this; none owns it. Threads: the context's.
// Errors: create() says what the driver refused, or that the framebuffer has nothing to mask by.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/foveation/level_target.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/rate_map.hpp"
#include "render/gl/framebuffer_shape.hpp"

namespace fovea::foveation {

struct BinsView {
    // Where a level is drawn, and the part of it that its bins (and guard) lie in.
    struct Area {
        gl::Name framebuffer = 0;
        int x = 0, y = 0, width = 0, height = 0;       // viewport
        int x0 = 0, y0 = 0, x1 = 0, y1 = 0;            // scissor, half-open
    };

    // with_levels: also the targets; without, the view only has a plan and rectangles.
    [[nodiscard]] static Result<BinsView> create(const ViewTarget& target, const gl::FramebufferShape& shape, const MethodSettings& settings, bool with_levels);
    // The plan's rectangles, if it has changed since. noexcept, no allocation.
    void upload() noexcept;
    [[nodiscard]] Area area(const ViewTarget& target, int level) const noexcept;
    // Why this frame cannot be foveated on top of what is there; empty: it can.
    [[nodiscard]] const char* obstacle(const ViewTarget& target, const gl::Clear& clear, const MethodSettings& settings) const noexcept;
    // The level starts with what the app's framebuffer holds, made smaller. The scissor must be off.
    void load(const ViewTarget& target, const gl::Clear& clear, int level) const noexcept;
    [[nodiscard]] bool uses(int level) const noexcept { return count[static_cast<std::size_t>(level)] != 0; }
    [[nodiscard]] bool whole() const noexcept { return plan.texels(0) == plan.pixels_full(); }
    [[nodiscard]] std::size_t bins() const noexcept { return static_cast<std::size_t>(plan.columns()) * static_cast<std::size_t>(plan.rows()); }
    // The level's rectangles, widened, in NDC.
    [[nodiscard]] std::span<const gl::Box> mask_boxes(int level) const noexcept {
        const auto i = static_cast<std::size_t>(level);
        return std::span(boxes).subspan(first_mask[i], count[i]);
    }

    explicit BinsView(density::Plan p) noexcept : plan(std::move(p)) {}
    density::Plan plan;
    gl::FramebufferShape shape;   // of the app's framebuffer
    std::array<LevelTarget, density::kMaxLevels> levels;   // [0] stays empty
    gl::Buffer rectangles;        // vec4 NDC
    gl::VertexArray arrays;       // attribute 0: a rectangle per instance
    std::array<std::uint32_t, density::kMaxLevels> first_exact{}, first_mask{}, count{};
    std::vector<gl::Box> boxes;
    std::uint64_t uploaded = ~std::uint64_t{0};   // plan generation in `rectangles` and `boxes`
    bool depth_mask = false;      // masks are depths
    bool clears_numbers = false;  // the clear colour has a use: not every attachment is of integers
    gl::Name clearing = 0;        // program of the mask that also clears (LevelMasks); late fovea
    bool on_processor = false;    // the resolve (LevelResolve)
    gl::Name resolve_color = 0, resolve_depth = 0;
    // Of BinsPlanner: what the plan was made from, the rate of every bin, and the shader that fills them (empty: the processor).
    density::RateInput rate_input;
    std::vector<std::uint8_t> rate_levels;
    std::optional<RateMap> rate_map;
    Method::Region region;
};

// Draws rectangles of a view that is bound (arrays and buffer).
void draw_rectangles(std::uint32_t first, std::uint32_t count) noexcept;

}  // namespace fovea::foveation
