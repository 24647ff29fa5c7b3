// What the keys of the window have set, and the read-out drawn into it.
//
// Pure: no I/O, no clock, no GL.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "render/present/presenter.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

struct Controls {
    bool levels = false, gaze = true, readout = true, help = false;
    bool paused = false;        // the scene stands still, the gaze does not
    bool latch_early = false;
    bool mouse = false;         // the pointer is the gaze even with a tracker
    bool quit = false;
    std::string method;

    // methods: their names, in the order of the digits.
    void handle(const present::Event& event, std::span<const std::string> methods);
};

// What the read-out says of the last frames.
struct ReadOut {
    std::string executor, scene, quality;   // quality: the governor's setting; empty: none
    double frames_per_second = 0;
    int width_px = 0, height_px = 0;
    Summary summary;
    Frame newest;
};
[[nodiscard]] std::vector<std::string> text_lines(const Controls& controls, const ReadOut& state, std::span<const std::string> methods);

}  // namespace fovea::viewer
