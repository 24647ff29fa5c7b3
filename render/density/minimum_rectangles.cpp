#include "render/density/minimum_rectangles.hpp"

#include <algorithm>

namespace fovea::density {
namespace {

// Of a bin: a cut along its left edge, along its lower edge; the grid point at its lower left is an end of a chord that is cut.
constexpr std::uint8_t kLeft = 1, kBelow = 2, kSettled = 4;

}  // namespace

MinimumRectangles::MinimumRectangles(int columns, int rows) : columns_(static_cast<std::uint32_t>(columns)), rows_(static_cast<std::uint32_t>(rows)) {
    const std::size_t bins = std::size_t{columns_} * rows_, chords = bins / 2 + 1;
    corners_.reserve(bins);
    across_.reserve(chords);
    upward_.reserve(chords);
    reached_.reserve(chords);
    queue_.reserve(chords);
    upward_at_.assign(bins, kNone);
    cuts_.assign(bins, 0);
}

void MinimumRectangles::make(std::span<const std::uint8_t> levels, int level_count, std::span<BinRect> out,
                             std::array<std::size_t, kMaxLevels + 1>& first) noexcept {
    std::fill(cuts_.begin(), cuts_.end(), std::uint8_t{0});
    find_chords(levels);
    match();
    cut_chords();
    cut_corners(levels);
    std::size_t n = 0;
    first[0] = 0;
    for (int level = 0; level < level_count; ++level) {
        // A bin is the lower left of a rectangle when the level or a cut ends both to its left and below it.
        for (std::uint32_t y = 0, bin = 0; y < rows_; ++y)
            for (std::uint32_t x = 0; x < columns_; ++x, ++bin) {
                if (levels[bin] != level) continue;
                if (x > 0 && levels[bin - 1] == level && !(cuts_[bin] & kLeft)) continue;
                if (y > 0 && levels[bin - columns_] == level && !(cuts_[bin] & kBelow)) continue;
                std::uint32_t x1 = x + 1, y1 = y + 1;
                while (x1 < columns_ && levels[bin + x1 - x] == level && !(cuts_[bin + x1 - x] & kLeft)) ++x1;
                for (std::uint32_t up = bin + columns_; y1 < rows_ && levels[up] == level && !(cuts_[up] & kBelow); up += columns_) ++y1;
                out[n++] = {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(x1), static_cast<std::uint16_t>(y1)};
            }
        first[static_cast<std::size_t>(level) + 1] = n;
    }
}

// A chord is found from its left or lower end: a walk along edges with the level on both sides. Where that ends with the
// level on one side only, the end is concave too.
void MinimumRectangles::find_chords(std::span<const std::uint8_t> levels) noexcept {
    corners_.clear();
    across_.clear();
    upward_.clear();
    reached_.clear();
    const auto walk = [&](std::uint32_t at, std::uint32_t steps, std::uint32_t step, std::uint32_t aside, std::uint8_t level) -> std::uint32_t {
        for (std::uint32_t n = 0; n < steps; ++n, at += step) {
            const bool here = levels[at] == level, there = levels[at - aside] == level;
            if (!(here && there)) return here || there ? n : 0;
        }
        return 0;   // the edge of the grid
    };
    for (std::uint32_t y = 1; y < rows_; ++y)
        for (std::uint32_t x = 1, at = y * columns_ + 1; x < columns_; ++x, ++at) {
            const std::uint8_t right_up = levels[at], left_up = levels[at - 1], right_down = levels[at - columns_], left_down = levels[at - columns_ - 1];
            // Concave: three are the same level and the fourth is not.
            const bool rising = left_down == right_up, falling = left_up == right_down;
            if (rising == falling) continue;   // none, or both: and then all four are the same or it is a checkerboard
            const std::uint8_t level = rising ? right_up : left_up;
            const bool first = (rising ? left_up : left_down) == level, second = (rising ? right_down : right_up) == level;
            if (first == second) continue;     // two only, at a diagonal
            const bool right = !first, up = rising ? first : second;   // missing at the left: the cut goes right; missing below: up
            corners_.push_back({at, right});
            if (right)
                if (const std::uint32_t n = walk(at, columns_ - x, 1, columns_, level)) across_.push_back({at, n, kNone});
            if (up)
                if (const std::uint32_t n = walk(at, rows_ - y, columns_, 1, level)) {
                    for (std::uint32_t i = 0, p = at; i <= n; ++i, p += columns_) upward_at_[p] = static_cast<std::uint32_t>(upward_.size());
                    upward_.push_back({at, n, kNone});
                    reached_.push_back({round_, kNone});
                }
        }
}

// Rounds over all horizontal chords that are alone; what one search of a round has reached in vain is not searched again.
// The last round finds nothing: what it has reached is all that can be reached from a chord without a mate.
void MinimumRectangles::match() noexcept {
    for (bool more = true; more;) {
        more = false;
        ++round_;
        for (std::uint32_t h = 0; h < across_.size(); ++h)
            if (across_[h].mate == kNone && extend(h)) more = true;
    }
}

bool MinimumRectangles::extend(std::uint32_t start) noexcept {
    queue_.clear();
    queue_.push_back(start);
    for (std::size_t i = 0; i < queue_.size(); ++i) {
        const std::uint32_t h = queue_[i], end = across_[h].from + across_[h].length;
        for (std::uint32_t at = across_[h].from; at <= end; ++at) {
            const std::uint32_t v = upward_at_[at];
            if (v == kNone || reached_[v].round == round_) continue;
            reached_[v] = {round_, h};
            if (upward_[v].mate != kNone) {
                queue_.push_back(upward_[v].mate);
                continue;
            }
            for (std::uint32_t free = v;;) {
                const std::uint32_t by = reached_[free].by, before = across_[by].mate;
                upward_[free].mate = by;
                across_[by].mate = free;
                if (by == start) return true;
                free = before;
            }
        }
    }
    return false;
}

// Koenig: the horizontal chords that the last round has searched and the vertical ones that it has not reached.
void MinimumRectangles::cut_chords() noexcept {
    for (const Chord& c : across_) {
        if (c.mate != kNone && reached_[c.mate].round != round_) continue;
        for (std::uint32_t i = 0; i < c.length; ++i) cuts_[c.from + i] |= kBelow;
        cuts_[c.from] |= kSettled;
        cuts_[c.from + c.length] |= kSettled;
    }
    for (std::uint32_t v = 0; v < upward_.size(); ++v) {
        const Chord& c = upward_[v];
        const std::uint32_t end = c.from + c.length * columns_;
        for (std::uint32_t at = c.from; at <= end; at += columns_) upward_at_[at] = kNone;
        if (reached_[v].round == round_) continue;
        for (std::uint32_t at = c.from; at < end; at += columns_) cuts_[at] |= kLeft;
        cuts_[c.from] |= kSettled;
        cuts_[end] |= kSettled;
    }
}

// All of these are horizontal and end at a vertical chord or the level's edge: their order does not matter.
void MinimumRectangles::cut_corners(std::span<const std::uint8_t> levels) noexcept {
    for (const Corner& c : corners_) {
        if (cuts_[c.at] & kSettled) continue;
        const std::uint8_t level = c.right ? levels[c.at] : levels[c.at - 1];   // the cut's side is of the level above and below
        std::uint32_t x = c.at % columns_;
        for (std::uint32_t at = c.at;;) {
            const std::uint32_t bin = c.right ? at : at - 1;   // above the next edge
            if (levels[bin] != level || levels[bin - columns_] != level) break;
            cuts_[bin] |= kBelow;
            c.right ? ++at : --at;
            c.right ? ++x : --x;
            if (x == 0 || x == columns_ || ((cuts_[at] | cuts_[at - columns_]) & kLeft)) break;
        }
    }
}

}  // namespace fovea::density
