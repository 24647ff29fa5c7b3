// Saves what the GL side of the engine changes in the application's context, and puts it back.
//
// Threads: the context's thread.
#pragma once

#include <array>

#include "render/extrapolation/gl_functions.hpp"

namespace fovea::render::extrapolation {

class GlStateGuard {
public:
    static constexpr int kUnits = 6;   // texture units 0 to kUnits - 1 are used

    // Afterwards: no pixel buffers, default pixel storage, and no test or mask between a draw and its target.
    // `passes`: shaders will run; false: only pixels are read and written.
    GlStateGuard(const GlFunctions& gl, bool passes) noexcept;
    ~GlStateGuard();
    GlStateGuard(const GlStateGuard&) = delete;
    GlStateGuard& operator=(const GlStateGuard&) = delete;

private:
    struct Image {
        GLint name, level, layered, layer, access, format;
    };
    const GlFunctions& gl_;
    bool passes_;
    GLint read_framebuffer_ = 0, draw_framebuffer_ = 0, pack_buffer_ = 0, unpack_buffer_ = 0, draw_buffer_ = 0, dispatch_buffer_ = 0, active_ = 0, program_ = 0, array_ = 0;
    std::array<GLint, 10> storage_{};
    std::array<GLint, kUnits> textures_{}, samplers_{};
    Image image_{};   // unit 0, the only one used
    std::array<GLboolean, 7> enabled_{};
    std::array<GLint, 4> viewport_{};
    std::array<GLfloat, 4> first_viewport_{};
    GLboolean first_scissor_ = GL_FALSE;
    static constexpr GLuint kBuffers = 2;   // draw buffers of a pass
    std::array<std::array<GLboolean, 4>, kBuffers> masks_{};
    std::array<GLboolean, kBuffers> blends_{};
    GLint clip_origin_ = 0, clip_depth_ = 0, reversed_ = 0;
    unsigned clip_distances_ = 0;   // a bit each
    bool paused_ = false;   // transform feedback, by us
};

}  // namespace fovea::render::extrapolation
