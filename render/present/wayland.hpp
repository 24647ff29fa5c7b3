// A window of a Wayland compositor; wp_presentation tells when its frames were seen.
//
// Source: xdg-shell, presentation-time (wayland-protocols), wl_egl_window.
// Photon instants: measured if the compositor says that the display's hardware told the time or that the frame was on
// screen (HW_CLOCK, HW_COMPLETION), estimated if a timer of the compositor's did or there is no wp_presentation; plus
// half a refresh period, the middle of the scan-out.
// A frame begins when the compositor asks for one (frame callback): a hidden window costs nothing.
// Threads, Errors: those of Presenter.
#pragma once

#include "render/present/presenter.hpp"

namespace fovea::present {

[[nodiscard]] bool wayland_offered();   // $WAYLAND_DISPLAY is set
[[nodiscard]] Result<std::unique_ptr<Presenter>> create_wayland(const PresenterSettings& settings, const TimeSource& time);

}  // namespace fovea::present
