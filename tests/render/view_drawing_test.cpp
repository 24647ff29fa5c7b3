// One draw for all views: every way draws the same pictures, with as many calls as it promises.
#include "render/gl/view_drawing.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "render/foveation/driver_traits.hpp"
#include "render/foveation/view_images.hpp"
#include "render/scene/scene.hpp"
#include "tests/render/gl_calls.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::FrameCost;
using foveation::Method;
using foveation::MethodSettings;
using gl::ViewDrawing;

namespace {

constexpr ViewDrawing kWays[] = {ViewDrawing::repeated, ViewDrawing::instanced, ViewDrawing::multiview2};

struct Drawn {
    std::array<Pixels, 2> eyes;
    FrameCost cost;
    std::uint64_t counted = 0;
    GlCalls calls;
};

class ViewDrawingTest : public GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        static_cast<void>(foveation::driver_traits());
        // A driver that is told to have it (FOVEA_EXPECT_MULTIVIEW, set by the test that runs this on our own layer) must.
        if (std::getenv("FOVEA_EXPECT_MULTIVIEW") != nullptr) { ASSERT_TRUE(gl::can_draw(ViewDrawing::multiview2)); }
    }

    Drawn draw(scene::Scene& scene, MethodSettings settings, int width = 160, int height = 160) {
        Views v(width, height, 2);
        v.look(0, {0.3f, 0.1f, 6, 6, 0});
        v.look(1, {-0.9f, 0.4f, 6, 6, 0});   // the inset of this eye sticks out of the picture
        auto method = foveation::create_method("inset_outset", settings);
        EXPECT_TRUE(method.has_value()) << method.error().message();
        const auto ready = (*method)->prepare(v.targets);
        EXPECT_TRUE(ready.has_value()) << ready.error().message();
        const auto programs = scene.draw_at_once((*method)->views_at_once());
        EXPECT_TRUE(programs.has_value()) << programs.error().message();
        gl::CommandList list;
        scene.record(1.3, scene::stereo_views(), list);
        Drawn d;
        d.calls = calls_of([&] { d.cost = (*method)->submit(list, v.targets, v.focus); });
        d.counted = (*method)->counted_fragments();
        for (std::size_t i = 0; i < 2; ++i) d.eyes[i] = read(v.targets[i]);
        return d;
    }
};

MethodSettings way(ViewDrawing drawing) {
    MethodSettings s;
    s.inset_outset.blend_px = 8;
    s.inset_outset.drawing = drawing;
    return s;
}

// Part of the channels that differ by more than `by`.
double differing(const Pixels& a, const Pixels& b, int by) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < a.size(); ++i) n += std::abs(int{a[i]} - int{b[i]}) > by;
    return static_cast<double>(n) / static_cast<double>(a.size());
}

TEST_F(ViewDrawingTest, EveryWayDrawsTheSamePictures) {
    for (const char* name : {"circuit", FOVEA_SOURCE_DIR "/configs/scenes/lantern.gltf"}) {
        auto scene = scene::Scene::create({.name = name});
        ASSERT_TRUE(scene.has_value()) << scene.error().message();
        const Drawn plain = draw(*scene, way(ViewDrawing::repeated));
        EXPECT_EQ(plain.cost.drawing, ViewDrawing::repeated);
        EXPECT_NE(plain.eyes[0], plain.eyes[1]);
        for (const ViewDrawing w : {ViewDrawing::instanced, ViewDrawing::multiview2}) {
            if (!gl::can_draw(w)) continue;
            const Drawn d = draw(*scene, way(w));
            EXPECT_EQ(d.cost.drawing, w) << name;
            EXPECT_FALSE(d.cost.fell_back) << d.cost.note;
            EXPECT_EQ(d.cost.pixels_shaded, plain.cost.pixels_shaded);
            for (std::size_t eye = 0; eye < 2; ++eye) {
                if (w == ViewDrawing::multiview2) {
                    EXPECT_EQ(d.eyes[eye], plain.eyes[eye]) << name << ": a layer is drawn as if alone";
                    continue;
                }
                // Moved into a part of an image and cut off there: vertices round differently by a 256th of a pixel.
                EXPECT_LT(differing(d.eyes[eye], plain.eyes[eye], 2), 0.004) << name;
                EXPECT_GT(psnr(d.eyes[eye], plain.eyes[eye]), 40) << name;
            }
        }
    }
}

