// Numbers out of a glTF file's buffers: every offset, stride, count and type is checked before a byte is read.
//
// Errors: name the accessor and what is wrong with it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace tinygltf {
class Model;
}

namespace fovea::scene {

struct Numbers {
    std::size_t count = 0, per = 0;   // elements, numbers per element
    std::vector<float> values;        // normalised integers become [0, 1] or [-1, 1]
};

// per: how many numbers an element must have (1 to 4). most: elements. file: for errors.
[[nodiscard]] Result<Numbers> read_numbers(const tinygltf::Model& gltf, int accessor, std::size_t per, std::size_t most, const std::string& file);
// Unsigned integers.
[[nodiscard]] Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& gltf, int accessor, std::size_t most, const std::string& file);

// A part of a buffer that lies inside it; nothing otherwise.
struct ByteRange {
    const std::uint8_t* first = nullptr;
    std::size_t size = 0;
};
[[nodiscard]] Result<ByteRange> view_bytes(const tinygltf::Model& gltf, int buffer_view, const std::string& file);

}  // namespace fovea::scene
