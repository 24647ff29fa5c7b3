#include <algorithm>
#include <cmath>

#include <tiny_gltf.h>

#include "render/scene/gltf_accessors.hpp"
#include "render/scene/gltf_parts.hpp"

namespace fovea::scene {
namespace {

constexpr const char* kExportAgain = "the file is damaged or was cut off: export it again";

void remark(Model& model, const char* text) {
    if (std::ranges::find(model.remarks, text) == model.remarks.end()) model.remarks.emplace_back(text);
}

float bounded(double v, double low, double high) noexcept { return std::isfinite(v) ? static_cast<float>(std::clamp(v, low, high)) : static_cast<float>(low); }

// The picture of a texture; -1: none or one that does not exist.
Result<int> image_of(const tinygltf::Model& gltf, int texture, const std::string& file, bool* repeat) {
    if (texture < 0) return -1;
    const auto missing = [&](const char* what, int i) { return fail(std::string(what) + " " + std::to_string(i) + " does not exist", file, kExportAgain); };
    if (static_cast<std::size_t>(texture) >= gltf.textures.size()) return missing("texture", texture);
    const tinygltf::Texture& t = gltf.textures[static_cast<std::size_t>(texture)];
    if (t.source < 0) return fail("texture " + std::to_string(texture) + " has no picture", file, "export with PNG or JPEG textures and without texture extensions");
    if (static_cast<std::size_t>(t.source) >= gltf.images.size()) return missing("picture", t.source);
    if (t.sampler >= 0 && static_cast<std::size_t>(t.sampler) < gltf.samplers.size())
        *repeat = gltf.samplers[static_cast<std::size_t>(t.sampler)].wrapS != TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    return t.source;
}

// A strip or fan as single triangles.
std::vector<std::uint32_t> as_triangles(std::vector<std::uint32_t> indices, int mode) {
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        indices.resize(indices.size() / 3 * 3);
        return indices;
    }
    std::vector<std::uint32_t> list;
    if (indices.size() < 3) return list;
    list.reserve((indices.size() - 2) * 3);
    for (std::size_t i = 2; i < indices.size(); ++i) {
        const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN, odd = !fan && i % 2 == 1;
        const std::uint32_t a = fan ? indices[0] : indices[i - 2], b = indices[i - 1], c = indices[i];
        list.insert(list.end(), {odd ? b : a, odd ? a : b, c});
    }
    return list;
}

std::array<float, 3> face_normal(const float* a, const float* b, const float* c) noexcept {
    const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    std::array<float, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    const float l = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(l > 0) || !std::isfinite(l)) return {0, 1, 0};
    for (float& x : n) x /= l;
    return n;
}

class PrimitiveReader {
public:
    PrimitiveReader(const tinygltf::Model& gltf, Model& model, const std::string& file, const GltfLimits& limits)
        : gltf_(gltf), model_(model), file_(file), limits_(limits) {}

