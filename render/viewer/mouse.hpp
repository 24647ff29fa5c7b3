// The mouse in the place of an eye tracker: the same answer as libfovea's latch, from a pointer over the window.
//
// The pointer is taken where it is when asked (latched last); it is not predicted, and no other eye knows better. Both
// eyes look at the same direction far away.
// Pure, noexcept.
#pragma once

#include <span>

#include "render/scene/scene.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/layout.hpp"

namespace fovea::viewer {

// How exactly a hand points: what full resolution has to cover around the pointer.
inline constexpr double kMouseRadius95Rad = 0.01;

// now: when the pointer was read; photon: what it is for.
[[nodiscard]] Latched latch_pointer(const present::Pointer& pointer, const PointedAt& at, std::span<const scene::SceneView, kEyes> views, Instant now,
                                    Instant photon) noexcept;

}  // namespace fovea::viewer
