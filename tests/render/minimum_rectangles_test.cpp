#include "render/density/minimum_rectangles.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "render/density/plan.hpp"
#include "tests/render/allocation_count.hpp"

using namespace fovea::density;

namespace {

struct Grid {
    int columns, rows;
    std::vector<std::uint8_t> level;
    [[nodiscard]] int at(int x, int y) const { return level[static_cast<std::size_t>(y * columns + x)]; }
};

// The rectangles of each level; checks that they are of the level, disjoint, ordered and all.
std::array<std::size_t, kMaxLevels> checked(MinimumRectangles& minimum, const Grid& g, int levels) {
    std::vector<BinRect> out(g.level.size());
    std::array<std::size_t, kMaxLevels + 1> first{};
    minimum.make(g.level, levels, out, first);
    std::vector<int> covered(g.level.size());
    std::array<std::size_t, kMaxLevels> count{};
    for (std::size_t l = 0; l < static_cast<std::size_t>(levels); ++l) {
        count[l] = first[l + 1] - first[l];
        for (std::size_t i = first[l]; i < first[l + 1]; ++i) {
            RC_ASSERT(!out[i].empty());
            if (i > first[l]) RC_ASSERT((std::pair(out[i - 1].y0, out[i - 1].x0) < std::pair(out[i].y0, out[i].x0)));
            for (int y = out[i].y0; y < out[i].y1; ++y)
                for (int x = out[i].x0; x < out[i].x1; ++x) {
                    RC_ASSERT(g.at(x, y) == static_cast<int>(l));
                    ++covered[static_cast<std::size_t>(y * g.columns + x)];
                }
        }
    }
    for (const int n : covered) RC_ASSERT(n == 1);
    return count;
}

std::array<std::size_t, kMaxLevels> checked(const Grid& g, int levels) {
    MinimumRectangles minimum(g.columns, g.rows);
    return checked(minimum, g, levels);
}

// Every way to divide the level: the first bin that is free is the lower left of some rectangle.
void divide(const Grid& g, int level, std::uint32_t taken, std::size_t used, std::size_t& best) {
    if (used >= best) return;
    int bin = 0;
    const int bins = g.columns * g.rows;
    while (bin < bins && (g.level[static_cast<std::size_t>(bin)] != level || (taken >> bin & 1))) ++bin;
    if (bin == bins) {
        best = used;
        return;
    }
    const int x0 = bin % g.columns, y0 = bin / g.columns;
    for (int x1 = x0 + 1, most = g.rows; x1 <= g.columns; ++x1) {
        std::uint32_t mask = 0;
        for (int y1 = y0; y1 < most; ++y1) {
            for (int x = x0; x < x1; ++x) {
                const int b = y1 * g.columns + x;
                if (g.at(x, y1) != level || (taken >> b & 1)) {
                    most = y1;
                    break;
                }
                mask |= 1u << b;
            }
            if (y1 >= most) break;
            divide(g, level, taken | mask, used + 1, best);
        }
        if (most == y0) break;
    }
}

// Runs of a row, joined with the run below when that is as long: an upper bound.
std::size_t row_runs(const Grid& g, int level) {
    std::size_t n = 0;
    const auto is = [&](int x, int y) { return x >= 0 && x < g.columns && y >= 0 && g.at(x, y) == level; };
    for (int y = 0; y < g.rows; ++y)
        for (int x = 0; x < g.columns; ++x) {
            if (!is(x, y) || is(x - 1, y)) continue;
            bool same = is(x, y - 1) && !is(x - 1, y - 1);
            for (int i = x; same && is(i, y); ++i) same = is(i + 1, y) == is(i + 1, y - 1);
            n += !same;
        }
    return n;
}

Grid transposed(const Grid& g) {
    Grid t{g.rows, g.columns, {}};
    for (int x = 0; x < g.columns; ++x)
        for (int y = 0; y < g.rows; ++y) t.level.push_back(static_cast<std::uint8_t>(g.at(x, y)));
    return t;
}

Grid of_plan(const Plan& plan) {
    Grid g{plan.columns(), plan.rows(), {}};
    for (int y = 0; y < g.rows; ++y)
        for (int x = 0; x < g.columns; ++x) g.level.push_back(static_cast<std::uint8_t>(plan.level_at(x, y)));
    return g;
}

RC_GTEST_PROP(MinimumRectangles, AreAsFewAsTheBestOfAllDivisions, ()) {
    Grid g{*rc::gen::inRange(1, 7), 0, {}};
    g.rows = *rc::gen::inRange(1, g.columns == 6 ? 5 : 6);
    const int levels = *rc::gen::inRange(2, 4), weight = *rc::gen::inRange(0, 4);   // of level 0: so that regions are large, with holes
    for (int i = g.columns * g.rows; i > 0; --i) g.level.push_back(static_cast<std::uint8_t>(std::max(0, *rc::gen::inRange(-weight, levels))));
    const auto count = checked(g, levels);
    for (int level = 0; level < levels; ++level) {
        std::size_t best = row_runs(g, level) + 1;
        divide(g, level, 0, 0, best);
        RC_ASSERT(count[static_cast<std::size_t>(level)] == best);
    }
}

RC_GTEST_PROP(MinimumRectangles, OfLargeGridsAreAsManyTurnedAndNeverMoreThanRowRuns, ()) {
    Grid g{*rc::gen::inRange(1, 65), *rc::gen::inRange(1, 65), {}};
    const int weight = *rc::gen::inRange(0, 12);
    for (int i = g.columns * g.rows; i > 0; --i) g.level.push_back(1);
    // Boxes over each other: long chords that cross; then single bins.
    for (int n = *rc::gen::inRange(0, 40); n > 0; --n) {
        const int x = *rc::gen::inRange(0, g.columns), y = *rc::gen::inRange(0, g.rows), w = *rc::gen::inRange(1, 20), h = *rc::gen::inRange(1, 20);
        const auto level = static_cast<std::uint8_t>(n % 3);
        for (int j = y; j < std::min(g.rows, y + h); ++j)
            for (int i = x; i < std::min(g.columns, x + w); ++i) g.level[static_cast<std::size_t>(j * g.columns + i)] = level;
    }
    for (int n = weight * 10; n > 0; --n) g.level[static_cast<std::size_t>(*rc::gen::inRange(0, g.columns * g.rows))] = 2;
    const auto count = checked(g, 3);
    RC_ASSERT(count == checked(transposed(g), 3));
    Grid turned = g;
    std::reverse(turned.level.begin(), turned.level.end());
    RC_ASSERT(count == checked(turned, 3));
    for (int level = 0; level < 3; ++level) RC_ASSERT(count[static_cast<std::size_t>(level)] <= std::min(row_runs(g, level), row_runs(transposed(g), level)));
}

TEST(MinimumRectangles, KnownRegions) {
    const auto of = [](int columns, std::string_view bins) {
        Grid g{columns, static_cast<int>(bins.size()) / columns, {}};
        for (const char c : bins) g.level.push_back(c == '#' ? 0 : 1);
        return checked(g, 2)[0];
    };
    EXPECT_EQ(of(3, ".#."
                    "###"
                    ".#."), 3u) << "two chords either way, four in the graph";
    EXPECT_EQ(of(3, "###"
                    "#.#"
                    "###"), 4u) << "a ring";
    EXPECT_EQ(of(4, "#.#."
                    ".#.#"
                    "#.#."), 6u) << "corners that touch join nothing";
    EXPECT_EQ(of(5, "##.##"
                    "##.##"
                    "#####"), 3u) << "the row runs' answer too";
    EXPECT_EQ(of(5, "#####"
                    "#.#.#"
                    "#####"), 5u) << "two holes side by side share their chords";
    EXPECT_EQ(of(4, "##.."
                    "####"
                    "####"
                    "..##"), 2u) << "side by side; three as row runs";
}

TEST(MinimumRectangles, OfPlansAreFewerThanRowRunsAndTheSameOnReuse) {
    auto made = Plan::create({.width_px = 1024, .height_px = 1024});
    ASSERT_TRUE(made.has_value());
    Plan plan = *std::move(made);
    MinimumRectangles reused(plan.columns(), plan.rows());
    std::size_t fewest = 0, runs = 0;
    for (int i = 0; i < 40; ++i) {
        const FocalPoint p[] = {{0.04f * static_cast<float>(i) - 0.8f, 0.3f, 4, 5, 0.2f}, {0.5f, -0.03f * static_cast<float>(i), 6, 6, 0}};
        plan.update(std::span(p).first(i % 2 == 0 ? 1u : 2u));
        const Grid g = of_plan(plan);
        const auto count = checked(reused, g, 3);
        EXPECT_EQ(count, checked(g, 3));
        for (int level = 0; level < 3; ++level) {
            EXPECT_EQ(plan.rectangles(level).size(), count[static_cast<std::size_t>(level)]);
            EXPECT_LE(count[static_cast<std::size_t>(level)], row_runs(g, level));
            fewest += count[static_cast<std::size_t>(level)];
            runs += row_runs(g, level);
        }
    }
    RecordProperty("fewest", static_cast<int>(fewest));
    RecordProperty("row_runs", static_cast<int>(runs));
    EXPECT_LT(fewest, runs);
}

TEST(MinimumRectangles, AreMadeWithoutAllocatingHoweverManyCorners) {
    Grid holes{64, 64, {}};   // each inner grid point is a concave corner of level 0
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) holes.level.push_back(x % 2 == 1 && y % 2 == 1 ? 1 : 0);
    MinimumRectangles minimum(64, 64);
    std::vector<BinRect> out(holes.level.size());
    std::array<std::size_t, kMaxLevels + 1> first{};
    const auto before = fovea::test::allocation_count();
    for (int i = 0; i < 3; ++i) minimum.make(holes.level, 2, out, first);
    EXPECT_EQ(fovea::test::allocation_count(), before);
    // Corners - chords - holes + 1, with 63 x 63 corners of which all but one are the end of a chord, and 31 x 31 holes.
    EXPECT_EQ(first[1], 63u * 63u - (63u * 63u) / 2 - 31u * 31u + 1);
}

}  // namespace
