// A screen without a window system: the kernel's mode setting, one page flip per frame.
//
// Source: GBM surface drawn by EGL; legacy mode setting (drmModeSetCrtc, drmModePageFlip), which every driver has.
// Photon instants: measured by the page flip's event (the vblank at which the scan-out of the new picture began), plus half
// the time that the mode's visible lines take. Estimated where the driver has no vblanks (sequence 0) or no monotonic time.
// The first connected screen of the first card in /dev/dri ($FOVEA_KMS_CARD names another), in its preferred mode
// ($FOVEA_KMS_MODE: another, e.g. 640x480). What was on it before is put back at the end. There is no keyboard and no
// mouse: Ctrl-C ends it.
// Threads, Errors: those of Presenter. Only one program can have a screen: run it from a text console.
#pragma once

#include "render/present/presenter.hpp"

namespace fovea::present {

// Never for `auto`: nobody's screen is taken unasked.
[[nodiscard]] bool kms_offered();
[[nodiscard]] Result<std::unique_ptr<Presenter>> create_kms(const PresenterSettings& settings, const TimeSource& time);

}  // namespace fovea::present
