#include "render/foveation/scaled_bins.hpp"

#include <utility>

#include "render/foveation/full.hpp"

namespace fovea::foveation {

Result<std::unique_ptr<ScaledBins>> ScaledBins::make(const MethodSettings& wanted) {
    const auto checked = density::Plan::create(wanted.plan);
    if (!checked) return std::unexpected(checked.error());
    MethodSettings settings = wanted;
    if (settings.filter == gl::Filter::cubic) settings.plan.guard_texels = 2;
    auto masks = LevelMasks::create();
    if (!masks) return std::unexpected(masks.error());
    auto resolve = LevelResolve::create(settings);
    if (!resolve) return std::unexpected(resolve.error());
    return std::unique_ptr<ScaledBins>(new ScaledBins(settings, *std::move(masks), *std::move(resolve)));
}

Result<std::unique_ptr<Method>> ScaledBins::create(const MethodSettings& settings) {
    auto method = make(settings);
    if (!method) return std::unexpected(method.error());
    return std::unique_ptr<Method>(*std::move(method));
}

Result<std::unique_ptr<Method>> ScaledBins::create_late(const MethodSettings& settings) {
    auto method = make(settings);
    if (!method) return std::unexpected(method.error());
    (*method)->late_.emplace();
    return std::unique_ptr<Method>(*std::move(method));
}

Result<std::unique_ptr<Method>> ScaledBins::create_rates(const MethodSettings& settings) {
    if (auto fine = BinsPlanner::check_rates(settings.shading_rate); !fine) return std::unexpected(fine.error());
    MethodSettings s = settings;
    s.plan.bin_px = settings.shading_rate.tile_px;
    s.plan.levels = density::standard_levels();
    s.plan.level_count = 3;   // 1x1, 2x2, 4x4
    auto method = make(s);
    if (!method) return std::unexpected(method.error());
    (*method)->planner_ = BinsPlanner(settings.shading_rate, settings.rate_maker);
    return std::unique_ptr<Method>(*std::move(method));
}

Result<void> ScaledBins::make_views(std::span<const ViewTarget> targets) {
    views_.clear();
    if (late_) late_->clear();
    std::vector<BinsView> views;
    for (std::size_t i = 0; i < targets.size(); ++i) {
        auto view = BinsView::create(targets[i], prepared_.shape(i), settings_, !late_);
        if (!view) return std::unexpected(view.error());
        if (auto r = planner_.prepare(*view); !r) return r;
        // Depth apart from colour for a late fovea, whose depth comes last.
        if (auto r = resolve_.prepare(*view, targets[i], late_.has_value()); !r) return r;
        if (late_)
            if (auto r = late_->add(tools(), *view, targets[i]); !r) return r;
        views.push_back(*std::move(view));
    }
    views_ = std::move(views);
    rectangles_.prepare(late_ ? 0 : targets.size(), settings_.texels_per_rectangle);
    return {};
}

Result<void> ScaledBins::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    if (*same) return {};
    return prepared_.settle(make_views(targets));
}

const char* ScaledBins::obstacle(std::size_t view, const ViewTarget& t, const gl::Clear& clear) const noexcept {
    if (late_ && (clear.keep_color || clear.keep_depth)) return "a late fovea cannot go on over a picture";
    return views_[view].obstacle(t, clear, settings_);
}

void ScaledBins::submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept {
    if (!late_) return;
    late_->forget_early();
    if (draws.empty() || !prepared_.ready(targets) || draws.clear().keep_color || draws.clear().keep_depth) return;
    counter_.begin();
    late_->early(tools(), views_, draws, targets, focus);
}

FrameCost ScaledBins::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                             std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    if (late_ && !late_->early_done()) submit_early(draws, targets, focus);
    if (late_ && late_->early_done()) {
        late_->late(tools(), views_, draws, targets, focus, cost);
        cost.executor = "late level 0";
        cost.why = "the method";
        return cost;
    }
    counter_.begin();
    const bool ready = prepared_.ready(targets), by_rectangles = settings_.executor == BinExecutor::rectangles;
    bool foveated = false;
    for (std::size_t v = 0; v < targets.size(); ++v) {
        const auto index = static_cast<std::uint32_t>(v);
        const char* why = ready ? obstacle(v, targets[v], draws.clear()) : prepared_.note();
        if (*why == 0) planner_.plan(views_[v], focus[v], {});
        if (*why != 0 || draws.empty() || views_[v].whole()) {
            submit_full_view(draws, index, targets[v], counter_.enabled(), cost, ready ? &views_[v].shape : nullptr);
            if (*why != 0 && !draws.empty()) {
                cost.fell_back = true;
                cost.note = why;
            }
            continue;
        }
        BinsView& view = views_[v];
        cost.pixels_full += view.plan.pixels_full();
        view.upload();
        if (by_rectangles) rectangles_.update(view, v);
        // Coarse to fine: while the driver still draws level 0 of one view, the other's is being recorded.
        for (int level = view.plan.settings().level_count - 1; level >= 0; --level)
            if (view.uses(level) && !(by_rectangles && rectangles_.draw(view, index, targets[v], draws, level, counter_.enabled(), cost)))
                masks_.draw(view, index, targets[v], draws, level, false, counter_.enabled(), cost);
        foveated = true;
    }
    cost.why = cost.fell_back ? cost.note : foveated ? "the setting" : draws.empty() ? "nothing is drawn" : "full density is wanted everywhere";
    if (foveated) cost.executor = by_rectangles ? "rectangle lists" : "level masks";
    if (!ready || draws.empty()) return cost;
    for (std::size_t v = 0; v < targets.size(); ++v)
        if (*obstacle(v, targets[v], draws.clear()) == 0 && !views_[v].whole()) resolve_.run(views_[v], views_[v], targets[v], true, true);
    return cost;
}

}  // namespace fovea::foveation
