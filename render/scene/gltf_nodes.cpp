#include <algorithm>
#include <cmath>

#include <tiny_gltf.h>

#include "render/scene/gltf_accessors.hpp"
#include "render/scene/gltf_parts.hpp"

namespace fovea::scene {
namespace {

constexpr const char* kExportAgain = "the file is damaged or was cut off: export it again";
constexpr std::size_t kMostKeys = 4'000'000;   // of all tracks

bool all_finite(const std::vector<double>& v) noexcept {
    return std::ranges::all_of(v, [](double x) { return std::isfinite(x) && std::abs(x) < 1e12; });
}

Result<Node> node_of(const tinygltf::Node& from, const std::string& where, const std::string& file) {
    Node n;
    if (!all_finite(from.matrix) || !all_finite(from.translation) || !all_finite(from.rotation) || !all_finite(from.scale))
        return fail(where + " has a transform that is not finite", file, kExportAgain);
    if (from.matrix.size() == 16) {
        n.matrix.emplace();
        std::ranges::copy(from.matrix, n.matrix->begin());
    }
    if (from.translation.size() == 3) std::ranges::copy(from.translation, n.placement.translation.begin());
    if (from.rotation.size() == 4) std::ranges::copy(from.rotation, n.placement.rotation.begin());
    if (from.scale.size() == 3) std::ranges::copy(from.scale, n.placement.scale.begin());
    n.mesh = from.mesh;
    return n;
}

// Yaw and pitch of a camera that looks along its node's -z.
Pose pose_of(const Mat4& m) noexcept {
    Pose p;
    p.x_m = m[12];
    p.y_m = m[13];
    p.z_m = m[14];
    const double back[3] = {m[8], m[9], m[10]}, l = std::sqrt(back[0] * back[0] + back[1] * back[1] + back[2] * back[2]);
    if (l > 0) {
        p.yaw_rad = std::atan2(back[0], back[2]);
        p.pitch_rad = std::asin(std::clamp(-back[1] / l, -1.0, 1.0));
    }
    return p;
}

Result<void> read_track(const tinygltf::Model& gltf, const tinygltf::Animation& a, const tinygltf::AnimationChannel& c, const std::vector<int>& place,
                        const std::string& where, const std::string& file, std::size_t& keys_left, Model& model) {
    const bool rotation = c.target_path == "rotation";
    if (!rotation && c.target_path != "translation" && c.target_path != "scale") {
        if (std::ranges::find(model.remarks, "morph targets are left out") == model.remarks.end()) model.remarks.emplace_back("morph targets are left out");
        return {};
    }
    if (c.sampler < 0 || static_cast<std::size_t>(c.sampler) >= a.samplers.size()) return fail(where + " has no sampler", file, kExportAgain);
    if (c.target_node < 0) return {};
    if (static_cast<std::size_t>(c.target_node) >= gltf.nodes.size()) return fail(where + " moves a node that does not exist", file, kExportAgain);
    if (place[static_cast<std::size_t>(c.target_node)] < 0) return {};   // of another scene
    const tinygltf::AnimationSampler& s = a.samplers[static_cast<std::size_t>(c.sampler)];
    const auto times = read_numbers(gltf, s.input, 1, keys_left, file);
    if (!times) return std::unexpected(times.error());
    const bool spline = s.interpolation == "CUBICSPLINE";
    const std::size_t per = rotation ? 4 : 3, expected = times->count * (spline ? 3 : 1);
    const auto values = read_numbers(gltf, s.output, per, keys_left, file);
    if (!values) return std::unexpected(values.error());
    if (values->count != expected) return fail(where + " has " + std::to_string(times->count) + " times and " + std::to_string(values->count) + " values", file, kExportAgain);
    keys_left -= std::min(keys_left, expected);
    Track t;
    t.node = static_cast<std::uint32_t>(place[static_cast<std::size_t>(c.target_node)]);
    t.path = rotation ? Track::Path::rotation : c.target_path == "scale" ? Track::Path::scale : Track::Path::translation;
    t.step = s.interpolation == "STEP";
    t.times_s = times->values;
    if (!std::ranges::is_sorted(t.times_s) || t.times_s.front() < 0) return fail(where + " has times that go back", file, kExportAgain);
    t.values.resize(times->count);
    for (std::size_t i = 0; i < times->count; ++i) {
        const std::size_t at = (spline ? 3 * i + 1 : i) * per;   // a spline's tangents are left out: linear between its keys
        for (std::size_t k = 0; k < per; ++k) t.values[i][k] = values->values[at + k];
    }
    model.duration_s = std::max(model.duration_s, static_cast<double>(t.times_s.back()));
    model.tracks.push_back(std::move(t));
    return {};
}

}  // namespace

Result<void> read_nodes(const tinygltf::Model& gltf, Model& model, const std::string& file, const GltfLimits& limits) {
    const std::size_t scene = gltf.defaultScene >= 0 ? static_cast<std::size_t>(gltf.defaultScene) : 0;
    std::vector<std::pair<int, int>> open;   // node of the file, its parent's place
    if (scene < gltf.scenes.size()) {
        for (const int n : gltf.scenes[scene].nodes) open.emplace_back(n, -1);
    } else {   // no scene: everything that is nobody's child
        std::vector<bool> child(gltf.nodes.size());
        for (const auto& n : gltf.nodes)
            for (const int c : n.children)
                if (c >= 0 && static_cast<std::size_t>(c) < child.size()) child[static_cast<std::size_t>(c)] = true;
        for (std::size_t i = 0; i < gltf.nodes.size(); ++i)
            if (!child[i]) open.emplace_back(static_cast<int>(i), -1);
    }
    std::ranges::reverse(open);
    std::vector<int> place(gltf.nodes.size(), -1);   // in the model, by node of the file
    std::size_t draws = 0;
    int camera = -1;
    while (!open.empty()) {
        const auto [index, parent] = open.back();
        open.pop_back();
        const std::string where = "node " + std::to_string(index);
        if (index < 0 || static_cast<std::size_t>(index) >= gltf.nodes.size()) return fail(where + " does not exist", file, kExportAgain);
        if (place[static_cast<std::size_t>(index)] >= 0) return fail(where + " has two parents, or is its own", file, "nodes must form a tree: export it again");
        const tinygltf::Node& from = gltf.nodes[static_cast<std::size_t>(index)];
        auto node = node_of(from, where, file);
        if (!node) return std::unexpected(node.error());
        node->parent = parent;
        if (from.mesh >= 0) {
            if (static_cast<std::size_t>(from.mesh) >= model.meshes.size()) return fail(where + " has a mesh that does not exist", file, kExportAgain);
            draws += model.meshes[static_cast<std::size_t>(from.mesh)].count;
            if (draws > limits.draws) return fail("more than " + std::to_string(limits.draws) + " objects", file, "join objects with the same material before the export");
        }
        const int at = static_cast<int>(model.nodes.size());
        place[static_cast<std::size_t>(index)] = at;
        if (from.camera >= 0 && camera < 0) camera = at;
        model.nodes.push_back(*std::move(node));
        for (const int c : from.children) open.emplace_back(c, at);
    }
    std::size_t keys_left = kMostKeys;
    for (std::size_t a = 0; a < gltf.animations.size(); ++a)
        for (std::size_t c = 0; c < gltf.animations[a].channels.size(); ++c) {
            const std::string where = "animation " + std::to_string(a) + ", channel " + std::to_string(c);
            if (auto ok = read_track(gltf, gltf.animations[a], gltf.animations[a].channels[c], place, where, file, keys_left, model); !ok) return ok;
        }
    std::ranges::stable_sort(model.tracks, {}, &Track::node);
    if (camera >= 0) {
        std::vector<Mat4> world(model.nodes.size());
        place_nodes(model, 0, world);
        model.camera = pose_of(world[static_cast<std::size_t>(camera)]);
    }
    return {};
}

}  // namespace fovea::scene
