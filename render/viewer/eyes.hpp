// The pictures of both eyes: a scene, a foveation method and the targets that they are drawn into.
//
//   record -> (submit_early, for a late method) -> submit -> pictures in targets()
//
// Threads: the context's. Errors: a scene or a method that cannot be had, targets that the driver refuses.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "render/density/fovea_size.hpp"
#include "render/foveation/method.hpp"
#include "render/gl/command_list.hpp"
#include "render/scene/scene.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

class Eyes {
public:
    [[nodiscard]] static std::expected<Eyes, Failure> create(const Options& options, const TimeSource& time);

    [[nodiscard]] static std::array<scene::SceneView, kEyes> views() noexcept { return scene::stereo_views(); }
    // Both change with one call at most; cheap when nothing does. The next frame uses them.
    [[nodiscard]] Result<void> resize(int width_px, int height_px);   // of each eye
    [[nodiscard]] Result<void> choose_method(const std::string& name);

    // The draws of a frame, `time_s` after the start.
    void record(double time_s) { scene_->record(time_s, views_, draws_); }
    [[nodiscard]] scene::Pose camera(double time_s) const noexcept { return scene_->camera(time_s); }
    [[nodiscard]] bool late_fovea() const noexcept { return method_->late_fovea(); }
    void submit_early(const Latched& latched) noexcept;
    foveation::FrameCost submit(const Latched& latched) noexcept;
    void observe(Duration cost) noexcept { method_->observe(cost); }

    [[nodiscard]] int width() const noexcept { return targets_[0].width_px; }
    [[nodiscard]] int height() const noexcept { return targets_[0].height_px; }
    [[nodiscard]] const gl::RenderTarget& target(std::size_t eye) const noexcept { return owned_[eye]; }
    [[nodiscard]] const foveation::Method& method() const noexcept { return *method_; }
    [[nodiscard]] const std::string& method_name() const noexcept { return method_name_; }

private:
    explicit Eyes(const density::FoveaSizeSettings& fovea) noexcept : fovea_(fovea) {}
    void focus_on(const Latched& latched) noexcept;
    [[nodiscard]] bool warm_up(const TimeSource& time);

    density::FoveaSizeSettings fovea_;
    std::array<scene::SceneView, kEyes> views_ = views();
    std::optional<scene::Scene> scene_;
    std::string method_name_;
    std::unique_ptr<foveation::Method> method_;
    std::array<gl::RenderTarget, kEyes> owned_;
    std::array<foveation::ViewTarget, kEyes> targets_;
    std::array<foveation::ViewFocus, kEyes> focus_;
    gl::CommandList draws_;
};

}  // namespace fovea::viewer
