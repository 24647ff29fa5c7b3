#include <gtest/gtest.h>

#include <algorithm>

#include "render/extrapolation/projection.hpp"
#include "tests/render/extrapolation_engine.hpp"

using namespace fovea::render::extrapolation;
using fovea::test::engine;
using fovea::test::kInf;
using fovea::test::kNan;
using fovea::test::moved_noise;
using fovea::test::Picture;
using fovea::test::psnr;
using fovea::test::run;

namespace {

// A buffer of motion and depth, one entry per pixel: a still background at depth 10.
struct Known {
    Known(int w, int h) : width(w), height(h), motion(2 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h)), depth(motion.size() / 2, 10.0f) {}
    void set(int x, int y, float u, float v, float z) {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
        motion[2 * at] = u;
        motion[2 * at + 1] = v;
        depth[at] = z;
    }
    [[nodiscard]] KnownMotion view() const { return {motion.data(), depth.data(), width, height}; }
    int width, height;
    std::vector<float> motion, depth;
};

// An upright bar from `left` to `right`, its edges blended as a renderer's antialiasing does, before a still background.
Picture bar_at(int w, int h, float left, float right) {
    Picture p(w, h, Format::rgba8);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const auto at = static_cast<float>(x);
            const float cover = std::clamp(std::min(right, at + 1) - std::max(left, at), 0.0f, 1.0f);
            const float back = 0.1f + 0.2f * fovea::test::noise(at, static_cast<float>(y), 3);
            p.set(x, y, {back + cover * (0.95f - back), back + cover * (0.2f - back), back * (1 - cover), 1});
        }
    return p;
}
Known bar_motion(int w, int h, float left, float right, float u) {
    Known k(w, h);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            if (static_cast<float>(x) + 0.5f >= left && static_cast<float>(x) + 0.5f < right) k.set(x, y, u, 0, 2);
    return k;
}
int level(const Picture& p, int x, int y, int channel) { return std::to_integer<int>(p.at(x, y)[channel]); }

TEST(KnownMotion, DepthMayComeAndGoBetweenFramesOfOneSize) {
    const Picture a = bar_at(96, 64, 30, 50), b = bar_at(96, 64, 36, 56);
    const Known known = bar_motion(96, 64, 36, 56, 6);
    const KnownMotion with_depth = known.view(), without{known.motion.data(), nullptr, 96, 64};
    Picture out(96, 64, Format::rgba8), fresh(out);
    auto e = engine(), other = engine();
    ASSERT_EQ(run(other, a, b, fresh, 0.5f, {.motion = &without}), Outcome::ok);
    for (const KnownMotion* motion : {&with_depth, &without, &with_depth, &without}) ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = motion}), Outcome::ok);
    EXPECT_EQ(out, fresh);
}

TEST(KnownMotion, CarriesWhatIsInFrontOverWhatIsBehind) {
    // Stripes that match everywhere, so that the pictures alone say nothing: only the known motion can move them.
    constexpr int kSize = 96;
    Picture a(kSize, kSize, Format::rgba8), b(a), out(a);
    std::vector<float> motion(2 * kSize * kSize), depth(kSize * kSize, 10.0f);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const bool front = x >= 30 && x < 50 && y >= 30 && y < 60;
            a.set(x, y, {0.1f, 0.1f, 0.1f, 1});
            b.set(x, y, front ? std::array<float, 4>{1, 0.5f, 0, 1} : std::array<float, 4>{0.2f, static_cast<float>(x) / kSize, 0.2f, 1});
            if (!front) continue;
            motion[static_cast<std::size_t>(2 * (y * kSize + x))] = 16;
            depth[static_cast<std::size_t>(y * kSize + x)] = 2;
        }
    auto e = engine();
    const KnownMotion known{motion.data(), depth.data(), kSize, kSize};
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &known}), Outcome::ok);
    for (int x = 38; x < 58; ++x) EXPECT_EQ(std::memcmp(out.at(x, 45), b.at(40, 45), 4), 0) << x;   // carried on by 8
    for (int x = 30; x < 38; ++x) EXPECT_NE(std::memcmp(out.at(x, 45), b.at(40, 45), 4), 0) << x << " must show what lies behind";
    EXPECT_EQ(std::memcmp(out.at(80, 45), b.at(80, 45), 4), 0);
}

TEST(KnownMotion, ThatIsNoNumberStandsStill) {
    const Picture a = moved_noise(64, 64, Format::rgba8, 0, 0), b = moved_noise(64, 64, Format::rgba8, 3, 0);
    Picture out(64, 64, Format::rgba8);
    std::vector<float> motion(2 * 16 * 16), depth(16 * 16, kNan);
    for (std::size_t i = 0; i < motion.size(); ++i) motion[i] = i % 3 == 0 ? kNan : i % 3 == 1 ? kInf : -1e38f;
    auto e = engine();
    const KnownMotion known{motion.data(), depth.data(), 16, 16};
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &known}), Outcome::ok);
    EXPECT_EQ(out, b);
}

