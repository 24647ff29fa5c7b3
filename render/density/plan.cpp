#include "render/density/plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace fovea::density {
namespace {

// Bins cost little with level masks; 64 along an edge near the continuous limit, 128 save 3 % more of a large picture's texels
// where they are not so small that more of a processor rasteriser's blocks of pixels are cut than saved (docs/render.md).
constexpr int kFewBins = 64, kManyBins = 128, kFineBin_px = 16;

int default_bin_px(int edge_px) noexcept {
    const int coarse = (edge_px + kFewBins - 1) / kFewBins, fine = (edge_px + kManyBins - 1) / kManyBins;
    return std::max({4, std::min(coarse, kFineBin_px), fine});
}

int ceil_shift(int value, int shift) noexcept { return (value + (1 << shift) - 1) >> shift; }

// Bits, so that NaN equals itself and a repeated NaN does not replan for ever.
bool same_bits(const FocalPoint& a, const FocalPoint& b) noexcept { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

std::array<LevelScale, kMaxLevels> standard_levels(bool anisotropic) noexcept {
    if (anisotropic) return {{{0, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 2}, {3, 2}, {3, 3}, {3, 3}}};
    return {{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {3, 3}, {3, 3}, {3, 3}, {3, 3}}};
}

Result<Plan> Plan::create(const PlanSettings& wanted) {
    PlanSettings s = wanted;
    const auto bad = [](const std::string& what, const char* way_out) { return fail(what, "foveation plan", way_out); };
    if (s.width_px < 1 || s.width_px > kMaxImagePx || s.height_px < 1 || s.height_px > kMaxImagePx)
        return bad("image of " + std::to_string(s.width_px) + "x" + std::to_string(s.height_px) + " pixels",
                   "each edge must be 1 to 16384");
    if (s.level_count < 1 || s.level_count > kMaxLevels)
        return bad(std::to_string(s.level_count) + " levels", "1 to 8 are possible");
    if (s.bin_px != 0 && (s.bin_px < 4 || s.bin_px > 1024))
        return bad("bins of " + std::to_string(s.bin_px) + " pixels", "0 (automatic) or 4 to 1024");
    if (!(s.min_density >= 0 && s.min_density <= 1)) return bad("minimum density outside [0, 1]", "use 0 for none");
    if (s.guard_texels < 0 || s.guard_texels > 2) return bad("a guard ring of " + std::to_string(s.guard_texels) + " texels", "0 to 2 are possible");
    int max_shift = 0;
    for (int i = 0; i < s.level_count; ++i) {
        const LevelScale level = s.levels[static_cast<std::size_t>(i)];
        if (level.x_shift > 3 || level.y_shift > 3) return bad("a level below 1/8", "shifts are 0 to 3");
        if (i == 0 && level != LevelScale{}) return bad("level 0 is not full resolution", "its shifts must be 0");
        if (i > 0) {
            const LevelScale before = s.levels[static_cast<std::size_t>(i - 1)];
            if (level.x_shift < before.x_shift || level.y_shift < before.y_shift || level == before)
                return bad("levels that do not get coarser", "order them from fine to coarse");
        }
        max_shift = std::max({max_shift, static_cast<int>(level.x_shift), static_cast<int>(level.y_shift)});
    }
    if (s.bin_px == 0) s.bin_px = default_bin_px(std::max(s.width_px, s.height_px));
    s.bin_px = ceil_shift(s.bin_px, max_shift) << max_shift;
    s.bin_px = std::max(s.bin_px, s.guard_texels << max_shift);   // the ring ends in the next bin

    Plan plan;
    plan.settings_ = s;
    plan.columns_ = (s.width_px + s.bin_px - 1) / s.bin_px;
    plan.rows_ = (s.height_px + s.bin_px - 1) / s.bin_px;
    for (int i = 0; i < s.level_count; ++i) {
        const LevelScale level = s.levels[static_cast<std::size_t>(i)];
        const int shift = s.reading == Reading::area ? level.x_shift + level.y_shift
                                                     : std::max(level.x_shift, level.y_shift);
        const double density = std::ldexp(1.0, -shift);
        plan.threshold_[static_cast<std::size_t>(i)] =
            density >= s.min_density ? 1 / density : std::numeric_limits<double>::infinity();
    }
    const auto bins = static_cast<std::size_t>(plan.columns_) * static_cast<std::size_t>(plan.rows_);
    plan.level_.assign(bins, 0);
    plan.column_terms_.assign(static_cast<std::size_t>(plan.columns_) * kMaxFocalPoints, 0);
    plan.rectangles_.resize(bins);
    plan.minimum_ = MinimumRectangles(plan.columns_, plan.rows_);
    // The extension's default focal point: everything at full density.
    plan.point_count_ = std::numeric_limits<std::size_t>::max();
    const FocalPoint everywhere;
    plan.update(std::span(&everywhere, 1), {});
    plan.generation_ = 0;
    return plan;
}

bool Plan::update(std::span<const FocalPoint> points) noexcept { return update(points, {}); }

bool Plan::update(std::span<const FocalPoint> points, std::span<const BinRect> drawn) noexcept {
    const bool too_many = points.size() > kMaxFocalPoints;
    if (too_many) points = points.first(kMaxFocalPoints);
    std::array<BinRect, kMaxLevels> boxes{};
    std::copy_n(drawn.begin(), std::min<std::size_t>(drawn.size(), kMaxLevels), boxes.begin());
    if (points.size() == point_count_ && too_many == too_many_points_ && restricted_ == !drawn.empty() && boxes == drawn_ &&
        std::equal(points.begin(), points.end(), points_.begin(), same_bits))
        return false;
    std::copy(points.begin(), points.end(), points_.begin());
    point_count_ = points.size();
    too_many_points_ = too_many;
    drawn_ = boxes;
    restricted_ = !drawn.empty();
    choose_levels();
    finish_levels();
    return true;
}

void Plan::assign(std::span<const BinRect> boxes) noexcept {
    std::size_t bin = 0;
    for (int r = 0; r < rows_; ++r)
        for (int c = 0; c < columns_; ++c, ++bin) {
            int level = settings_.level_count - 1;
            for (int i = level - 1; i >= 1; --i) {
                const BinRect& b = boxes[static_cast<std::size_t>(i)];
                if (c >= b.x0 && c < b.x1 && r >= b.y0 && r < b.y1) level = i;
            }
            level_[bin] = static_cast<std::uint8_t>(level);
        }
    point_count_ = std::numeric_limits<std::size_t>::max();   // the next update() plans anew
    finish_levels();
}

bool Plan::assign_levels(std::span<const std::uint8_t> levels) noexcept {
    FOVEA_REQUIRE(levels.size() >= level_.size());
    if (std::equal(level_.begin(), level_.end(), levels.begin())) return false;
    const auto last = static_cast<std::uint8_t>(settings_.level_count - 1);
    std::transform(levels.begin(), levels.begin() + static_cast<std::ptrdiff_t>(level_.size()), level_.begin(),
                   [last](std::uint8_t l) { return std::min(l, last); });
    point_count_ = std::numeric_limits<std::size_t>::max();   // the next update() plans anew
    finish_levels();
    return true;
}

void Plan::finish_levels() noexcept {
    minimum_.make(level_, settings_.level_count, rectangles_, first_rectangle_);
    for (int level = 0; level < settings_.level_count; ++level) {
        find_bounds(level);
        count_texels(level);
    }
    ++generation_;
}

void Plan::choose_levels() noexcept {
    const double w = settings_.width_px, h = settings_.height_px;
    for (std::size_t p = 0; p < point_count_; ++p)
        for (int c = 0; c < columns_; ++c) {
            const double lo = 2.0 * c * settings_.bin_px / w - 1;
            const double hi = std::min(2.0 * (c + 1) * settings_.bin_px / w - 1, 1.0);
            column_terms_[p * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c)] =
                nearest_term(lo, hi, points_[p].x_ndc, points_[p].gain_x);
        }
    std::size_t bin = 0;
    for (int r = 0; r < rows_; ++r) {
        const double lo = 2.0 * r * settings_.bin_px / h - 1;
        const double hi = std::min(2.0 * (r + 1) * settings_.bin_px / h - 1, 1.0);
        std::array<double, kMaxFocalPoints> row_terms{};
        for (std::size_t p = 0; p < point_count_; ++p)
            row_terms[p] = nearest_term(lo, hi, points_[p].y_ndc, points_[p].gain_y);
        for (int c = 0; c < columns_; ++c, ++bin) {
            double denominator = std::numeric_limits<double>::infinity();
            for (std::size_t p = 0; p < point_count_; ++p)
                denominator = std::min(
                    denominator,
                    denominator_bound(column_terms_[p * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c)],
                                      row_terms[p], points_[p].fovea_area));
            if (too_many_points_) denominator = 1;
            int level = settings_.level_count - 1;
            while (level > 0 && !(denominator >= threshold_[static_cast<std::size_t>(level)] &&
                                  threshold_[static_cast<std::size_t>(level)] < std::numeric_limits<double>::infinity()))
                --level;
            if (restricted_) {
                const auto there = [&](const BinRect& b) { return c >= b.x0 && c < b.x1 && r >= b.y0 && r < b.y1; };
                while (level > 0 && !there(drawn_[static_cast<std::size_t>(level)])) --level;
            }
            level_[bin] = static_cast<std::uint8_t>(level);
        }
    }
}

