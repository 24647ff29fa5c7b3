// Shaders of GL_OVR_multiview and GL_OVR_multiview2 for a driver without them: gl_ViewID_OVR becomes a uniform that the
// layer sets before each view's draw, and layout(num_views = N) is read and taken out.
//
// Source: OVR_multiview.txt ("Modifications to The OpenGL ES Shading Language"). Input: the source as the program gave
// it, #version 300 es or later. Output: the source for the driver; line numbers stay, so that the driver's messages fit.
// Macros: GL_OVR_multiview and GL_OVR_multiview2 are defined for the program, under names that a shader may define;
// N may be a macro that stands for a number.
// Threads: pure. Errors: what the extension calls a compile-time error becomes an #error line, which the driver reports.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace fovea::layer {

inline constexpr int kMaxViews = 16;                        // GL_MAX_VIEWS_OVR
inline constexpr const char* kViewUniform = "fovea_ViewID";  // uniform mediump uint

struct MultiviewSource {
    std::string text;   // for the driver
    int num_views = 0;  // 0: not declared, which counts as 1
};

// nullopt: the shader has nothing to do with the extensions, and goes to the driver as it is.
[[nodiscard]] std::optional<MultiviewSource> rewrite_multiview(std::string_view source);

}  // namespace fovea::layer
