#include <gtest/gtest.h>

#include "tests/render/allocation_count.hpp"
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

constexpr Format kFormats[] = {Format::rgba8, Format::rgb8, Format::r8, Format::rgba16f, Format::rgb16f, Format::rgba32f, Format::rgb32f};

// A 40-pixel square of its own texture at x, before noise that has moved by `behind`.
Picture square_at(int size, float x, float y, float behind = 0) {
    Picture p = moved_noise(size, size, Format::rgba8, behind, 0, 5);
    for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
            const float u = static_cast<float>(i) - x, v = static_cast<float>(j) - y;
            if (u < 0 || u >= 40 || v < 0 || v >= 40) continue;
            const float n = fovea::test::noise(3 * u, 3 * v, 77);
            p.set(i, j, {0.6f + 0.4f * n, n, 0.9f - 0.5f * n, 1});
        }
    return p;
}

TEST(Extrapolation, StaticPairReturnsItselfBitForBitInEveryFormat) {
    for (const Format f : kFormats) {
        const Picture a = moved_noise(70, 45, f, 0, 0);
        Picture out(70, 45, f);
        auto e = engine();
        for (const float factor : {0.5f, 1.0f, -0.5f, 1e-30f, -1e30f, kNan}) {
            ASSERT_EQ(run(e, a, a, out, factor), Outcome::ok);
            EXPECT_EQ(out, a) << format_name(f) << " " << factor;
        }
        EXPECT_EQ(e.report().static_fraction, 0) << "a factor without meaning is answered before the comparison";
    }
}

TEST(Extrapolation, FollowsAMotionInEveryPresetWellBeyondRepeating) {
    const Picture a = moved_noise(256, 256, Format::rgba8, 0, 0), b = moved_noise(256, 256, Format::rgba8, 5.3f, -3.6f);
    const Picture truth = moved_noise(256, 256, Format::rgba8, 1.5f * 5.3f, -1.5f * 3.6f);
    Picture out(256, 256, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        EXPECT_FALSE(e.report().repeated);
        EXPECT_GT(psnr(out, truth, 12), psnr(b, truth, 12) + 10) << preset_name(p);
        EXPECT_GT(psnr(out, truth), psnr(b, truth) + 7) << preset_name(p);
    }
}

TEST(Extrapolation, FactorsBetweenAndBeforeTheSourcesGoBackInTime) {
    const Picture a = moved_noise(192, 160, Format::rgba8, 0, 0), b = moved_noise(192, 160, Format::rgba8, 6, 2);
    Picture out(192, 160, Format::rgba8);
    auto e = engine();
    for (const float factor : {-0.25f, -0.5f, -0.75f, -1.5f}) {
        ASSERT_EQ(run(e, a, b, out, factor), Outcome::ok);
        const Picture truth = moved_noise(192, 160, Format::rgba8, 6 * (1 + factor), 2 * (1 + factor));
        EXPECT_GT(psnr(out, truth, 8), std::max(psnr(a, truth, 8), psnr(b, truth, 8)) + 6) << factor;
    }
    ASSERT_EQ(run(e, a, b, out, -1), Outcome::ok);
    EXPECT_EQ(out, a);
}

TEST(Extrapolation, ExtremeFactorsRepeatWhatMovesOutOfReach) {
    const Picture a = moved_noise(128, 96, Format::rgba8, 0, 0), b = moved_noise(128, 96, Format::rgba8, 4, 1);
    Picture out(128, 96, Format::rgba8);
    auto e = engine();
    for (const float factor : {1e30f, 3e38f, kInf, kNan, 1e-30f, std::numeric_limits<float>::denorm_min()}) {
        ASSERT_EQ(run(e, a, b, out, factor), Outcome::ok);
        EXPECT_EQ(out, b) << factor;
    }
    for (const float factor : {-1e30f, -kInf}) {
        ASSERT_EQ(run(e, a, b, out, factor), Outcome::ok);
        EXPECT_EQ(out, a) << factor;
    }
}

