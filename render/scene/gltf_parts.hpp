// The parts of a parsed glTF file, turned into those of a Model: materials, meshes, nodes with their animation.
//
// Errors: as load_gltf().
#pragma once

#include "protocol/error.hpp"
#include "render/scene/gltf.hpp"

namespace tinygltf {
class Model;
}

namespace fovea::scene {

[[nodiscard]] Result<void> read_materials(const tinygltf::Model& gltf, Model& model, const std::string& file);
[[nodiscard]] Result<void> read_meshes(const tinygltf::Model& gltf, Model& model, const std::string& file, const GltfLimits& limits);
// Also tracks and the camera.
[[nodiscard]] Result<void> read_nodes(const tinygltf::Model& gltf, Model& model, const std::string& file, const GltfLimits& limits);

}  // namespace fovea::scene
