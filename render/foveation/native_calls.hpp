// The calls of the extensions that do foveation in hardware, as a small table of functions: what the driver of the current
// context offers, or what a test puts in its place.
//
// Source: GL_QCOM_framebuffer_foveated, GL_QCOM_texture_foveated, GL_EXT_fragment_shading_rate, GL_QCOM_shading_rate.
// Threads: the functions are those of the context. Errors: none; what is missing is false and null.
#pragma once

#include <cstdint>

#include "render/gl/objects.hpp"

namespace fovea::foveation {

struct NativeCalls {
    bool framebuffer_foveated = false;   // GL_QCOM_framebuffer_foveated
    bool texture_foveated = false;       // GL_QCOM_texture_foveated
    bool rate_attachment = false;        // GL_EXT_fragment_shading_rate_attachment
    bool rate_per_draw = false;          // GL_QCOM_shading_rate

    using Config = void (*)(gl::Name framebuffer, std::uint32_t layers, std::uint32_t points, std::uint32_t features, std::uint32_t* provided);
    using Parameters = void (*)(gl::Name object, std::uint32_t layer, std::uint32_t point, float x, float y, float gain_x, float gain_y, float area);
    Config framebuffer_config = nullptr;
    Parameters framebuffer_parameters = nullptr;
    Parameters texture_parameters = nullptr;
    // glTexParameteri, glTexParameterf and glGetTexParameteriv, for the parameters of GL_QCOM_texture_foveated.
    void (*texture_integer)(std::uint32_t target, std::uint32_t name, std::int32_t value) = nullptr;
    void (*texture_real)(std::uint32_t target, std::uint32_t name, float value) = nullptr;
    void (*get_texture_integer)(std::uint32_t target, std::uint32_t name, std::int32_t* value) = nullptr;

    void (*rate)(std::uint32_t rate) = nullptr;                  // glShadingRateEXT or glShadingRateQCOM
    void (*rate_combiners)(std::uint32_t op0, std::uint32_t op1) = nullptr;
    void (*attach_rates)(std::uint32_t target, std::uint32_t attachment, gl::Name texture, std::int32_t base_layer, std::int32_t layers,
                         std::int32_t texel_width, std::int32_t texel_height) = nullptr;
    int least_texel_px = 0, most_texel_px = 0;                   // of a rate attachment's texels
};

// Of the context that is current.
[[nodiscard]] NativeCalls driver_calls();

}  // namespace fovea::foveation
