// Reads a texture of floats that cannot be attached, in OpenGL ES 3.0: a shader copies the bits into an image of integers, which
// every driver can draw to.
//
// Threads: the context's thread.
#pragma once

#include <memory>

#include "render/extrapolation/gl_functions.hpp"

namespace fovea::render::extrapolation {

class GlFloatReader {
public:
    // A GlStateGuard with passes is alive, here and below. Null: the driver refused the shader.
    [[nodiscard]] static std::unique_ptr<GlFloatReader> create(const GlFunctions& gl);
    ~GlFloatReader();
    GlFloatReader(const GlFloatReader&) = delete;
    GlFloatReader& operator=(const GlFloatReader&) = delete;

    // The base level, four floats a pixel, rows as the texture's own; a swizzle of the texture applies.
    [[nodiscard]] bool read(GLuint texture, int width_px, int height_px, void* rgba) noexcept;

private:
    explicit GlFloatReader(const GlFunctions& gl) noexcept : gl_(gl) {}
    const GlFunctions& gl_;
    GLuint program_ = 0, array_ = 0, framebuffer_ = 0, sampler_ = 0;
};

}  // namespace fovea::render::extrapolation
