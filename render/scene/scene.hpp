// A scene on the GPU: what to draw, recorded as draws for any number of views.
//
// Input: time in seconds (the camera and the lamps move with it) and the views. Output: a CommandList whose draws carry
// their bounds in every view.
// Threads: the context's. Errors: create() names an unknown scene or the shader that does not compile; record() cannot
// fail and does not allocate once the list has its capacity.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "render/gl/command_list.hpp"
#include "render/scene/camera.hpp"
#include "render/scene/model_draws.hpp"
#include "render/scene/source.hpp"

namespace fovea::scene {

struct SceneSettings {
    std::string name = "circuit";    // of a built-in, or the path of a .gltf or .glb file
    int extra_lights = 0;            // 0 to 58: a heavier fragment
    bool count_fragments = false;    // also builds the counting variants of the shaders
    double eye_distance_m = 0.064;   // between the two views
    double speed = 1;                // of the camera; 0: still
};

// One rendered view; offset_m to the right of the head (-eye_distance/2 for the left eye).
struct SceneView {
    FieldOfView fov;
    double offset_m = 0;
};

// The usual two eyes of a headset: 90 degrees high, slightly wider outward than inward.
[[nodiscard]] std::array<SceneView, 2> stereo_views(double eye_distance_m = 0.064) noexcept;

class Scene {
public:
    [[nodiscard]] static Result<Scene> create(const SceneSettings& settings);   // loads what `name` says
    [[nodiscard]] static Result<Scene> create(const SceneSettings& settings, Source source);
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;
    ~Scene();

    [[nodiscard]] std::string_view name() const noexcept;
    [[nodiscard]] std::size_t triangles() const noexcept;
    [[nodiscard]] std::size_t draw_count() const noexcept;
    [[nodiscard]] Pose camera(double time_s) const noexcept;
    // The objects that move on their own, each with its transform in this and in the previously recorded frame: known
    // motion for a frame extrapolation. Of the last record(); empty where nothing does.
    [[nodiscard]] std::span<const ObjectMotion> motion() const noexcept;
    // Draws recorded from now on have programs that draw several views at once, too (Method::views_at_once()); repeated:
    // they have none. Cheap when nothing changes. Errors: a shader that does not compile; it then draws as before.
    [[nodiscard]] Result<void> draw_at_once(const gl::ViewsAtOnce& how);
    // views: 1 to gl::kListViews.
    void record(double time_s, std::span<const SceneView> views, gl::CommandList& list) const noexcept;

private:
    struct State;
    explicit Scene(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::scene
