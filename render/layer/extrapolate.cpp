#include "render/layer/extrapolate.hpp"

#include <array>

#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

struct Image {
    Attachment texture;
    GLint format = 0;
};

// The base level of a texture; the format is 0 for what is no two-dimensional texture.
Image base_level(GLuint name) {
    Image image;
    image.texture.type = GL_TEXTURE;
    image.texture.name = name;
    if (name == 0 || !gl.IsTexture(name)) return image;
    find_target(image.texture);
    if (image.texture.target != GL_TEXTURE_2D) return image;
    const GLint bound = get_integer(GL_TEXTURE_BINDING_2D);
    gl.BindTexture(GL_TEXTURE_2D, name);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_INTERNAL_FORMAT, &image.format);
    gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    return image;
}

bool in_table(GLint format) {
    switch (format) {
        case GL_RGBA8: case GL_RGB8: case GL_R8: case GL_RGBA16F: case GL_RGB16F: case GL_RGBA32F: case GL_RGB32F: return true;
        // Unsized formats of images that the driver keeps with 8 bits.
        case GL_RGBA: case GL_RGB: return true;
        default: return false;
    }
}

}  // namespace

bool can_extrapolate() noexcept { return false; }

void GL_APIENTRY layer_glExtrapolateTex2DQCOM(GLuint src1, GLuint src2, GLuint output, GLfloat scale) {
    Context* c = t_context;
    if (!c || !c->active()) return;
    if (c->native().frame_extrapolation) return gl.ExtrapolateTex2DQCOM(src1, src2, output, scale);
    if (scale == 0.0f) return c->raise(GL_INVALID_VALUE);
    c->before_finish(Call::ExtrapolateTex2DQCOM);
    c->keep_driver_error();
    const std::array<Image, 3> images{base_level(src1), base_level(src2), base_level(output)};
    for (const Image& image : images)
        if (!in_table(image.format) || image.format != images[0].format || image.texture.width != images[0].texture.width ||
            image.texture.height != images[0].texture.height)
            return c->raise(GL_INVALID_OPERATION);
}

}  // namespace fovea::layer
