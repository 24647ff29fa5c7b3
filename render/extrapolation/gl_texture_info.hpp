// What a texture is that the GL call was given: format, size, base level, swizzle.
//
// Source: OpenGL ES 3.1, 8.10.3 (level queries); for 3.0, which has none, OpenGL ES 3.0.6, 3.8.3 and 3.8.5: which uploads are
// errors, and 6.1.13: sizes and type of an attachment's channels.
// Threads: the context's thread.
#pragma once

#include <optional>

#include "render/extrapolation/gl_functions.hpp"
#include "render/extrapolation/image.hpp"

namespace fovea::render::extrapolation {

struct TextureInfo {
    std::optional<Format> format;   // the effective one; nothing: no 2D texture, no image at its base level, or another format
    int width = 0, height = 0, base_level = 0;   // pixels; meaningless without a format
    bool swizzled = false;
};

// Both leave the texture bound, if it is one, and no error pending. OpenGL ES 3.1.
[[nodiscard]] TextureInfo inspect(const GlFunctions& gl, GLuint name) noexcept;

// OpenGL ES 3.0: uploads of nothing at all are tried, which change nothing and are errors where they do not fit. A debug
// callback hears of them. A GlStateGuard is alive; `framebuffer` is left bound to be read, with nothing attached. `like`: what
// its size is likely to be; without a format where nothing is known.
[[nodiscard]] TextureInfo inspect_by_trial(const GlFunctions& gl, GLuint name, GLuint framebuffer, const TextureInfo& like) noexcept;

// Whether the context raises errors: one of EGL_KHR_create_context_no_error does not, and cannot be inspected by trial.
[[nodiscard]] bool raises_errors(const GlFunctions& gl) noexcept;

}  // namespace fovea::render::extrapolation