TEST(Extrapolation, WhatAFactorCarriesBeyondReachIsRepeatedWhereItWas) {
    constexpr int kSize = 128;   // a quarter of it is 32 pixels
    const Picture a = moved_noise(kSize, 96, Format::rgba8, 0, 0), b = moved_noise(kSize, 96, Format::rgba8, 4, 1);
    Picture out(kSize, 96, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 12), Outcome::ok);   // 48 pixels: still inside the picture, so only the limit holds it back
        EXPECT_EQ(out, b) << preset_name(p);
        ASSERT_EQ(run(e, a, b, out, 5), Outcome::ok);    // 20 pixels
        EXPECT_GT(psnr(out, moved_noise(kSize, 96, Format::rgba8, 24, 6), 26), psnr(b, moved_noise(kSize, 96, Format::rgba8, 24, 6), 26) + 3) << preset_name(p);
    }
    std::vector<float> motion(static_cast<std::size_t>(2 * kSize * 96));
    for (std::size_t i = 0; i < motion.size(); i += 2) motion[i] = static_cast<float>(i / 2 % kSize < 64 ? 40 : 0);
    const KnownMotion known{motion.data(), nullptr, kSize, 96};
    auto e = engine();
    ASSERT_EQ(run(e, a, b, out, 1, {.motion = &known}), Outcome::ok);
    EXPECT_EQ(out, b) << "known motion has the same limit";
    ASSERT_EQ(run(e, a, b, out, 0.5f, {.motion = &known}), Outcome::ok);
    EXPECT_NE(out, b) << "half of it is within reach";
}

TEST(Extrapolation, EveryErrorLeavesTheOutputAlone) {
    const Picture a = moved_noise(16, 16, Format::rgba8, 0, 0), b = moved_noise(16, 16, Format::rgba8, 1, 0);
    const Picture other_format = moved_noise(16, 16, Format::rgba16f, 0, 0), other_size = moved_noise(16, 17, Format::rgba8, 0, 0);
    Picture out(16, 16, Format::rgba8);
    const Picture before = out;
    auto e = engine();
    EXPECT_EQ(run(e, a, b, out, 0.0f), Outcome::factor_is_zero);
    EXPECT_EQ(run(e, a, b, out, -0.0f), Outcome::factor_is_zero);
    EXPECT_EQ(run(e, other_format, b, out, 1), Outcome::formats_differ);
    EXPECT_EQ(run(e, a, other_size, out, 1), Outcome::sizes_differ);
    const float nothing[2] = {};
    const KnownMotion bad{nothing, nullptr, 5, 5};
    EXPECT_EQ(run(e, a, b, out, 1, {.motion = &bad}), Outcome::unusable_motion);
    EXPECT_EQ(e.extrapolate({}, {}, {}, 1), Outcome::unusable_picture);
    EXPECT_EQ(out, before);
    EXPECT_FALSE(Extrapolator::create({.threads = 0}).has_value());
}

TEST(Extrapolation, AnySizeInAnyFormatStaysInsideItsRows) {
    auto e = engine(Preset::best, 2);
    for (const Format f : kFormats)
        for (const auto& [w, h] : {std::pair{1, 1}, {1, 37}, {37, 1}, {2, 3}, {7, 7}, {17, 33}, {129, 5}, {5, 300}, {63, 64}}) {
            const Picture a = moved_noise(w, h, f, 0, 0, 1, 7 * bytes_per_channel(f)), b = moved_noise(w, h, f, 1.5f, 0.5f, 1, 7 * bytes_per_channel(f));
            Picture out(w, h, f, 7 * bytes_per_channel(f));
            for (const float factor : {0.5f, 2.0f, -0.3f, -3.0f}) {
                ASSERT_EQ(run(e, a, b, out, factor), Outcome::ok);
                for (int y = 0; y < h; ++y)
                    for (int k = 0; k < 7 * bytes_per_channel(f); ++k) ASSERT_EQ(*(out.at(w, y) + k), Picture::kSlack) << w << "x" << h;
            }
        }
}

