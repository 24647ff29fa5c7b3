// Sizes, limits, extreme views and lost contexts; and pictures of every method that must not change.
#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "render/gl/png.hpp"
#include "render/scene/scene.hpp"
#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::FrameCost;
using foveation::MethodSettings;

namespace {

constexpr density::FocalPoint kFocus{0.1f, -0.2f, 6, 6, 0};
constexpr const char* kMethods[] = {"full", "scaled_bins", "scaled_bins_late", "inset_outset", "dynamic_viewports", "shading_rate", "auto", "auto_late"};

using Robustness = GlTest;

TEST_F(Robustness, EveryMethodFollowsATargetThatIsResized) {
    const QuadDraw quad("color = vec4(1.0, 0.5, 0.25, 1.0);");
    for (const char* name : kMethods) {
        MethodSettings settings;
        settings.inset_outset.blend_px = 2;
        auto m = *foveation::create_method(name, settings);
        for (const auto& [width, height] : {std::pair{64, 64}, {1, 1}, {3, 200}, {200, 3}, {65, 31}, {64, 64}}) {
            Views v(width, height);
            ASSERT_TRUE(m->prepare(v.targets).has_value()) << name << " " << width << "x" << height;
            v.look(0, kFocus);
            EXPECT_FALSE(m->submit(quad.list(), v.targets, v.focus).fell_back) << name << " " << width << "x" << height;
            const Pixels got = read(v.targets[0]);
            std::size_t holes = 0;
            for (std::size_t i = 0; i < got.size(); i += 4) holes += !(got[i] == 255 && std::abs(got[i + 1] - 128) <= 1 && std::abs(got[i + 2] - 64) <= 1);
            // softpipe clips the quad's two triangles apart where a narrow view cuts them, and leaves pinholes on the diagonal.
            EXPECT_LE(holes, context().info().renderer.find("softpipe") == std::string::npos ? 0u : 3u) << name << " " << width << "x" << height;
            EXPECT_EQ(gl::pending_error(), "") << name;
        }
    }
}

TEST_F(Robustness, TargetsThatCannotBeHadAreDrawnInFullAndSaySo) {
    const QuadDraw quad(kSmooth);
    const Surface s = color_surface(64);
    for (const char* name : kMethods) {
        if (name == std::string("full")) continue;
        auto m = *foveation::create_method(name, {});
        const foveation::ViewTarget huge{s.target.framebuffer, 0, 0, 65536, 65536};
        const auto r = m->prepare({&huge, 1});
        if (std::string(name).starts_with("auto")) {
            EXPECT_TRUE(r.has_value()) << "full is what it has chosen";
        } else {
            ASSERT_FALSE(r.has_value()) << name;
            EXPECT_NE(r.error().message().find("1 to "), std::string::npos) << r.error().message();
            EXPECT_FALSE(m->prepare({&huge, 1}).has_value()) << "and again, at once";
        }
        foveation::ViewFocus focus;
        focus.points[0] = kFocus;
        focus.count = 1;
        const FrameCost cost = m->submit(quad.list(), {&huge, 1}, {&focus, 1});
        EXPECT_TRUE(cost.fell_back) << name;
        if (!std::string(name).starts_with("auto")) {
            EXPECT_STRNE(cost.note, "") << name;
        }
        // The small target is there all the same.
        ASSERT_TRUE(m->prepare({&s.target, 1}).has_value()) << name;
        EXPECT_FALSE(submit(*m, quad.list(), s, kFocus).fell_back) << name;
    }
    EXPECT_EQ(gl::pending_error(), "");
}

TEST_F(Robustness, ExtremeProjectionsKeepTheFoveaExact) {
    auto scene = scene::Scene::create({.name = "fragbox"});
    ASSERT_TRUE(scene.has_value()) << scene.error().message();
    gl::CommandList list;
    for (const FieldOfView fov : {FieldOfView{-30, 30, 30, -30}, {0.4, 3.0, 2.5, 0.3}, {-0.001, 0.001, 0.001, -0.001}, {-2, 0.01, 0.01, -5}}) {
        const scene::SceneView view{fov, 0.1};
        scene->record(2.0, {&view, 1}, list);
        const Surface plain = color_surface(96), s = color_surface(96);
        submit(*make_method("full", plain), list, plain, {});
        const auto m = make_method("scaled_bins", s);
        for (const density::FocalPoint p : {kFocus, density::FocalPoint{-1, 1, 9, 9, 0}, {40, 0, 1, 1, 0}}) {
            submit(*m, list, s, p);
            const Pixels got = read(s.target), want = read(plain.target);
            for (int y = 0; y < 96; ++y)
                for (int x = 0; x < 96; ++x) {
                    const std::size_t i = static_cast<std::size_t>(y * 96 + x) * 4;
                    if (m->plan(0)->level_at(x / m->plan(0)->bin_px(), y / m->plan(0)->bin_px()) == 0) {
                        ASSERT_TRUE(std::equal(&got[i], &got[i] + 4, &want[i])) << x << "," << y << " field " << fov.tan_left << " to " << fov.tan_right;
                    }
                }
        }
    }
}

TEST_F(Robustness, ALostContextTakesItsObjectsAlongAndTheNextOneDrawsTheSame) {
    for (const char* name : kMethods) {
        auto lost = gl::Context::create();
        ASSERT_TRUE(lost.has_value());
        std::optional<QuadDraw> quad(std::in_place, kSmooth);
        std::optional<Surface> s(color_surface(64));
        auto m = make_method(name, *s);
        submit(*m, quad->list(), *s, kFocus);
        const Pixels expected = read(s->target);
        gl::Fence fence = gl::Fence::insert();
        { const gl::Context gone = *std::move(lost); }   // destroyed, and no context is current
        // Whoever has not noticed yet is told, and neither crashes nor hangs.
        const auto told = m->prepare({&s->target, 1});
        ASSERT_FALSE(told.has_value()) << name;
        EXPECT_NE(told.error().message().find("no context"), std::string::npos);
        EXPECT_FALSE(fence.wait(SystemTime{}, std::chrono::milliseconds(1)).has_value());
        m.reset();
        s.reset();
        quad.reset();
        fence = gl::Fence();
        auto next = gl::Context::create();
        ASSERT_TRUE(next.has_value());
        const QuadDraw again(kSmooth);
        const Surface t = color_surface(64);
        submit(*make_method(name, t), again.list(), t, kFocus);
        EXPECT_EQ(read(t.target), expected) << name;
    }
    ASSERT_TRUE(context().make_current());
}

TEST_F(Robustness, AMethodWhoseShadersDoNotCompileSaysWhichOne) {
    const auto p = gl::build_program("level resolve", "#version 310 es\nvoid main() { gl_Position = vec4(0.0); }", "#version 310 es\nprecision highp float;\nout vec4 c;\nvoid main() { c = texture(level, vec2(0.0)); }");
    ASSERT_FALSE(p.has_value());
    EXPECT_NE(p.error().message().find("'level resolve'"), std::string::npos);
    EXPECT_NE(p.error().message().find("level"), std::string::npos);
    EXPECT_NE(p.error().message().find("4: void main()"), std::string::npos) << "with the listing";
}

// ---- golden pictures ----

constexpr int kGolden_px = 96;

Pixels golden_picture(const char* name) {
    // A pattern that gets finer to the right, and a disc with a hard edge in front of it.
    const QuadDraw back("color = vec4(0.5 + 0.5 * sin((ndc.x + 1.3) * (ndc.x + 1.3) * 16.0) * cos(ndc.y * 13.0), 0.5 + 0.5 * ndc.y, 0.5 - 0.5 * ndc.x, 1.0);", {.depth = 0.8f, .depth_right = 0.8f});
    const QuadDraw front("if (length(ndc - vec2(0.1, -0.1)) > 0.45) discard; color = vec4(0.9, 0.85, 0.2 + 0.6 * fract(ndc.x * 8.0), 1.0);", {.depth = 0.3f, .depth_right = 0.3f});
    gl::CommandList list;
    list.begin({}, {});
    list.add(back.list().draws()[0]);
    list.add(front.list().draws()[0]);
    MethodSettings settings;
    settings.inset_outset.blend_px = 6;
    settings.shading_rate.tile_px = 8;
    const Surface s = color_surface(kGolden_px);
    submit(*make_method(name, s, settings), list, s, kFocus);
    return read(s.target);
}

std::filesystem::path golden_path(const char* name) { return std::filesystem::path(FOVEA_SOURCE_DIR) / "tests/data/render" / (std::string(name) + ".png"); }

std::vector<std::uint8_t> rgb_top_down(const Pixels& p) {
    std::vector<std::uint8_t> rgb;
    for (int y = kGolden_px - 1; y >= 0; --y)
        for (int x = 0; x < kGolden_px; ++x)
            for (int c = 0; c < 3; ++c) rgb.push_back(p[static_cast<std::size_t>(y * kGolden_px + x) * 4 + static_cast<std::size_t>(c)]);
    return rgb;
}

// Makes tests/data/render: fovea_render_test --gtest_also_run_disabled_tests --gtest_filter='*WriteGoldenPictures'. Look at them.
TEST_F(Robustness, DISABLED_WriteGoldenPictures) {
    std::filesystem::create_directories(golden_path("full").parent_path());
    for (const char* name : kMethods) {
        if (std::string(name).starts_with("auto")) continue;
        ASSERT_TRUE(gl::write_png(golden_path(name), {kGolden_px, kGolden_px, rgb_top_down(golden_picture(name))}).has_value());
    }
}

TEST_F(Robustness, PicturesAreTheGoldenOnes) {
    for (const char* name : kMethods) {
        if (std::string(name).starts_with("auto")) continue;   // the same as scaled_bins
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        ASSERT_NE(png_image_begin_read_from_file(&image, golden_path(name).c_str()), 0) << golden_path(name);
        image.format = PNG_FORMAT_RGB;
        std::vector<std::uint8_t> golden(PNG_IMAGE_SIZE(image));
        ASSERT_NE(png_image_finish_read(&image, nullptr, golden.data(), 0, nullptr), 0);
        const std::vector<std::uint8_t> got = rgb_top_down(golden_picture(name));
        ASSERT_EQ(golden.size(), got.size());
        // Rasterisers round edges and interpolation each in its own way: some pixels may differ much, most by little.
        std::size_t off = 0;
        for (std::size_t i = 0; i < got.size(); ++i) off += std::abs(int{got[i]} - int{golden[i]}) > 6;
        EXPECT_LT(off, got.size() / 100) << name;
    }
}

}  // namespace
