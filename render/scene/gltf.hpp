// Reads a user's own scene: glTF 2.0, text (.gltf with its buffers beside it or inside) or binary (.glb).
//
// Source: Khronos glTF 2.0 specification; the container is parsed by tinygltf, everything it says is checked here.
// Read: triangles, strips and fans, indexed or not; positions, normals (made where missing), texture coordinates; base
// colour, metallic-roughness and their textures (PNG, JPEG), emission, alpha (cut out, blended), double-sided; nodes; the
// animation of nodes; the first camera; `extras.fovea` of the scene or the asset. Left out, with a remark in the model:
// skins, morph targets, vertex colours, normal maps, lines and points.
// Cost: memory is bounded by kLimits before it is taken, whatever the file claims. Files outside the scene's own folder
// are not read.
// Errors: name the file, what is wrong in it (with its index), and the way out. A hostile file is an error, never a crash.
// Threads: any.
#pragma once

#include <filesystem>
#include <span>

#include "protocol/error.hpp"
#include "render/scene/model.hpp"

namespace fovea::scene {

struct GltfLimits {
    std::size_t file_bytes = std::size_t{1} << 30;      // all files of a scene together
    std::size_t json_bytes = std::size_t{32} << 20;
    std::size_t objects = 200'000;                      // JSON objects
    std::size_t depth = 48;                             // of their nesting
    std::size_t vertices = 16'000'000, indices = 48'000'000;
    std::size_t draws = 20'000;                         // nodes times parts
    std::size_t pixels = std::size_t{128} << 20;        // of all pictures
};
inline constexpr GltfLimits kLimits{};

[[nodiscard]] Result<Model> load_gltf(const std::filesystem::path& path, const GltfLimits& limits = kLimits);
// The same from memory. folder: where the files that it names are; name: for errors.
[[nodiscard]] Result<Model> read_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder, const std::string& name,
                                      const GltfLimits& limits = kLimits);

}  // namespace fovea::scene
