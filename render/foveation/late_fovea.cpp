#include "render/foveation/late_fovea.hpp"

#include <algorithm>

#include "render/foveation/full.hpp"

namespace fovea::foveation {

void LateFovea::clear() noexcept {
    early_.clear();
    boxes_.clear();
    rest_.clear();
    done_ = false;
}

Result<void> LateFovea::add(const Tools& tools, BinsView& view, const ViewTarget& target) {
    if (auto r = tools.masks.prepare_clearing(view); !r) return r;
    auto before = BinsView::create(target, view.shape, tools.settings, true);
    if (!before) return std::unexpected(before.error());
    if (auto r = tools.resolve.prepare(*before, target, true); !r) return r;
    early_.push_back(*std::move(before));
    boxes_.emplace_back();
    if (!tools.settings.resolve_depth) return {};
    auto last = BinsView::create(target, view.shape, tools.settings, false);
    if (!last) return std::unexpected(last.error());
    if (auto r = tools.resolve.prepare(*last, target, true); !r) return r;
    rest_levels_.resize(std::max(rest_levels_.size(), last->bins()));
    rest_.push_back(*std::move(last));
    return {};
}

void LateFovea::early(const Tools& tools, std::span<BinsView> views, const gl::CommandList& draws, std::span<const ViewTarget> targets,
                      std::span<const ViewFocus> focus) noexcept {
    cost_ = {};
    const int levels = tools.settings.plan.level_count;
    for (std::size_t v = 0; v < targets.size(); ++v) {
        const density::Plan& plan = views[v].plan;
        tools.planner.plan(views[v], focus[v], {});
        // Level n is drawn where the finer ones would be, and a margin further: the gaze may move until the latch.
        const int margin = std::max(2, plan.columns() / 16);
        density::BinRect box;
        for (int level = 0; level < levels; ++level) {
            const density::BinRect b = plan.bounds(level);
            if (!b.empty())
                box = box.empty() ? b : density::BinRect{std::min(box.x0, b.x0), std::min(box.y0, b.y0), std::max(box.x1, b.x1), std::max(box.y1, b.y1)};
            if (level == 0) continue;
            boxes_[v][static_cast<std::size_t>(level)] = {
                static_cast<std::uint16_t>(std::max(0, box.x0 - margin)), static_cast<std::uint16_t>(std::max(0, box.y0 - margin)),
                static_cast<std::uint16_t>(std::min(plan.columns(), box.x1 + margin)),
                static_cast<std::uint16_t>(std::min(plan.rows(), box.y1 + margin))};
        }
        boxes_[v][static_cast<std::size_t>(levels - 1)] = {0, 0, static_cast<std::uint16_t>(plan.columns()), static_cast<std::uint16_t>(plan.rows())};
        early_[v].plan.assign(boxes_[v]);
        early_[v].upload();
        for (int level = levels - 1; level >= 1; --level)
            if (early_[v].uses(level)) tools.masks.draw(early_[v], static_cast<std::uint32_t>(v), targets[v], draws, level, false, tools.count_fragments, cost_);
    }
    for (std::size_t v = 0; v < targets.size(); ++v) tools.resolve.run(early_[v], early_[v], targets[v], true, false);
    done_ = levels > 1;
}

void LateFovea::late(const Tools& tools, std::span<BinsView> views, const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus,
                     FrameCost& cost) noexcept {
    cost = cost_;
    done_ = false;
    for (std::size_t v = 0; v < targets.size(); ++v) {
        BinsView& view = views[v];
        tools.planner.plan(view, focus[v], boxes_[v]);
        if (view.whole()) {
            submit_full_view(draws, static_cast<std::uint32_t>(v), targets[v], tools.count_fragments, cost, &view.shape);
            continue;
        }
        cost.pixels_full += view.plan.pixels_full();
        view.upload();
        if (view.uses(0)) tools.masks.draw(view, static_cast<std::uint32_t>(v), targets[v], draws, 0, true, tools.count_fragments, cost);
        if (!rest_.empty()) late_depth(tools, view, v, targets[v]);   // last: the mask of level 0 has used the app's depth
    }
}

void LateFovea::late_depth(const Tools& tools, const BinsView& view, std::size_t v, const ViewTarget& t) noexcept {
    const density::Plan &late = view.plan, &early = early_[v].plan;
    std::size_t bin = 0;
    for (int r = 0; r < late.rows(); ++r)
        for (int c = 0; c < late.columns(); ++c) rest_levels_[bin++] = static_cast<std::uint8_t>(late.level_at(c, r) == 0 ? 0 : early.level_at(c, r));
    rest_[v].plan.assign_levels(rest_levels_);
    rest_[v].upload();
    tools.resolve.run(rest_[v], early_[v], t, false, true);
}

}  // namespace fovea::foveation
