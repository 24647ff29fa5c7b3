// What a scene is made of before it is on the GPU: by name, or from a user's own file.
//
// Threads: any. Errors: an unknown name lists the known ones; a file's are those of load_gltf().
#pragma once

#include <optional>
#include <span>
#include <string>

#include "protocol/error.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/model.hpp"

namespace fovea::scene {

struct SceneEntry {
    const char* name;
    const char* summary;
};
[[nodiscard]] std::span<const SceneEntry> scenes() noexcept;

struct Source {
    std::string name;                       // the built-in's, or the file's path
    Mesh mesh;                              // procedural materials
    std::optional<Model> model{};           // textures, objects that move
    Pose (*camera)(double time_s) = nullptr;
    std::optional<Pose> stand{};            // instead of `camera`: the file's own camera
    float light_ring_m = 2.4f, light_height_m = 2.2f, light_reach_m = 8;
    double near_m = 0.08, far_m = 130;
    [[nodiscard]] std::size_t triangles() const noexcept { return mesh.triangles() + (model ? model->indices.size() / 3 : 0); }
    [[nodiscard]] Pose pose(double time_s) const noexcept { return stand ? *stand : camera(time_s); }
};

// Whether `scene` is a built-in name or looks like a file's path; the error lists the names.
[[nodiscard]] Result<void> check_scene(const std::string& scene);

// A built-in name, or the path of a .gltf or .glb file. A model of its own size is scaled to a radius of 2.5 m and walked
// around, unless the file has a camera: then it is left as it is, and seen from there.
[[nodiscard]] Result<Source> load_source(const std::string& scene);

}  // namespace fovea::scene
