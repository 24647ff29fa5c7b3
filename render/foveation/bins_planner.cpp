#include "render/foveation/bins_planner.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "render/foveation/driver_traits.hpp"

namespace fovea::foveation {

Result<void> BinsPlanner::check_rates(const density::RateSettings& r) {
    if (r.tile_px < 4 || r.tile_px > 64 || r.tile_px % 4 != 0) return fail("a shading-rate tile of " + std::to_string(r.tile_px) + " pixels", "shading_rate", "a multiple of 4, 4 to 64");
    if (!(r.inner_radius >= 0 && r.outer_radius >= r.inner_radius && r.outer_radius <= 4) || !(r.lens_radius > 0) || !(r.focus_extent >= 0 && r.focus_extent <= 1))
        return fail("a radius or extent is out of range", "shading_rate", "0 <= inner_radius <= outer_radius <= 4, lens_radius > 0, focus_extent 0 to 1");
    return {};
}

Result<void> BinsPlanner::prepare(BinsView& view) const {
    if (!by_rates_) return {};
    view.rate_levels.resize(view.bins());
    if (maker_ != RateMaker::gpu && !(maker_ == RateMaker::automatic && driver_traits().gpu_rate_map)) return {};
    auto map = RateMap::create(view.bins());
    if (!map) return std::unexpected(map.error());
    view.rate_map.emplace(*std::move(map));
    return {};
}

void BinsPlanner::plan(BinsView& view, const ViewFocus& focus, std::span<const density::BinRect> drawn) const noexcept {
    const density::PlanSettings& s = view.plan.settings();
    const density::FocalPoint* p = focus.count > 0 ? &focus.points[0] : nullptr;
    if (!by_rates_) {
        view.plan.update(focus.all(), drawn);
        view.region = {};
        if (p != nullptr)
            view.region = {p->x_ndc, p->y_ndc, std::min(density::full_radius_ndc(*p, 0), view.region.half_width_ndc),
                           std::min(density::full_radius_ndc(*p, 1), view.region.half_height_ndc)};
        return;
    }
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const density::RateInput input = density::rate_input(rates_, s.width_px, s.height_px, p != nullptr ? NdcPoint{p->x_ndc, p->y_ndc} : NdcPoint{kNone, kNone});
    if (input == view.rate_input) return;
    view.rate_input = input;
    if (view.rate_map) {
        view.rate_map->set_input(input);
        view.rate_map->dispatch(input.columns(), input.rows());
        view.rate_map->read(input.columns(), input.rows(), view.rate_levels);
    } else {
        density::fill_rate_map(input, view.rate_levels);
    }
    for (std::uint8_t& rate : view.rate_levels) rate &= 3;   // 0x0, 0x5, 0xa: level 0, 1, 2
    view.plan.assign_levels(view.rate_levels);
    view.region = {};
    if ((input.flags & density::kRateGaze) != 0)
        view.region = {p->x_ndc, p->y_ndc, 2.0 * input.inner / s.width_px, 2.0 * input.inner / s.height_px};
}

}  // namespace fovea::foveation
