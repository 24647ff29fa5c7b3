#include "drivers/camera/pupil_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <vector>

#include "drivers/camera/eye_model.hpp"
#include "drivers/synthetic/eye_image.hpp"

using namespace fovea;
using namespace fovea::drivers::camera;
using fovea::drivers::synthetic::EyeImageScene;
using fovea::drivers::synthetic::render_eye;

namespace {

PupilResult detect(PupilDetector& d, const EyeImageScene& s) {
    const auto pixels = render_eye(s);
    return d.detect({pixels.data(), s.width, s.height, s.width});
}

double error_px(const PupilResult& r, const EyeImageScene& s) {
    return r.found ? std::hypot(r.ellipse.x - s.pupil_x, r.ellipse.y - s.pupil_y) : 1e9;
}

EyeImageScene scene(double x, double y, double radius) {
    EyeImageScene s;
    s.pupil_x = x;
    s.pupil_y = y;
    s.pupil_a = s.pupil_b = radius;
    return s;
}

}  // namespace

TEST(EyeImage, HasItsPupilWhereTheSceneSays) {
    const EyeImageScene s = scene(80.3, 99.6, 17.5);
    const auto pixels = render_eye(s);
    double n = 0, x = 0, y = 0;
    for (int j = 0; j < s.height; ++j)
        for (int i = 0; i < s.width; ++i) {
            const double dark = std::max(0.0, (s.iris_level - pixels[static_cast<std::size_t>(j * s.width + i)]) / (s.iris_level - s.pupil_level));
            n += dark;
            x += dark * i;
            y += dark * j;
        }
    EXPECT_NEAR(x / n, 80.3, 0.03);
    EXPECT_NEAR(y / n, 99.6, 0.03);
    EXPECT_NEAR(std::sqrt(n / 3.14159265), 17.5, 0.05);
}

TEST(EyeImage, EffectsThatAreOffChangeNothingAndTurnedOnChangeNoOther) {
    EyeImageScene a = scene(96, 96, 20), b = a;
    b.seed = 99;
    EXPECT_EQ(render_eye(a), render_eye(b)) << "without a random effect the seed plays no part";
    a.noise = b.noise = 5;
    EXPECT_NE(render_eye(a), render_eye(b));
}

TEST(PupilDetector, FindsACleanPupilToATenthOfAPixelWithEveryPreset) {
    for (const PupilPreset preset : {PupilPreset::fast, PupilPreset::balanced, PupilPreset::best}) {
        PupilDetector d({.preset = preset});
        for (const double radius : {12.0, 18.3, 27.0})
            for (const double x : {78.2, 96.0, 110.7}) {
                const EyeImageScene s = scene(x, 90.4, radius);
                EXPECT_LT(error_px(detect(d, s), s), 0.1) << to_string(preset) << " " << radius << " " << x;
            }
    }
    PupilDetector draft({.preset = PupilPreset::draft});
    const EyeImageScene s = scene(96.5, 90, 20);
    EXPECT_LT(error_px(detect(draft, s), s), 1.5);
}

TEST(PupilDetector, TellsShapeAndTurnOfAnObliquePupil) {
    PupilDetector d({});
    EyeImageScene s = scene(100, 92, 24);
    s.pupil_b = 15;
    s.pupil_angle_rad = 0.6;
    const PupilResult r = detect(d, s);
    ASSERT_TRUE(r.found);
    EXPECT_NEAR(r.ellipse.a, 24, 0.3);
    EXPECT_NEAR(r.ellipse.b, 15, 0.3);
    EXPECT_NEAR(std::remainder(r.ellipse.angle_rad - 0.6, 3.14159265358979), 0, 0.02);
}

TEST(PupilDetector, SeesPastGlintsNoiseAndALid) {
    PupilDetector d({.preset = PupilPreset::best});
    EyeImageScene s = scene(94, 97, 22);
    s.glints = 2;
    s.glint_offset = 0.9;   // across the pupil's edge
    const PupilResult r = detect(d, s);
    EXPECT_LT(error_px(r, s), 0.2);
    ASSERT_EQ(r.glint_count, 2);
    const double gx = s.pupil_x + s.glint_offset * s.pupil_a, gy = s.pupil_y - 0.3 * s.pupil_b;
    EXPECT_LT(std::min(std::hypot(r.glints[0].x - gx, r.glints[0].y - gy), std::hypot(r.glints[1].x - gx, r.glints[1].y - gy)), 0.5);
    s = scene(94, 97, 22);
    s.noise = 10;
    EXPECT_LT(error_px(detect(d, s), s), 0.5);
    s.noise = 0;
    s.upper_lid = 0.38;     // a third of the pupil is covered
    EXPECT_LT(error_px(detect(d, s), s), 0.7);
}