TEST(Extrapolation, ASceneCutRepeatsTheLastFrame) {
    const Picture a = moved_noise(256, 200, Format::rgba8, 0, 0, 1), b = moved_noise(256, 200, Format::rgba8, 0, 0, 900);
    Picture out(256, 200, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        EXPECT_EQ(e.report().reason, Report::Reason::scene_cut) << preset_name(p) << " " << e.report().unexplained_fraction;
        EXPECT_EQ(out, b);
    }
}

TEST(Extrapolation, MotionBeyondTheSearchDegradesToRepeating) {
    Picture out(256, 256, Format::rgba8);
    for (const float motion : {60.0f, 90.0f, 150.0f}) {
        const Picture a = square_at(256, 20, 100), b = square_at(256, 20 + motion, 100), truth = square_at(256, 20 + 1.5f * motion, 100);
        for (const Preset p : kPresets) {
            auto e = engine(p);
            ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
            // Half a decibel: the square's rim may still be taken for a neighbour's motion; noise would cost several.
            EXPECT_GT(psnr(out, truth), psnr(b, truth) - 0.5) << preset_name(p) << " " << motion;
        }
    }
}

TEST(Extrapolation, AThirdThatMovesBeyondTheSearchIsRepeatedAndNotNoise) {
    // Two thirds turn slowly, so that this is no cut; the rest shows nothing that the search could find again.
    const auto at = [](float slow, float quick) {
        Picture p = moved_noise(256, 256, Format::rgba8, slow, 0);
        const Picture other = moved_noise(256, 256, Format::rgba8, quick, 0.4f * quick, 60);
        for (int y = 0; y < 256; ++y) std::memcpy(p.at(176, y), other.at(176, y), 80 * 4);
        return p;
    };
    for (const float motion : {75.0f, 120.0f}) {
        const Picture a = at(0, 0), b = at(2, motion);
        Picture out(256, 256, Format::rgba8);
        for (const Preset p : kPresets) {
            auto e = engine(p);
            ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
            EXPECT_FALSE(e.report().repeated) << e.report().unexplained_fraction;
            long equal = 0;
            for (int y = 16; y < 240; ++y)
                for (int x = 192; x < 240; ++x) equal += std::memcmp(out.at(x, y), b.at(x, y), 4) == 0 ? 1 : 0;
            EXPECT_GT(equal, 224 * 48 / 3) << preset_name(p) << " " << motion;
        }
    }
}

TEST(Extrapolation, WhatStandsStillIsCopiedBitForBitBesideWhatMoves) {
    const Picture a = square_at(256, 40, 40), b = square_at(256, 45, 43), truth = square_at(256, 47.5f, 44.5f);
    Picture out(256, 256, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        EXPECT_GT(e.report().static_fraction, 0.8f);
        for (int y = 0; y < 256; ++y)
            for (int x = 0; x < 256; ++x)
                if (x >= 112 || y >= 112) {
                    ASSERT_EQ(std::memcmp(out.at(x, y), b.at(x, y), 4), 0) << preset_name(p) << " " << x << " " << y;
                }
        EXPECT_GT(psnr(out, truth), psnr(b, truth) + 3) << preset_name(p);
    }
}

// The truth only beside the edges of what moves: within `reach` pixels of the square's outline.
double psnr_around_square(const Picture& out, const Picture& truth, float x, float y, float reach) {
    double sum = 0, count = 0;
    for (int j = 0; j < truth.height; ++j)
        for (int i = 0; i < truth.width; ++i) {
            const float u = static_cast<float>(i) - x - 20, v = static_cast<float>(j) - y - 20;
            if (std::fabs(std::max(std::fabs(u), std::fabs(v)) - 20) > reach) continue;
            for (int c = 0; c < 3; ++c) {
                const double d = std::to_integer<int>(out.at(i, j)[c]) - std::to_integer<int>(truth.at(i, j)[c]);
                sum += d * d;
                count += 1;
            }
        }
    return 10 * std::log10(255.0 * 255.0 * count / sum);
}

