// A window of an X server.
//
// Source: core protocol by xcb; the Present extension's vblank clock (PresentNotifyMSC).
// Photon instants: estimated. After a frame has been handed over, the server tells when the next vertical blank begins;
// whether the picture made it into that scan-out, or a compositing manager holds it for one more, nobody tells. Without
// Present: the next multiple of the refresh period after the hand-over.
// Threads, Errors: those of Presenter. xcb, unlike Xlib, returns an error when the server goes away.
#pragma once

#include "render/present/presenter.hpp"

namespace fovea::present {

[[nodiscard]] bool x11_offered();   // $DISPLAY is set
[[nodiscard]] Result<std::unique_ptr<Presenter>> create_x11(const PresenterSettings& settings, const TimeSource& time);

}  // namespace fovea::present
