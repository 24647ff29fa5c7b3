#include "render/scene/gltf.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include "render/scene/gltf_accessors.hpp"
#include "render/scene/gltf_parts.hpp"
#include "render/scene/image_file.hpp"

namespace fovea::scene {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExportAgain = "the file is damaged or was cut off: export it again";
// Extensions that a file may require: these change nothing that is drawn wrongly without them.
constexpr const char* kKnownExtensions[] = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_materials_emissive_strength", "KHR_lights_punctual"};

// What tinygltf's callbacks know.
struct Files {
    fs::path folder;
    std::size_t left = 0;   // bytes that may still be read
    std::string refused;    // the first reason
};

bool exists(const std::string& name, void* user) {
    const Files& files = *static_cast<Files*>(user);
    std::error_code ignored;
    const fs::path path = fs::weakly_canonical(name, ignored), folder = fs::weakly_canonical(files.folder, ignored);
    const auto [end, unused] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
    return end == folder.end() && fs::is_regular_file(path, ignored);
}

bool read(std::vector<unsigned char>* out, std::string* error, const std::string& name, void* user) {
    Files& files = *static_cast<Files*>(user);
    std::error_code failed;
    const auto size = fs::file_size(name, failed);
    if (failed || size > files.left) {
        files.refused = failed ? failed.message() : name + " and the files before it are too large";
        if (error != nullptr) *error = files.refused;
        return false;
    }
    files.left -= size;
    out->resize(size);
    return static_cast<bool>(std::ifstream(name, std::ios::binary).read(reinterpret_cast<char*>(out->data()), static_cast<std::streamsize>(size)));
}

// Keeps a picture's file as it is: it is decoded later, within the limits. One in a buffer view is not touched here:
// tinygltf has not checked where it ends.
bool keep_image(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes, int size, void*) {
    if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
    return true;
}

// How deep the text nests, and how many objects it has: before anything is built from it.
struct Shape {
    std::size_t depth = 0, objects = 0;
};
Shape shape_of(std::string_view json) noexcept {
    Shape s;
    std::size_t depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (quoted) {
            if (c == '\\') ++i;
            else if (c == '"') quoted = false;
            continue;
        }
        if (c == '"') quoted = true;
        s.objects += c == '{';
        if (c == '{' || c == '[') s.depth = std::max(s.depth, ++depth);
        if ((c == '}' || c == ']') && depth > 0) --depth;
    }
    return s;
}

std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
    std::uint32_t v = 0;
    for (std::size_t i = 0; i < 4; ++i) v |= std::uint32_t{bytes[at + i]} << (8 * i);
    return v;
}

// The JSON text of either form of file.
Result<std::string_view> json_text(std::span<const std::uint8_t> bytes, bool binary, const std::string& name) {
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    if (!binary) return std::string_view(text, bytes.size());
    if (bytes.size() < 20) return fail("a .glb of " + std::to_string(bytes.size()) + " bytes: the header alone has 20", name, kExportAgain);
    if (word(bytes, 4) != 2) return fail("glTF version " + std::to_string(word(bytes, 4)), name, "export it as glTF 2.0");
    const std::size_t length = word(bytes, 12);
    if (word(bytes, 8) > bytes.size() || length > bytes.size() - 20)
        return fail("the file says that it has " + std::to_string(word(bytes, 8)) + " bytes, and has " + std::to_string(bytes.size()), name, kExportAgain);
    return std::string_view(text + 20, length);
}

// What tinygltf would build too much from, or explain badly.
Result<void> check_json(std::string_view text, bool binary, const std::string& name, const GltfLimits& limits) {
    if (text.size() > limits.json_bytes) return fail("its description has " + std::to_string(text.size()) + " bytes", name, "keep meshes and pictures in files of their own, or export as .glb");
    const Shape shape = shape_of(text);
    if (shape.depth > limits.depth || shape.objects > limits.objects)
        return fail("its description nests " + std::to_string(shape.depth) + " deep and has " + std::to_string(shape.objects) + " objects", name,
                    "at most " + std::to_string(limits.depth) + " and " + std::to_string(limits.objects) + ": join objects before the export");
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return fail("not glTF: its description is no JSON object", name, "is it a .gltf or .glb file, and whole?");
    const auto asset = json.find("asset");
    if (asset == json.end() || !asset->is_object() || !asset->contains("version") || !(*asset)["version"].is_string())
        return fail("not glTF: it has no asset.version", name, "is it a .gltf or .glb file?");
    if (const std::string version = (*asset)["version"]; !version.starts_with("2.")) return fail("glTF version " + version, name, "export it as glTF 2.0");
    if (const auto required = json.find("extensionsRequired"); required != json.end() && required->is_array())
        for (const auto& e : *required) {
            const std::string extension = e.is_string() ? e.get<std::string>() : "";
            if (std::ranges::find(kKnownExtensions, extension) != std::end(kKnownExtensions)) continue;
            const char* way_out = extension.find("draco") != extension.npos || extension.find("meshopt") != extension.npos
                                      ? "export without mesh compression, or run: gltf-transform copy IN OUT (decompresses)"
                                  : extension.find("texture") != extension.npos ? "export with PNG or JPEG textures and without texture extensions"
                                                                                : "export without it";
            return fail("needs the extension " + extension, name, way_out);
        }
    if (const auto buffers = json.find("buffers"); buffers != json.end() && buffers->is_array()) {
        double total = 0;
        for (const auto& b : *buffers)
            if (b.is_object() && b.contains("byteLength") && b["byteLength"].is_number()) total += std::max(0.0, b["byteLength"].get<double>());
        if (total > static_cast<double>(limits.file_bytes)) return fail("its buffers claim " + std::to_string(total / 1e6) + " MB", name, "reduce the scene");
        if (binary && buffers->size() > 64) return fail("it has " + std::to_string(buffers->size()) + " buffers", name, "export it with one");
    }
    return {};
}

