#include "render/scene/scene.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "render/scene/generators.hpp"
#include "render/scene/shaders.hpp"

namespace fovea::scene {
namespace {

constexpr double kTau = 6.283185307179586;

// std140 layout of the block `View`.
struct ViewBlock {
    std::array<float, 16> clip_from_world;
    std::array<float, 4> eye;
    std::array<std::array<float, 4>, kLights> light_position, light_color;
    std::array<std::array<float, 4>, 15> unused;
};
static_assert(sizeof(ViewBlock) == 512, "as in the shaders; a multiple of every driver's uniform alignment (at most 256)");

constexpr std::array<std::array<float, 4>, kLights> kLightColors{{{7.0f, 2.4f, 0.7f, 0}, {0.6f, 2.6f, 7.0f, 0}, {6.5f, 0.8f, 1.6f, 0},
                                                                   {1.2f, 6.0f, 2.2f, 0}, {5.5f, 4.6f, 1.2f, 0}, {3.0f, 1.0f, 6.5f, 0}}};

}  // namespace

std::array<SceneView, 2> stereo_views(double eye_distance_m) noexcept {
    const FieldOfView left{-1.05, 0.95, 1.0, -1.0}, right{-0.95, 1.05, 1.0, -1.0};
    return {{{left, -eye_distance_m / 2}, {right, eye_distance_m / 2}}};
}

struct Scene::State {
    SceneSettings settings;
    Source source;   // without its geometry, which is on the GPU
    std::optional<ModelDraws> model;
    std::array<gl::Program, kFamilies> programs, counting;   // those that the mesh needs
    std::array<gl::Program, kFamilies> at_once_programs, at_once_counting;
    gl::ViewsAtOnce at_once;   // what those are
    gl::VertexArray arrays;
    gl::Buffer vertices, indices, views;
    std::vector<Chunk> chunks;
    std::vector<std::pair<double, std::uint32_t>> order;   // scratch of record()
    std::size_t triangles = 0;

    // The programs of the chunks' families.
    Result<void> build(const gl::ViewsAtOnce& how, std::array<gl::Program, kFamilies>& plain, std::array<gl::Program, kFamilies>& with_counter) const {
        for (const Chunk& c : chunks) {
            const auto f = static_cast<std::size_t>(c.family);
            for (const bool count : {false, true}) {
                gl::Program& program = (count ? with_counter : plain)[f];
                if (program || (count && !settings.count_fragments)) continue;
                auto built = gl::build_program("scene " + settings.name, vertex_shader(c.family, how),
                                               fragment_shader({.family = c.family, .count_fragments = count, .extra_lights = settings.extra_lights, .at_once = how}));
                if (!built) return std::unexpected(built.error());
                program = *std::move(built);
            }
        }
        return {};
    }
};

Scene::Scene(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

Result<Scene> Scene::create(const SceneSettings& settings) {
    auto source = load_source(settings.name);
    if (!source) return std::unexpected(source.error());
    return create(settings, *std::move(source));
}

Result<Scene> Scene::create(const SceneSettings& settings, Source source) {
    if (settings.extra_lights < 0 || settings.extra_lights > 58) return fail("extra lights outside 0 to 58", "scene");
    auto state = std::make_unique<State>();
    state->settings = settings;
    state->triangles = source.triangles();
    Mesh mesh = std::move(source.mesh);
    if (source.model) {
        auto model = ModelDraws::create(*std::move(source.model), settings.count_fragments, settings.extra_lights);
        if (!model) return std::unexpected(model.error());
        state->model = *std::move(model);
    }
    source.model.reset();
    state->source = std::move(source);
    state->chunks = std::move(mesh.chunks);
    if (auto ok = state->build({}, state->programs, state->counting); !ok) return std::unexpected(ok.error());
    state->order.resize(state->chunks.size() + (state->model ? state->model->size() : 0));
    state->vertices = gl::create_vertex_buffer(std::as_bytes(std::span(mesh.vertices)));
    state->indices = gl::create_vertex_buffer(std::as_bytes(std::span(mesh.indices)));
    state->arrays = gl::create_vertex_array();
    glBindVertexArray(state->arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, state->vertices.name());
    const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(offsetof(Vertex, position)));
    glVertexAttribPointer(1, 4, GL_BYTE, GL_TRUE, sizeof(Vertex), offset(offsetof(Vertex, normal)));
    glVertexAttribPointer(2, 2, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(offsetof(Vertex, uv)));
    glVertexAttribIPointer(3, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offset(offsetof(Vertex, material)));
    for (GLuint i = 0; i < 4; ++i) glEnableVertexAttribArray(i);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, state->indices.name());
    glBindVertexArray(0);
    state->views = gl::create_dynamic_buffer(sizeof(ViewBlock) * gl::kListViews);
    return Scene(std::move(state));
}

Result<void> Scene::draw_at_once(const gl::ViewsAtOnce& how) {
    if (how == state_->at_once) return {};
    std::array<gl::Program, kFamilies> plain, counting;
    if (how.drawing != gl::ViewDrawing::repeated)
        if (auto ok = state_->build(how, plain, counting); !ok) return ok;
    if (state_->model)
        if (auto ok = state_->model->draw_at_once(how); !ok) return ok;
    state_->at_once_programs = std::move(plain);
    state_->at_once_counting = std::move(counting);
    state_->at_once = how;
    return {};
}

