// Every way to make the extrapolated frame that is measured: our presets, and the baselines to judge them by.
//
// Baselines: the last frame repeated; the last frame turned with the head (what a runtime's reprojection does, exact
// camera rotation given); OpenCV's DIS and Farneback optical flow, whose motion goes through our `balanced` projection
// and gather, so that only the motion differs.
// Threads: one at a time.
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
    std::function<void(const ExtrapolationInput&, std::vector<std::uint8_t>& rgba)> run;
};

[[nodiscard]] std::vector<ExtrapolationMethod> extrapolation_methods();

}  // namespace fovea::tools
