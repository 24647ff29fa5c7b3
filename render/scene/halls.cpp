#include <cmath>

#include "render/scene/generators.hpp"
#include "render/scene/shaders.hpp"

namespace fovea::scene {
namespace {

void hall(MeshBuilder& m) {
    m.material(kMarble);
    m.room({-4, 0, -4}, {4, 4.2f, 4});
}

}  // namespace

Mesh box_mesh() {
    MeshBuilder m;
    hall(m);
    m.end_chunk();
    constexpr std::uint8_t kMaterials[] = {kWood, kAnodised, kEpoxy, kMetal, kWood, kMarble, kCeramic, kAnodised};
    for (int i = 0; i < 8; ++i) {
        const float angle = 0.785398f * static_cast<float>(i) + 0.3f, r = i % 2 == 0 ? 2.2f : 3.0f;
        const float x = r * std::cos(angle), z = r * std::sin(angle), half = 0.35f + 0.08f * static_cast<float>(i % 3);
        const float low = i % 3 == 1 ? 0.9f : 0.0f;
        m.material(kMaterials[i], static_cast<std::uint8_t>(37 * i));
        m.box({x - half, low, z - half}, {x + half, low + 2 * half, z + half}, true);
        m.end_chunk();
    }
    return m.take();
}

Mesh reading_room_mesh() {
    MeshBuilder m;
    hall(m);
    m.end_chunk();
    return m.take();
}

Mesh sky_mesh() {
    MeshBuilder m;
    m.material(kSky);
    m.room({-60, -60, -60}, {60, 60, 60}, 4);
    m.end_chunk();
    return m.take();
}

Mesh hall_mesh() {
    MeshBuilder m;
    hall(m);
    m.end_chunk();
    Dice dice(7);
    for (int i = 0; i < 16; ++i) {
        const float x = -3.0f + 2.0f * static_cast<float>(i % 4), z = -3.0f + 2.0f * static_cast<float>(i / 4);
        m.material(i % 2 == 0 ? kWood : kMarble, static_cast<std::uint8_t>(dice.below(256)));
        m.cylinder({x, 0, z}, 0.22f, dice.uniform(0.6f, 1.6f), 40, 0.04f);
        m.material(i % 3 == 0 ? kMetal : kAnodised, static_cast<std::uint8_t>(dice.below(256)));
        m.dome({x + 0.8f, 0, z + 0.7f}, 0.35f, 0.45f, 24, 8);
        m.end_chunk();
    }
    return m.take();
}

Mesh dunes_mesh() {
    constexpr int kBlocks = 10, kQuads = 100;   // per side
    constexpr float kBlock = 2.0f;
    MeshBuilder m;
    m.material(kEpoxy, 3);
    for (int j = 0; j < kBlocks; ++j)
        for (int i = 0; i < kBlocks; ++i) {
            const float x = (static_cast<float>(i) - kBlocks / 2) * kBlock, z = (static_cast<float>(j) - kBlocks / 2) * kBlock;
            m.material(i % 2 == j % 2 ? kAnodised : kCeramic, 200);
            m.floor(x, z, x + kBlock, z + kBlock, 0, kQuads, kQuads);
            m.end_chunk();
        }
    Mesh mesh = m.take();
    const auto height = [](float x, float z) {
        return 0.25f * std::sin(1.3f * x + 0.4f * z) + 0.15f * std::sin(2.9f * z - 0.8f * x) + 0.03f * std::sin(11.0f * x) * std::cos(13.0f * z);
    };
    for (Vertex& v : mesh.vertices) {
        const float x = v.position[0], z = v.position[2], e = 0.004f;
        v.position[1] = height(x, z);
        const float nx = (height(x - e, z) - height(x + e, z)) / (2 * e), nz = (height(x, z - e) - height(x, z + e)) / (2 * e);
        const float l = 127.0f / std::sqrt(nx * nx + 1 + nz * nz);
        v.normal = {static_cast<std::int8_t>(nx * l), static_cast<std::int8_t>(l), static_cast<std::int8_t>(nz * l), 0};
    }
    for (Chunk& c : mesh.chunks) {
        c.bounds.low[1] = -0.45f;
        c.bounds.high[1] = 0.45f;
    }
    return mesh;
}

}  // namespace fovea::scene