void Plan::find_bounds(int level) noexcept {
    BinRect box{static_cast<std::uint16_t>(columns_), static_cast<std::uint16_t>(rows_), 0, 0};
    for (const BinRect& r : rectangles(level))
        box = {std::min(box.x0, r.x0), std::min(box.y0, r.y0), std::max(box.x1, r.x1), std::max(box.y1, r.y1)};
    bounds_[static_cast<std::size_t>(level)] = box.empty() ? BinRect{} : box;
}

void Plan::count_texels(int level) noexcept {
    const LevelScale scale = settings_.levels[static_cast<std::size_t>(level)];
    const auto is = [&](int c, int r) {
        return c >= 0 && r >= 0 && c < columns_ && r < rows_ && level_at(c, r) == level;
    };
    std::uint64_t inside = 0, guard = 0;
    for (const BinRect& rect : rectangles(level)) {
        const PixelRect p = pixels(rect);
        inside += static_cast<std::uint64_t>(ceil_shift(p.x1, scale.x_shift) - (p.x0 >> scale.x_shift)) *
                  static_cast<std::uint64_t>(ceil_shift(p.y1, scale.y_shift) - (p.y0 >> scale.y_shift));
    }
    const BinRect box = bounds(level);
    const int ring = settings_.guard_texels;
    if (level > 0 && !box.empty() && ring > 0)
        for (int r = std::max(0, box.y0 - 1); r < std::min(rows_, box.y1 + 1); ++r)
            for (int c = std::max(0, box.x0 - 1); c < std::min(columns_, box.x1 + 1); ++c) {
                if (is(c, r)) continue;
                const int left = is(c - 1, r), right = is(c + 1, r), below = is(c, r - 1), above = is(c, r + 1);
                const PixelRect p = pixels({static_cast<std::uint16_t>(c), static_cast<std::uint16_t>(r),
                                            static_cast<std::uint16_t>(c + 1), static_cast<std::uint16_t>(r + 1)});
                const int w = ceil_shift(p.x1, scale.x_shift) - (p.x0 >> scale.x_shift);
                const int h = ceil_shift(p.y1, scale.y_shift) - (p.y0 >> scale.y_shift);
                const int across = std::min(w, ring * (left + right)), up = std::min(h, ring * (below + above));
                int texels = across * h + up * w - across * up;
                const int corner = std::min(w, ring) * std::min(h, ring);
                texels += corner * (!left && !below && is(c - 1, r - 1));
                texels += corner * (!right && !below && is(c + 1, r - 1));
                texels += corner * (!left && !above && is(c - 1, r + 1));
                texels += corner * (!right && !above && is(c + 1, r + 1));
                guard += static_cast<std::uint64_t>(std::min(texels, w * h));
            }
    texels_[static_cast<std::size_t>(level)] = inside;
    guard_[static_cast<std::size_t>(level)] = guard;
}

std::span<const BinRect> Plan::rectangles(int level) const noexcept {
    const auto i = static_cast<std::size_t>(level);
    return std::span(rectangles_).subspan(first_rectangle_[i], first_rectangle_[i + 1] - first_rectangle_[i]);
}

PixelRect Plan::pixels(const BinRect& r) const noexcept {
    return {r.x0 * settings_.bin_px, r.y0 * settings_.bin_px, std::min(r.x1 * settings_.bin_px, settings_.width_px),
            std::min(r.y1 * settings_.bin_px, settings_.height_px)};
}

int Plan::level_width_px(int level) const noexcept {
    return ceil_shift(settings_.width_px, settings_.levels[static_cast<std::size_t>(level)].x_shift);
}

int Plan::level_height_px(int level) const noexcept {
    return ceil_shift(settings_.height_px, settings_.levels[static_cast<std::size_t>(level)].y_shift);
}

}  // namespace fovea::density
