// A scene of objects: meshes with materials and textures, placed by a tree of nodes that may move. No GL.
//
// What a glTF file becomes, and what the scenes that bring their own textures or moving objects are made of.
// Input: metres, +y up, counter-clockwise seen from outside; colours of materials linear, of images sRGB.
// Threads: a value.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/scene/camera.hpp"

namespace fovea::scene {

struct Image {
    int width = 0, height = 0;         // 1 to kMaxImageEdge
    std::vector<std::uint8_t> rgba;    // top row first
};
inline constexpr int kMaxImageEdge = 8192;

struct ModelMaterial {
    std::array<float, 4> base_color{1, 1, 1, 1};
    std::array<float, 3> emissive{0, 0, 0};
    float metallic = 0, roughness = 0.5f;
    int color_image = -1;      // sRGB, times base_color; -1: none
    int surface_image = -1;    // linear: green times roughness, blue times metallic; -1: none
    float alpha_cutoff = 0;    // below: not drawn; 0: everything is
    bool blend = false;        // alpha is coverage, drawn last
    bool double_sided = false;
    bool repeat = true;        // the images beyond their edges; else clamped
};

struct ModelVertex {
    std::array<float, 3> position;
    std::array<std::int16_t, 4> normal;   // snorm
    std::array<float, 2> uv;              // +v down
};

// Triangles with one material.
struct Part {
    std::uint32_t first_index = 0, index_count = 0;
    std::uint32_t material = 0;
    Aabb bounds;   // in the mesh's space
};

struct PartRange {
    std::uint32_t first = 0, count = 0;
};

using Quaternion = std::array<double, 4>;   // x y z w

struct Placement {
    std::array<double, 3> translation{0, 0, 0};
    Quaternion rotation{0, 0, 0, 1};
    std::array<double, 3> scale{1, 1, 1};
};

struct Node {
    int parent = -1;                 // an earlier node; -1: the world
    int mesh = -1;                   // -1: none
    Placement placement;             // used unless `matrix` is set
    std::optional<Mat4> matrix;
};

// One property of one node over time; repeats after the model's duration.
struct Track {
    enum class Path : std::uint8_t { translation, rotation, scale };
    std::uint32_t node = 0;
    Path path = Path::translation;
    bool step = false;               // else interpolated: linear, rotations along the shorter arc
    std::vector<float> times_s;      // rising
    std::vector<std::array<float, 4>> values;   // one per time
};

struct Model {
    std::vector<ModelVertex> vertices;
    std::vector<std::uint32_t> indices;
    std::vector<Part> parts;
    std::vector<PartRange> meshes;
    std::vector<Node> nodes;
    std::vector<ModelMaterial> materials;
    std::vector<Image> images;
    std::vector<Track> tracks;
    double duration_s = 0;           // of the tracks; 0: nothing moves
    std::optional<Pose> camera;      // where the file wants it to be seen from
    std::string declared;            // JSON text of the author's `fovea` extras; empty: none
    std::vector<std::string> remarks;   // what the file has and the drawing leaves out
};

[[nodiscard]] Mat4 matrix_of(const Placement& placement) noexcept;
// World transforms of all nodes at a time; `world` as long as the nodes. noexcept, no allocation.
void place_nodes(const Model& model, double time_s, std::span<Mat4> world) noexcept;
// True for each node that a track moves, directly or through a parent.
[[nodiscard]] std::vector<bool> moving_nodes(const Model& model);
// The box around a transformed box.
[[nodiscard]] Aabb transformed(const Mat4& m, const Aabb& box) noexcept;
// Around everything at time 0.
[[nodiscard]] Aabb bounds_of(const Model& model);
[[nodiscard]] std::array<std::int16_t, 4> snorm16(float x, float y, float z) noexcept;

}  // namespace fovea::scene
