// The scene `specular`: polished metal whose highlights are a few pixels wide and move with the eye.
#include <cmath>

#include "render/scene/generators.hpp"
#include "render/scene/model_builder.hpp"

namespace fovea::scene {

Result<Model> specular_model() {
    ModelBuilder b;
    Dice dice(23);
    // Hammered metal: every dent has a highlight of its own.
    b.material({.base_color = {0.30f, 0.24f, 0.20f, 1}, .metallic = 1, .roughness = 0.14f});
    const auto dents = [](float x, float z) { return 0.0045f * std::sin(21 * x + 3 * std::sin(2 * z)) * std::sin(23 * z + 2 * std::sin(3 * x)); };
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            const float x = -4 + 2.0f * static_cast<float>(i), z = -4 + 2.0f * static_cast<float>(j);
            b.sheet(x, z, x + 2, z + 2, 72, 72, dents);
            b.end_part();
        }
    b.node(b.end_mesh());
    constexpr std::array<std::array<float, 3>, 4> kMetals{{{0.95f, 0.93f, 0.90f}, {1.0f, 0.78f, 0.36f}, {0.96f, 0.65f, 0.54f}, {0.55f, 0.57f, 0.62f}}};
    std::array<int, kMetals.size()> balls{}, screws{};
    for (std::size_t m = 0; m < kMetals.size(); ++m) {
        b.material({.base_color = {kMetals[m][0], kMetals[m][1], kMetals[m][2], 1}, .metallic = 1, .roughness = 0.08f + 0.03f * static_cast<float>(m)});
        b.sphere({0, 0, 0}, 1, 36, 18);
        balls[m] = b.end_mesh();
        // A bolt: thread of rings over a shank, head on top.
        b.tube({0, 0, 0}, {0, 1, 0}, 0.16f, 16);
        for (int i = 0; i < 9; ++i) b.ring({0, 0.05f + 0.09f * static_cast<float>(i), 0}, 0.17f, 0.028f, 20, 6);
        b.ring({0, 0.98f, 0}, 0.24f, 0.10f, 24, 10);
        b.sphere({0, 0.98f, 0}, 0.2f, 20, 8);
        screws[m] = b.end_mesh();
    }
    for (int i = 0; i < 90; ++i) {
        const auto m = static_cast<std::size_t>(dice.below(static_cast<int>(kMetals.size())));
        const double x = static_cast<double>(dice.uniform(-3.2f, 3.2f)), z = static_cast<double>(dice.uniform(-3.6f, 1.4f));
        if (i % 3 != 0) {
            const double r = static_cast<double>(dice.uniform(0.025f, 0.16f));
            b.node(balls[m], {.translation = {x, r, z}, .scale = {r, r, r}});
        } else {
            const double s = static_cast<double>(dice.uniform(0.18f, 0.5f)), lean = static_cast<double>(dice.uniform(-0.3f, 0.3f));
            b.node(screws[m], {.translation = {x, 0, z}, .rotation = {0, 0, std::sin(lean / 2), std::cos(lean / 2)}, .scale = {s, s, s}});
        }
    }
    return b.take();
}

}  // namespace fovea::scene
