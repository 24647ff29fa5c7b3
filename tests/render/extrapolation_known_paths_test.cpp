// Known motion: where paths lead that bend, and what stands where no source shows anything.
#include <gtest/gtest.h>

#include "render/extrapolation/path_bend.hpp"
#include "tests/render/extrapolation_engine.hpp"

using namespace fovea::render::extrapolation;
using fovea::test::engine;
using fovea::test::kInf;
using fovea::test::kNan;
using fovea::test::noise;
using fovea::test::Picture;
using fovea::test::psnr;
using fovea::test::run;

namespace {

struct Buffers {
    Buffers(int w, int h, float u, float v) : width(w), height(h), motion(2 * static_cast<std::size_t>(w * h)), ahead(motion.size()), depth(motion.size() / 2, 5.0f) {
        for (std::size_t i = 0; i < motion.size(); i += 2) {
            motion[i] = u;
            motion[i + 1] = v;
        }
    }
    [[nodiscard]] KnownMotion view() const { return {motion.data(), depth.data(), width, height}; }
    [[nodiscard]] KnownMotion view_ahead() const { return {motion.data(), depth.data(), width, height, ahead.data()}; }
    int width, height;
    std::vector<float> motion, ahead, depth;
};

// A camera that turns by `yaw` per frame, 90 degrees wide: where what is seen at x, y was, and will be.
constexpr float kYaw_rad = 0.03f;
void turned(float x, float y, int size, float angle, float& to_x, float& to_y) {
    const float f = 0.5f * static_cast<float>(size), c = f - 0.5f, dx = (x - c) / f, dy = (y - c) / f;
    const float along = dx * std::cos(angle) + std::sin(angle), depth = std::cos(angle) - dx * std::sin(angle);
    to_x = c + f * along / depth;
    to_y = c + f * dy / depth;
}
Buffers turning(int size, float factor) {
    Buffers b(size, size, 0, 0);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const auto at = 2 * static_cast<std::size_t>(y * size + x);
            const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
            float px, py;
            turned(fx, fy, size, -kYaw_rad, px, py);
            b.motion[at] = fx - px;
            b.motion[at + 1] = fy - py;
            turned(fx, fy, size, factor * kYaw_rad, px, py);
            b.ahead[at] = px - fx;
            b.ahead[at + 1] = py - fy;
        }
    return b;
}
// What the turning camera sees at `time`.
Picture seen(int size, float time) {
    Picture p(size, size, Format::rgba8);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            float u, v;
            turned(static_cast<float>(x), static_cast<float>(y), size, -time * kYaw_rad, u, v);
            p.set(x, y, {noise(u, v, 1), noise(u, v, 2), noise(u, v, 3), 1});
        }
    return p;
}

TEST(PathBend, OfATurnSaysHowFarEachPathLeavesTheStraightOne) {
    constexpr int kSize = 512;
    for (const float factor : {0.5f, 1.0f, -0.5f}) {
        const Buffers b = turning(kSize, factor);
        const PathBend bend = fit_path_bend(b.motion.data(), kSize, kSize, 128);
        float straight = 0, bent = 0;
        for (int y = 8; y < kSize; y += 31)
            for (int x = 8; x < kSize; x += 31) {
                const auto at = 2 * static_cast<std::size_t>(y * kSize + x);
                const float u = b.motion[at], v = b.motion[at + 1], k = 0.5f * factor * (1 + factor);
                const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
                const auto along = [&](const float (&g)[2][3]) { return k * ((g[0][0] + g[0][1] * fx + g[0][2] * fy) * u + (g[1][0] + g[1][1] * fx + g[1][2] * fy) * v); };
                straight = std::max(straight, std::hypot(b.ahead[at] - factor * u, b.ahead[at + 1] - factor * v));
                bent = std::max(bent, std::hypot(b.ahead[at] - factor * u - along(bend.u), b.ahead[at + 1] - factor * v - along(bend.v)));
            }
        EXPECT_LT(bent, 0.15f * straight) << factor << ": " << straight << " px if straight";
    }
}

TEST(PathBend, WhatMovesBeforeAStillRoomBendsNothing) {
    constexpr int kSize = 256;
    Buffers b(kSize, kSize, 0, 0);
    for (int y = 40; y < 130; ++y)
        for (int x = 60; x < 150; ++x) b.motion[2 * static_cast<std::size_t>(y * kSize + x)] = 12;
    for (int x = 0; x < kSize; ++x) b.motion[2 * static_cast<std::size_t>(200 * kSize + x)] = x % 3 == 0 ? kNan : kInf;
    const PathBend bend = fit_path_bend(b.motion.data(), kSize, kSize, 64);
    for (const auto* g : {&bend.u, &bend.v})
        for (const auto& axis : *g) EXPECT_LT(std::fabs(axis[0] + axis[1] * 105 + axis[2] * 85), 0.001f);   // 12 px are bent by less than 0.005
}

