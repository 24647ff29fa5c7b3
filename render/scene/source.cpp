#include "render/scene/source.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "render/scene/generators.hpp"
#include "render/scene/gltf.hpp"

namespace fovea::scene {
namespace {

constexpr double kTau = 6.283185307179586;
constexpr double kModelRadius_m = 2.5;

struct Kind {
    SceneEntry entry;
    Mesh (*mesh)();
    Result<Model> (*model)();   // null: none
    Pose (*camera)(double time_s);
    float light_ring_m, light_height_m, light_reach_m;
};

Pose fly_over(double t) {
    const double a = 0.35 + kTau * t / 90, r = 6.2;   // one round in 90 seconds
    return {r * std::sin(a), 1.75 + 0.15 * std::sin(t * 0.4), r * std::cos(a), a + 0.16 * std::sin(t * 0.23), -0.46 + 0.05 * std::sin(t * 0.31)};
}

Pose stand_in_hall(double t) {
    return {0.8 * std::sin(t * 0.3), 1.6, 0.8 * std::cos(t * 0.3), 0.5 + kTau * t / 60, -0.12 + 0.05 * std::sin(t * 0.5)};
}

// Around a model of kModelRadius_m.
Pose walk_around(double t) {
    const double a = 0.6 + kTau * t / 60, r = 1.7 * kModelRadius_m;
    return {r * std::sin(a), 1.4 + 0.3 * std::sin(t * 0.2), r * std::cos(a), a, -std::atan2(1.4, r)};
}

Pose reading_place(double t) {
    return {0.05 * std::sin(t * 0.4), 1.5 + 0.02 * std::sin(t * 0.7), 0.68 + 0.04 * std::cos(t * 0.3), 0.10 * std::sin(t * 0.25), -0.02 * std::sin(t * 0.3)};
}

Pose balcony(double t) {
    return {0.5 * std::sin(t * 0.2), 1.7, 2.6 + 0.2 * std::cos(t * 0.2), 0.25 * std::sin(t * 0.13), -0.05 + 0.04 * std::sin(t * 0.17)};
}

Pose gallery(double t) {
    return {1.2 * std::sin(t * 0.15), 1.55, 2.9 + 0.3 * std::cos(t * 0.2), 0.22 * std::sin(t * 0.15 + 0.5), -0.22};
}

constexpr std::array kKinds{
    Kind{{"circuit", "a circuit board as a landscape, 55,000 triangles, heavy fragments"}, &circuit_mesh, nullptr, &fly_over, 5.0f, 0.9f, 4.5f},
    Kind{{"fragbox", "a marble hall of 108 triangles: only fragments cost"}, &box_mesh, nullptr, &stand_in_hall, 2.4f, 2.2f, 8.0f},
    Kind{{"frag", "the hall with columns and spheres, 9,000 triangles"}, &hall_mesh, nullptr, &stand_in_hall, 2.4f, 2.2f, 8.0f},
    Kind{{"vert", "a height field of 2 million triangles: only vertices cost"}, &dunes_mesh, nullptr, &fly_over, 5.0f, 1.5f, 7.0f},
    Kind{{"beads", "a double helix of 1,600 balls whose fragments write their own depth, in 160 small draws"}, &beads_mesh, nullptr, &gallery, 2.4f, 2.2f, 8.0f},
    Kind{{"text", "three printed pages at reading distance, letters of 4 to 30 mm"}, &reading_room_mesh, &text_model, &reading_place, 2.4f, 2.2f, 8.0f},
    Kind{{"thin", "railings, a wire fence and overhead lines of 1.5 to 12 mm before a bright sky"}, &sky_mesh, &thin_model, &balcony, 4.0f, 3.0f, 12.0f},
    Kind{{"specular", "polished balls, screws and ripples: highlights of a few pixels"}, &sky_mesh, &specular_model, &gallery, 3.0f, 2.4f, 9.0f},
    Kind{{"moving", "a hall of objects that spin, roll, swing and orbit on their own"}, &reading_room_mesh, &moving_model, &gallery, 2.4f, 2.2f, 8.0f},
};

constexpr auto kEntries = [] {
    std::array<SceneEntry, kKinds.size()> e{};
    for (std::size_t i = 0; i < e.size(); ++i) e[i] = kKinds[i].entry;
    return e;
}();

bool is_file(const std::string& scene) {
    const std::string extension = std::filesystem::path(scene).extension().string();
    return extension == ".gltf" || extension == ".glb" || scene.find('/') != scene.npos;
}

// A root node above all others, so that the model has the wanted radius around the origin.
void bring_to_size(Model& model) {
    const Aabb box = bounds_of(model);
    double radius2 = 0;
    std::array<double, 3> centre{};
    for (std::size_t i = 0; i < 3; ++i) {
        centre[i] = 0.5 * (static_cast<double>(box.low[i]) + static_cast<double>(box.high[i]));
        const double half = 0.5 * (static_cast<double>(box.high[i]) - static_cast<double>(box.low[i]));
        radius2 += half * half;
    }
    const double scale = radius2 > 0 && std::isfinite(radius2) ? kModelRadius_m / std::sqrt(radius2) : 1;
    Node root;
    for (std::size_t i = 0; i < 3; ++i) root.placement.translation[i] = -centre[i] * scale;
    root.placement.scale = {scale, scale, scale};
    for (Node& n : model.nodes) ++n.parent;   // -1 becomes the new root
    for (Track& t : model.tracks) ++t.node;
    model.nodes.insert(model.nodes.begin(), root);
}

}  // namespace

std::span<const SceneEntry> scenes() noexcept { return kEntries; }

Result<void> check_scene(const std::string& scene) {
    if (is_file(scene) || std::filesystem::path(scene).extension() == ".toml") return {};
    std::string known;
    for (const Kind& k : kKinds) {
        if (scene == k.entry.name) return {};
        known += (known.empty() ? "" : ", ") + std::string(k.entry.name);
    }
    return fail("unknown scene '" + scene + "'", {}, "known scenes: " + known + "; or the path of a .gltf or .glb file");
}

Result<Source> load_source(const std::string& scene) {
    if (auto known = check_scene(scene); !known) return std::unexpected(known.error());
    for (const Kind& k : kKinds) {
        if (scene != k.entry.name) continue;
        Source s{.name = scene, .mesh = k.mesh(), .camera = k.camera, .light_ring_m = k.light_ring_m, .light_height_m = k.light_height_m, .light_reach_m = k.light_reach_m};
        if (k.model == nullptr) return s;
        auto model = k.model();
        if (!model) return std::unexpected(model.error());
        s.model = *std::move(model);
        return s;
    }
    auto model = load_gltf(scene);
    if (!model) return std::unexpected(model.error());
    Source s{.name = scene, .mesh = sky_mesh(), .camera = &walk_around, .light_ring_m = 5, .light_height_m = 3, .light_reach_m = 10};
    if (model->camera) s.stand = model->camera;
    else bring_to_size(*model);
    s.model = *std::move(model);
    return s;
}

}  // namespace fovea::scene
