#include "render/foveation/native_calls.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

namespace fovea::foveation {
namespace {

// Newer than the headers that come with libepoxy 1.5.
constexpr GLenum kMinTexelWidth = 0x96D7, kMaxTexelWidth = 0x96D8;   // GL_{MIN,MAX}_FRAGMENT_SHADING_RATE_ATTACHMENT_TEXEL_WIDTH_EXT

template <class Function>
bool find(Function& into, const char* name) noexcept {
    into = reinterpret_cast<Function>(eglGetProcAddress(name));
    return into != nullptr;
}

}  // namespace

NativeCalls driver_calls() {
    NativeCalls c;
    c.texture_integer = [](std::uint32_t target, std::uint32_t name, std::int32_t value) { glTexParameteri(target, name, value); };
    c.texture_real = [](std::uint32_t target, std::uint32_t name, float value) { glTexParameterf(target, name, value); };
    c.get_texture_integer = [](std::uint32_t target, std::uint32_t name, std::int32_t* value) { glGetTexParameteriv(target, name, value); };
    if (epoxy_has_gl_extension("GL_QCOM_framebuffer_foveated"))
        c.framebuffer_foveated = find(c.framebuffer_config, "glFramebufferFoveationConfigQCOM") &&
                                 find(c.framebuffer_parameters, "glFramebufferFoveationParametersQCOM");
    if (epoxy_has_gl_extension("GL_QCOM_texture_foveated")) c.texture_foveated = find(c.texture_parameters, "glTextureFoveationParametersQCOM");
    if (epoxy_has_gl_extension("GL_EXT_fragment_shading_rate_attachment"))
        c.rate_attachment = find(c.rate, "glShadingRateEXT") && find(c.rate_combiners, "glShadingRateCombinerOpsEXT") &&
                            find(c.attach_rates, "glFramebufferShadingRateEXT");
    if (c.rate_attachment) {
        glGetIntegerv(kMinTexelWidth, &c.least_texel_px);
        glGetIntegerv(kMaxTexelWidth, &c.most_texel_px);
        c.rate_attachment = c.least_texel_px > 0 && c.most_texel_px >= c.least_texel_px;
    }
    if (!c.rate_attachment && epoxy_has_gl_extension("GL_QCOM_shading_rate")) c.rate_per_draw = find(c.rate, "glShadingRateQCOM");
    return c;
}

}  // namespace fovea::foveation