TEST_F(ViewDrawingTest, OneDrawForAllFourViews) {
    auto scene = scene::Scene::create({.name = "circuit"});
    ASSERT_TRUE(scene.has_value());
    gl::CommandList list;
    scene->record(1.3, scene::stereo_views(), list);
    const auto size = static_cast<std::uint32_t>(list.size());
    for (const ViewDrawing w : kWays) {
        if (!gl::can_draw(w)) continue;
        const Drawn d = draw(*scene, way(w));
        const std::uint64_t elements = d.calls.of("glDrawElements"), instanced = d.calls.of("glDrawElementsInstanced");
        EXPECT_EQ(d.cost.draws, elements + instanced);
        if (w == ViewDrawing::repeated) {
            EXPECT_EQ(d.cost.submissions, 4u);
            EXPECT_GT(d.cost.draws, 2 * size);
            EXPECT_EQ(instanced, 0u);
        } else {
            EXPECT_EQ(d.cost.submissions, 1u) << gl::view_drawing_name(w);
            EXPECT_EQ(d.cost.draws, size) << gl::view_drawing_name(w);
            EXPECT_EQ(w == ViewDrawing::instanced ? elements : instanced, 0u);
        }
    }
}

// Sizes that differ: multiview2 takes a draw for the wide and one for the narrow views, instances still one.
TEST_F(ViewDrawingTest, InsetsOfAnotherSizeAreDrawnApartOnlyWhereTheyMustBe) {
    auto scene = scene::Scene::create({.name = "fragbox"});
    ASSERT_TRUE(scene.has_value());
    MethodSettings s = way(ViewDrawing::repeated);
    s.inset_outset.inset_px = 48;
    const Drawn plain = draw(*scene, s, 200, 120);
    for (const ViewDrawing w : {ViewDrawing::instanced, ViewDrawing::multiview2}) {
        if (!gl::can_draw(w)) continue;
        s.inset_outset.drawing = w;
        const Drawn d = draw(*scene, s, 200, 120);
        EXPECT_EQ(d.cost.drawing, w);
        EXPECT_EQ(d.cost.submissions, w == ViewDrawing::instanced ? 1u : 2u);
        for (std::size_t eye = 0; eye < 2; ++eye) EXPECT_LT(differing(d.eyes[eye], plain.eyes[eye], 2), w == ViewDrawing::multiview2 ? 1e-9 : 0.004);
    }
}

TEST_F(ViewDrawingTest, EveryWayShadesTheSameFragments) {
    if (!foveation::driver_traits().early_stencil) GTEST_SKIP() << "this driver shades what its stencil rejects";
    auto scene = scene::Scene::create({.name = "fragbox", .count_fragments = true});
    ASSERT_TRUE(scene.has_value());
    for (const int inset_px : {0, 40}) {
        MethodSettings s = way(ViewDrawing::repeated);
        s.count_fragments = true;
        s.inset_outset.inset_px = inset_px;
        const Drawn plain = draw(*scene, s);
        EXPECT_GT(plain.counted, 1000u);
        for (const ViewDrawing w : {ViewDrawing::instanced, ViewDrawing::multiview2}) {
            if (!gl::can_draw(w)) continue;
            s.inset_outset.drawing = w;
            const auto counted = static_cast<double>(draw(*scene, s).counted);
            EXPECT_NEAR(counted, static_cast<double>(plain.counted), static_cast<double>(plain.counted) * 0.005) << gl::view_drawing_name(w);
        }
    }
}