TEST(Extrapolation, EdgesBetweenMotionsAreJudgedPixelByPixel) {
    const Picture a = square_at(256, 100, 100, 0), b = square_at(256, 107, 103, -3), truth = square_at(256, 110.5f, 104.5f, -4.5f);
    Picture out(256, 256, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        RecordProperty(preset_name(p), std::to_string(psnr_around_square(out, truth, 110.5f, 104.5f, 4)));
        EXPECT_GT(psnr_around_square(out, truth, 110.5f, 104.5f, 4), 20.8) << preset_name(p) << ": cells alone reach 19.0 to 20.2 dB";
    }
}

TEST(Extrapolation, BarsThinnerThanACellMoveEvenSlowly) {
    // Two pixels wide, blended at their edges, 1.4 pixels per frame over a wall that moves three quarters as far.
    const auto at = [](float t) {
        Picture p = moved_noise(256, 256, Format::rgba8, 1.1f * t, 0, 9);
        for (int y = 0; y < 256; ++y)
            for (int x = 0; x < 256; ++x) {
                const float from = 12 + 48 * std::floor((static_cast<float>(x) - 12 - 1.4f * t) / 48) + 1.4f * t;
                const float cover = std::clamp(std::min(from + 2, static_cast<float>(x) + 1) - std::max(from, static_cast<float>(x)), 0.0f, 1.0f);
                if (cover > 0) p.set(x, y, {cover * 0.9f + (1 - cover) * 0.3f, 0.8f * cover + (1 - cover) * 0.3f, 0.3f, 1});
            }
        return p;
    };
    const Picture a = at(0), b = at(1), truth = at(1.5f);
    Picture out(256, 256, Format::rgba8);
    for (const Preset p : kPresets) {
        auto e = engine(p);
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        RecordProperty(preset_name(p), std::to_string(psnr(out, truth, 16)) + " against " + std::to_string(psnr(b, truth, 16)));
        EXPECT_GT(psnr(out, truth, 16), psnr(b, truth, 16) + 7.4) << preset_name(p);
    }
}

TEST(Extrapolation, InfinitiesAndNansStayWhereTheyAreAndDoNotSpread) {
    for (const Format f : {Format::rgba16f, Format::rgb16f, Format::rgba32f, Format::rgb32f}) {
        Picture a = moved_noise(96, 80, f, 0, 0), b = moved_noise(96, 80, f, 4.5f, 2.5f);
        const int bpc = bytes_per_channel(f);
        const auto poison = [&](Picture& p, int x, int y, int channel, std::uint32_t half, float full) {
            if (bpc == 2) {
                const auto h = static_cast<std::uint16_t>(half);
                std::memcpy(p.at(x, y) + 2 * channel, &h, 2);
            } else {
                std::memcpy(p.at(x, y) + 4 * channel, &full, 4);
            }
        };
        poison(a, 30, 30, 0, 0x7c00, kInf);
        poison(b, 30, 30, 0, 0x7c00, kInf);
        poison(b, 50, 41, 1, 0x7e01, kNan);
        poison(b, 10, 70, 2, 0xfc00, -kInf);
        for (int x = 60; x < 90; ++x) poison(b, x, 10, 0, 0x7e00, kNan);
        Picture out(96, 80, f);
        auto e = engine();
        ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
        EXPECT_FALSE(e.report().repeated);
        const auto finite = [&](const Picture& p, int x, int y, int c) {
            if (bpc == 2) {
                std::uint16_t h;
                std::memcpy(&h, p.at(x, y) + 2 * c, 2);
                return (h & 0x7c00) != 0x7c00;
            }
            float v;
            std::memcpy(&v, p.at(x, y) + 4 * c, 4);
            return std::isfinite(v);
        };
        for (int y = 0; y < 80; ++y)
            for (int x = 0; x < 96; ++x)
                for (int c = 0; c < channel_count(f); ++c) {
                    ASSERT_EQ(finite(out, x, y, c), finite(b, x, y, c)) << format_name(f) << " " << x << " " << y;
                    if (!finite(b, x, y, c)) {
                        ASSERT_EQ(std::memcmp(out.at(x, y), b.at(x, y), static_cast<std::size_t>(bytes_per_pixel(f))), 0);
                    }
                }
    }
}

