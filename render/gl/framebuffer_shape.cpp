#include "render/gl/framebuffer_shape.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <string>

#include "render/gl/context.hpp"
#include "render/gl/layer_framebuffers.hpp"

namespace fovea::gl {
namespace {

GLint attachment(GLenum point, GLenum what) noexcept {
    GLint value = 0;
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, point, what, &value);
    return value;
}

// The sized format that has these components.
GLenum color_format(GLenum point) noexcept {
    struct Row {
        GLint type, r, g, b, a;
        GLenum format;
    };
    constexpr GLint N = GL_UNSIGNED_NORMALIZED, F = GL_FLOAT, I = GL_INT, U = GL_UNSIGNED_INT;
    static constexpr Row kRows[] = {
        {N, 8, 8, 8, 8, GL_RGBA8},      {N, 8, 8, 8, 0, GL_RGB8},         {N, 8, 8, 0, 0, GL_RG8},        {N, 8, 0, 0, 0, GL_R8},
        {N, 5, 6, 5, 0, GL_RGB565},     {N, 4, 4, 4, 4, GL_RGBA4},        {N, 5, 5, 5, 1, GL_RGB5_A1},    {N, 10, 10, 10, 2, GL_RGB10_A2},
        {F, 16, 16, 16, 16, GL_RGBA16F}, {F, 16, 16, 16, 0, GL_RGB16F},   {F, 16, 16, 0, 0, GL_RG16F},    {F, 16, 0, 0, 0, GL_R16F},
        {F, 32, 32, 32, 32, GL_RGBA32F}, {F, 32, 32, 0, 0, GL_RG32F},     {F, 32, 0, 0, 0, GL_R32F},      {F, 11, 11, 10, 0, GL_R11F_G11F_B10F},
        {I, 8, 0, 0, 0, GL_R8I},        {I, 8, 8, 0, 0, GL_RG8I},         {I, 8, 8, 8, 8, GL_RGBA8I},     {I, 16, 0, 0, 0, GL_R16I},
        {I, 16, 16, 0, 0, GL_RG16I},    {I, 16, 16, 16, 16, GL_RGBA16I},  {I, 32, 0, 0, 0, GL_R32I},      {I, 32, 32, 0, 0, GL_RG32I},
        {I, 32, 32, 32, 32, GL_RGBA32I}, {U, 8, 0, 0, 0, GL_R8UI},        {U, 8, 8, 0, 0, GL_RG8UI},      {U, 8, 8, 8, 8, GL_RGBA8UI},
        {U, 10, 10, 10, 2, GL_RGB10_A2UI}, {U, 16, 0, 0, 0, GL_R16UI},    {U, 16, 16, 0, 0, GL_RG16UI},   {U, 16, 16, 16, 16, GL_RGBA16UI},
        {U, 32, 0, 0, 0, GL_R32UI},     {U, 32, 32, 0, 0, GL_RG32UI},     {U, 32, 32, 32, 32, GL_RGBA32UI},
    };
    const GLint type = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE);
    const GLint r = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE), g = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_GREEN_SIZE);
    const GLint b = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_BLUE_SIZE), a = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_ALPHA_SIZE);
    const bool srgb = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_COLOR_ENCODING) == GL_SRGB;
    for (const Row& row : kRows)
        if (row.type == type && row.r == r && row.g == g && row.b == b && row.a == a) {
            if (srgb) return row.format == GL_RGBA8 ? GL_SRGB8_ALPHA8 : 0;
            return row.format;
        }
    return 0;
}

ColorKind kind_of(GLenum point, GLenum format) noexcept {
    const GLint type = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE);
    if (type == GL_INT) return ColorKind::whole;
    if (type == GL_UNSIGNED_INT) return ColorKind::natural;
    const bool wide = format == GL_RGBA32F || format == GL_RG32F || format == GL_R32F;
    return wide && !epoxy_has_gl_extension("GL_OES_texture_float_linear") ? ColorKind::unfiltered : ColorKind::filtered;
}

// Also its size.
GLenum texture_target(Name name, GLint level, GLint* width, GLint* height) noexcept {
    struct Target {
        GLenum target, query;
    };
    static constexpr Target kTargets[] = {{GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D},
                                          {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY},
                                          {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE},
                                          {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D}};
    for (const Target& t : kTargets) {
        GLint before = 0;
        glGetIntegerv(t.query, &before);
        if (static_cast<Name>(before) != name) glBindTexture(t.target, name);   // fails for a texture of another target
        if (glGetError() != GL_NO_ERROR) continue;
        glGetTexLevelParameteriv(t.target, level, GL_TEXTURE_WIDTH, width);
        glGetTexLevelParameteriv(t.target, level, GL_TEXTURE_HEIGHT, height);
        glBindTexture(t.target, static_cast<GLuint>(before));
        return t.target;
    }
    return 0;
}

