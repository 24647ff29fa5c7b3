// No display: frames stay in their textures, and a simulated scan-out says when they would have been seen.
//
// Photon instants are marked simulated. Threads, Errors: those of Presenter.
#pragma once

#include "render/present/presenter.hpp"

namespace fovea::present {

[[nodiscard]] Result<std::unique_ptr<Presenter>> create_surfaceless(const PresenterSettings& settings, const TimeSource& time);

}  // namespace fovea::present
