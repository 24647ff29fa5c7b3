// How many seconds of its present velocity an eye goes on, per phase of the movement and horizon after the present.
//
// Source: fitted offline to the recordings of docs/pipeline.md, by least mean angular error; device groups weigh the
// same. The slope of the velocity is that of Classified::fast_rad_s.
#pragma once

#include "daemon/pipeline/self_judge.hpp"

namespace fovea::pipeline {

inline constexpr float kGainTable_s[kPhases][kAhead] = {
    {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
    {.001f, .001f, .001f, .001f, .001f, .001f, .001f, .001f, .001f, .001f, .001f},
    {.003f, .006f, .009f, .012f, .015f, .016f, .016f, .016f, .016f, .016f, .016f},
    {.008f, .014f, .018f, .020f, .021f, .021f, .021f, .021f, .021f, .021f, .021f},
    {.004f, .005f, .006f, .006f, .006f, .006f, .006f, .006f, .006f, .006f, .006f},
    {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}};

}  // namespace fovea::pipeline