TEST(KnownMotion, AnEdgeKeepsItsAntialiasing) {
    // 2.6 pixels wide, moved by half a pixel's fraction: with hard edges it would be 3 pixels wide, and leave a trace behind.
    const Picture a = bar_at(96, 32, 30.6f, 33.2f), b = bar_at(96, 32, 35.6f, 38.2f), truth = bar_at(96, 32, 38.1f, 40.7f);
    const Known known = bar_motion(96, 32, 35.6f, 38.2f, 5);
    const KnownMotion motion = known.view();
    Picture out(96, 32, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    EXPECT_GT(psnr(out, truth), 36);
}

TEST(KnownMotion, AnEdgeThatLandsBetweenPixelsCoversAPartOfBothWhicheverWayItsDepthSlopes) {
    const Picture a = bar_at(96, 32, 30.2f, 40.2f), b = bar_at(96, 32, 35, 45), truth = bar_at(96, 32, 37.4f, 47.4f);
    for (const float slope : {0.0f, 0.01f, -0.01f}) {
        Known known = bar_motion(96, 32, 35, 45, 4.8f);
        for (int y = 0; y < 32; ++y)   // the nearest neighbour of what lies beside the bar is across a corner
            for (int x = 35; x < 45; ++x) known.set(x, y, 4.8f, 0, 2 + slope * static_cast<float>(y));
        const KnownMotion motion = known.view();
        Picture out(96, 32, Format::rgba8);
        auto e = engine();
        ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
        int most = 0;
        for (int y = 4; y < 28; ++y)
            for (int x = 46; x < 50; ++x) most = std::max(most, std::abs(level(out, x, y, 0) - level(truth, x, y, 0)));
        EXPECT_LT(most, 16) << "levels of 180, slope " << slope;
    }
}

// A box of one colour before stripes across: whole pixels, nothing blended.
Picture box_before_stripes(int left, int top, int right, int bottom) {
    Picture p(128, 96, Format::rgba8);
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 128; ++x) {
            const bool box = x >= left && x < right && y >= top && y < bottom;
            const float stripe = x % 7 < 3 ? 0.1f : 0.45f;
            p.set(x, y, box ? std::array{0.9f, 0.2f, 0.1f, 1.0f} : std::array{stripe, stripe, 0.8f, 1.0f});
        }
    return p;
}

