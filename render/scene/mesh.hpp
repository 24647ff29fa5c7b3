// Builds indexed triangle meshes from quads, boxes, cylinders and domes, in chunks that are drawn and culled as one.
//
// Input: metres, +y up; counter-clockwise seen from outside.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/scene/camera.hpp"
#include "render/scene/shaders.hpp"

namespace fovea::scene {

using Point = std::array<float, 3>;

struct Vertex {
    Point position;
    std::array<std::int8_t, 4> normal;       // snorm
    std::array<float, 2> uv;                 // metres on the surface, or 0..1: the material knows
    std::array<std::uint8_t, 4> material;    // material, variant, and two bytes of its own
};

struct Chunk {
    std::uint32_t first_index = 0, index_count = 0;
    Family family = Family::board;
    Aabb bounds;
};

struct Mesh {
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> indices;
    std::vector<Chunk> chunks;
    [[nodiscard]] std::size_t triangles() const noexcept { return indices.size() / 3; }
};

class MeshBuilder {
public:
    void material(std::uint8_t id, std::uint8_t variant = 0) noexcept { material_ = {id, variant, 0, 0}; }
    // Everything added since the last call becomes one chunk per family of materials in it.
    void end_chunk();
    [[nodiscard]] Mesh take() { return std::move(mesh_); }
    [[nodiscard]] std::size_t triangles() const noexcept { return mesh_.triangles(); }

    void quad(const Point& a, const Point& b, const Point& c, const Point& d, std::array<float, 2> uv0, std::array<float, 2> uv1);
    // Five faces (no bottom) or six; uv in metres on each face. bevel > 0 chamfers the top edges.
    void box(const Point& low, const Point& high, bool bottom = false, float bevel = 0);
    // Upright; uv.x runs around (0..1), uv.y up in metres; the top's uv is -1..1 across. bevel rounds the upper rim.
    void cylinder(const Point& base, float radius, float height, int segments, float bevel = 0);
    // Upright half ellipsoid.
    void dome(const Point& base, float radius, float height, int segments, int rings);
    // A grid of nx * nz quads in the plane y; uv in metres.
    void floor(float x0, float z0, float x1, float z1, float y, int nx, int nz);
    // A box around a ball, for Family::balls: normals point to the corners, uv.x is the radius.
    void ball_box(const Point& centre, float radius);
    // A six-faced box seen from inside.
    void room(const Point& low, const Point& high, int subdivisions = 1);

private:
    std::uint32_t vertex(const Point& p, const Point& n, std::array<float, 2> uv);
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
    Mesh mesh_;
    std::array<std::uint8_t, 4> material_{};
    std::uint32_t chunk_start_ = 0;
};

// Deterministic numbers for placement: the same scene on every machine and run.
class Dice {
public:
    explicit Dice(std::uint64_t seed) noexcept : state_(seed) {}
    [[nodiscard]] std::uint64_t next() noexcept {   // splitmix64 (Steele, Lea, Flood 2014)
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    [[nodiscard]] float uniform(float low, float high) noexcept {
        return low + (high - low) * static_cast<float>(next() >> 40) * (1.0f / 16777216.0f);
    }
    [[nodiscard]] int below(int n) noexcept { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }

private:
    std::uint64_t state_;
};

}  // namespace fovea::scene