TEST(PupilDetector, FindsNothingWhereThereIsNothing) {
    for (const PupilPreset preset : {PupilPreset::draft, PupilPreset::balanced}) {
        PupilDetector d({.preset = preset});
        std::vector<std::uint8_t> flat(192 * 192, 128);
        EXPECT_FALSE(d.detect({flat.data(), 192, 192, 192}).found);
        std::mt19937 rng(3);
        int found = 0;
        for (int i = 0; i < 50; ++i) {
            for (auto& v : flat) v = static_cast<std::uint8_t>(rng());
            // Full-range noise has dark blots; what is made of them must not pass for a pupil one can rely on (the
            // pipeline's min_confidence is 0.6).
            found += d.detect({flat.data(), 192, 192, 192}).confidence >= 0.6 ? 1 : 0;
        }
        EXPECT_EQ(found, 0);
        for (std::size_t i = 0; i < flat.size(); ++i) flat[i] = static_cast<std::uint8_t>(i % 192);   // a ramp
        EXPECT_FALSE(d.detect({flat.data(), 192, 192, 192}).found);
        EXPECT_FALSE(d.detect({}).found);
        EXPECT_FALSE(d.detect({flat.data(), 16, 16, 16}).found);
    }
}

TEST(PupilDetector, TakesTheLashesOfAClosedEyeForAPupilOnlyRarely) {
    constexpr int kPictures = 12;
    const std::array presets = {PupilPreset::draft, PupilPreset::fast, PupilPreset::balanced, PupilPreset::best};
    std::array<int, 4> imagined{}, open{};
    for (int i = 0; i < kPictures; ++i) {
        EyeImageScene s = scene(75 + 4 * i, 112 - 2 * i, 12 + i);
        s.lashes = 15;
        s.noise = 4;
        s.seed = static_cast<std::uint64_t>(i) + 1;
        s.upper_lid = 0.2;
        const auto lashes = render_eye(s);
        s.upper_lid = 1;
        const auto closed = render_eye(s);
        for (std::size_t p = 0; p < presets.size(); ++p) {
            PupilDetector detector({.preset = presets[p]});
            open[p] += detector.detect({lashes.data(), s.width, s.height, s.width}).found ? 1 : 0;
            imagined[p] += detector.detect({closed.data(), s.width, s.height, s.width}).found ? 1 : 0;
        }
    }
    for (std::size_t p = 0; p < presets.size(); ++p) {
        EXPECT_LE(imagined[p], kPictures / 3) << to_string(presets[p]) << ": without the look below the edge it is most of them";
        EXPECT_EQ(open[p], kPictures) << to_string(presets[p]) << ": the same lashes before an open eye";
    }
}

TEST(PupilDetector, ErrsLessWithEachDearerPreset) {
    constexpr int kPictures = 12;   // of each of six cases
    const std::array presets = {PupilPreset::draft, PupilPreset::fast, PupilPreset::balanced, PupilPreset::best};
    std::array<std::vector<double>, 4> errors;
    std::mt19937_64 rng(7);
    const auto between = [&](double low, double high) { return low + (high - low) * static_cast<double>(rng() >> 11) * 0x1p-53; };
    for (int i = 0; i < 6 * kPictures; ++i) {
        EyeImageScene s = scene(between(73, 119), between(77, 115), between(12, 29));
        s.seed = rng();
        switch (i % 6) {
            case 0: s.noise = 10; break;
            case 1: s.blur_px = 2.3; break;
            case 2: s.pupil_b = 0.6 * s.pupil_a, s.pupil_angle_rad = between(0, 3); break;
            case 3: s.upper_lid = between(0.32, 0.45); break;
            case 4: s.upper_lid = 0.2, s.lashes = 25; break;
            default: s.noise = 6, s.blur_px = 1.2, s.glints = 2, s.pupil_b = 0.75 * s.pupil_a, s.upper_lid = 0.28, s.lashes = 15, s.shade = 0.25; break;
        }
        const auto pixels = render_eye(s);
        for (std::size_t p = 0; p < presets.size(); ++p) {
            PupilDetector detector({.preset = presets[p]});
            errors[p].push_back(std::min(5.0, error_px(detector.detect({pixels.data(), s.width, s.height, s.width}), s)));
        }
    }
    std::array<double, 4> median{}, mean{};
    for (std::size_t p = 0; p < presets.size(); ++p) {
        std::ranges::sort(errors[p]);
        median[p] = errors[p][errors[p].size() / 2];
        mean[p] = std::accumulate(errors[p].begin(), errors[p].end(), 0.0) / static_cast<double>(errors[p].size());
        std::printf("%-10s median %.3f mean %.3f px\n", to_string(presets[p]), median[p], mean[p]);
        if (p == 0) continue;
        EXPECT_LT(median[p], median[p - 1]) << to_string(presets[p]);
        EXPECT_LT(mean[p], mean[p - 1]) << to_string(presets[p]);
    }
    EXPECT_LT(median[3], 0.7 * median[2]) << "what the pixels along the edge add to rays";
    EXPECT_LT(mean[3], 0.7 * mean[2]);
}