TEST(Extrapolation, LightOfAnyRangeKeepsItsRange) {
    const auto lamp = [](float x) {
        Picture p = moved_noise(128, 128, Format::rgba32f, 0.4f * x, 0);
        for (int j = 50; j < 80; ++j)
            for (int i = 0; i < 128; ++i)
                if (static_cast<float>(i) >= x && static_cast<float>(i) < x + 30) p.set(i, j, {1e6f, 2e6f, 3e6f, 0.5f});
        return p;
    };
    Picture out(128, 128, Format::rgba32f);
    auto e = engine(Preset::best);
    ASSERT_EQ(run(e, lamp(30), lamp(36), out, 0.5f), Outcome::ok);
    float high = 0;
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 128; ++x) {
            float v[4];
            std::memcpy(v, out.at(x, y), 16);
            for (int c = 0; c < 4; ++c) ASSERT_GE(v[c], 0);
            ASSERT_LE(v[2], 3e6f);
            high = std::max(high, v[2]);
        }
    EXPECT_EQ(high, 3e6f);
    float moved[4];
    std::memcpy(moved, out.at(66, 65), 16);   // the lamp's right edge has gone on from 66 to 69
    EXPECT_GT(moved[0], 5e5f);
}

TEST(Extrapolation, AlphaMovesWithItsPicture) {
    const auto mask = [](float dx) {
        Picture p(160, 160, Format::rgba8);
        for (int y = 0; y < 160; ++y)
            for (int x = 0; x < 160; ++x) p.set(x, y, {0.5f, 0.5f, 0.5f, fovea::test::noise(static_cast<float>(x) - dx, static_cast<float>(y), 3)});
        return p;
    };
    Picture out(160, 160, Format::rgba8);
    auto e = engine();
    ASSERT_EQ(run(e, mask(0), mask(6), out, 0.5f), Outcome::ok);
    EXPECT_GT(psnr(out, mask(9), 10), psnr(mask(6), mask(9), 10) + 6);
}

TEST(Extrapolation, ThreadsAndCodePathsGiveTheSameBits) {
    const Picture a = square_at(300, 60, 90), b = square_at(300, 66, 88, 2.5f);
    for (const Preset p : kPresets) {
        Picture one(300, 300, Format::rgba8), three(one), portable(one);
        auto e1 = engine(p), e3 = engine(p, 3), ep = engine(p, 2, false);
        EXPECT_STREQ(ep.code_path(), "portable");
        for (int repeat = 0; repeat < 3; ++repeat) {
            ASSERT_EQ(run(e1, a, b, one, 0.7f), Outcome::ok);
            ASSERT_EQ(run(e3, a, b, three, 0.7f), Outcome::ok);
            ASSERT_EQ(run(ep, a, b, portable, 0.7f), Outcome::ok);
            EXPECT_EQ(one, three) << preset_name(p);
            EXPECT_EQ(one, portable) << preset_name(p);
        }
    }
}

TEST(Extrapolation, GazeSavesEffortOutsideAndNothingInside) {
    const Picture a = moved_noise(512, 512, Format::rgba8, 0, 0), b = moved_noise(512, 512, Format::rgba8, 6.3f, 3.1f), truth = moved_noise(512, 512, Format::rgba8, 9.45f, 4.65f);
    Picture full(512, 512, Format::rgba8), foveated(full);
    auto e = engine();
    ASSERT_EQ(run(e, a, b, full, 0.5f), Outcome::ok);
    const Gaze centre{256, 256, 64, 128}, nowhere{kNan, kNan, 64, 128};
    ASSERT_EQ(run(e, a, b, foveated, 0.5f, {.gaze = &centre}), Outcome::ok);
    EXPECT_GT(psnr(foveated, truth, 224), psnr(full, truth, 224) - 0.5);
    EXPECT_GT(psnr(foveated, truth), psnr(b, truth) + 7);
    EXPECT_NE(foveated, full);
    ASSERT_EQ(run(e, a, b, foveated, 0.5f, {.gaze = &nowhere}), Outcome::ok);
    EXPECT_EQ(foveated, full) << "a gaze that is no number is full effort";
}

