// The scenes' shaders: one vertex stage and one fragment stage with procedural materials.
//
// Source: microfacet lighting after Walter et al. 2007 (GGX) and Schlick's Fresnel term; noise is value noise on the pcg
// hash (Jarzynski and Olano, JCGT 9(3), 2020); filmic curve after Narkowicz 2016.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace fovea::scene {

// Second byte of Vertex::material selects a variant, mostly a seed.
enum Material : std::uint8_t {
    kBoard = 0, kEpoxy = 1, kMetal = 2, kAluminium = 3, kCeramic = 4, kLamp = 5, kAnodised = 6, kSky = 7, kMarble = 8, kWood = 9
};

// Materials that share a program. A processor rasteriser runs both sides of every branch, so a program holds only what
// its draws need.
enum class Family : std::uint8_t { board, parts, sky, hall };
inline constexpr std::size_t kFamilies = 4;
[[nodiscard]] constexpr Family family_of(std::uint8_t material) noexcept {
    return material == kBoard ? Family::board
           : material == kSky ? Family::sky
           : material == kMarble || material == kWood ? Family::hall
                                                      : Family::parts;
}

inline constexpr int kLights = 6;

struct ShaderOptions {
    Family family = Family::board;
    bool count_fragments = false;   // with an atomic counter at binding 0, after early depth and stencil tests
    int extra_lights = 0;           // 0 to 58: repeats the lights around the scene, for a heavier fragment
};

[[nodiscard]] std::string vertex_shader();
[[nodiscard]] std::string fragment_shader(const ShaderOptions& options);

}  // namespace fovea::scene
