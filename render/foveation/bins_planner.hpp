// Which level each bin of a view gets, from the latched focus: by the density equation (scaled_bins) or by a shading-rate
// map (shading_rate), which a compute shader or the processor fills.
//
// Input: focal points in NDC of the view. Output: BinsView::plan and BinsView::region.
// Threads: the context's. Errors: settings out of range; a compute shader that does not build. plan() is noexcept.
#pragma once

#include "render/foveation/bins_view.hpp"

namespace fovea::foveation {

class BinsPlanner {
public:
    BinsPlanner() noexcept = default;
    explicit BinsPlanner(const density::RateSettings& rates, RateMaker maker) noexcept : by_rates_(true), rates_(rates), maker_(maker) {}
    [[nodiscard]] static Result<void> check_rates(const density::RateSettings& settings);
    [[nodiscard]] bool by_rates() const noexcept { return by_rates_; }
    // What plan() needs of a view; once, after it was made.
    [[nodiscard]] Result<void> prepare(BinsView& view) const;
    // drawn: boxes of levels that are there already (density::Plan::update); empty: none.
    void plan(BinsView& view, const ViewFocus& focus, std::span<const density::BinRect> drawn) const noexcept;

private:
    bool by_rates_ = false;
    density::RateSettings rates_;
    RateMaker maker_ = RateMaker::automatic;
};

}  // namespace fovea::foveation