Result<std::vector<Image>> read_images(const tinygltf::Model& gltf, const std::string& name, const GltfLimits& limits, const std::vector<bool>& used) {
    std::vector<Image> images(gltf.images.size());
    std::size_t left = limits.pixels;
    for (std::size_t i = 0; i < images.size(); ++i) {
        if (!used[i]) continue;
        const tinygltf::Image& from = gltf.images[i];
        const std::string where = name + ": picture " + std::to_string(i) + (from.uri.empty() ? "" : " (" + from.uri + ")");
        std::span<const std::uint8_t> bytes = from.image;
        if (from.bufferView >= 0) {
            const auto view = view_bytes(gltf, from.bufferView, name);
            if (!view) return std::unexpected(view.error());
            bytes = {view->first, view->size};
        }
        if (bytes.empty()) return fail("the picture cannot be read", where, "it must lie beside the scene's file or below it");
        auto image = decode_image(bytes, left, where);
        if (!image) return std::unexpected(image.error());
        left -= image->rgba.size() / 4;
        images[i] = *std::move(image);
    }
    return images;
}

// The author's own words, as JSON.
std::string declared_by(std::string_view text) {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    const auto extras = [](const nlohmann::json& of) -> std::string {
        if (!of.is_object() || !of.contains("extras") || !of["extras"].is_object() || !of["extras"].contains("fovea")) return {};
        return of["extras"]["fovea"].dump();
    };
    if (const auto scenes = json.find("scenes"); scenes != json.end() && scenes->is_array() && !scenes->empty()) {
        const auto chosen = json.find("scene");
        const std::size_t i = chosen != json.end() && chosen->is_number_unsigned() ? chosen->get<std::size_t>() : 0;
        if (i < scenes->size())
            if (auto said = extras((*scenes)[i]); !said.empty()) return said;
    }
    return extras(json["asset"]);
}

Result<Model> build(const tinygltf::Model& gltf, const std::string& name, const GltfLimits& limits) {
    Model model;
    if (auto ok = read_materials(gltf, model, name); !ok) return std::unexpected(ok.error());
    if (auto ok = read_meshes(gltf, model, name, limits); !ok) return std::unexpected(ok.error());
    if (auto ok = read_nodes(gltf, model, name, limits); !ok) return std::unexpected(ok.error());
    if (model.indices.empty()) return fail("it has no triangles", name, "lines, points and empty scenes are not drawn");
    std::vector<bool> used(gltf.images.size());
    for (const ModelMaterial& m : model.materials)
        for (const int i : {m.color_image, m.surface_image})
            if (i >= 0) used[static_cast<std::size_t>(i)] = true;
    auto images = read_images(gltf, name, limits, used);
    if (!images) return std::unexpected(images.error());
    model.images = *std::move(images);
    return model;
}

}  // namespace

Result<Model> read_gltf(std::span<const std::uint8_t> bytes, const fs::path& folder, const std::string& name, const GltfLimits& limits) {
    const bool binary = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
    const auto text = json_text(bytes, binary, name);
    if (!text) return std::unexpected(text.error());
    if (auto ok = check_json(*text, binary, name, limits); !ok) return std::unexpected(ok.error());
    if (bytes.size() > limits.file_bytes || bytes.size() > std::numeric_limits<unsigned>::max())
        return fail("a file of " + std::to_string(bytes.size()) + " bytes", name, "reduce the scene");
    Files files{folder, limits.file_bytes - bytes.size(), {}};
    try {
        tinygltf::TinyGLTF loader;
        loader.SetImageLoader(&keep_image, nullptr);
        loader.SetFsCallbacks({&exists, [](const std::string& n, void*) { return n; }, &read, nullptr, &files});
        tinygltf::Model gltf;
        std::string error, warning;
        const auto size = static_cast<unsigned>(bytes.size());
        const bool ok = binary ? loader.LoadBinaryFromMemory(&gltf, &error, &warning, bytes.data(), size, folder.string())
                               : loader.LoadASCIIFromString(&gltf, &error, &warning, reinterpret_cast<const char*>(bytes.data()), size, folder.string());
        if (!ok) {
            std::string line = error.substr(0, error.find('\n'));
            if (line.starts_with("File not found : ")) return fail("its file " + line.substr(17) + " is missing", name, "it must lie in the scene's folder or below it");
            if (line.size() > 300) line.resize(300);
            return fail("broken glTF: " + (line.empty() ? std::string("no reason given") : line), name, kExportAgain);
        }
        auto model = build(gltf, name, limits);
        if (model) model->declared = declared_by(*text);
        return model;
    } catch (const std::exception& e) {   // of tinygltf and the JSON parser; memory that is not to be had
        return fail(std::string("broken glTF: ") + e.what(), name, kExportAgain);
    }
}

Result<Model> load_gltf(const fs::path& path, const GltfLimits& limits) {
    std::error_code failed;
    if (!fs::is_regular_file(path, failed)) return fail("no such file", path.string(), "a scene is a built-in name (fovea scene list) or a .gltf or .glb file");
    const auto size = fs::file_size(path, failed);
    if (failed) return fail(failed.message(), path.string());
    if (size > limits.file_bytes) return fail("a file of " + std::to_string(size) + " bytes", path.string(), "reduce the scene");
    std::vector<std::uint8_t> bytes(size);
    if (!std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
        return fail("cannot be read", path.string());
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    return read_gltf(bytes, folder, path.string(), limits);
}

}  // namespace fovea::scene