GLenum depth_format(GLenum point) noexcept {
    const GLint bits = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE);
    const bool packed = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE) > 0;
    const bool real = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE) == GL_FLOAT;
    if (bits == 16) return GL_DEPTH_COMPONENT16;
    if (bits == 24) return packed ? GL_DEPTH24_STENCIL8 : GL_DEPTH_COMPONENT24;
    if (bits == 32 && real) return packed ? GL_DEPTH32F_STENCIL8 : GL_DEPTH_COMPONENT32F;
    return bits > 0 ? GL_DEPTH24_STENCIL8 : 0;
}

}  // namespace

Name attached_object(int draw_buffer) noexcept {
    GLint buffer = GL_NONE;
    glGetIntegerv(GL_DRAW_BUFFER0 + static_cast<GLenum>(draw_buffer), &buffer);
    if (buffer == GL_NONE || buffer == GL_BACK) return 0;
    return static_cast<Name>(attachment(static_cast<GLenum>(buffer), GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
}

Result<FramebufferShape> framebuffer_shape(Name framebuffer) {
    const std::string where = "framebuffer " + std::to_string(framebuffer);
    if (eglGetCurrentContext() == EGL_NO_CONTEXT) return fail("no context is current", where, "was it lost? Make a new one, and everything in it anew");
    static_cast<void>(pending_error());
    if (framebuffer != 0 && glIsFramebuffer(framebuffer) == GL_FALSE) return fail("there is no such framebuffer", where, "create it before the method is prepared");
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE)
        return fail(status == GL_FRAMEBUFFER_UNDEFINED ? "there is no surface" : "the framebuffer is incomplete", where,
                    "attach images of one size and number of samples, in formats that can be drawn to");
    if (bound_framebuffer_is_layered())
        return fail("all its layers are attached at once", where, "draw to its layers one by one, a view each: gl::LayerFramebuffers makes a framebuffer of each");
    FramebufferShape shape;
    GLint most = kMaxColors;
    glGetIntegerv(GL_MAX_DRAW_BUFFERS, &most);
    for (int i = 0; i < std::min(most, kMaxColors); ++i) {
        GLint buffer = GL_NONE;
        glGetIntegerv(GL_DRAW_BUFFER0 + static_cast<GLenum>(i), &buffer);
        if (buffer == GL_NONE) continue;
        const auto point = static_cast<GLenum>(buffer);
        const GLint type = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE);
        if (type == GL_NONE) continue;
        ColorShape& c = shape.color[static_cast<std::size_t>(i)];
        c.format = color_format(point);
        if (c.format == 0)
            return fail("colour attachment " + std::to_string(i) + " has a format that cannot be foveated", where,
                        "use RGBA8, SRGB8_ALPHA8, RGB10_A2, R11F_G11F_B10F, a 16 or 32 bit float or an integer format");
        c.kind = kind_of(point, c.format);
        GLint width = 0, height = 0;
        const auto object = static_cast<Name>(attachment(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
        if (type == GL_RENDERBUFFER) {
            GLint before = 0;
            glGetIntegerv(GL_RENDERBUFFER_BINDING, &before);
            glBindRenderbuffer(GL_RENDERBUFFER, object);
            glGetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_WIDTH, &width);
            glGetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_HEIGHT, &height);
            glBindRenderbuffer(GL_RENDERBUFFER, static_cast<GLuint>(before));
        }
        if (type == GL_TEXTURE) {
            c.level = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL);
            c.layer = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER);
            const auto face = static_cast<GLenum>(attachment(point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_CUBE_MAP_FACE));
            c.texture_target = face != 0 ? face : texture_target(object, c.level, &width, &height);
        }
        if (i == 0) {
            shape.width_px = width;
            shape.height_px = height;
        }
        shape.colors = i + 1;
    }
    GLint samples = 0;
    glGetIntegerv(GL_SAMPLES, &samples);
    shape.samples = samples > 1 ? samples : 0;
    const GLenum depth = framebuffer == 0 ? GL_DEPTH : GL_DEPTH_ATTACHMENT, stencil = framebuffer == 0 ? GL_STENCIL : GL_STENCIL_ATTACHMENT;
    if (attachment(depth, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_NONE) shape.depth_format = depth_format(depth);
    if (attachment(stencil, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_NONE)
        shape.stencil = attachment(stencil, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE) >= 8;
    static_cast<void>(pending_error());   // what a driver thinks of a query that does not apply
    return shape;
}

}  // namespace fovea::gl