TEST(KnownMotion, OfATurnLeadsAsFarAsThePathAheadDoes) {
    constexpr int kSize = 384;
    const Buffers b = turning(kSize, 0.5f);
    const Picture src1 = seen(kSize, 0), src2 = seen(kSize, 1), truth = seen(kSize, 1.5f);
    Picture out(src2), ahead(src2);
    auto e = engine();
    const KnownMotion motion = b.view(), with_ahead = b.view_ahead();
    ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
    ASSERT_EQ(run(e, src1, src2, ahead, 0.5f, {.motion = &with_ahead}), Outcome::ok);
    EXPECT_GT(psnr(ahead, truth, 16), 44);
    EXPECT_GT(psnr(out, truth, 16), psnr(ahead, truth, 16) - 0.3);
}

// Stripes that run slantwise out of the picture.
Picture stripes(Format format, float moved_x, float moved_y) {
    Picture p(160, 120, format);
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x) {
            const float v = 0.5f + 0.4f * std::sin(0.25f * (static_cast<float>(x) - moved_x) + 0.35f * (static_cast<float>(y) - moved_y));
            p.set(x, y, {v, 0.8f * v, 0.3f, 1});
        }
    return p;
}

TEST(KnownMotion, WhatComesIntoViewContinuesTheLinesAtTheBorder) {
    struct Way {
        float u, v;
        int x0, y0, x1, y1;   // what comes into view
    };
    for (const Format format : {Format::rgba8, Format::rgba32f})
        for (const Way& way : {Way{12, 0, 0, 20, 6, 100}, Way{-12, 0, 154, 20, 160, 100}, Way{0, 12, 20, 0, 140, 6}, Way{0, -12, 20, 114, 140, 120}}) {
            const Picture src1 = stripes(format, 0, 0), src2 = stripes(format, way.u, way.v), truth = stripes(format, 1.5f * way.u, 1.5f * way.v);
            Picture out(src2);
            const Buffers b(160, 120, way.u, way.v);
            const KnownMotion motion = b.view();
            auto e = engine();
            ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
            float most = 0;
            for (int y = way.y0; y < way.y1; ++y)
                for (int x = way.x0; x < way.x1; ++x) {
                    const auto value = [&](const Picture& p) {
                        if (format == Format::rgba8) return static_cast<float>(std::to_integer<int>(p.at(x, y)[0])) / 255;
                        float v;
                        std::memcpy(&v, p.at(x, y), 4);
                        return v;
                    };
                    most = std::max(most, std::fabs(value(out) - value(truth)));
                }
            EXPECT_LT(most, 0.08f) << format_name(format) << " " << way.u << " " << way.v << ": up to 0.7 if the last pixels are repeated";
        }
}

TEST(KnownMotion, WhatNoSourceShowsIsTheRimOfWhatLiesBehindAndNotItsMirrorImage) {
    // A box wider than its motion before a slope of light: nothing has shown yet what it uncovers.
    constexpr int kWidth = 160, kHeight = 64;
    const auto picture = [&](int left) {
        Picture p(kWidth, kHeight, Format::rgba8);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const float v = static_cast<float>(x) / 200;
                if (x >= left && x < left + 50)
                    p.set(x, y, {0.9f, 0.1f, 0.1f, 1});
                else
                    p.set(x, y, {v, v, v, 1});
            }
        return p;
    };
    const Picture src1 = picture(40), src2 = picture(56);
    Picture out(src2);
    Buffers b(kWidth, kHeight, 0, 0);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 56; x < 106; ++x) {
            b.motion[2 * static_cast<std::size_t>(y * kWidth + x)] = 16;
            b.depth[static_cast<std::size_t>(y * kWidth + x)] = 2;
        }
    const KnownMotion motion = b.view();
    auto e = engine();
    ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 56; x < 64; ++x) ASSERT_NEAR(std::to_integer<int>(out.at(x, y)[1]), std::to_integer<int>(src2.at(55, y)[1]), 1) << x << " " << y;
}

