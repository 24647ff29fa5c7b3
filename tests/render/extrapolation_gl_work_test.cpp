// The shaders work where anything moves, and nowhere else.
#include <algorithm>

#include "tests/render/extrapolation_gl.hpp"

namespace fovea::test {

namespace {

constexpr int kWidth = 330, kHeight = 250;   // no multiples of a tile

// Noise that stands still, but for a rectangle of other noise that has moved by (dx, dy), with its content.
Picture moved_in_part(int x0, int y0, int x1, int y1, int dx, int dy) {
    Picture p = moved_noise(kWidth, kHeight, Format::rgba8, 0, 0), other = moved_noise(kWidth, kHeight, Format::rgba8, static_cast<float>(dx), static_cast<float>(dy), 50);
    for (int y = std::clamp(y0 + dy, 0, kHeight); y < std::clamp(y1 + dy, 0, kHeight); ++y)
        for (int x = std::clamp(x0 + dx, 0, kWidth); x < std::clamp(x1 + dx, 0, kWidth); ++x) std::memcpy(p.at(x, y), other.at(x, y), 4);
    return p;
}

}  // namespace

class ExtrapolationGlWork : public ExtrapolationGl {};

TEST_F(ExtrapolationGlWork, AStillPairIsComparedAndCopiedAndThatIsAll) {
    const Picture a = moved_noise(kWidth, kHeight, Format::rgba8, 0, 0), b = moved_noise(kWidth, kHeight, Format::rgba8, 3, 1);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_GE(e.work().searched, (kWidth / 16) * (kHeight / 16)) << backend_name(k);
        EXPECT_GE(e.work().written, (kWidth / 16) * (kHeight / 16)) << backend_name(k);
        for (const float factor : {0.5f, -0.4f, 2.0f}) {
            ASSERT_EQ(e.extrapolate(src2, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_EQ(e.work().searched, 0) << backend_name(k);
            EXPECT_EQ(e.work().written, 0) << backend_name(k);
            EXPECT_EQ(read(out, b), b) << backend_name(k);
        }
    }
}

TEST_F(ExtrapolationGlWork, AMovingPartIsWorkedOnByItself) {
    const Picture a = moved_in_part(100, 90, 180, 154, 0, 0), b = moved_in_part(100, 90, 180, 154, 4, 2);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        const GlWork work = e.work();
        // The rectangle touches 6x5 tiles; with those beside them, 8x7. Nothing goes further than a tile.
        EXPECT_GE(work.searched, 6 * 5) << backend_name(k);
        EXPECT_LE(work.searched, 8 * 7) << backend_name(k);
        EXPECT_GE(work.written, 6 * 5) << backend_name(k);
        EXPECT_LE(work.written, 10 * 9) << backend_name(k);
        EXPECT_GT(work.tiles, (kWidth / 16) * (kHeight / 16)) << backend_name(k);
        const Picture result = read(out, a), truth = moved_in_part(100, 90, 180, 154, 6, 3);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                ASSERT_TRUE((x >= 64 && x < 216 && y >= 54 && y < 190) || std::memcmp(result.at(x, y), b.at(x, y), 4) == 0) << backend_name(k) << " " << x << " " << y;
        EXPECT_GT(psnr(result, truth), psnr(b, truth) + 7) << backend_name(k);
    }
}

// The corners of the picture, where a patch of the search lies outside of it.
TEST_F(ExtrapolationGlWork, WhatMovesInACornerIsFound) {
    for (const auto& [x0, y0, x1, y1] : {std::array{-20, -20, 50, 40}, {kWidth - 50, kHeight - 40, kWidth + 20, kHeight + 20}, {kWidth - 41, -20, kWidth + 20, 40}}) {
        const Picture a = moved_in_part(x0, y0, x1, y1, 0, 0), b = moved_in_part(x0, y0, x1, y1, 4, 2), truth = moved_in_part(x0, y0, x1, y1, 6, 3);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_GT(psnr(read(out, a), truth), psnr(b, truth) + 4) << backend_name(k) << " " << x0 << " " << y0;
        }
    }
}

// Beyond 8192 pixels tiles and blocks are twice as large.
TEST_F(ExtrapolationGlWork, VeryWidePicturesWorkTheSame) {
    constexpr int kWide = 8328, kHigh = 72;
    const auto at = [](int moved) {   // what moves is at the far end, and goes 4 pixels to the left per frame time
        Picture p(kWide, kHigh, Format::rgba8);
        for (int y = 0; y < kHigh; ++y)
            for (int x = 0; x < kWide; ++x) {
                const bool moves = x >= kWide - 200 - moved;
                const float n = x < kWide - 400 ? static_cast<float>((x / 7 + y / 5) % 9) / 9 : noise(static_cast<float>(x + (moves ? moved : 0)), static_cast<float>(y), moves ? 5 : 6);
                p.set(x, y, {n, n, 1 - n, 1});
            }
        return p;
    };
    const Picture a = at(0), b = at(4), truth = at(6);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        if (k == Backend::processor) continue;
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_GT(psnr(read(out, a), truth), psnr(b, truth) + 7) << backend_name(k);
        EXPECT_GT(e.work().searched, 10) << backend_name(k);
        EXPECT_LT(e.work().searched, 60) << backend_name(k);   // of 783
    }
}

// What an earlier call has left in the images outside of what this one works on reaches no pixel: neither where the surroundings
// show that they stand still, nor where they are even, and two things move that leave holes.
TEST_F(ExtrapolationGlWork, EarlierPicturesLeaveNoTrace) {
    const auto on_grey = [](float t) {
        Picture p(kWidth, kHeight, Format::rgba8);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const float u = static_cast<float>(x) - 60 - 9 * t, v = static_cast<float>(y) - 60 - 5 * t, u2 = static_cast<float>(x) - 150 + 8 * t, v2 = static_cast<float>(y) - 80 + 3 * t;
                const bool first = u >= 0 && v >= 0 && u < 50 && v < 40, second = u2 >= 0 && v2 >= 0 && u2 < 40 && v2 < 50;
                const float n = first ? noise(4 * u, 4 * v, 7) : second ? noise(4 * u2, 4 * v2, 8) : 0.4f;
                p.set(x, y, {n, n, first ? 0.2f : n, 1});
            }
        return p;
    };
    const Picture all1 = moved_noise(kWidth, kHeight, Format::rgba8, 0, 0, 9), all2 = moved_noise(kWidth, kHeight, Format::rgba8, -5, 4, 9);
    const GLuint before1 = texture(all1), before2 = texture(all2);
    const std::pair<Picture, Picture> pairs[] = {{moved_in_part(40, 40, 130, 120, 0, 0), moved_in_part(40, 40, 130, 120, 4, 2)}, {on_grey(0), on_grey(1)}};
    for (const Backend backend : {Backend::compute, Backend::fragment}) {
        auto fresh = GlExtrapolator::create(load_gl, {.preset = Preset::best, .backend = backend}), used = GlExtrapolator::create(load_gl, {.preset = Preset::best, .backend = backend});
        if (!fresh || !used) continue;
        for (const auto& [a, b] : pairs) {
            const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), out2 = texture(a);
            ASSERT_EQ(fresh->extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            ASSERT_EQ(used->extrapolate(before1, before2, out2, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            ASSERT_EQ(used->extrapolate(src1, src2, out2, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_EQ(read(out2, a), read(out, a)) << backend_name(backend) << (&a == &pairs[0].first ? " on noise" : " on grey");
        }
    }
}

}  // namespace fovea::test
