// The search with a gaze: see MotionSearch::Fovea.
#include <cmath>


#include "render/extrapolation/motion.hpp"

namespace fovea::render::extrapolation {

namespace {

std::size_t at(int x, int y, int width) noexcept { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }

Box common(const Box& a, const Box& b) noexcept {
    const Box c{std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
    return c.x1 > c.x0 && c.y1 > c.y0 ? c : Box{};
}

Box whole_blocks(const Box& b, int block, int width, int height) noexcept {
    return {b.x0 / block * block, b.y0 / block * block, std::min((b.x1 + block - 1) / block * block, width), std::min((b.y1 + block - 1) / block * block, height)};
}

}  // namespace

bool MotionSearch::fovea(const Gaze& gaze, Fovea& out) const noexcept {
    if (levels() < 3 || cell_px_ != 2) return false;
    if (!std::isfinite(gaze.x_px) || !std::isfinite(gaze.y_px) || !(gaze.full_radius_px >= 0)) return false;
    const Field &finest = forward_[0], &coarse = forward_[1];
    out.box = whole_blocks(Box{0, 0, finest.width, finest.height}.around(gaze.x_px, gaze.y_px, gaze.full_radius_px, cell_px_), kFoveaBlock, finest.width, finest.height);
    constexpr int kMostOf = 2;   // half of the picture at full effort: then the rest may have it as well
    if (kMostOf * (out.box.x1 - out.box.x0) * (out.box.y1 - out.box.y0) > finest.width * finest.height) return false;
    out.searched = Box{0, 0, coarse.width, coarse.height}.around(gaze.x_px, gaze.y_px, gaze.coarse_radius_px, 2 * cell_px_);
    // Whole bands; and the fovea has a coarser level to start from.
    const Box inner{out.box.x0 / 2, out.box.y0 / 2, (out.box.x1 + 1) / 2, (out.box.y1 + 1) / 2};
    out.searched = {std::min(out.searched.x0, inner.x0) / kStridePx * kStridePx, std::min(out.searched.y0, inner.y0) / kStridePx * kStridePx,
                    std::min(std::max(out.searched.x1, inner.x1), coarse.width), std::min(std::max(out.searched.y1, inner.y1), coarse.height)};
    return true;
}

Box MotionSearch::coarse_active() const noexcept { return {active_.x0 >> 1, active_.y0 >> 1, (active_.x1 + 1) >> 1, (active_.y1 + 1) >> 1}; }

// The way back is never searched on the finest level then: what it would tell is known a level above.
int MotionSearch::backward_from(const Tuning& tuning) const noexcept {
    return tuning.backward_level < 0 ? levels() : std::max(1, std::min(tuning.backward_level, levels() - 1));
}

// Of a part of the finest level, the whole blocks that may move, and a block around them: what stands still pulls at its neighbours.
Box MotionSearch::moving(const Box& part, const TileMap& tiles) const noexcept {
    const int cells = kTilePx / cell_px_;
    Box found{tiles.columns, tiles.rows, 0, 0};
    for (int row = part.y0 / cells; row < std::min((part.y1 + cells - 1) / cells, tiles.rows); ++row)
        for (int column = part.x0 / cells; column < std::min((part.x1 + cells - 1) / cells, tiles.columns); ++column) {
            if (tiles.is_anchor(column, row)) continue;
            found = {std::min(found.x0, column), std::min(found.y0, row), std::max(found.x1, column + 1), std::max(found.y1, row + 1)};
        }
    if (found.x1 == 0) return {};
    const Field& f = forward_[0];
    const Box blocks = whole_blocks({found.x0 * cells, found.y0 * cells, found.x1 * cells, found.y1 * cells}, kFoveaBlock, f.width, f.height);
    return common(part, blocks.grown(kFoveaBlock, f.width, f.height));
}

Box MotionSearch::run_coarse(const Fovea& fovea, const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept {
    levels_below(near_, 2, kernels, pool);
    levels_below(far_, 2, kernels, pool);
    Field &finest = forward_[0], &coarse = forward_[1];
    box_ = moving(fovea.box, tiles);
    const Box &box = box_, inner{box.x0 / 2, box.y0 / 2, (box.x1 + 1) / 2, (box.y1 + 1) / 2};
    // The way back is asked for where the finest level will be smoothed, and as far around as most motions lead from there; above, a
    // patch further, to start from.
    constexpr int kBackAround = 16;
    const int back_from = backward_from(tuning);
    // Away from the gaze, and to start from beside it, half the rounds and two passes lose next to nothing.
    Tuning less = tuning;
    less.passes = std::min(tuning.passes, 2);
    less.balance_rounds = std::min(tuning.balance_rounds, 8);
    for (int l = levels() - 1; l >= 1; --l) {
        const Box around = active_at(l);
        const Box searched = l == 1 ? common(fovea.searched, around) : around;
        choose_tasks(searched, tiles, l);
        search_level(searched, around, l, false, less, kernels, pool);
        if (l < back_from || box.x1 == 0) continue;
        const int down = l - 1, half = kBackAround >> down, end_x = forward_[static_cast<std::size_t>(l)].width, end_y = forward_[static_cast<std::size_t>(l)].height;
        const Box grown = Box{inner.x0 >> down, inner.y0 >> down, std::min((inner.x1 >> down) + 1, end_x), std::min((inner.y1 >> down) + 1, end_y)}.grown(half + (l == 1 ? 0 : kPatchPx), end_x, end_y);
        const Box back = common(searched, {grown.x0 / kStridePx * kStridePx, grown.y0 / kStridePx * kStridePx, grown.x1, grown.y1});
        search_level(back, around, l, true, less, kernels, pool);
    }
    const Box rim = coarse_active();
    most_ = 0;
    for (int y = rim.y0; y < rim.y1; ++y)
        for (int x = rim.x0; x < rim.x1; ++x) most_ = std::max(most_, std::max(std::fabs(coarse.u[at(x, y, coarse.width)]), std::fabs(coarse.v[at(x, y, coarse.width)])));
    // A patch of the fovea reaches a stride beyond it, starts from as far away as level 1 has found anything, and may run its own size
    // further. What would go on is compared at the rim, and refused there.
    filled_ = {};
    if (box.x1 == 0) return {};
    const int per_tile = kTilePx / cell_px_;
    const Box seen = box.grown(static_cast<int>(std::min(2 * most_, static_cast<float>(std::max(finest.width, finest.height)))) + 3 * kPatchPx, finest.width, finest.height);
    const Box filled{seen.x0 / per_tile, seen.y0 / per_tile, (seen.x1 + per_tile - 1) / per_tile, (seen.y1 + per_tile - 1) / per_tile};
    filled_ = {filled.x0 * per_tile, filled.y0 * per_tile, std::min(filled.x1 * per_tile, finest.width), std::min(filled.y1 * per_tile, finest.height)};
    return filled;
}

void MotionSearch::run_fine(const Fovea& fovea, float step, const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept {
    Field &finest = forward_[0], &coarse = forward_[1];
    const Box& box = box_;
    const int back_from = backward_from(tuning);
    // What may come into the fovea from around it.
    const float carried = 2 * most_ * std::fabs(step);
    fine_ = fovea.box.grown(8 + static_cast<int>(std::min(carried, static_cast<float>(std::max(finest.width, finest.height)))), finest.width, finest.height);
    if (moving(fine_, tiles).x1 == 0) fine_ = {};   // nothing moves there, and nothing comes
    if (box.x1 > 0) {
        choose_tasks(box, tiles, 0);
        search_level(box, common(fine_, active_at(0)), 0, false, tuning, kernels, pool);
        if (back_from < levels()) {
            const int level = back_from;
            check_backward({box.x0 >> level, box.y0 >> level, std::min((box.x1 >> level) + 1, forward_[static_cast<std::size_t>(level)].width), std::min((box.y1 >> level) + 1, forward_[static_cast<std::size_t>(level)].height)},
                           box.grown(8, finest.width, finest.height), level);
        }
        smooth(box, tiles, tuning.smoothing_passes, kernels, pool);
    } else if (fine_.x1 > 0) {
        go_on(common(fine_, active_at(0)), {}, 0, false);
    }
    validate(tiles, &fovea.box);
    stand_still(coarse, active_at(1), 2 * cell_px_, tiles);
    if (fine_.x1 > 0) stand_still(finest, common(fine_, active_at(0)), cell_px_, tiles);
}

}  // namespace fovea::render::extrapolation
