#include "render/scene/gltf_accessors.hpp"

#include <cmath>
#include <cstring>

#include <tiny_gltf.h>

namespace fovea::scene {
namespace {

constexpr const char* kExportAgain = "the file is damaged or was cut off: export it again";

// Where the elements lie.
struct Elements {
    const std::uint8_t* first = nullptr;
    std::size_t stride = 0, count = 0;
    int type = 0;   // TINYGLTF_COMPONENT_TYPE_*
    bool normalized = false;
};

std::size_t component_bytes(int type) noexcept {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
        default: return 0;
    }
}

std::size_t components(int type) noexcept {
    switch (type) {
        case TINYGLTF_TYPE_SCALAR: return 1;
        case TINYGLTF_TYPE_VEC2: return 2;
        case TINYGLTF_TYPE_VEC3: return 3;
        case TINYGLTF_TYPE_VEC4: return 4;
        default: return 0;
    }
}

Result<Elements> elements(const tinygltf::Model& gltf, int index, std::size_t per, std::size_t most, const std::string& file) {
    const auto bad = [&](const std::string& what, const char* way_out = kExportAgain) { return fail("accessor " + std::to_string(index) + " " + what, file, way_out); };
    if (index < 0 || static_cast<std::size_t>(index) >= gltf.accessors.size()) return bad("does not exist");
    const tinygltf::Accessor& a = gltf.accessors[static_cast<std::size_t>(index)];
    if (a.sparse.isSparse) return bad("is sparse, which is not read", "export without sparse accessors");
    if (a.bufferView < 0) return bad("has no buffer view", "a compressed mesh? Export without Draco or meshopt compression");
    const std::size_t bytes = component_bytes(a.componentType);
    if (components(a.type) != per || bytes == 0) return bad("has the wrong type");
    const auto view = view_bytes(gltf, a.bufferView, file);
    if (!view) return std::unexpected(view.error());
    const std::size_t element = bytes * per, declared = gltf.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
    const std::size_t stride = declared != 0 ? declared : element;
    if (stride < element || stride > 252 + element) return bad("has the wrong stride");
    if (a.count == 0) return bad("is empty");
    if (a.count > most) return bad("has " + std::to_string(a.count) + " elements", "reduce the scene: at most 16 million vertices and 48 million indices are drawn");
    if (a.byteOffset > view->size || view->size - a.byteOffset < element || (view->size - a.byteOffset - element) / stride < a.count - 1)
        return bad("reaches beyond its buffer view");
    return Elements{view->first + a.byteOffset, stride, a.count, a.componentType, a.normalized};
}

template <class T>
T load(const std::uint8_t* at) noexcept {
    T v;
    std::memcpy(&v, at, sizeof v);
    return v;
}

float number(const std::uint8_t* at, int type, bool normalized) noexcept {
    const auto scaled = [&](auto v, float most) {
        const float f = static_cast<float>(v);
        return normalized ? std::fmax(f / most, -1.0f) : f;
    };
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE: return scaled(load<std::int8_t>(at), 127);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return scaled(*at, 255);
        case TINYGLTF_COMPONENT_TYPE_SHORT: return scaled(load<std::int16_t>(at), 32767);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return scaled(load<std::uint16_t>(at), 65535);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return static_cast<float>(load<std::uint32_t>(at));
        default: return load<float>(at);
    }
}

}  // namespace

Result<ByteRange> view_bytes(const tinygltf::Model& gltf, int index, const std::string& file) {
    const auto bad = [&](const char* what) { return fail("buffer view " + std::to_string(index) + " " + what, file, kExportAgain); };
    if (index < 0 || static_cast<std::size_t>(index) >= gltf.bufferViews.size()) return bad("does not exist");
    const tinygltf::BufferView& v = gltf.bufferViews[static_cast<std::size_t>(index)];
    if (v.buffer < 0 || static_cast<std::size_t>(v.buffer) >= gltf.buffers.size()) return bad("is in no buffer");
    const auto& data = gltf.buffers[static_cast<std::size_t>(v.buffer)].data;
    if (v.byteOffset > data.size() || v.byteLength > data.size() - v.byteOffset) return bad("reaches beyond its buffer");
    return ByteRange{data.data() + v.byteOffset, v.byteLength};
}

Result<Numbers> read_numbers(const tinygltf::Model& gltf, int accessor, std::size_t per, std::size_t most, const std::string& file) {
    const auto e = elements(gltf, accessor, per, most, file);
    if (!e) return std::unexpected(e.error());
    Numbers n{e->count, per, {}};
    n.values.resize(e->count * per);
    const std::size_t bytes = component_bytes(e->type);
    for (std::size_t i = 0; i < e->count; ++i)
        for (std::size_t k = 0; k < per; ++k) {
            const float v = number(e->first + i * e->stride + k * bytes, e->type, e->normalized);
            if (!std::isfinite(v)) return fail("accessor " + std::to_string(accessor) + " holds a number that is not finite, at element " + std::to_string(i), file, kExportAgain);
            n.values[i * per + k] = v;
        }
    return n;
}

Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& gltf, int accessor, std::size_t most, const std::string& file) {
    const auto e = elements(gltf, accessor, 1, most, file);
    if (!e) return std::unexpected(e.error());
    std::vector<std::uint32_t> indices(e->count);
    for (std::size_t i = 0; i < e->count; ++i) {
        const std::uint8_t* at = e->first + i * e->stride;
        switch (e->type) {
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: indices[i] = *at; break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: indices[i] = load<std::uint16_t>(at); break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: indices[i] = load<std::uint32_t>(at); break;
            default: return fail("accessor " + std::to_string(accessor) + " holds no indices: they are unsigned integers", file, kExportAgain);
        }
    }
    return indices;
}

}  // namespace fovea::scene