TEST(PupilDetector, GivesTheSameAnswerForTheSamePicture) {
    EyeImageScene s = scene(94, 97, 22);
    s.noise = 12;
    PupilDetector a({}), b({});
    const PupilResult first = detect(a, s);
    (void)detect(b, scene(60, 90, 12));
    const PupilResult second = detect(b, s);
    EXPECT_EQ(first.ellipse.x, second.ellipse.x);
    EXPECT_EQ(first.ellipse.angle_rad, second.ellipse.angle_rad);
    EXPECT_EQ(first.confidence, second.confidence);
}

TEST(PupilDetector, SurvivesHostilePictures) {
    std::mt19937_64 rng(17);
    PupilDetector detectors[] = {PupilDetector({.preset = PupilPreset::draft}), PupilDetector({.preset = PupilPreset::fast}),
                                 PupilDetector({}), PupilDetector({.preset = PupilPreset::best, .min_radius_px = 1, .max_radius_px = 2000})};
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 1500; ++i) {
        const int w = static_cast<int>(32 + rng() % 120), h = static_cast<int>(32 + rng() % 120);
        pixels.assign(static_cast<std::size_t>(w * h), static_cast<std::uint8_t>(rng()));
        const int boxes = static_cast<int>(rng() % 6);
        for (int b = 0; b < boxes; ++b) {   // blocks of light and dark, up to the picture's rim
            const int x0 = static_cast<int>(rng() % static_cast<unsigned>(w)), y0 = static_cast<int>(rng() % static_cast<unsigned>(h));
            const auto level = static_cast<std::uint8_t>(rng() % 2 == 0 ? 0 : 255);
            for (int y = y0; y < std::min(h, y0 + static_cast<int>(rng() % 60)); ++y)
                for (int x = x0; x < std::min(w, x0 + 40); ++x) pixels[static_cast<std::size_t>(y * w + x)] = level;
        }
        if (i % 3 == 0)
            for (auto& v : pixels) v = static_cast<std::uint8_t>(rng());
        const PupilResult r = detectors[i % 4].detect({pixels.data(), w, h, w});
        if (!r.found) continue;
        ASSERT_TRUE(std::isfinite(r.ellipse.x) && std::isfinite(r.ellipse.y) && r.ellipse.a >= r.ellipse.b && r.ellipse.b > 0);
        ASSERT_GE(r.confidence, 0);
        ASSERT_LE(r.confidence, 1);
    }
}

TEST(EyeModel, TurnsTheEyeWithThePupil) {
    EyeModel m{96, 96, 80, false, false};
    PupilResult p;
    p.found = true;
    p.ellipse = {96, 96, 20, 20, 0};
    EXPECT_EQ(look(m, p)->z, -1);
    p.ellipse.x = 96 - 40;   // left in the picture is the wearer's right
    EXPECT_NEAR(std::asin(look(m, p)->x), std::asin(0.5), 1e-12);
    p.ellipse.y = 96 - 20;
    EXPECT_GT(look(m, p)->y, 0);
    m.mirrored = true;
    EXPECT_LT(look(m, p)->x, 0);
    p.ellipse.x = 96 + 90;
    EXPECT_FALSE(look(m, p)) << "off the eyeball";
    m = {5, -3, 80, true, false};
    p.ellipse.x = p.ellipse.y = 96;
    EXPECT_FALSE(look(m, p)) << "no glint to refer to";
    p.glint_count = 1;
    p.glints[0] = {91, 99, 4};
    EXPECT_EQ(look(m, p)->z, -1);
}
