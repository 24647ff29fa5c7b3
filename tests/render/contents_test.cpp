// What is measured of a scene, on scenes whose contents are known; and what their authors declare.
#include "render/effects/contents.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "render/effects/declared.hpp"
#include "render/scene/model_builder.hpp"

using namespace fovea;
using effects::Effect;

namespace {

// Seen from the origin along -z; the wall covers the left half of the view.
scene::Source before_wall(scene::ModelBuilder& b, double duration_s = 0) {
    scene::Source s;
    s.name = "test";
    s.stand = scene::Pose{};
    s.model = b.take(duration_s);
    return s;
}

constexpr effects::Look kLook{.width_px = 512, .height_px = 512};

TEST(Contents, AWallIsNothingSpecial) {
    scene::ModelBuilder b;
    b.material({.roughness = 0.1f});
    b.quad({-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2});
    b.node(b.end_mesh());
    const auto n = effects::look_at(before_wall(b), kLook);
    EXPECT_EQ(n.triangles, 2);
    EXPECT_EQ(n.thin_share, 0);
    EXPECT_EQ(n.glossy_share, 0) << "smooth, but flat: its highlight is wide";
    EXPECT_EQ(n.moving_share, 0);
    EXPECT_EQ(n.transparent_share, 0);
    EXPECT_EQ(n.camera_px, 0);
    EXPECT_GT(n.triangle_px, 512 * 512 / 4);
}

TEST(Contents, WiresAreThinAndPostsAreNot) {
    const auto share = [](float radius) {
        scene::ModelBuilder b;
        b.material({});
        b.quad({-9, -9, -4}, {9, -9, -4}, {9, 9, -4}, {-9, 9, -4});
        for (int i = 0; i < 20; ++i) b.tube({-1.9f + 0.2f * static_cast<float>(i), -3, -2}, {-1.9f + 0.2f * static_cast<float>(i), 3, -2}, radius, 12);
        b.node(b.end_mesh());
        return effects::look_at(before_wall(b), kLook).thin_share;
    };
    EXPECT_NEAR(share(0.0035f), 20 * 0.007 / 4, 0.01) << "1 px wide";
    EXPECT_EQ(share(0.03f), 0) << "8 px wide";
}

TEST(Contents, HighlightsAreSmallWhereSmoothSurfacesBend) {
    const auto share = [](float roughness) {
        scene::ModelBuilder b;
        b.material({.metallic = 1, .roughness = roughness});
        for (int i = 0; i < 9; ++i) b.sphere({-0.9f + 0.22f * static_cast<float>(i), 0, -2}, 0.1f, 32, 16);
        b.node(b.end_mesh());
        return effects::look_at(before_wall(b), kLook).glossy_share;
    };
    EXPECT_GT(share(0.1f), 0.8);
    EXPECT_EQ(share(0.7f), 0);
}

TEST(Contents, MotionIsWhatTheTrackSays) {
    scene::ModelBuilder b;
    b.material({});
    b.quad({-9, -9, -4}, {9, -9, -4}, {9, 9, -4}, {-9, 9, -4});
    b.node(b.end_mesh());
    b.quad({-0.5f, -0.5f, -2}, {0.5f, -0.5f, -2}, {0.5f, 0.5f, -2}, {-0.5f, 0.5f, -2});
    const auto n = b.node(b.end_mesh());
    // 0.9 m/s at 2 m in a view of 2 units width and 512 px: 0.01 m a frame is 0.01 / 2 / 2 * 512 px.
    b.track(n, scene::Track::Path::translation, {0, 10}, {{-0.5f, 0, 0, 0}, {8.5f, 0, 0, 0}});
    const auto needs = effects::look_at(before_wall(b, 10), {.width_px = 512, .height_px = 512, .times_s = {0.5, 1.0}});
    EXPECT_NEAR(needs.object_px, 0.01 / 4 * 512, 0.02);
    EXPECT_NEAR(needs.moving_share, 0.0625, 0.01);
    EXPECT_EQ(needs.camera_px, 0);
}

TEST(Contents, WhatIsSeenThroughIsTransparent) {
    scene::ModelBuilder b;
    b.material({});
    b.quad({-9, -9, -4}, {9, -9, -4}, {9, 9, -4}, {-9, 9, -4});
    b.material({.base_color = {1, 1, 1, 0.3f}, .blend = true});
    b.quad({-1, -1, -2}, {1, -1, -2}, {1, 1, -2}, {-1, 1, -2});
    b.quad({-1, -1, -5}, {1, -1, -5}, {1, 1, -5}, {-1, 1, -5});   // behind the wall: not seen
    b.node(b.end_mesh());
    EXPECT_NEAR(effects::look_at(before_wall(b), kLook).transparent_share, 0.25, 0.01);
}

scene::Image stripes(int period, int ink, std::uint8_t dark) {
    scene::Image i{64, 64, std::vector<std::uint8_t>(64 * 64 * 4, 230)};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            if (x % period < ink)
                for (std::size_t k = 0; k < 3; ++k) i.rgba[(static_cast<std::size_t>(y) * 64 + static_cast<std::size_t>(x)) * 4 + k] = dark;
    return i;
}

TEST(Contents, PrintIsTwoTonesOfUnequalShare) {
    EXPECT_EQ(effects::stroke_texels(stripes(8, 2, 20)), 2);
    EXPECT_EQ(effects::stroke_texels(stripes(16, 3, 20)), 3);
    EXPECT_EQ(effects::stroke_texels(stripes(8, 2, 190)), 0) << "too faint to be read";
    EXPECT_EQ(effects::stroke_texels(stripes(8, 5, 20)), 3) << "light letters on dark";
    EXPECT_EQ(effects::stroke_texels(stripes(8, 4, 20)), 0) << "a chequered cloth";
    EXPECT_EQ(effects::stroke_texels({}), 0);
}

TEST(Contents, EachSceneHasWhatItIsForAndTheMarbleHallHasNothing) {
    const auto needs = [](const char* name) { return effects::look_at(*scene::load_source(name), {}); };
    EXPECT_GT(needs("text").text_share, 0.3);
    EXPECT_GT(needs("thin").thin_share, 0.03);
    EXPECT_GT(needs("specular").glossy_share, 0.2);
    const auto moving = needs("moving");
    EXPECT_GT(moving.moving_share, 0.03);
    EXPECT_GT(moving.object_px, effects::kMoves_px);
    const auto hall = needs("fragbox");
    for (const double share : {hall.text_share, hall.thin_share, hall.moving_share, hall.transparent_share}) EXPECT_LT(share, 0.005);
    EXPECT_LT(hall.glossy_share, 0.02);
}

// ---- declarations ----

TEST(Declared, ASceneFileNamesASceneAndOverrides) {
    const auto f = effects::read_scene_file("scene = \"text\"\n[effects]\nmsaa = false\nblend = \"auto\"\n[needs]\nlens_radius = 1.1\ncamera_px = 3\n", "room.toml");
    ASSERT_TRUE(f.has_value()) << f.error().message();
    EXPECT_EQ(f->scene, "text");
    EXPECT_EQ(f->declared.effects[static_cast<std::size_t>(Effect::msaa)], false);
    EXPECT_FALSE(f->declared.effects[static_cast<std::size_t>(Effect::blend)].has_value());
    const auto p = effects::plan({}, {.method = "inset_outset"}, f->declared);
    EXPECT_EQ(p.needs().lens_radius, 1.1);
    EXPECT_EQ(p.needs().camera_px, 3);
    EXPECT_TRUE(p.on(Effect::hidden_area));
}

TEST(Declared, MistakesNameTheLineAndTheLegalKeys) {
    const auto error = [](const char* text) { return effects::read_scene_file(text, "room.toml").error(); };
    EXPECT_NE(error("scene = \"text\"\n[effects]\nmasa = true\n").message().find("room.toml:3:"), std::string::npos);
    EXPECT_NE(error("scene = \"text\"\n[effects]\nmasa = true\n").way_out.find("msaa"), std::string::npos);
    EXPECT_NE(error("scene = \"text\"\n[effects]\nmsaa = 3\n").way_out.find("auto"), std::string::npos);
    EXPECT_NE(error("scene = \"text\"\n[needs]\nthin_share = 2\n").way_out.find("0 to 1"), std::string::npos);
    EXPECT_NE(error("scene = \"text\"\n[needs]\nthin_share = nan\n").what.find("range"), std::string::npos);
    EXPECT_NE(error("scene = \"text\"\n[need]\nviews = 2\n").what.find("need"), std::string::npos);
    EXPECT_NE(error("[needs]\nviews = 2\n").what.find("no 'scene'"), std::string::npos);
    EXPECT_NE(error("scene = 3\n").what.find("no name"), std::string::npos);
    EXPECT_NE(error("scene = \n").where.find("room.toml:1"), std::string::npos);
    EXPECT_FALSE(effects::declared_in_json("[1]", "x").has_value());
    EXPECT_FALSE(effects::declared_in_json(R"({"effects":{"nothing":true}})", "x").has_value());
    EXPECT_FALSE(effects::declared_in_json(R"({"needs":3})", "x").has_value());
}

TEST(Declared, ExtrasOfAFileHoldUnlessASceneFileSaysOtherwise) {
    const auto plain = effects::open_scene(FOVEA_SOURCE_DIR "/configs/scenes/lantern.gltf");
    ASSERT_TRUE(plain.has_value()) << plain.error().message();
    EXPECT_EQ(plain->declared.effects[static_cast<std::size_t>(Effect::msaa)], true);
    const auto path = std::filesystem::temp_directory_path() / ("fovea_scene_" + std::to_string(::getpid()) + ".toml");
    std::ofstream(path) << "scene = \"" FOVEA_SOURCE_DIR "/configs/scenes/lantern.gltf\"\n[effects]\nmsaa = false\n";
    const auto over = effects::open_scene(path.string());
    std::filesystem::remove(path);
    ASSERT_TRUE(over.has_value()) << over.error().message();
    EXPECT_EQ(over->declared.effects[static_cast<std::size_t>(Effect::msaa)], false);
    EXPECT_EQ(effects::plan({}, {}, over->declared).needs().lens_radius, 1.2) << "still the extras'";
}

TEST(Declared, EverySceneFileThatComesWithFoveaOpens) {
    int files = 0;
    for (const auto& e : std::filesystem::directory_iterator(FOVEA_SOURCE_DIR "/configs/scenes")) {
        if (e.path().extension() != ".toml") continue;
        ++files;
        const auto o = effects::open_scene(e.path().string());
        EXPECT_TRUE(o.has_value()) << o.error().message();
    }
    EXPECT_GE(files, 2);
}

}  // namespace
