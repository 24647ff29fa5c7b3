// Builds the Models of the built-in scenes: shapes with normals and texture coordinates, nodes, tracks.
//
// Input: metres, +y up. Threads: a value.
#pragma once

#include <functional>

#include "render/scene/model.hpp"

namespace fovea::scene {

class ModelBuilder {
public:
    using P3 = std::array<float, 3>;
    [[nodiscard]] int image(Image image);
    // What follows has this material.
    std::uint32_t material(const ModelMaterial& m);
    void use(std::uint32_t material) noexcept { material_ = material; }

    // Shapes go into the open mesh. a b c d counter-clockwise; uv 0..1, the first at the lower left.
    void quad(const P3& a, const P3& b, const P3& c, const P3& d);
    void box(const P3& low, const P3& high);
    // Without ends; `sides` at least 3.
    void tube(const P3& from, const P3& to, float radius, int sides);
    void sphere(const P3& middle, float radius, int around, int up);
    // Around +y in the plane y = middle.y.
    void ring(const P3& middle, float radius, float thickness, int around, int sides);
    // z over (x, z) by a function; normals by differences.
    void sheet(float x0, float z0, float x1, float z1, int nx, int nz, const std::function<float(float, float)>& height);
    // Closes the open part, so that the next shapes are culled on their own.
    void end_part();
    [[nodiscard]] int end_mesh();   // its index
    std::uint32_t node(int mesh, const Placement& placement = {}, int parent = -1);
    void track(std::uint32_t node, Track::Path path, std::vector<float> times_s, std::vector<std::array<float, 4>> values);
    [[nodiscard]] Model take(double duration_s = 0);

private:
    std::uint32_t vertex(const P3& p, const P3& n, float u, float v);
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { model_.indices.insert(model_.indices.end(), {a, b, c}); }
    Model model_;
    std::uint32_t material_ = 0, part_first_ = 0, mesh_first_ = 0;
};

}  // namespace fovea::scene
