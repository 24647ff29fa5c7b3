// One frame on its way through the viewer's loop, and what was latched for it.
#pragma once

#include <fovea/fovea.h>

#include <array>
#include <cstdint>

#include "protocol/clock.hpp"
#include "render/foveation/method.hpp"
#include "render/present/presenter.hpp"

namespace fovea::viewer {

inline constexpr std::size_t kEyes = 2;

enum class GazeSource : std::uint8_t { daemon, mouse };

// The answer to one question for the focal points.
struct Latched {
    GazeSource source = GazeSource::daemon;
    std::array<fovea_focal, kEyes> focals{};
    fovea_latch_info info{};
    [[nodiscard]] Instant when() const noexcept { return instant_from_ns(info.latched_ns); }
    [[nodiscard]] bool live() const noexcept { return (info.flags & FOVEA_LATCH_LIVE) != 0 && (focals[0].flags & FOVEA_FOCAL_STATIC) == 0; }
};

// started <= early.when() <= late.when() <= submitted <= gpu_done < photon; an extrapolated one starts after it was latched
struct Frame {
    std::uint64_t number = 0;      // from 1, of the frames that are presented
    bool extrapolated = false;     // made from the rendered frame before it, whose latch and regions it carries
    double scene_s = 0;            // what the picture shows, seconds after the start
    Instant started;               // of its recording
    Latched early, late;           // before and after recording: both are taken in every frame, to be compared
    bool uses_early = false;       // drawn with the second best
    Instant submitted, gpu_done;
    Instant asked;                 // the photon instant that the latch was for
    [[nodiscard]] const Latched& latched() const noexcept { return uses_early ? early : late; }   // what it was drawn with
    foveation::FrameCost cost;
    std::array<foveation::Method::Region, kEyes> regions;   // at full resolution
    [[nodiscard]] double shaded() const noexcept {
        return cost.pixels_full != 0 ? static_cast<double>(cost.pixels_shaded) / static_cast<double>(cost.pixels_full) : 1;
    }
};

}  // namespace fovea::viewer
