// The scene `thin`: what is narrower than a pixel of the periphery.
#include <cmath>

#include "render/scene/generators.hpp"
#include "render/scene/model_builder.hpp"

namespace fovea::scene {
namespace {

constexpr float kTau = 6.28318530718f;
using P3 = ModelBuilder::P3;

// A wire that sags between two points.
void sagging(ModelBuilder& b, const P3& from, const P3& to, float sag_m, float radius_m) {
    constexpr int kPieces = 12;
    P3 last = from;
    for (int i = 1; i <= kPieces; ++i) {
        const float t = static_cast<float>(i) / kPieces;
        const P3 p{from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]) - 4 * sag_m * t * (1 - t), from[2] + t * (to[2] - from[2])};
        b.tube(last, p, radius_m, 5);
        last = p;
    }
}

void railing(ModelBuilder& b, float z, float half_width_m) {
    for (float y : {0.95f, 0.52f, 0.12f}) b.tube({-half_width_m, y, z}, {half_width_m, y, z}, y > 0.9f ? 0.012f : 0.006f, 8);
    const int bars = static_cast<int>(half_width_m * 2 / 0.11f);
    for (int i = 0; i <= bars; ++i) {
        const float x = -half_width_m + 2 * half_width_m * static_cast<float>(i) / static_cast<float>(bars);
        b.tube({x, 0, z}, {x, 0.95f, z}, 0.005f, 6);
        if (i % 16 == 15) b.end_part();
    }
    b.end_part();
}

// Wire mesh of diamonds between two posts.
void fence(ModelBuilder& b, float x, float z, float width_m, float height_m) {
    for (const float at : {x, x + width_m}) b.tube({at, 0, z}, {at, height_m + 0.1f, z}, 0.02f, 10);
    constexpr float kPitch_m = 0.07f;
    const int wires = static_cast<int>((width_m + height_m) / kPitch_m);
    for (int i = 1; i < wires; ++i) {
        const float s = kPitch_m * static_cast<float>(i);   // where the wire meets the lower edge, or would
        const float low = std::fmax(0.0f, s - width_m), high = std::fmin(s, height_m);
        for (const bool rising : {false, true}) {
            const auto at = [&](float y) { return rising ? x + width_m - (s - y) : x + (s - y); };
            b.tube({at(low), low, z}, {at(high), high, z}, 0.0015f, 4);
        }
        if (i % 12 == 11) b.end_part();
    }
    b.end_part();
}

void pylon(ModelBuilder& b, float x, float z, float height_m) {
    for (int side = 0; side < 4; ++side) {
        const float a = kTau * (static_cast<float>(side) + 0.5f) / 4, n = kTau * (static_cast<float>(side) + 1.5f) / 4, r = 0.45f;
        const auto at = [&](float angle, float t) { return P3{x + r * (1 - 0.8f * t) * std::sin(angle), height_m * t, z + r * (1 - 0.8f * t) * std::cos(angle)}; };
        b.tube(at(a, 0), at(a, 1), 0.012f, 6);
        for (int i = 0; i < 7; ++i) {
            const float t0 = static_cast<float>(i) / 7, t1 = static_cast<float>(i + 1) / 7;
            b.tube(at(a, t0), at(n, t1), 0.006f, 5);
            b.tube(at(n, t0), at(a, t1), 0.006f, 5);
        }
    }
    for (float y : {0.80f, 0.95f}) b.tube({x - 0.9f, height_m * y, z}, {x + 0.9f, height_m * y, z}, 0.012f, 6);
    b.end_part();
}

}  // namespace

Result<Model> thin_model() {
    ModelBuilder b;
    b.material({.base_color = {0.34f, 0.34f, 0.32f, 1}, .roughness = 0.9f});
    b.sheet(-12, -14, 12, 6, 24, 20, [](float x, float z) { return 0.05f * std::sin(0.7f * x) * std::cos(0.5f * z) - 0.06f; });
    b.material({.base_color = {0.05f, 0.06f, 0.07f, 1}, .metallic = 0.4f, .roughness = 0.5f});
    railing(b, 1.1f, 4.5f);
    railing(b, -3.2f, 7);
    b.material({.base_color = {0.62f, 0.64f, 0.66f, 1}, .metallic = 1, .roughness = 0.35f});
    fence(b, -3.4f, -0.9f, 2.6f, 1.8f);
    fence(b, 0.9f, -0.9f, 2.6f, 1.8f);
    b.material({.base_color = {0.30f, 0.10f, 0.05f, 1}, .roughness = 0.7f});
    for (int i = 0; i < 3; ++i) pylon(b, -7 + 7.0f * static_cast<float>(i), -7 - 1.5f * static_cast<float>(i % 2), 5.2f);
    b.material({.base_color = {0.02f, 0.02f, 0.02f, 1}, .roughness = 0.6f});
    for (int i = 0; i < 2; ++i) {
        const float x0 = -7 + 7.0f * static_cast<float>(i), z0 = -7 - 1.5f * static_cast<float>(i % 2), z1 = -7 - 1.5f * static_cast<float>((i + 1) % 2);
        for (float y : {0.80f, 0.95f})
            for (float off : {-0.9f, -0.45f, 0.45f, 0.9f}) sagging(b, {x0 + off, 5.2f * y, z0}, {x0 + 7 + off, 5.2f * y, z1}, 0.5f, 0.006f);
        b.end_part();
    }
    b.node(b.end_mesh());
    return b.take();
}

}  // namespace fovea::scene
