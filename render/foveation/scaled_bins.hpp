// `scaled_bins`: the image as a grid of bins, each rendered at the resolution that the density equation asks for.
//
//   plan (bins_planner)  ->  per view and level, coarse to fine: the recorded draws once more (an executor)  ->  resolve
//
//   executor                                                        picture                  wins where
//   level_masks        a stencil mask of the level's bins            the same                 most scenes
//   rectangle_lists    each level as a few scissored rectangles     the same                 many small draws with bounds
//   late_fovea         levels 1.. before the latch, level 0 after    denser around the gaze   a late latch counts
//
// Level 0 goes straight into the app's framebuffer with the app's viewport, so the fovea is bit-identical to a full
// render; levels 1.. have targets of their own (LevelTarget) and are drawn into the app's image by the resolve.
// gl_FragCoord in level n is scaled by 1/2^n, as the extension specifies.
// Source: GL_QCOM_framebuffer_foveated, scaled bin method.
// Levels have the app's attachments and samples; multisampled levels are averaged before they are enlarged.
// A frame that goes on over the picture before it (Clear::keep_color) starts its levels with that picture, made smaller, and
// puts them back; where that cannot be (multisampled, no stencil, depth that was not resolved) it is drawn in full.
#pragma once

#include <optional>
#include <vector>

#include "render/foveation/bins_planner.hpp"
#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/late_fovea.hpp"
#include "render/foveation/level_masks.hpp"
#include "render/foveation/level_resolve.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/prepared.hpp"
#include "render/foveation/rectangle_lists.hpp"

namespace fovea::foveation {

class ScaledBins final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    // The same with the fovea drawn last: late_fovea().
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_late(const MethodSettings& settings);
    // The same fed by a shading-rate map instead of the density equation: `shading_rate`.
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_rates(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return late_ ? "scaled_bins_late" : planner_.by_rates() ? "shading_rate" : "scaled_bins"; }
    // From the next submit on; not for a late fovea, which is drawn by masks.
    void use(BinExecutor executor) noexcept { settings_.executor = executor; }
    [[nodiscard]] bool exact_fovea() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] bool late_fovea() const noexcept override { return late_.has_value(); }
    void submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                      std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t view) const noexcept override {
        return view < views_.size() ? &views_[view].plan : nullptr;
    }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return view < views_.size() ? views_[view].region : Region{}; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    ScaledBins(const MethodSettings& settings, LevelMasks masks, LevelResolve resolve) noexcept
        : settings_(settings), counter_(settings.count_fragments), masks_(std::move(masks)), resolve_(std::move(resolve)) {}
    [[nodiscard]] static Result<std::unique_ptr<ScaledBins>> make(const MethodSettings& settings);
    [[nodiscard]] Result<void> make_views(std::span<const ViewTarget> targets);
    [[nodiscard]] const char* obstacle(std::size_t view, const ViewTarget& target, const gl::Clear& clear) const noexcept;
    [[nodiscard]] LateFovea::Tools tools() noexcept { return {settings_, planner_, masks_, resolve_, counter_.enabled()}; }

    MethodSettings settings_;
    FragmentCounter counter_;
    BinsPlanner planner_;
    LevelMasks masks_;
    LevelResolve resolve_;
    RectangleLists rectangles_;
    std::optional<LateFovea> late_;
    Prepared prepared_;
    std::vector<BinsView> views_;
};

}  // namespace fovea::foveation