TEST(Extrapolation, AGazeAnywhereAndOfAnySizeGivesAFrame) {
    const Picture a = square_at(300, 60, 90), b = square_at(300, 66, 88, 2.5f), still = square_at(300, 66, 88), truth = square_at(300, 69, 87, 3.75f);
    Picture out(300, 300, Format::rgba8), three(out);
    for (const Preset p : {Preset::draft, Preset::best}) {
        auto e = engine(p), e3 = engine(p, 3);
        for (const Gaze& gaze : {Gaze{-1000, -1000, 64, 128}, Gaze{5000, 150, 64, 128}, Gaze{299, 299, 0, 0}, Gaze{150, 150, 1e30f, 1e30f}, Gaze{66, 88, 3, kInf}, Gaze{0, 150, 40, 90}})
            for (const Picture* before : {&a, &still}) {
                ASSERT_EQ(run(e, *before, b, out, 0.5f, {.gaze = &gaze}), Outcome::ok);
                ASSERT_EQ(run(e3, *before, b, three, 0.5f, {.gaze = &gaze}), Outcome::ok);
                EXPECT_EQ(out, three) << gaze.x_px << " " << gaze.full_radius_px;
                if (before == &a) {
                    EXPECT_GT(psnr(out, truth), psnr(b, truth) + 3) << gaze.x_px << " " << gaze.full_radius_px << ": less effort, and still a motion";
                }
            }
    }
}

TEST(Extrapolation, AGazeGivesTheSameFrameWhateverCameBefore) {
    // All moves; a square moves before what stands still; one beside it moves otherwise.
    const Picture moved[2] = {moved_noise(400, 330, Format::rgba8, 0, 0), moved_noise(400, 330, Format::rgba8, 6.3f, 3.1f)};
    const Picture one[2] = {square_at(400, 190, 150), square_at(400, 197, 153)}, other[2] = {square_at(400, 238, 140), square_at(400, 226, 130)};
    const Gaze centre{205, 165, 40, 90}, corner{30, 310, 48, 80};
    Picture first(400, 330, Format::rgba8), again(first);
    Picture small_first(400, 400, Format::rgba8), small_again(small_first);
    for (const Preset p : {Preset::balanced, Preset::best}) {
        auto fresh = engine(p), used = engine(p);
        ASSERT_EQ(run(fresh, one[0], one[1], small_first, 0.5f, {.gaze = &centre}), Outcome::ok);
        for (const Gaze* gaze : {&corner, &centre, static_cast<const Gaze*>(nullptr)})
            for (const Picture* pair : {other, one}) ASSERT_EQ(run(used, pair[0], pair[1], small_again, 0.8f, {.gaze = gaze}), Outcome::ok);
        ASSERT_EQ(run(used, one[0], one[1], small_again, 0.5f, {.gaze = &centre}), Outcome::ok);
        EXPECT_EQ(small_first, small_again) << preset_name(p);
        EXPECT_GT(psnr(small_first, square_at(400, 200.5f, 154.5f)), psnr(one[1], square_at(400, 200.5f, 154.5f)) + 3) << preset_name(p);
        ASSERT_EQ(run(fresh, moved[0], moved[1], first, 0.5f, {.gaze = &centre}), Outcome::ok);
        ASSERT_EQ(run(used, moved[0], moved[1], again, -0.8f, {.gaze = &corner}), Outcome::ok);
        ASSERT_EQ(run(used, moved[0], moved[1], again, 0.5f, {.gaze = &centre}), Outcome::ok);
        EXPECT_EQ(first, again) << preset_name(p);
    }
}

TEST(Extrapolation, SteadyFramesDoNotAllocate) {
    const Picture a = square_at(256, 40, 40), b = square_at(256, 45, 43);
    Picture out(256, 256, Format::rgba8);
    auto e = engine(Preset::best, 2);
    ASSERT_TRUE(e.prepare(256, 256, Format::rgba8));
    ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
    const auto before = fovea::test::allocation_count();
    ASSERT_EQ(run(e, a, b, out, 0.5f), Outcome::ok);
    ASSERT_EQ(run(e, b, a, out, -0.7f), Outcome::ok);
    EXPECT_EQ(fovea::test::allocation_count(), before);
}

}  // namespace