TEST(KnownMotion, AFrontLeavesNothingOfItsEdgeBehind) {
    // A box with blended edges before a slower background: its trailing edge uncovers a pixel or two, and what lay beside it is mixed.
    constexpr int kWidth = 128, kHeight = 48;
    const auto picture = [&](float time) {
        Picture p(kWidth, kHeight, Format::rgba8);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const auto fx = static_cast<float>(x);
                const float left = 20.3f - 4.3f * time, right = 80.4f + 0.07f * static_cast<float>(y) - 4.3f * time;
                const float cover = std::clamp(std::min(right, fx + 1) - std::max(left, fx), 0.0f, 1.0f);
                const float back = 0.1f + 0.1f * noise(fx + 1.6f * time, static_cast<float>(y), 3);
                p.set(x, y, {back + cover * (0.9f - back), back, back, 1});
            }
        return p;
    };
    const Picture src1 = picture(0), src2 = picture(1), truth = picture(1.5f);
    Picture out(src2);
    Buffers b(kWidth, kHeight, -1.6f, 0);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            if (static_cast<float>(x) + 0.5f >= 16.0f && static_cast<float>(x) + 0.5f < 76.1f + 0.07f * static_cast<float>(y)) {
                b.motion[2 * static_cast<std::size_t>(y * kWidth + x)] = -4.3f;
                b.depth[static_cast<std::size_t>(y * kWidth + x)] = 2;
            }
    const KnownMotion motion = b.view();
    auto e = engine();
    ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
    int behind = 0;
    for (int y = 4; y < kHeight - 4; ++y)
        for (int x = 50; x < 100; ++x) {   // from one pixel behind the edge on
            const auto edge = static_cast<int>(std::ceil(80.4f + 0.07f * static_cast<float>(y) - 6.45f));
            if (x > edge) behind = std::max(behind, std::to_integer<int>(out.at(x, y)[0]) - std::to_integer<int>(truth.at(x, y)[0]));
        }
    EXPECT_LT(behind, 32) << "levels of the box's red in what lies behind it";
}

// Noise that moves by 4 px per frame under a light of its own.
template <class Light>
Picture lit(Format format, float time, const Light& light) {
    Picture p(192, 160, format);
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x) {
            const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
            const float shade = light(fx, fy, time), v = 0.2f + 0.3f * noise(fx - 4 * time, fy, 5);
            p.set(x, y, {v + shade, v + shade, 0.8f * v + shade, 1});
        }
    return p;
}

TEST(KnownMotion, AHighlightThatSlidesOverASurfaceGoesOnSliding) {
    const auto highlight = [](float x, float y, float time) {
        const float dx = x - 90 + 2 * time, dy = y - 80 - 2 * time;
        return 0.3f * std::exp(-(dx * dx + dy * dy) / (2 * 12 * 12));
    };
    const Buffers b(192, 160, 4, 0);
    const KnownMotion motion = b.view();
    for (const Format format : {Format::rgba8, Format::rgb8}) {
        const Picture src1 = lit(format, 0, highlight), src2 = lit(format, 1, highlight), truth = lit(format, 1.5f, highlight);
        Picture out(src2), portable(src2);
        auto e = engine(), other = engine(Preset::balanced, 3, false);
        ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
        ASSERT_EQ(run(other, src1, src2, portable, 0.5f, {.motion = &motion}), Outcome::ok);
        EXPECT_EQ(out, portable) << format_name(format) << ": whatever the code path and the number of threads";
        EXPECT_GT(psnr(out, truth, 16), 38) << format_name(format) << ": 36 if the mean of both sources is shown";
    }
}

TEST(KnownMotion, AShadowsEdgeIsNotMadeDarkerThanTheShadow) {
    // It goes on over a surface that moves otherwise: between its place in src1 and in src2 the light has fallen once, and stays.
    const auto shadow = [](float x, float, float time) { return x < 60 + 11 * time ? -0.15f : 0.0f; };
    const Buffers b(192, 160, 4, 0);
    const KnownMotion motion = b.view();
    const Picture src1 = lit(Format::rgba8, 0, shadow), src2 = lit(Format::rgba8, 1, shadow);
    const Picture lightless = lit(Format::rgba8, 1.5f, [](float, float, float) { return -0.15f; });
    Picture out(src2);
    auto e = engine();
    ASSERT_EQ(run(e, src1, src2, out, 0.5f, {.motion = &motion}), Outcome::ok);
    int darker = 0;
    for (int y = 8; y < 152; ++y)
        for (int x = 16; x < 176; ++x) darker = std::max(darker, std::to_integer<int>(lightless.at(x, y)[1]) - std::to_integer<int>(out.at(x, y)[1]));
    EXPECT_LT(darker, 8) << "levels of 38 by which the light fell";
}

}  // namespace
