#include "render/scene/generators.hpp"

#include "render/scene/shaders.hpp"

namespace fovea::scene {
namespace {

constexpr int kCells = 13;              // per side; 169 chunks
constexpr float kCell = 2.0f;           // metres: a board to fly over, not to hold
constexpr float kHalf = kCells * kCell / 2;
constexpr std::size_t kTriangles = 55'000;   // as the circuit scene of Arm's white paper

// A bent leg that leaves the body in direction (dx, dz).
void leg(MeshBuilder& m, float x, float y, float z, float dx, float dz, float width) {
    const float px = -dz * width * 0.5f, pz = dx * width * 0.5f;
    const float reach[4] = {0, 0.05f, 0.08f, 0.14f}, height[4] = {y, y, 0.015f, 0.012f};
    for (int i = 0; i < 3; ++i) {
        const Point a{x + dx * reach[i] + px, height[i], z + dz * reach[i] + pz}, b{x + dx * reach[i] - px, height[i], z + dz * reach[i] - pz};
        const Point c{x + dx * reach[i + 1] - px, height[i + 1], z + dz * reach[i + 1] - pz}, d{x + dx * reach[i + 1] + px, height[i + 1], z + dz * reach[i + 1] + pz};
        m.quad(a, d, c, b, {0, 0}, {width, reach[i + 1] - reach[i]});
    }
}

void chip(MeshBuilder& m, Dice& dice, float x, float z, float half_x, float half_z, int legs_x, int legs_z) {
    const float height = dice.uniform(0.10f, 0.20f);
    m.material(kEpoxy, static_cast<std::uint8_t>(dice.below(256)));
    m.box({x - half_x, 0.03f, z - half_z}, {x + half_x, height, z + half_z}, false, 0.025f);
    m.material(kMetal, static_cast<std::uint8_t>(dice.below(256)));
    for (int i = 0; i < legs_x; ++i) {
        const float at = x + half_x * (2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(legs_x) - 1) * 0.94f;
        const float width = half_x / static_cast<float>(legs_x);
        leg(m, at, height * 0.5f, z + half_z, 0, 1, width);
        leg(m, at, height * 0.5f, z - half_z, 0, -1, width);
    }
    for (int i = 0; i < legs_z; ++i) {
        const float at = z + half_z * (2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(legs_z) - 1) * 0.94f;
        const float width = half_z / static_cast<float>(legs_z);
        leg(m, x + half_x, height * 0.5f, at, 1, 0, width);
        leg(m, x - half_x, height * 0.5f, at, -1, 0, width);
    }
}

void capacitor(MeshBuilder& m, Dice& dice, float x, float z, float radius) {
    m.material(kAluminium, static_cast<std::uint8_t>(dice.below(256)));
    m.cylinder({x, 0, z}, radius, dice.uniform(0.45f, 1.1f), 20, 0.03f);
}

void passive(MeshBuilder& m, Dice& dice, float x, float z, bool along_x) {
    const auto kind = static_cast<std::uint8_t>(dice.below(256));
    const float l = 0.10f, w = 0.05f, h = 0.05f, cap = 0.035f;
    const auto part = [&](float from, float to, float grow) {
        const float side = w + grow;
        if (along_x) m.box({x + from, 0, z - side}, {x + to, h + grow, z + side});
        else m.box({x - side, 0, z + from}, {x + side, h + grow, z + to});
    };
    m.material(kCeramic, kind);
    part(-l + cap, l - cap, 0);
    m.material(kMetal, kind);
    part(-l, -l + cap, 0.004f);
    part(l - cap, l, 0.004f);
}

void heat_sink(MeshBuilder& m, Dice& dice, float x, float z) {
    m.material(kAnodised, static_cast<std::uint8_t>(dice.below(256)));
    m.box({x - 0.6f, 0.06f, z - 0.6f}, {x + 0.6f, 0.14f, z + 0.6f});
    constexpr int kFins = 11;
    for (int i = 0; i < kFins; ++i) {
        const float at = x - 0.58f + 1.13f * static_cast<float>(i) / static_cast<float>(kFins - 1);
        m.box({at, 0.14f, z - 0.58f}, {at + 0.035f, 0.62f, z + 0.58f}, false, 0.01f);
    }
}

void header(MeshBuilder& m, Dice& dice, float x, float z, int pins) {
    m.material(kEpoxy, static_cast<std::uint8_t>(dice.below(256)));
    const float pitch = 0.14f, half = static_cast<float>(pins) * pitch * 0.5f;
    m.box({x - half, 0, z - pitch}, {x + half, 0.16f, z + pitch}, false, 0.012f);
    m.material(kMetal);
    for (int i = 0; i < pins * 2; ++i) {
        const float px = x - half + pitch * (static_cast<float>(i / 2) + 0.5f), pz = z + (i % 2 == 0 ? -0.5f : 0.5f) * pitch;
        m.box({px - 0.02f, 0.16f, pz - 0.02f}, {px + 0.02f, 0.42f, pz + 0.02f}, false, 0.012f);
    }
}

void lamp(MeshBuilder& m, float x, float z, int light) {
    m.material(kMetal);
    m.cylinder({x, 0, z}, 0.11f, 0.05f, 12);
    m.material(kLamp, static_cast<std::uint8_t>(light));
    m.dome({x, 0.05f, z}, 0.085f, 0.14f, 16, 6);
}

void solder_point(MeshBuilder& m, Dice& dice, float x, float z) {
    m.material(kMetal, static_cast<std::uint8_t>(dice.below(256)));
    m.dome({x, 0, z}, 0.035f, 0.025f, 8, 2);
}

// The parts of one cell whose corner is (x, z).
void populate(MeshBuilder& m, Dice& dice, float x, float z, int cell) {
    const float cx = x + kCell / 2, cz = z + kCell / 2;
    switch (dice.below(10)) {   // 7 and above: bare board
        case 0: chip(m, dice, cx, cz, 0.62f, 0.62f, 9, 9); break;
        case 1:
            chip(m, dice, cx - 0.45f, cz, 0.24f, 0.60f, 0, 9);
            chip(m, dice, cx + 0.45f, cz, 0.24f, 0.60f, 0, 9);
            break;
        case 2:
            for (int i = 0; i < 3; ++i) capacitor(m, dice, x + 0.45f + 0.58f * static_cast<float>(i), cz + dice.uniform(-0.5f, 0.5f), dice.uniform(0.16f, 0.26f));
            break;
        case 3: heat_sink(m, dice, cx, cz); break;
        case 4: header(m, dice, cx, cz, 5); break;
        case 5: chip(m, dice, cx, cz, 0.40f, 0.40f, 8, 8); break;
        case 6:
            capacitor(m, dice, cx - 0.5f, cz + 0.4f, 0.30f);
            chip(m, dice, cx + 0.4f, cz - 0.3f, 0.30f, 0.20f, 6, 0);
            break;
        default: break;
    }
    for (int i = 0; i < 2; ++i) passive(m, dice, x + 0.35f + 0.62f * static_cast<float>(i), z + 0.16f, true);
    passive(m, dice, x + 0.14f, z + 0.95f, false);
    if (cell % 7 == 3) lamp(m, x + 1.82f, z + 1.80f, cell % kLights);
}

}  // namespace

Mesh circuit_mesh() {
    MeshBuilder m;
    Dice dice(2017);
    for (int cell = 0; cell < kCells * kCells; ++cell) {
        const float x = -kHalf + static_cast<float>(cell % kCells) * kCell, z = -kHalf + static_cast<float>(cell / kCells) * kCell;
        m.material(kBoard);
        m.floor(x, z, x + kCell, z + kCell, 0, 4, 4);
        populate(m, dice, x, z, cell);
        // What the parts leave of this cell's share is spread as solder points, 28 triangles each.
        const std::size_t share = kTriangles * static_cast<std::size_t>(cell + 1) / (kCells * kCells);
        while (m.triangles() + 28 < share) solder_point(m, dice, x + dice.uniform(0.3f, 1.9f), z + dice.uniform(0.3f, 1.9f));
        m.end_chunk();
    }
    m.material(kSky);
    m.room({-60, -30, -60}, {60, 30, 60});
    m.end_chunk();
    return m.take();
}

}  // namespace fovea::scene
