// How many seconds of its present velocity an eye goes on, per phase of the movement and horizon after the present.
//
// Source: the multiples (on a grid of 1 ms) with the least mean error relative to hold on the recordings of
// docs/pipeline.md; device groups weigh the same. Only a rising saccade is worth extrapolating by its velocity alone.
#pragma once

#include "daemon/pipeline/self_judge.hpp"

namespace fovea::pipeline {

inline constexpr float kGainTable_s[kPhases][kAhead] = {
    {0, -.001f, -.001f, -.001f, -.001f, -.001f, -.001f, -.001f, -.001f, -.001f, -.001f},   // quiet
    {0, 0, 0, 0, -.001f, -.001f, 0, -.001f, -.001f, -.001f, 0},                            // stirring
    {0, .001f, 0, .001f, .001f, .001f, .001f, .001f, 0, 0, .001f},                         // pursuit
    {.005f, .008f, .008f, .008f, .008f, .008f, .008f, .008f, .009f, .008f, .009f},         // rising
    {.002f, 0, 0, 0, 0, 0, 0, 0, 0, -.001f, 0},                                            // falling
    {.001f, 0, 0, 0, 0, 0, 0, 0, 0, 0, -.001f},                                            // landed
    {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}};                                                    // turning: `auto` only

}  // namespace fovea::pipeline