    Result<void> read(const tinygltf::Primitive& p, const std::string& where) {
        if (p.mode != TINYGLTF_MODE_TRIANGLES && p.mode != TINYGLTF_MODE_TRIANGLE_STRIP && p.mode != TINYGLTF_MODE_TRIANGLE_FAN) {
            remark(model_, "lines or points are not drawn");
            return {};
        }
        const auto attribute = [&](const std::string& name) {
            const auto at = p.attributes.find(name);
            return at != p.attributes.end() ? at->second : -1;
        };
        if (attribute("POSITION") < 0) return fail(where + " has no positions", file_, kExportAgain);
        if (attribute("COLOR_0") >= 0) remark(model_, "vertex colours are left out");
        if (attribute("JOINTS_0") >= 0) remark(model_, "skins stay in the pose they were modelled in");
        if (!p.targets.empty()) remark(model_, "morph targets are left out");
        const auto positions = read_numbers(gltf_, attribute("POSITION"), 3, limits_.vertices - model_.vertices.size(), file_);
        if (!positions) return std::unexpected(positions.error());
        const std::size_t count = positions->count;
        Numbers normals, uvs;
        if (const int a = attribute("NORMAL"); a >= 0) {
            auto n = read_numbers(gltf_, a, 3, count, file_);
            if (!n) return std::unexpected(n.error());
            normals = *std::move(n);
        }
        if (const int a = attribute("TEXCOORD_" + std::to_string(texture_set(p.material))); a >= 0) {
            auto n = read_numbers(gltf_, a, 2, count, file_);
            if (!n) return std::unexpected(n.error());
            uvs = *std::move(n);
        }
        if ((normals.count != 0 && normals.count != count) || (uvs.count != 0 && uvs.count != count)) return fail(where + " has attributes of different lengths", file_, kExportAgain);
        std::vector<std::uint32_t> indices;
        const std::size_t indices_left = limits_.indices - model_.indices.size();
        if (p.indices >= 0) {
            auto i = read_indices(gltf_, p.indices, indices_left, file_);
            if (!i) return std::unexpected(i.error());
            indices = *std::move(i);
            if (const auto most = std::ranges::max_element(indices); *most >= count)
                return fail(where + " uses vertex " + std::to_string(*most) + " of " + std::to_string(count), file_, kExportAgain);
        } else {
            indices.resize(count);
            for (std::size_t i = 0; i < count; ++i) indices[i] = static_cast<std::uint32_t>(i);
        }
        indices = as_triangles(std::move(indices), p.mode);
        const bool flat = normals.count == 0;   // the specification wants flat shading then: no vertex is shared
        const std::size_t vertices_left = limits_.vertices - model_.vertices.size();
        if (indices.size() > indices_left || (flat && indices.size() > vertices_left))
            return fail(where + " is one triangle too many", file_, "reduce the scene: at most 16 million vertices and 48 million indices are drawn");
        if (indices.empty()) return {};
        add(*positions, normals, uvs, indices, flat, p.material);
        return {};
    }

private:
    [[nodiscard]] int texture_set(int material) const noexcept {
        if (material < 0 || static_cast<std::size_t>(material) >= gltf_.materials.size()) return 0;
        const int set = gltf_.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorTexture.texCoord;
        return set >= 0 && set < 8 ? set : 0;
    }

    void add(const Numbers& positions, const Numbers& normals, const Numbers& uvs, const std::vector<std::uint32_t>& indices, bool flat, int material) {
        Part part;
        part.first_index = static_cast<std::uint32_t>(model_.indices.size());
        part.index_count = static_cast<std::uint32_t>(indices.size());
        // The last material is the specification's default.
        part.material = material >= 0 ? static_cast<std::uint32_t>(material) : static_cast<std::uint32_t>(model_.materials.size() - 1);
        const auto base = static_cast<std::uint32_t>(model_.vertices.size());
        const auto push = [&](std::size_t i, const std::array<float, 3>& n) {
            ModelVertex v{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                v.position[axis] = positions.values[i * 3 + axis];
                part.bounds.low[axis] = std::min(part.bounds.low[axis], v.position[axis]);
                part.bounds.high[axis] = std::max(part.bounds.high[axis], v.position[axis]);
            }
            const float l = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), s = l > 0 ? 1 / l : 0;
            v.normal = s > 0 && std::isfinite(s) ? snorm16(n[0] * s, n[1] * s, n[2] * s) : snorm16(0, 1, 0);
            if (uvs.count != 0) v.uv = {uvs.values[i * 2], uvs.values[i * 2 + 1]};
            model_.vertices.push_back(v);
        };
        if (flat) {
            for (std::size_t i = 0; i < indices.size(); i += 3) {
                const auto at = [&](std::size_t k) { return &positions.values[std::size_t{indices[i + k]} * 3]; };
                const auto n = face_normal(at(0), at(1), at(2));
                for (std::size_t k = 0; k < 3; ++k) {
                    push(indices[i + k], n);
                    model_.indices.push_back(base + static_cast<std::uint32_t>(i + k));
                }
            }
        } else {
            for (std::size_t i = 0; i < positions.count; ++i) push(i, {normals.values[i * 3], normals.values[i * 3 + 1], normals.values[i * 3 + 2]});
            for (const std::uint32_t i : indices) model_.indices.push_back(base + i);
        }
        model_.parts.push_back(part);
    }

    const tinygltf::Model& gltf_;
    Model& model_;
    const std::string& file_;
    const GltfLimits& limits_;
};

}  // namespace