TEST(KnownMotion, WhatLiesBesideAnEdgeAndHoldsNothingOfTheFrontStaysBehind) {
    const Picture a = box_before_stripes(30, 20, 50, 70), b = box_before_stripes(36, 20, 56, 70), truth = box_before_stripes(39, 20, 59, 70);
    Known known(128, 96);
    for (int y = 20; y < 70; ++y)
        for (int x = 36; x < 56; ++x) known.set(x, y, 6, 0, 2);
    const KnownMotion motion = known.view();
    Picture out(128, 96, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    for (int y = 24; y < 66; ++y)
        for (int x = 57; x < 62; ++x) ASSERT_NEAR(level(out, x, y, 0), level(truth, x, y, 0), 2) << x << " " << y;
}

TEST(KnownMotion, AHoleBeforeAFloorThatSlopesAwayTakesTheNearestOfIt) {
    // The box goes up and leaves the floor below; what lies beside the box is a little further away than that.
    const Picture a = box_before_stripes(40, 38, 90, 60), b = box_before_stripes(40, 30, 90, 52), truth = box_before_stripes(40, 26, 90, 48);
    Known known(128, 96);
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 128; ++x) known.set(x, y, 0, 0, 10 - 0.02f * static_cast<float>(y));
    for (int y = 30; y < 52; ++y)
        for (int x = 40; x < 90; ++x) known.set(x, y, 0, -8, 2);
    const KnownMotion motion = known.view();
    Picture out(128, 96, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    for (int y = 48; y < 52; ++y)
        for (int x = 48; x < 82; ++x) ASSERT_NEAR(level(out, x, y, 0), level(truth, x, y, 0), 2) << x << " " << y;
}

TEST(Projection, ASurfaceThatGrowsTearsOpenAndIsClosedWithItself) {
    // Grown by a fifth, one column in six is landed on by nothing. Rows of a still background are near enough to be chosen
    // for these, since they lie behind.
    constexpr int kWidth = 120, kHeight = 48;
    std::vector<float> u(kWidth * kHeight), v(u.size());
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            if (y % 12 >= 7) u[static_cast<std::size_t>(y * kWidth + x)] = 0.2f * static_cast<float>(x - 60);
    Projection projection;
    projection.resize(kWidth, kHeight);
    projection.run({u.data(), v.data(), 1, 1.0f}, 1, 100);
    EXPECT_GT(projection.filled_fraction(), 0.05f) << "nothing is torn: nothing is tested";
    for (int y = 19; y < 24; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const float from = (static_cast<float>(x) + 12) / 1.2f;
            ASSERT_NEAR(projection.displacement().u[static_cast<std::size_t>(y * kWidth + x)], from - static_cast<float>(x), 0.3f) << x << " " << y;
        }
}

TEST(KnownMotion, WhatAThinThingUncoversIsTakenFromTheOtherSource) {
    const Picture a = bar_at(96, 32, 20, 23), b = bar_at(96, 32, 32, 35), truth = bar_at(96, 32, 38, 41);
    const Known known = bar_motion(96, 32, 32, 35, 12);
    const KnownMotion motion = known.view();
    Picture out(96, 32, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    for (int y = 0; y < 32; ++y)
        for (int x = 32; x < 35; ++x) ASSERT_EQ(std::memcmp(out.at(x, y), truth.at(x, y), 4), 0) << x << " " << y;
}

TEST(KnownMotion, WhatTheMoverHidesInTheOtherSourceIsNotTakenFromThere) {
    const Picture a = bar_at(128, 32, 20, 60), b = bar_at(128, 32, 32, 72);   // wider than its motion
    const Known known = bar_motion(128, 32, 32, 72, 12);
    const KnownMotion motion = known.view();
    Picture out(128, 32, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    for (int y = 0; y < 32; ++y)
        for (int x = 32; x < 36; ++x) ASSERT_LT(level(out, x, y, 0), 100) << x << " " << y << ": the bar's own red";
}

TEST(KnownMotion, TwoSourcesThatSayTheSameAreAveraged) {
    const auto lit = [](float x, float light) {
        Picture p = moved_noise(128, 96, Format::rgba8, x, 0);
        for (std::size_t i = 0; i < p.bytes.size(); ++i)
            if (i % 4 != 3) p.bytes[i] = static_cast<std::byte>(std::lround(static_cast<float>(std::to_integer<int>(p.bytes[i])) * 0.8f * light));
        return p;
    };
    const Picture a = lit(0, 1.05f), b = lit(4, 0.95f), truth = lit(6, 1);
    Known known(128, 96);
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 128; ++x) known.set(x, y, 4, 0, 5);
    const KnownMotion motion = known.view();
    for (const Format f : {Format::rgba8, Format::rgba32f}) {
        Picture p(128, 96, f), q(p), out(p), wanted(p);
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 128; ++x) {
                const auto value = [&](const Picture& from) {
                    std::array<float, 4> v{};
                    for (int c = 0; c < 4; ++c) v[static_cast<std::size_t>(c)] = static_cast<float>(level(from, x, y, c)) / 255;
                    return v;
                };
                p.set(x, y, value(a));
                q.set(x, y, value(b));
                wanted.set(x, y, value(truth));
            }
        auto e = engine();
        ASSERT_EQ(run(e, p, q, out, 0.5f, {.motion = &motion}), Outcome::ok);
        EXPECT_TRUE(e.report().used_both);
        double off = 0;
        for (int y = 8; y < 88; ++y)
            for (int x = 16; x < 112; ++x) {
                if (f == Format::rgba8) {
                    off += std::abs(level(out, x, y, 0) - level(wanted, x, y, 0)) / 255.0;
                    continue;
                }
                float is, should;
                std::memcpy(&is, out.at(x, y), 4);
                std::memcpy(&should, wanted.at(x, y), 4);
                off += static_cast<double>(std::fabs(is - should));
            }
        EXPECT_LT(off / (80 * 96), 0.004) << format_name(f) << ": src2 alone is 0.02 off";
    }
}

TEST(KnownMotion, AfterACutOnlyTheLastFrameIsCarriedOn) {
    const Picture a = moved_noise(128, 96, Format::rgba8, 0, 0, 900), b = moved_noise(128, 96, Format::rgba8, 4, 0);
    Known known(128, 96);
    std::vector<float> ahead(known.motion.size());
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 128; ++x) {
            known.set(x, y, 4, 0, 5);
            ahead[static_cast<std::size_t>(2 * (y * 128 + x))] = 2;
        }
    const KnownMotion motion = known.view(), alone{nullptr, known.depth.data(), 128, 96, ahead.data()};
    Picture out(128, 96, Format::rgba8), without(out);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    EXPECT_FALSE(e.report().used_both);
    ASSERT_EQ(run(e, a, b, without, 0.5f, {.motion = &alone}), Outcome::ok);
    EXPECT_EQ(out, without);
    EXPECT_GT(psnr(out, moved_noise(128, 96, Format::rgba8, 6, 0), 8), 35);
}

