// Every way to make the extrapolated frame that is measured: our presets, and the baselines to judge them by.
//
// Baselines: the last frame repeated; the last frame turned with the head (what a runtime's reprojection does, exact
// camera rotation given); OpenCV's DIS and Farneback optical flow, whose motion goes through our `balanced` projection
// and gather, so that only the motion differs.
// Backends: the GL call on each backend that works here, textures in the driver before and after, until the GPU is done;
// of a software rasteriser that is this process's time as well.
// Threads: one at a time, that of the first call: a GL context is current on it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/extrapolation_scenes.hpp"

namespace fovea::tools {

struct ExtrapolationInput {
    const SceneFrame *src1, *src2;   // src2 with motion and depth
    const ExtrapolationScene* scene;
    float factor;
};

struct ExtrapolationMethod {
    std::string name;
    bool baseline;
    std::function<void(const ExtrapolationInput&, std::vector<std::uint8_t>& rgba)> run;   // timed
    // Where the pictures have to be somewhere else first and come back after; neither is timed. Empty: nothing to do.
    std::function<void(const ExtrapolationInput&)> before;
    std::function<void(std::vector<std::uint8_t>& rgba)> after;
};

[[nodiscard]] std::vector<ExtrapolationMethod> extrapolation_methods();

}  // namespace fovea::tools
