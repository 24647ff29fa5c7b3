// The renderer's own motion of a wall whose distance is known, against the pinhole's equations.
#include "render/viewer/motion_pass.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "render/gl/context.hpp"
#include "render/scene/model_builder.hpp"

using namespace fovea;
using viewer::MotionPass;

namespace {

constexpr int kSize = 128;
constexpr double kAway_m = 4;

class MotionPassTest : public testing::Test {
protected:
    static void SetUpTestSuite() {
        auto c = gl::Context::create();
        if (c) context_.emplace(std::move(*c));
    }
    static void TearDownTestSuite() { context_.reset(); }
    void SetUp() override {
        if (!context_) GTEST_SKIP() << "no OpenGL ES context";
        scene::ModelBuilder b;
        b.material({});
        b.quad({-20, -20, -4}, {20, -20, -4}, {20, 0.5f, -4}, {-20, 0.5f, -4});   // above it: the sky
        b.node(b.end_mesh());
        scene::Source source;
        source.name = "wall";
        source.stand = scene::Pose{};
        source.model = b.take(0);
        auto made = scene::Scene::create({.name = "wall", .speed = 0}, std::move(source));
        ASSERT_TRUE(made.has_value());
        scene_.emplace(std::move(*made));
        const scene::SceneView views[] = {view_};
        scene_->record(0, views, draws_);
    }
    void draw(const MotionPass::Cameras& cameras, std::span<const scene::ObjectMotion> objects = {}) {
        const auto drawn = pass_.draw(draws_, 0, view_, kSize, kSize, cameras, objects);
        ASSERT_TRUE(drawn.has_value());
        ASSERT_EQ(pass_.columns(), kSize / 2);
        ASSERT_EQ(pass_.rows(), kSize / 2);
    }
    // The cell's place on the wall, as a tangent; rows run from the bottom.
    static double tangent(int cell) { return 2 * (cell + 0.5) / (kSize / 2.0) - 1; }
    static std::size_t at(int x, int y) { return static_cast<std::size_t>(y) * (kSize / 2) + static_cast<std::size_t>(x); }

    static inline std::optional<gl::Context> context_;
    scene::SceneView view_{.fov = {.tan_left = -1, .tan_right = 1, .tan_up = 1, .tan_down = -1}, .offset_m = 0};
    std::optional<scene::Scene> scene_;
    gl::CommandList draws_;
    MotionPass pass_;
};

constexpr double kPxPerTangent = kSize / 2.0;

TEST_F(MotionPassTest, DepthIsTheDistanceAlongTheView) {
    draw({});
    EXPECT_NEAR(pass_.depth()[at(5, 10)], kAway_m, 0.01);
    EXPECT_NEAR(pass_.depth()[at(60, 30)], kAway_m, 0.01);
    EXPECT_GT(pass_.depth()[at(30, 60)], 100) << "nothing was drawn there";
    for (const float m : pass_.motion_px()) EXPECT_NEAR(m, 0, 1e-3);
    for (const float m : pass_.ahead_px()) EXPECT_NEAR(m, 0, 1e-3);
}

TEST_F(MotionPassTest, AStepAndATurnAreThoseOfThePinhole) {
    MotionPass::Cameras cameras;
    cameras.before.x_m = -0.1;
    cameras.then.x_m = 0.05;
    cameras.then.yaw_rad = 0.02;   // to the left: what is seen goes to the right
    cameras.factor = 0.5;
    draw(cameras);
    for (const int x : {3, 31, 60}) {
        const double t = tangent(x), y = tangent(20), z = (t * kAway_m - 0.05) * std::sin(0.02);
        EXPECT_NEAR(pass_.motion_px()[2 * at(x, 20)], -0.1 / kAway_m * kPxPerTangent, 0.01) << x;
        EXPECT_NEAR(pass_.motion_px()[2 * at(x, 20) + 1], 0, 0.01) << x;
        const double turned = std::tan(std::atan((t * kAway_m - 0.05) / kAway_m) + 0.02);
        EXPECT_NEAR(pass_.ahead_px()[2 * at(x, 20)], (turned - t) * kPxPerTangent, 0.03) << x;
        const double away = kAway_m * std::cos(0.02) - z;
        EXPECT_NEAR(pass_.ahead_px()[2 * at(x, 20) + 1], (y * kAway_m / away - y) * kPxPerTangent, 0.03) << x;
    }
    // The sky is too far away for a step to show.
    EXPECT_NEAR(pass_.motion_px()[2 * at(30, 60)], 0, 0.02);
}

TEST_F(MotionPassTest, AnObjectGoesOnAsItDid) {
    scene::ObjectMotion moved;
    moved.world_from_object = moved.previous_world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    moved.previous_world_from_object[12] = -0.2;   // it came from the left
    moved.bounds = {{0.0f, -20, -5}, {20, 20, -3}};
    draw({.before = {}, .now = {}, .then = {}, .factor = 0.5}, {&moved, 1});
    EXPECT_NEAR(pass_.motion_px()[2 * at(50, 20)], 0.2 / kAway_m * kPxPerTangent, 0.01);
    EXPECT_NEAR(pass_.ahead_px()[2 * at(50, 20)], 0.1 / kAway_m * kPxPerTangent, 0.01);
    EXPECT_NEAR(pass_.motion_px()[2 * at(10, 20)], 0, 0.01) << "outside of its bounds";
    EXPECT_NEAR(pass_.ahead_px()[2 * at(10, 20)], 0, 0.01);
}

TEST_F(MotionPassTest, WhatWasBehindTheCameraHasNoMotion) {
    MotionPass::Cameras cameras;
    cameras.before.z_m = -8;   // beyond the wall, which is behind it
    draw(cameras);
    EXPECT_EQ(pass_.motion_px()[2 * at(20, 20)], viewer::kNoMotion_px);
}

}  // namespace
