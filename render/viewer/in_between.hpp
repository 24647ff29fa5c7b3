// Frames between rendered frames: each eye's two last pictures, carried on by half the time between them.
//
//   rendered     1 ------------- 2 ------------- 3 -------------
//   extrapolated                        2.5             3.5           shown in turn; 2.5 is made of 1 and 2
//
// Off, it is a branch: no GL object is made and no call is issued before the first frame that calls for it.
// Cost: two copies of a picture per eye, the extrapolation (`fovea tradeoff extrapolation`), and once the choice of a backend.
// Threads: the context's. Errors: targets or shaders that the driver refuses; out of memory.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "render/effects/effects.hpp"
#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/gl/objects.hpp"
#include "render/scene/camera.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/options.hpp"

namespace fovea::viewer {

inline constexpr float kBetweenFactor = 0.5f;   // how far ahead, times the time between the two last rendered frames, where the display can wait for it

// Pixels that the median point of a view moves by from one pose to the other, for a scene some metres away.
[[nodiscard]] double camera_motion_px(const scene::Pose& from, const scene::Pose& to, const FieldOfView& fov, int width_px) noexcept;

class InBetween {
public:
    InBetween(Extrapolate mode, render::extrapolation::Preset preset) noexcept : mode_(mode), preset_(preset) {}

    [[nodiscard]] bool enabled() const noexcept { return mode_ != Extrapolate::off; }
    // Whether the frame that has just been rendered is to be followed by an extrapolated one: forced, or by the planner's rule.
    // `declared`: what the scene's author says of it, which wins over the rule, but not over the person at the command line.
    [[nodiscard]] bool called_for(const effects::Needs& needs, Duration frame_cost, Duration budget, std::optional<bool> declared = {}) const noexcept;
    // Takes the eye's newest picture. True: target(eye) holds what follows it `factor` of a frame time later. False: it was the first of its size, or the
    // first after a gap. `region`: where the picture is sharp; effort is spent there. `motion`: where its points will be, if known.
    [[nodiscard]] Result<bool> follow(std::size_t eye, const gl::RenderTarget& newest, const foveation::Method::Region& region, float factor,
                                      const render::extrapolation::KnownMotion* motion = nullptr);
    // The next picture does not continue the last one.
    void forget() noexcept { known_ = {}; }

    [[nodiscard]] const gl::RenderTarget& target(std::size_t eye) const noexcept { return made_[eye]; }
    // Who extrapolates and why: "processor (probe: 256x256 takes 2.4 ms ...)". Empty before the first.
    [[nodiscard]] std::string backend() const;

private:
    Extrapolate mode_;
    render::extrapolation::Preset preset_;
    std::unique_ptr<render::extrapolation::GlExtrapolator> extrapolator_;
    std::array<gl::RenderTarget, kEyes> last_, made_;
    std::array<bool, kEyes> known_{};   // last_ holds the picture before the newest
};

}  // namespace fovea::viewer