Result<void> read_materials(const tinygltf::Model& gltf, Model& model, const std::string& file) {
    for (const tinygltf::Material& from : gltf.materials) {
        ModelMaterial m;
        const auto& pbr = from.pbrMetallicRoughness;
        for (std::size_t i = 0; i < 4 && i < pbr.baseColorFactor.size(); ++i) m.base_color[i] = bounded(pbr.baseColorFactor[i], 0, 1);
        for (std::size_t i = 0; i < 3 && i < from.emissiveFactor.size(); ++i) m.emissive[i] = bounded(from.emissiveFactor[i], 0, 1);
        m.metallic = bounded(pbr.metallicFactor, 0, 1);
        m.roughness = bounded(pbr.roughnessFactor, 0, 1);
        const auto color = image_of(gltf, pbr.baseColorTexture.index, file, &m.repeat);
        if (!color) return std::unexpected(color.error());
        const auto surface = image_of(gltf, pbr.metallicRoughnessTexture.index, file, &m.repeat);
        if (!surface) return std::unexpected(surface.error());
        m.color_image = *color;
        m.surface_image = *surface;
        m.alpha_cutoff = from.alphaMode == "MASK" ? std::max(0.001f, bounded(from.alphaCutoff, 0, 1)) : 0;
        m.blend = from.alphaMode == "BLEND";
        m.double_sided = from.doubleSided;
        if (from.normalTexture.index >= 0) remark(model, "normal maps are left out");
        if (const auto e = from.extensions.find("KHR_materials_emissive_strength"); e != from.extensions.end() && e->second.Has("emissiveStrength"))
            for (float& v : m.emissive) v *= bounded(e->second.Get("emissiveStrength").GetNumberAsDouble(), 0, 100);
        if (from.extensions.contains("KHR_materials_unlit")) {
            for (std::size_t i = 0; i < 3; ++i) m.emissive[i] = m.base_color[i];
            m.base_color = {0, 0, 0, m.base_color[3]};
        }
        model.materials.push_back(m);
    }
    model.materials.push_back({.metallic = 1, .roughness = 1});
    return {};
}

Result<void> read_meshes(const tinygltf::Model& gltf, Model& model, const std::string& file, const GltfLimits& limits) {
    PrimitiveReader reader(gltf, model, file, limits);
    for (std::size_t m = 0; m < gltf.meshes.size(); ++m) {
        PartRange range{static_cast<std::uint32_t>(model.parts.size()), 0};
        for (std::size_t i = 0; i < gltf.meshes[m].primitives.size(); ++i) {
            const tinygltf::Primitive& p = gltf.meshes[m].primitives[i];
            const std::string where = "mesh " + std::to_string(m) + " (" + gltf.meshes[m].name.substr(0, 60) + "), primitive " + std::to_string(i);
            if (p.material >= 0 && static_cast<std::size_t>(p.material) >= gltf.materials.size()) return fail(where + " has material " + std::to_string(p.material) + ", which does not exist", file, kExportAgain);
            if (auto ok = reader.read(p, where); !ok) return ok;
        }
        range.count = static_cast<std::uint32_t>(model.parts.size()) - range.first;
        model.meshes.push_back(range);
    }
    return {};
}

}  // namespace fovea::scene
