// The scene `moving`: objects with a will of their own, on tracks that repeat after 12 seconds.
#include <algorithm>
#include <cmath>

#include "render/scene/generators.hpp"
#include "render/scene/model_builder.hpp"

namespace fovea::scene {
namespace {

constexpr float kPeriod_s = 12, kTau = 6.28318530718f;

// Squares with a finer grain inside, so that every motion shows.
Image checkers(std::array<int, 3> light, std::array<int, 3> dark, std::uint64_t seed) {
    constexpr int kSize = 256;
    Image image{kSize, kSize, std::vector<std::uint8_t>(std::size_t{kSize} * kSize * 4)};
    Dice dice(seed);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const auto& c = ((x / 32) ^ (y / 32)) % 2 == 0 ? light : dark;
            const int grain = dice.below(41) - 20;
            std::uint8_t* to = &image.rgba[(static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)) * 4];
            for (std::size_t k = 0; k < 3; ++k) to[k] = static_cast<std::uint8_t>(std::clamp(c[k] + grain, 0, 255));
            to[3] = 255;
        }
    return image;
}

using Key = std::array<float, 4>;
// A path sampled often enough that straight pieces between the keys are not seen.
template <class At>
void along(ModelBuilder& b, std::uint32_t node, Track::Path path, At at) {
    constexpr int kKeys = 96;
    std::vector<float> times;
    std::vector<Key> values;
    for (int i = 0; i <= kKeys; ++i) {
        const float part = static_cast<float>(i) / kKeys;
        times.push_back(part * kPeriod_s);
        values.push_back(at(part));
    }
    b.track(node, path, std::move(times), std::move(values));
}

Key turn(int axis, float angle) {
    Key q{0, 0, 0, std::cos(angle / 2)};
    q[static_cast<std::size_t>(axis)] = std::sin(angle / 2);
    return q;
}

}  // namespace

Result<Model> moving_model() {
    ModelBuilder b;
    const auto painted = [&](std::array<int, 3> light, std::array<int, 3> dark, std::uint64_t seed, float roughness) {
        b.material({.roughness = roughness, .color_image = b.image(checkers(light, dark, seed))});
    };
    painted({214, 92, 60}, {246, 226, 190}, 1, 0.4f);
    b.box({-0.28f, -0.28f, -0.28f}, {0.28f, 0.28f, 0.28f});
    const int cube = b.end_mesh();
    painted({40, 96, 160}, {232, 236, 240}, 2, 0.25f);
    b.sphere({0, 0, 0}, 0.3f, 32, 16);
    const int ball = b.end_mesh();
    painted({70, 140, 84}, {240, 232, 120}, 3, 0.3f);
    b.ring({0, 0, 0}, 0.42f, 0.09f, 48, 12);
    const int torus = b.end_mesh();
    painted({150, 60, 150}, {235, 220, 240}, 4, 0.5f);
    b.tube({0, 0, 0}, {0, -1.3f, 0}, 0.02f, 10);
    b.sphere({0, -1.45f, 0}, 0.2f, 28, 14);
    const int pendulum = b.end_mesh();

    // Cubes that spin, each at its own speed.
    for (int i = 0; i < 5; ++i) {
        const auto n = b.node(cube, {.translation = {-2.0 + i, 0.75 + 0.25 * (i % 2), -2.4}});
        along(b, n, Track::Path::rotation, [&](float p) { return turn(i % 3, kTau * static_cast<float>(1 + i) * p); });
    }
    // Balls that roll to and fro: turned by the way they go.
    for (int i = 0; i < 3; ++i) {
        const float z = -1.2f + 0.8f * static_cast<float>(i), reach = 1.9f - 0.3f * static_cast<float>(i), turns = static_cast<float>(2 + i);
        const auto n = b.node(ball);
        const auto x = [=](float p) { return reach * std::sin(kTau * turns * p); };
        along(b, n, Track::Path::translation, [&](float p) { return Key{x(p), 0.3f, z, 0}; });
        along(b, n, Track::Path::rotation, [&](float p) { return turn(2, -x(p) / 0.3f); });
    }
    // Rings that orbit, tumbling; one inside the other's frame.
    const auto centre = b.node(-1, {.translation = {0, 2.1, -1.2}});
    along(b, centre, Track::Path::rotation, [](float p) { return turn(1, kTau * 3 * p); });
    for (int i = 0; i < 3; ++i) {
        const double a = 2.0944 * i;
        const auto n = b.node(torus, {.translation = {1.3 * std::sin(a), 0, 1.3 * std::cos(a)}}, static_cast<int>(centre));
        along(b, n, Track::Path::rotation, [&](float p) { return turn(0, kTau * static_cast<float>(2 + i) * p); });
    }
    // Pendulums, a little out of step.
    for (int i = 0; i < 6; ++i) {
        const auto n = b.node(pendulum, {.translation = {-2.5 + i, 3.6, -3.2}});
        along(b, n, Track::Path::rotation, [&](float p) { return turn(2, 0.7f * std::sin(kTau * 4 * p + 0.5f * static_cast<float>(i))); });
    }
    return b.take(static_cast<double>(kPeriod_s));
}

}  // namespace fovea::scene
