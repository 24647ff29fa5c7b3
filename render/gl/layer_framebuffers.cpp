#include "render/gl/layer_framebuffers.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <string>

#include "render/gl/context.hpp"
#include "render/gl/framebuffer_shape.hpp"

namespace fovea::gl {
namespace {

GLint query(GLenum point, GLenum what) noexcept {
    GLint value = 0;
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, point, what, &value);
    return value;
}

struct Attached {
    GLenum point = 0;
    GLuint texture = 0;
    GLint level = 0, layers = 0;
    bool cube = false;
};

// Layers of a texture; a name does not tell its target: binding to the wrong one is an error.
bool count_layers(Attached& a) noexcept {
    for (const auto& [target, binding, cube] : {std::tuple{GLenum{GL_TEXTURE_2D_ARRAY}, GLenum{GL_TEXTURE_BINDING_2D_ARRAY}, false},
                                                {GLenum{GL_TEXTURE_CUBE_MAP}, GLenum{GL_TEXTURE_BINDING_CUBE_MAP}, true}}) {
        GLint before = 0;
        glGetIntegerv(binding, &before);
        static_cast<void>(pending_error());
        glBindTexture(target, a.texture);
        const bool fits = glGetError() == GL_NO_ERROR;
        a.layers = 6;
        if (fits && !cube) glGetTexLevelParameteriv(target, a.level, GL_TEXTURE_DEPTH, &a.layers);
        glBindTexture(target, static_cast<GLuint>(before));
        a.cube = cube;
        if (fits) return true;
    }
    return false;
}

}  // namespace

bool bound_framebuffer_is_layered() noexcept {
    GLint name = 0, major = 0, minor = 0, most = 0;
    glGetIntegerv(GL_FRAMEBUFFER_BINDING, &name);
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    if (name == 0 || major * 10 + minor < 32) return false;
    glGetIntegerv(GL_MAX_COLOR_ATTACHMENTS, &most);
    for (GLint i = 0; i < std::min(most, GLint{kMaxColors}); ++i) {
        const auto point = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + i);
        if (query(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) == GL_TEXTURE && query(point, GL_FRAMEBUFFER_ATTACHMENT_LAYERED) != 0) return true;
    }
    return false;
}

Result<LayerFramebuffers> LayerFramebuffers::create(Name layered) {
    const std::string where = "framebuffer " + std::to_string(layered);
    if (eglGetCurrentContext() == EGL_NO_CONTEXT) return fail("no context is current", where, "was it lost? Make a new one, and everything in it anew");
    static_cast<void>(pending_error());
    glBindFramebuffer(GL_FRAMEBUFFER, layered);
    if (!bound_framebuffer_is_layered()) return fail("no image is attached with all its layers", where, "give it to the method as it is");
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) return fail("the framebuffer is incomplete", where, "attach all layers of every image, or of none");
    std::vector<Attached> all;
    std::vector<GLenum> draw_buffers;
    GLint most = 0;
    glGetIntegerv(GL_MAX_DRAW_BUFFERS, &most);
    for (GLint i = 0; i < std::min(most, GLint{kMaxColors}); ++i) {
        GLint buffer = GL_NONE;
        glGetIntegerv(GL_DRAW_BUFFER0 + static_cast<GLenum>(i), &buffer);
        draw_buffers.push_back(static_cast<GLenum>(buffer));
    }
    std::vector<GLenum> points{GL_DEPTH_ATTACHMENT, GL_STENCIL_ATTACHMENT};
    for (GLint i = 0; i < std::min(most, GLint{kMaxColors}); ++i) points.push_back(static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + i));
    GLint layers = 0;
    for (const GLenum point : points) {
        if (query(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_TEXTURE) continue;
        Attached a{point, static_cast<GLuint>(query(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME)), query(point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL), 0, false};
        if (!count_layers(a)) return fail("an image is neither a 2D array nor a cube map", where, "attach 2D arrays");
        layers = all.empty() ? a.layers : std::min(layers, a.layers);
        all.push_back(a);
    }
    LayerFramebuffers made;
    for (GLint layer = 0; layer < layers; ++layer) {
        GLuint name = 0;
        glGenFramebuffers(1, &name);
        made.layers_.emplace_back(name);
        glBindFramebuffer(GL_FRAMEBUFFER, name);
        for (const Attached& a : all) {
            if (a.cube) glFramebufferTexture2D(GL_FRAMEBUFFER, a.point, static_cast<GLenum>(GL_TEXTURE_CUBE_MAP_POSITIVE_X + layer), a.texture, a.level);
            else glFramebufferTextureLayer(GL_FRAMEBUFFER, a.point, a.texture, a.level, layer);
        }
        glDrawBuffers(static_cast<GLsizei>(draw_buffers.size()), draw_buffers.data());
        if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return fail("layer " + std::to_string(layer) + " cannot be drawn to by itself", where, "attach images of formats that can be drawn to");
    }
    glBindFramebuffer(GL_FRAMEBUFFER, layered);
    if (const std::string error = pending_error(); !error.empty()) return fail("its layers cannot be attached one by one (" + error + ")", where);
    return made;
}

}  // namespace fovea::gl