TEST(KnownMotion, TheFrameIsTheSameWhateverCameBefore) {
    // Small pictures whose motion carries most of them out of sight: holes that nothing surrounds, of every size of cell.
    std::uint32_t state = 1;
    const auto below = [&](std::uint32_t n) { return static_cast<int>((state = state * 1664525u + 1013904223u) >> 8) % static_cast<int>(n); };
    auto used = engine();
    int both = 0;
    for (int trial = 0; trial < 120; ++trial) {
        const int cell = 2 << below(3), w = 65, h = 63;
        const auto u = static_cast<float>(below(33) - 16), v = static_cast<float>(below(33) - 16);
        Known known((w + cell - 1) / cell, (h + cell - 1) / cell);
        for (int y = 0; y < known.height; ++y)
            for (int x = 0; x < known.width; ++x) known.set(x, y, u, v, static_cast<float>(1 + x / 5 % 3));
        for (int n = below(8); n > 0; --n) known.set(below(static_cast<std::uint32_t>(known.width)), below(static_cast<std::uint32_t>(known.height)), static_cast<float>(below(40) - 20), n % 2 == 0 ? 1e9f : 5, 0.5f);
        std::vector<float> ahead = known.motion;
        std::ranges::reverse(ahead);
        KnownMotion motion = known.view();
        if (below(2) == 0) motion.ahead_px = ahead.data();
        const Picture a = moved_noise(w, h, Format::rgb8, 0, 0), b = moved_noise(w, h, Format::rgb8, u, v);
        Picture out(w, h, Format::rgb8), again(out);
        const float factor = trial % 3 == 0 ? 3.0f : trial % 3 == 1 ? 1.0f : 0.5f;
        auto fresh = engine();
        ASSERT_EQ(run(used, a, b, out, factor, {.motion = &motion}), Outcome::ok);
        ASSERT_EQ(run(fresh, a, b, again, factor, {.motion = &motion}), Outcome::ok);
        both += used.report().used_both ? 1 : 0;
        ASSERT_EQ(out, again) << "trial " << trial << ", cells of " << cell;
    }
    EXPECT_GT(both, 10);
}

TEST(KnownMotion, InfinitiesAndNansOfEitherSourceStayWhereTheyAre) {
    Picture a = moved_noise(64, 48, Format::rgba32f, 0, 0), b = moved_noise(64, 48, Format::rgba32f, 4, 0);
    a.set(20, 20, {kNan, kInf, 0, 1});
    a.set(40, 30, {0, 0, -kInf, 1});
    b.set(30, 12, {kNan, 0, 0, 1});
    Known known(64, 48);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) known.set(x, y, 4, 0, 5);
    const KnownMotion motion = known.view();
    Picture out(64, 48, Format::rgba32f);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &motion}), Outcome::ok);
    EXPECT_TRUE(e.report().used_both);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            float v[4];
            std::memcpy(v, out.at(x, y), 16);
            const bool finite = std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]) && std::isfinite(v[3]);
            ASSERT_EQ(finite, !(x == 30 && y == 12)) << x << " " << y;
        }
}

TEST(KnownMotion, EveryCellAnySizeAndBothCodePathsGiveTheSameBitsAndStayInTheirRows) {
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 37}, {37, 1}, {9, 2}, {61, 43}, {130, 33}})
        for (const int cell : {1, 2, 4, 8}) {
            const Picture a = moved_noise(w, h, Format::rgba8, 0, 0, 1, 12), b = moved_noise(w, h, Format::rgba8, 5, 2, 1, 12);
            const int columns = (w + cell - 1) / cell, rows = (h + cell - 1) / cell;
            Known known(columns, rows);
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < columns; ++x)
                    (x + y) % 7 == 0 ? known.set(x, y, kNan, 1, kNan) : x > columns / 2 ? known.set(x, y, 5 + 0.1f * static_cast<float>(y), 2, 3) : known.set(x, y, -3, 1e30f, -kInf);
            const KnownMotion motion = known.view();
            for (const float factor : {0.5f, -0.4f, -1.5f, 7.0f}) {
                Picture one(w, h, Format::rgba8, 12), two(one);
                auto e1 = engine(), e2 = engine(Preset::balanced, 3, false);
                ASSERT_EQ(run(e1, a, b, one, factor, {.motion = &motion}), Outcome::ok);
                ASSERT_EQ(run(e2, a, b, two, factor, {.motion = &motion}), Outcome::ok);
                ASSERT_EQ(one, two) << w << "x" << h << " cell " << cell << " factor " << factor;
                for (int y = 0; y < h; ++y)
                    for (int k = 0; k < 12; ++k) ASSERT_EQ(*(one.at(w, y) + k), Picture::kSlack);
            }
        }
}

}  // namespace
