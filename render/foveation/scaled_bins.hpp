// `scaled_bins`: the image as a grid of bins, each rendered at the resolution that the density equation asks for.
//
//   the app's framebuffer          level 1 (1/2)             level 2 (1/4)
//   +--------------------+         +----------+              +----+
//   |                    |         |  ######  |              |#  #|     1. per level: clear, stencil mask of its bins
//   |       ####         |         |  #    #  |              |    |        (plus a guard ring of one texel), and the
//   |       ####         |         |  ######  |              |#  #|        recorded draws once, scissored to their box
//   |                    |         +----------+              +----+     2. levels 1.. are drawn into the app's image
//   +--------------------+                                                 (resolve), each bin from its level
//
// Level 0 goes straight into the app's framebuffer with the app's viewport, so the fovea is bit-identical to a full
// render. gl_FragCoord in level n is scaled by 1/2^n, as the extension specifies.
// Source: GL_QCOM_framebuffer_foveated, scaled bin method; one submission per level was measured to be the fastest way
// on processor rasterisers (docs/render.md).
// Late fovea: levels 1.. are drawn and resolved before the gaze is latched, each in a box that leaves room for the gaze to
// move; after the latch only level 0 is left to draw. Bins that need more than what lies under them become level 0.
// Masks are stencil values, or depths nearer than anything where only the depth test rejects early (docs/render.md), or where
// the app's framebuffer has no stencil.
// Levels have the app's attachments and samples (LevelTarget); multisampled levels are averaged before they are enlarged.
// A frame that goes on over the picture before it (Clear::keep_color) starts its levels with that picture, made smaller, and
// puts them back; where that cannot be (multisampled, no stencil, depth that was not resolved) it is drawn in full.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/foveation/bin_resolve.hpp"
#include "render/foveation/cpu_resolve.hpp"
#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/level_target.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/prepared.hpp"
#include "render/foveation/rate_map.hpp"

namespace fovea::foveation {

class ScaledBins final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    // The same with the fovea drawn last: late_fovea().
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_late(const MethodSettings& settings);
    [[nodiscard]] static Result<void> check_rates(const density::RateSettings& settings);
    // The same executor fed by a shading-rate map instead of the density equation: `shading_rate`.
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_rates(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return late_ ? "scaled_bins_late" : rates_ ? "shading_rate" : "scaled_bins"; }
    [[nodiscard]] bool exact_fovea() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] bool late_fovea() const noexcept override { return late_; }
    void submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                      std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t view) const noexcept override {
        return view < views_.size() ? &views_[view].plan : nullptr;
    }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return view < views_.size() ? views_[view].region : Region{}; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    struct View {
        explicit View(density::Plan p) noexcept : plan(std::move(p)) {}
        density::Plan plan;
        gl::FramebufferShape shape;   // of the app's framebuffer
        std::array<LevelTarget, density::kMaxLevels> levels;   // [0] stays empty
        gl::Buffer rectangles;        // vec4 NDC: exact ones of all levels, then dilated ones of levels 1..
        gl::VertexArray arrays;
        std::array<std::uint32_t, density::kMaxLevels> first_exact{}, first_mask{}, count{};
        std::vector<gl::Box> boxes;   // of the masks' rectangles, in the same order, for leaving out draws
        std::uint64_t uploaded = ~std::uint64_t{0};   // plan generation in `rectangles` and `boxes`
        bool on_processor = false;    // the resolve
        bool depth_mask = false;
        bool clears_numbers = false;  // the clear colour has a use: not every attachment is of integers
        gl::Name resolve_color = 0, resolve_depth = 0, clearing = 0;   // programs of resolve_programs_ and clearing_
        density::RateInput rate_input;          // shading_rate: what the plan was made from
        std::vector<std::uint8_t> rate_levels;  // of every bin
        std::optional<RateMap> rate_map;        // the shader that fills them; empty: the processor does
        Region region;
    };
    // Where a level is drawn, and the part of it that its bins (and guard) lie in.
    struct DrawArea {
        gl::Name framebuffer = 0;
        int x = 0, y = 0, width = 0, height = 0;       // viewport
        int x0 = 0, y0 = 0, x1 = 0, y1 = 0;            // scissor
    };

    explicit ScaledBins(const MethodSettings& settings) : settings_(settings), counter_(settings.count_fragments) {}
    [[nodiscard]] Result<View> make_view(const ViewTarget& target, const gl::FramebufferShape& shape, bool with_levels);
    [[nodiscard]] Result<void> make_views(std::span<const ViewTarget> targets);
    [[nodiscard]] Result<gl::Name> clearing_program(const gl::FramebufferShape& shape);
    void plan_view(View& view, const ViewFocus& focus, std::span<const density::BinRect> drawn) noexcept;
    void upload(View& view) noexcept;
    [[nodiscard]] static DrawArea area(const View& view, const ViewTarget& target, int level) noexcept;
    // Why this frame cannot be foveated on top of what is there; empty: it can.
    [[nodiscard]] const char* obstacle(const View& view, const ViewTarget& target, const gl::Clear& clear) const noexcept;
    void load_level(const View& view, const ViewTarget& target, const gl::Clear& clear, int level) noexcept;
    void draw_level(View& view, std::uint32_t index, const ViewTarget& target, const gl::CommandList& draws, int level,
                    bool over_finished, FrameCost& cost) noexcept;
    void resolve_late_depth(std::size_t view, const ViewTarget& target) noexcept;
    void submit_late(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus,
                     FrameCost& cost) noexcept;
    // Fills the bins of `view` outside level 0 from the levels of `from`.
    void resolve(View& view, const View& from, const ViewTarget& target, bool color, bool depth) noexcept;
    void resolve_on_gpu(const View& view, const View& from, const ViewTarget& target, gl::Name program, bool color, bool depth) noexcept;
    [[nodiscard]] bool drawn_whole(const View& view) const noexcept { return view.plan.texels(0) == view.plan.pixels_full(); }

    MethodSettings settings_;
    bool late_ = false, rates_ = false;
    gl::Program mask_;
    std::vector<std::pair<std::string, gl::Program>> clearing_;   // by source
    BinResolve resolve_programs_;
    FragmentCounter counter_;
    CpuResolve cpu_resolve_;
    Prepared prepared_;
    std::vector<View> views_;
    // Late fovea: what was drawn before the latch (levels 1.. in boxes), and whether it was for this frame.
    std::vector<View> early_;
    std::vector<std::array<density::BinRect, density::kMaxLevels>> early_boxes_;
    // With resolve_depth: what of the early levels is left to be seen once level 0 is drawn; one view each, without levels.
    std::vector<View> rest_;
    std::vector<std::uint8_t> rest_levels_;
    FrameCost early_cost_;
    bool early_done_ = false;
    std::vector<std::array<float, 4>> staging_;
};

}  // namespace fovea::foveation
