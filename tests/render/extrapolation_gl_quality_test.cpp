// The shaders against the processor's engine, scene by scene, each by its distance from the frame really rendered at that time.
#include "tests/render/extrapolation_gl.hpp"
#include "tools/extrapolation_scenes.hpp"

namespace fovea::test {

namespace {

constexpr int kSize = 320;
// How far behind the shaders may be. Without the judgement of pixels at edges of motion translation is 2.6 dB behind here,
// rotation and occlusion more than 1.
constexpr double kBehind_db = 0.5;

Picture rendered(const tools::ExtrapolationScene& scene, double time, int size = kSize) {
    Picture p(size, size, Format::rgba8);
    const auto frame = scene.render(time, size, false);
    std::memcpy(p.bytes.data(), frame.rgba.data(), p.bytes.size());
    return p;
}

struct Shot {
    std::string name;
    Picture src1, src2, truth;
};

const std::vector<Shot>& shots() {
    static const std::vector<Shot> all = [] {
        std::vector<Shot> made;
        for (const tools::SceneRow& row : tools::extrapolation_scenes()) {
            const tools::ExtrapolationScene scene(row.name, 1);
            made.push_back({row.name, rendered(scene, 0), rendered(scene, 1), rendered(scene, 1.5)});
        }
        return made;
    }();
    return all;
}

}  // namespace

class ExtrapolationGlQuality : public ExtrapolationGl {};

TEST_F(ExtrapolationGlQuality, EverySceneIsAboutAsCloseToTheTruthAsOnTheProcessor) {
    for (const Preset preset : {Preset::draft, Preset::balanced}) {
        auto processor = Extrapolator::create({.preset = preset});
        ASSERT_TRUE(processor.has_value());
        for (const Backend b : {Backend::compute, Backend::fragment}) {
            if (b == Backend::fragment && preset != Preset::balanced) continue;   // the same kernels
            auto made = GlExtrapolator::create(load_gl, {.preset = preset, .backend = b});
            if (!made) continue;
            for (const Shot& s : shots()) {
                Picture by_processor(kSize, kSize, Format::rgba8);
                ASSERT_EQ(processor->extrapolate(s.src1.view(), s.src2.view(), by_processor.target(), 0.5f), Outcome::ok);
                const GLuint src1 = texture(s.src1), src2 = texture(s.src2), out = texture(s.src1);
                ASSERT_EQ(made->extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
                const double here = psnr(read(out, s.truth), s.truth), there = psnr(by_processor, s.truth);
                std::printf("%-9s %-8s %-12s %6.2f dB, processor %6.2f, repeating %6.2f\n", preset_name(preset), backend_name(b), s.name.c_str(), here, there, psnr(s.src2, s.truth));
                EXPECT_GT(here, there - kBehind_db) << preset_name(preset) << " " << backend_name(b) << " " << s.name;
                EXPECT_GE(here, psnr(s.src2, s.truth) - 0.005) << preset_name(preset) << " " << backend_name(b) << " " << s.name << ": worse than repeating";
            }
        }
    }
}

TEST_F(ExtrapolationGlQuality, ALargeBrickWallDoesNotSlipByABrick) {
    // Patches here see bricks, which are everywhere alike; what only the corners of the wall know has to come from afar.
    constexpr int kLarge = 768;
    const tools::ExtrapolationScene scene("repetitive", 1);
    const Picture a = rendered(scene, 0, kLarge), b = rendered(scene, 1, kLarge), truth = rendered(scene, 1.5, kLarge);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    std::optional<double> processor;
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        const double db = psnr(read(out, a), truth);
        if (!processor) processor = db;
        // A slip costs more than 10 dB. The processor asks neighbours that have settled; a shader those of the round before.
        EXPECT_GT(db, *processor - 3) << backend_name(k) << ", repeating: " << psnr(b, truth);
    }
}

namespace {

double off_inside(const Picture& a, const Picture& b, int x0, int y0, int x1, int y1) {
    double sum = 0;
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            for (int c = 0; c < 3; ++c) sum += std::abs(std::to_integer<int>(a.at(x, y)[c]) - std::to_integer<int>(b.at(x, y)[c]));
    return sum / (3.0 * (x1 - x0) * (y1 - y0));
}

}  // namespace

TEST_F(ExtrapolationGlQuality, WhatNoMotionExplainsIsRepeatedAmongWhatMoves) {
    // The background moves; in a square of it the two pictures have nothing in common.
    const auto with_square = [](Picture p, std::uint32_t seed) {
        for (int y = 32; y < 128; ++y)
            for (int x = 96; x < 192; ++x) {
                const auto u = static_cast<float>(x), v = static_cast<float>(y);
                p.set(x, y, {noise(2 * u, 2 * v, seed), noise(2 * u, 2 * v, seed + 1), noise(2 * u, 2 * v, seed + 2), 1});
            }
        return p;
    };
    const Picture a = with_square(moved_noise(320, 160, Format::rgba8, 0, 0), 500), b = with_square(moved_noise(320, 160, Format::rgba8, 3, 1), 600), background = moved_noise(320, 160, Format::rgba8, 4.5f, 1.5f);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        const Picture result = read(out, a);
        // Levels of 255. The shaders leave 3.0; without the search back 4.2, without the judgement of blocks 9.5.
        EXPECT_LT(off_inside(result, b, 112, 48, 176, 112), k == Backend::processor ? 5.0 : 3.6) << backend_name(k);
        EXPECT_LT(off_inside(result, background, 224, 16, 304, 144), 0.3 * off_inside(b, background, 224, 16, 304, 144)) << backend_name(k);
    }
}

}  // namespace fovea::test
