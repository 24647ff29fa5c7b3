// The pictures of both eyes: a scene, a foveation method and the targets that they are drawn into.
//
//   record -> (submit_early, for a late method) -> submit -> pictures in targets()
//
// Threads: the context's. Errors: a scene or a method that cannot be had, targets that the driver refuses.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/density/fovea_size.hpp"
#include "render/effects/declared.hpp"
#include "render/effects/effects.hpp"
#include "render/foveation/method.hpp"
#include "render/gl/command_list.hpp"
#include "render/quality/control.hpp"
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
    [[nodiscard]] Result<void> choose_method(const std::string& name);   // ends what holds a budget

    // What the scene contains, as it was planned from.
    [[nodiscard]] const effects::Needs& needs() const noexcept { return needs_; }
    // Decided for the method and size at hand.
    [[nodiscard]] const effects::Plan& planned() const noexcept { return effects_; }
    // The draws of a frame, `time_s` after the start.
    void record(double time_s) { scene_->record(time_s, views_, draws_); }
    [[nodiscard]] scene::Pose camera(double time_s) const noexcept { return scene_->camera(time_s); }
    // Of the frame last recorded.
    [[nodiscard]] const gl::CommandList& draws() const noexcept { return draws_; }
    [[nodiscard]] const scene::Scene& scene() const noexcept { return *scene_; }
    [[nodiscard]] bool late_fovea() const noexcept { return next().late_fovea(); }
    void submit_early(const Latched& latched) noexcept;
    foveation::FrameCost submit(const Latched& latched) noexcept;
    // The frame that ended `now` took `cost`.
    void observe(Instant now, Duration cost) noexcept {
        if (quality_) quality_->observe(now, cost);
        else method_->observe(cost);
    }
    // The executor that a choosing method has settled on anew, once.
    [[nodiscard]] std::optional<foveation::ExecutorSwitch> take_switch() noexcept { return next().take_switch(); }
    // The effects that the planner has switched on for what draws, by name.
    [[nodiscard]] std::vector<std::string> effects() const;
    // What the quality governor has changed, line by line; null: no --quality.
    [[nodiscard]] quality::Control* quality() noexcept { return quality_ ? &*quality_ : nullptr; }

    [[nodiscard]] int width() const noexcept { return targets_[0].width_px; }
    [[nodiscard]] int height() const noexcept { return targets_[0].height_px; }
    // What the scene's author says of an effect; nothing: the planner decides.
    [[nodiscard]] std::optional<bool> declared(effects::Effect e) const noexcept { return declared_.effects[static_cast<std::size_t>(e)]; }
    [[nodiscard]] const gl::RenderTarget& target(std::size_t eye) const noexcept { return owned_[eye]; }
    // That drew the last frame.
    [[nodiscard]] const foveation::Method& method() const noexcept { return *drawn_; }
    // The levels of the last frame, for pictures of them: the method's plan, or one like it where the method has no bins:
    // level 0 in its region, the level nearest to its scale outside. Null: all full.
    [[nodiscard]] const density::Plan* levels(std::size_t eye);
    [[nodiscard]] std::string method_name() const { return quality_ ? std::string(drawn_->name()) : method_name_; }

private:
    explicit Eyes(const density::FoveaSizeSettings& fovea) noexcept : fovea_(fovea) {}
    [[nodiscard]] Result<void> draw_at_once();
    void focus_on(const Latched& latched) noexcept;
    [[nodiscard]] foveation::Method& next() const noexcept { return quality_ ? quality_->method() : *method_; }
    [[nodiscard]] bool warm_up(const TimeSource& time);
    // The settings of a ladder with what the scene calls for in each of them.
    [[nodiscard]] quality::Ladder planned(quality::Ladder ladder, int width_px, int height_px) const;
    [[nodiscard]] effects::Plan plan(const std::string& method, int width_px, int height_px) const;

    density::FoveaSizeSettings fovea_;
    std::optional<gl::ViewDrawing> drawing_;   // asked for
    std::array<scene::SceneView, kEyes> views_ = views();
    std::optional<scene::Scene> scene_;
    effects::Needs needs_;
    effects::Declared declared_;
    effects::Plan effects_;
    std::string method_name_;
    std::unique_ptr<foveation::Method> method_;
    std::optional<quality::Control> quality_;   // draws instead of method_
    foveation::Method* drawn_ = nullptr;
    std::array<gl::RenderTarget, kEyes> owned_;
    std::array<foveation::ViewTarget, kEyes> targets_;
    std::array<foveation::ViewFocus, kEyes> focus_;
    gl::CommandList draws_;
    std::array<std::optional<density::Plan>, kEyes> like_a_plan_;
    std::vector<std::uint8_t> levels_;
};

}  // namespace fovea::viewer
