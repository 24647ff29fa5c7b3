// The scenes' shaders: one vertex stage and one fragment stage with procedural materials.
//
// Source: microfacet lighting after Walter et al. 2007 (GGX) and Schlick's Fresnel term; noise is value noise on the pcg
// hash (Jarzynski and Olano, JCGT 9(3), 2020); filmic curve after Narkowicz 2016.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "render/gl/view_drawing.hpp"

namespace fovea::scene {

// Second byte of Vertex::material selects a variant, mostly a seed.
enum Material : std::uint8_t {
    kBoard = 0, kEpoxy = 1, kMetal = 2, kAluminium = 3, kCeramic = 4, kLamp = 5, kAnodised = 6, kSky = 7, kMarble = 8, kWood = 9, kBall = 10
};

// Materials that share a program. A processor rasteriser runs both sides of every branch, so a program holds only what
// its draws need.
enum class Family : std::uint8_t { board, parts, sky, hall, model, balls };   // model: materials of a Model, from textures; balls: cast in boxes, with their own depth
inline constexpr std::size_t kFamilies = 6;
[[nodiscard]] constexpr Family family_of(std::uint8_t material) noexcept {
    return material == kBoard ? Family::board
           : material == kSky ? Family::sky
           : material == kBall ? Family::balls
           : material == kMarble || material == kWood ? Family::hall
                                                      : Family::parts;
}

inline constexpr int kLights = 6;

// std140 layout of the block `Object` of Family::model.
struct ObjectBlock {
    std::array<float, 16> world_from_object;
    std::array<std::array<float, 4>, 3> normal_columns;   // inverse transpose of its upper 3x3, any scale
    std::array<float, 4> base_color;
    std::array<float, 4> surface;    // metallic, roughness, alpha cutoff, unused
    std::array<float, 4> emissive;
};
static_assert(sizeof(ObjectBlock) == 64 + 48 + 48);

struct ShaderOptions {
    Family family = Family::board;
    bool count_fragments = false;   // with an atomic counter at binding 0, after early depth and stencil tests
    int extra_lights = 0;           // 0 to 58: repeats the lights around the scene, for a heavier fragment
    // Family::model: what the material has; each is a variant, built only where a material asks for it.
    bool color_image = false, surface_image = false, cut_out = false;
    bool unlit = false;             // the root of the albedo alone, behind tile_vertex_shader()
    gl::ViewsAtOnce at_once = {};   // written once with gl_ViewID_OVR: how several views are drawn by it
    bool operator==(const ShaderOptions&) const = default;
};

// Family::model: attributes position, normal, uv; uniform block `Object`, binding 1, as in ObjectBlock.
[[nodiscard]] std::string vertex_shader(Family family = Family::board, const gl::ViewsAtOnce& at_once = {});
// Attributes as in Vertex; position is the place on the sheet, NDC (material_tiles.hpp).
[[nodiscard]] std::string tile_vertex_shader();
[[nodiscard]] std::string fragment_shader(const ShaderOptions& options);

}  // namespace fovea::scene
