// What a client reports for each frame: its instants, where the fovea was put, and what it cost.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/clock.hpp"
#include "protocol/frames.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea {

inline constexpr std::size_t kMaxViews = 4;

// The full-resolution region of one view, as put: an axis-aligned ellipse in NDC.
struct ViewFovea {
    Eye eye = Eye::combined;
    FieldOfView fov;
    Rotation<HeadFrame, ViewFrame> head_from_view;
    NdcPoint center_ndc;
    double half_width_ndc = 0, half_height_ndc = 0;   // semi-axes of the region rendered at full resolution
};

// How a shown frame came to be. An extrapolated one was made from the two rendered before it: its sample, model and latch
// are those of the frame that it continues, and its foveas lie where that frame's sharp regions have been carried.
enum class FrameKind : std::uint8_t { rendered, extrapolated };

struct FrameTiming {
    std::uint64_t frame = 0;             // the client's own count, from 1
    std::uint64_t model_sequence = 0;    // the motion model that the frame used; 0: none
    std::uint64_t sample_id = 0;         // its newest sample
    Instant exposed, received, filtered, published;   // of that sample
    Instant latched, submitted, gpu_done, photon;     // photon: the middle of this frame's scan-out
    Instant predicted_photon;            // what the latch was asked for
    bool exposed_estimated = false;
    bool photon_simulated = true;        // no display told us; a simulated scan-out clock did
    bool photon_estimated = false;       // there is a display, but it did not tell; neither flag: it did (measured)
    FrameKind kind = FrameKind::rendered;
    std::uint64_t pixels_shaded = 0;     // by the method's own account (docs of the method say how it counts)
    std::uint64_t pixels_full = 0;       // the same frame without foveation
    std::uint32_t view_count = 0;
    std::array<ViewFovea, kMaxViews> views;
};

}  // namespace fovea
