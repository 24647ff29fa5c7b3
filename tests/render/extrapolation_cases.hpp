// Random moving pictures whose content at any time is known, to look for frames that lose to repeating the last one.
//
// A case is a stack of layers, each a shape with a texture, both with motions of their own; edges cover the part of a pixel that
// they cut, so that every time is rendered to a fraction of a pixel. Kind and seed decide everything.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tests/render/extrapolation_pictures.hpp"

namespace fovea::test {

// What moves, and how.
[[nodiscard]] std::span<const char* const> case_kinds();

struct MovingLayer {
    enum Shape { everywhere, rectangle, disc, bar } shape = everywhere;
    enum Texture { plain, gradient, soft, fine, letters, checks, equal_luma } texture = plain;
    float x = 0, y = 0, half_w = 1, half_h = 1;    // at time 0, pixels; a disc's radius is half_w
    float u = 0, v = 0;                            // of the shape, pixels per frame
    float angle = 0, turn = 0;                     // radians, radians per frame
    float growth = 1;                              // per frame, of shape and texture, around its centre
    float scroll_u = 0, scroll_v = 0;              // of the texture in its shape
    float scale = 1;                               // of the texture
    std::array<float, 3> low{0.2f, 0.25f, 0.3f}, high{0.9f, 0.8f, 0.7f};
    float opacity = 1, opacity_step = 0;           // per frame
    float from = -100, until = 100;                // frames: shown
    float light = 1, light_step = 0, flicker = 0;  // flicker: another light every frame, by this much
    std::uint32_t seed = 1;
};

struct MovingCase {
    std::string name;        // kind and seed
    int width = 0, height = 0;
    float noise = 0;         // levels of 255, new in every frame
    bool sampled = false;    // at the centres of pixels: edges are not smoothed
    std::uint32_t seed = 0;
    std::vector<MovingLayer> layers;   // from behind
    [[nodiscard]] Picture at(float t) const;
};

[[nodiscard]] MovingCase moving_case(int kind, std::uint32_t seed);

}  // namespace fovea::test
