#include "render/density/rectangle_cover.hpp"

#include <algorithm>

namespace fovea::density {
namespace {

constexpr std::size_t kBandsMost = 4 * RectangleCover::kMost;   // rectangles after the cut; more are not merged but refused
constexpr std::size_t kNear = 8;   // merges are sought among so many that follow in the list: it is ordered by height

std::int64_t size(const PixelRect& r) noexcept { return std::int64_t{r.x1 - r.x0} * (r.y1 - r.y0); }

PixelRect around(const PixelRect& a, const PixelRect& b) noexcept {
    return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

bool overlap(const PixelRect& a, const PixelRect& b) noexcept { return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1; }

}  // namespace

RectangleCover::RectangleCover() {
    wide_.reserve(kMost);
    rectangles_.reserve(kBandsMost);
    edges_.reserve(2 * kMost);
    runs_.reserve(kMost);
}

std::uint64_t RectangleCover::texels() const noexcept {
    std::uint64_t n = 0;
    for (const PixelRect& r : rectangles_) n += static_cast<std::uint64_t>(size(r));
    return n;
}

bool RectangleCover::update(const Plan& plan, int level, double texels_per_rectangle) noexcept {
    rectangles_.clear();
    wide_.clear();
    const std::span<const BinRect> bins = plan.rectangles(level);
    if (bins.size() > kMost) return false;
    const PlanSettings& s = plan.settings();
    const int w = plan.level_width_px(level), h = plan.level_height_px(level), ring = level > 0 ? s.guard_texels : 0;
    const auto down = [](int px, int texels, int full) { return static_cast<int>(std::int64_t{px} * texels / full); };
    const auto up = [](int px, int texels, int full) { return static_cast<int>((std::int64_t{px} * texels + full - 1) / full); };
    for (const BinRect& b : bins) {
        const PixelRect p = plan.pixels(b);
        wide_.push_back({std::max(0, down(p.x0, w, s.width_px) - ring), std::max(0, down(p.y0, h, s.height_px) - ring),
                         std::min(w, up(p.x1, w, s.width_px) + ring), std::min(h, up(p.y1, h, s.height_px) + ring)});
    }
    cut_into_bands();
    if (rectangles_.size() >= kBandsMost) {
        rectangles_.clear();
        return false;
    }
    merge(texels_per_rectangle);
    return true;
}

// Between two neighbouring heights at which a rectangle begins or ends, the union is a row of runs.
void RectangleCover::cut_into_bands() noexcept {
    edges_.clear();
    for (const PixelRect& r : wide_) {
        edges_.push_back(r.y0);
        edges_.push_back(r.y1);
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    std::size_t below = 0;   // the first rectangle of the band before
    for (std::size_t e = 0; e + 1 < edges_.size(); ++e) {
        const int y0 = edges_[e], y1 = edges_[e + 1];
        runs_.clear();
        for (const PixelRect& r : wide_)
            if (r.y0 <= y0 && r.y1 >= y1) runs_.emplace_back(r.x0, r.x1);
        std::sort(runs_.begin(), runs_.end());
        const std::size_t band = rectangles_.size();
        for (std::size_t i = 0; i < runs_.size();) {
            int end = runs_[i].second;
            const int start = runs_[i].first;
            for (++i; i < runs_.size() && runs_[i].first <= end; ++i) end = std::max(end, runs_[i].second);
            if (rectangles_.size() == kBandsMost) return;
            rectangles_.push_back({start, y0, end, y1});
        }
        // The same runs as below: the band below goes on.
        const std::size_t n = rectangles_.size() - band;
        const bool same = n == band - below && std::equal(rectangles_.begin() + static_cast<std::ptrdiff_t>(below), rectangles_.begin() + static_cast<std::ptrdiff_t>(band),
                                                          rectangles_.begin() + static_cast<std::ptrdiff_t>(band),
                                                          [](const PixelRect& a, const PixelRect& b) { return a.x0 == b.x0 && a.x1 == b.x1 && a.y1 == b.y0; });
        if (!same) {
            below = band;
            continue;
        }
        for (std::size_t i = below; i < band; ++i) rectangles_[i].y1 = y1;
        rectangles_.resize(band);
    }
}

void RectangleCover::merge(double texels_per_rectangle) noexcept {
    const auto most = static_cast<std::int64_t>(std::clamp(texels_per_rectangle, 0.0, 1e12));
    for (;;) {
        std::size_t best_i = 0, best_j = 0;
        std::int64_t least = most + 1;
        for (std::size_t i = 0; i < rectangles_.size(); ++i)
            for (std::size_t j = i + 1; j < std::min(i + 1 + kNear, rectangles_.size()); ++j) {
                const PixelRect both = around(rectangles_[i], rectangles_[j]);
                const std::int64_t waste = size(both) - size(rectangles_[i]) - size(rectangles_[j]);
                if (waste >= least) continue;
                bool free = true;
                for (std::size_t k = 0; free && k < rectangles_.size(); ++k) free = k == i || k == j || !overlap(rectangles_[k], both);
                if (!free) continue;
                least = waste;
                best_i = i;
                best_j = j;
            }
        if (least > most) return;
        rectangles_[best_i] = around(rectangles_[best_i], rectangles_[best_j]);
        rectangles_.erase(rectangles_.begin() + static_cast<std::ptrdiff_t>(best_j));
    }
}

}  // namespace fovea::density
