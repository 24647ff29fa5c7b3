// The shaders against the processor's engine, scene by scene, each by its distance from the frame really rendered at that time.
#include "tests/render/extrapolation_gl.hpp"
#include "tools/extrapolation_scenes.hpp"

namespace fovea::test {

namespace {

constexpr int kSize = 320;
constexpr double kBehind_db[] = {2.5, 1.0, 1.0, 1.0};   // by preset: `draft` has three of its levels only, at this size

Picture rendered(const tools::ExtrapolationScene& scene, double time) {
    Picture p(kSize, kSize, Format::rgba8);
    const auto frame = scene.render(time, kSize, false);
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

TEST_F(ExtrapolationGlQuality, NoSceneIsADecibelFurtherFromTheTruthThanOnTheProcessor) {
    for (const Preset preset : kPresets) {
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
                EXPECT_GT(here, there - kBehind_db[static_cast<int>(preset)]) << preset_name(preset) << " " << backend_name(b) << " " << s.name;
                EXPECT_GE(here, psnr(s.src2, s.truth) - 0.005) << preset_name(preset) << " " << backend_name(b) << " " << s.name << ": worse than repeating";
            }
        }
    }
}

}  // namespace fovea::test