TEST_F(ViewDrawingTest, AListWithoutProgramsForItIsDrawnViewByView) {
    const QuadDraw quad(kSmooth);
    Views v(96, 96, 2);
    std::vector<Pixels> pictures;
    for (const ViewDrawing w : kWays) {
        if (!gl::can_draw(w)) continue;
        auto method = *foveation::create_method("inset_outset", way(w));
        ASSERT_TRUE(method->prepare(v.targets).has_value());
        EXPECT_EQ(method->views_at_once().drawing, w);
        const FrameCost cost = method->submit(quad.list(), v.targets, v.focus);
        EXPECT_EQ(cost.drawing, ViewDrawing::repeated);
        EXPECT_EQ(cost.submissions, 4u);
        pictures.push_back(read(v.targets[1]));
        EXPECT_LT(differing(pictures.back(), pictures.front(), 1), 0.001) << gl::view_drawing_name(w);
    }
}

TEST_F(ViewDrawingTest, SamplesAreDrawnWithoutMultiviewAndTheSame) {
    if (context().info().max_samples < 4) GTEST_SKIP() << context().info().renderer << " has no multisampling";
    auto scene = scene::Scene::create({.name = "thin"});
    ASSERT_TRUE(scene.has_value());
    MethodSettings s = way(ViewDrawing::repeated);
    s.inset_outset.samples = 4;
    const Drawn plain = draw(*scene, s);
    EXPECT_EQ(plain.cost.samples, 4);
    for (const ViewDrawing w : {ViewDrawing::instanced, ViewDrawing::multiview2}) {
        if (!gl::can_draw(w)) continue;
        s.inset_outset.drawing = w;
        const Drawn d = draw(*scene, s);
        EXPECT_NE(d.cost.drawing, ViewDrawing::multiview2) << "it has no multisampled images";
        EXPECT_EQ(d.cost.samples, 4);
        for (std::size_t eye = 0; eye < 2; ++eye) EXPECT_GT(psnr(d.eyes[eye], plain.eyes[eye]), 38);
    }
}

// Masks by depth, contrast and the hidden area, in parts and layers as in images of their own.
TEST_F(ViewDrawingTest, EveryEffectWorksInPartsAndLayers) {
    auto scene = scene::Scene::create({.name = "text"});
    ASSERT_TRUE(scene.has_value());
    for (const auto mask : {foveation::Mask::stencil, foveation::Mask::depth})
        for (const auto resolver : {foveation::Resolver::gpu, foveation::Resolver::processor}) {
            if (mask == foveation::Mask::depth && resolver == foveation::Resolver::processor) continue;
            MethodSettings s = way(ViewDrawing::repeated);
            s.mask = mask;
            s.resolver = resolver;
            s.inset_outset.hidden_radius = 1.05;
            s.inset_outset.contrast = resolver == foveation::Resolver::gpu ? 0.7 : 0;
            const Drawn plain = draw(*scene, s);
            for (const ViewDrawing w : {ViewDrawing::instanced, ViewDrawing::multiview2}) {
                if (!gl::can_draw(w)) continue;
                s.inset_outset.drawing = w;
                const Drawn d = draw(*scene, s);
                EXPECT_EQ(d.cost.drawing, w);
                for (std::size_t eye = 0; eye < 2; ++eye) EXPECT_LT(differing(d.eyes[eye], plain.eyes[eye], 3), w == ViewDrawing::multiview2 ? 0.0005 : 0.006) << gl::view_drawing_name(w);
            }
        }
}

TEST(ViewShaders, OneSourceServesEveryWay) {
    const std::string source = "precision highp float;\nin vec4 p;\nflat out uint v;\nvoid main() { v = gl_ViewID_OVR; place_in_view(p); }\n";
    const std::string repeated = gl::vertex_for_views(source, {});
    EXPECT_THAT(repeated, testing::HasSubstr("v = 0u;"));
    EXPECT_THAT(repeated, testing::Not(testing::HasSubstr("gl_ViewID_OVR")));
    const std::string instanced = gl::vertex_for_views(source, {ViewDrawing::instanced, 4});
    EXPECT_THAT(instanced, testing::HasSubstr("v = uint(gl_InstanceID);"));
    EXPECT_THAT(instanced, testing::HasSubstr("gl_ClipDistance"));
    const std::string multiview = gl::vertex_for_views(source, {ViewDrawing::multiview2, 4});
    EXPECT_THAT(multiview, testing::HasSubstr("layout(num_views = 4) in;"));
    EXPECT_THAT(multiview, testing::EndsWith(source));
}

}  // namespace