std::string_view Scene::name() const noexcept { return state_->source.name; }
std::size_t Scene::triangles() const noexcept { return state_->triangles; }
std::size_t Scene::draw_count() const noexcept { return state_->order.size(); }
Pose Scene::camera(double time_s) const noexcept { return state_->source.pose(time_s * state_->settings.speed); }
std::span<const ObjectMotion> Scene::motion() const noexcept { return state_->model ? state_->model->motion() : std::span<const ObjectMotion>{}; }

void Scene::record(double time_s, std::span<const SceneView> views, gl::CommandList& list) const noexcept {
    FOVEA_REQUIRE(!views.empty() && views.size() <= gl::kListViews);
    const State& s = *state_;
    const Pose pose = camera(time_s);
    const double t = time_s * s.settings.speed;
    std::array<Mat4, gl::kListViews> clip{};
    ViewBlock block{};
    for (std::size_t i = 0; i < kLights; ++i) {
        const double a = kTau * static_cast<double>(i) / kLights + 0.21 * t * (i % 2 == 0 ? 1 : -0.7);
        const double r = s.source.light_ring_m * (0.55 + 0.45 * std::sin(1.7 * static_cast<double>(i)));
        block.light_position[i] = {static_cast<float>(r * std::cos(a)), s.source.light_height_m + 0.25f * static_cast<float>(std::sin(t + static_cast<double>(i))),
                                   static_cast<float>(r * std::sin(a)), 1.0f / s.source.light_reach_m};
        block.light_color[i] = kLightColors[i];
    }
    for (std::size_t v = 0; v < views.size(); ++v) {
        clip[v] = multiply(projection(views[v].fov, s.source.near_m, s.source.far_m), view_from_world(pose, views[v].offset_m));
        std::transform(clip[v].begin(), clip[v].end(), block.clip_from_world.begin(), [](double x) { return static_cast<float>(x); });
        block.eye = {static_cast<float>(pose.x_m + views[v].offset_m * std::cos(pose.yaw_rad)), static_cast<float>(pose.y_m),
                     static_cast<float>(pose.z_m - views[v].offset_m * std::sin(pose.yaw_rad)), static_cast<float>(t)};
        gl::update_buffer(s.views, v * sizeof(ViewBlock), std::as_bytes(std::span(&block, 1)));
    }
    ModelDraws* model = state_->model ? &*state_->model : nullptr;
    if (model != nullptr) model->move_to(t);
    list.begin({.color = {0.05f, 0.06f, 0.09f, 1}},
               {.view = s.views.name(), .view_stride = sizeof(ViewBlock), .view_size = sizeof(ViewBlock), .object = model != nullptr ? model->objects().name() : 0,
                .object_size = model != nullptr ? static_cast<std::uint32_t>(sizeof(ObjectBlock)) : 0, .at_once = s.at_once});
    // Front to back, so that the depth test saves hidden fragments; what encloses the camera comes last, and after it what
    // is seen through, back to front.
    const auto distance = [&](const Aabb& bounds) {
        const std::array<double, 3> eye{pose.x_m, pose.y_m, pose.z_m};
        double sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double low = bounds.low[axis], high = bounds.high[axis], centre = 0.5 * (low + high);
            sum += (high - low > 50 ? 1e6 : 0) + (centre - eye[axis]) * (centre - eye[axis]);
        }
        return sum;
    };
    const std::size_t chunks = s.chunks.size(), all = state_->order.size();
    for (std::size_t i = 0; i < chunks; ++i) state_->order[i] = {distance(s.chunks[i].bounds), static_cast<std::uint32_t>(i)};
    for (std::size_t i = chunks; i < all; ++i) {
        const double d = distance(model->bounds(i - chunks));
        state_->order[i] = {model->draw(i - chunks).blend ? 1e12 - d : d, static_cast<std::uint32_t>(i)};
    }
    std::sort(state_->order.begin(), state_->order.end());
    for (const auto& [unused, index] : state_->order) {
        gl::Draw d;
        const bool procedural = index < chunks;
        if (procedural) {
            const Chunk& c = s.chunks[index];
            const auto f = static_cast<std::size_t>(c.family);
            d.program = s.programs[f].name();
            d.counting_program = s.counting[f].name();
            d.views_program = s.at_once_programs[f].name();
            d.views_counting_program = s.at_once_counting[f].name();
            d.vertex_array = s.arrays.name();
            d.first_index = c.first_index;
            d.index_count = c.index_count;
        } else {
            d = model->draw(index - chunks);
        }
        const Aabb& bounds = procedural ? s.chunks[index].bounds : model->bounds(index - chunks);
        bool seen = false;
        for (std::size_t v = 0; v < views.size(); ++v) {
            d.bounds[v] = project_bounds(clip[v], bounds);
            seen = seen || !d.bounds[v].empty();
        }
        if (seen) list.add(d);
    }
}

}  // namespace fovea::scene
