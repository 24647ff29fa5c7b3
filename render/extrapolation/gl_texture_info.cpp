#include "render/extrapolation/gl_texture_info.hpp"

namespace fovea::render::extrapolation {

namespace {

// The effective format, whatever it was asked for as.
std::optional<Format> format_of(const GlFunctions& gl, int level) noexcept {
    const auto get = [&](GLenum what) {
        GLint v = 0;
        gl.GetTexLevelParameteriv(GL_TEXTURE_2D, level, what, &v);
        return v;
    };
    switch (get(GL_TEXTURE_INTERNAL_FORMAT)) {
        case GL_RGBA8: return Format::rgba8;
        case GL_RGB8: return Format::rgb8;
        case GL_R8: return Format::r8;
        case GL_RGBA16F: return Format::rgba16f;
        case GL_RGB16F: return Format::rgb16f;
        case GL_RGBA32F: return Format::rgba32f;
        case GL_RGB32F: return Format::rgb32f;
        case GL_RGBA:
            if (get(GL_TEXTURE_RED_SIZE) == 8 && get(GL_TEXTURE_ALPHA_SIZE) == 8) return Format::rgba8;
            return std::nullopt;
        case GL_RGB:
            if (get(GL_TEXTURE_RED_SIZE) == 8 && get(GL_TEXTURE_GREEN_SIZE) == 8) return Format::rgb8;
            return std::nullopt;
        default: return std::nullopt;
    }
}

// Binds it and asks what every version answers; false: no 2D texture.
bool bind_2d(const GlFunctions& gl, GLuint name, TextureInfo& info) noexcept {
    if (name == 0 || gl.IsTexture(name) == GL_FALSE) return false;
    gl.BindTexture(GL_TEXTURE_2D, name);
    if (gl.GetError() != GL_NO_ERROR) return false;   // a texture of another target
    GLint v = 0;
    gl.GetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, &info.base_level);
    constexpr GLenum kSwizzles[4][2] = {{GL_TEXTURE_SWIZZLE_R, GL_RED}, {GL_TEXTURE_SWIZZLE_G, GL_GREEN}, {GL_TEXTURE_SWIZZLE_B, GL_BLUE}, {GL_TEXTURE_SWIZZLE_A, GL_ALPHA}};
    for (const auto& s : kSwizzles) {
        gl.GetTexParameteriv(GL_TEXTURE_2D, s[0], &v);
        info.swizzled |= static_cast<GLenum>(v) != s[1];
    }
    return true;
}

struct Upload {
    GLenum layout, type;
};

bool takes(const GlFunctions& gl, int level, int x, int y, const Upload& u) noexcept {
    gl.TexSubImage2D(GL_TEXTURE_2D, level, x, y, 0, 0, u.layout, u.type, nullptr);
    return gl.GetError() == GL_NO_ERROR;
}

// An upload of nothing may begin at the far edge, and no further.
int extent_by_trial(const GlFunctions& gl, int level, bool vertical, int likely, int most, const Upload& u) noexcept {
    const auto reaches = [&](int at) { return takes(gl, level, vertical ? 0 : at, vertical ? at : 0, u); };
    if (likely > 0 && reaches(likely) && !reaches(likely + 1)) return likely;
    int within = 0, beyond = most + 1;
    while (beyond - within > 1) {
        const int middle = within + (beyond - within) / 2;
        (reaches(middle) ? within : beyond) = middle;
    }
    return within;
}

}  // namespace

TextureInfo inspect(const GlFunctions& gl, GLuint name) noexcept {
    TextureInfo info;
    if (!bind_2d(gl, name, info)) return info;
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, info.base_level, GL_TEXTURE_WIDTH, &info.width);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, info.base_level, GL_TEXTURE_HEIGHT, &info.height);
    if (info.width > 0 && info.height > 0) info.format = format_of(gl, info.base_level);
    return info;
}

TextureInfo inspect_by_trial(const GlFunctions& gl, GLuint name, GLuint framebuffer, const TextureInfo& like) noexcept {
    TextureInfo info;
    if (!bind_2d(gl, name, info)) return info;
    // What a picture of each format takes, and the channels that others which take the same have not: packed formats have
    // smaller ones, sRGB another encoding. One row fits: half floats come before floats, which halves take as well.
    struct Row {
        Format format;
        Upload upload;
        int bits;
        bool floats;
    };
    constexpr Row kRows[] = {{Format::rgba8, {GL_RGBA, GL_UNSIGNED_BYTE}, 8, false},   {Format::rgb8, {GL_RGB, GL_UNSIGNED_BYTE}, 8, false},
                             {Format::r8, {GL_RED, GL_UNSIGNED_BYTE}, 8, false},       {Format::rgba16f, {GL_RGBA, GL_HALF_FLOAT}, 16, true},
                             {Format::rgb16f, {GL_RGB, GL_HALF_FLOAT}, 16, true},      {Format::rgba32f, {GL_RGBA, GL_FLOAT}, 32, true},
                             {Format::rgb32f, {GL_RGB, GL_FLOAT}, 32, true}};
    const Row* found = nullptr;
    for (const Row& row : kRows)
        if (found == nullptr && takes(gl, info.base_level, 0, 0, row.upload)) found = &row;
    if (found == nullptr) return info;
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    gl.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, name, info.base_level);
    const auto attached = [&](GLenum what) {
        GLint v = 0;
        gl.GetFramebufferAttachmentParameteriv(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, what, &v);
        return v;
    };
    const bool fits = attached(GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE) == found->bits && (channel_count(found->format) < 4 || attached(GL_FRAMEBUFFER_ATTACHMENT_ALPHA_SIZE) == found->bits) &&
                      attached(GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE) == (found->floats ? GL_FLOAT : GL_UNSIGNED_NORMALIZED) &&
                      attached(GL_FRAMEBUFFER_ATTACHMENT_COLOR_ENCODING) == GL_LINEAR;
    gl.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    if (gl.GetError() != GL_NO_ERROR || !fits) return info;
    GLint most = 0;
    gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    info.width = extent_by_trial(gl, info.base_level, false, like.width, most, found->upload);
    info.height = extent_by_trial(gl, info.base_level, true, like.height, most, found->upload);
    if (info.width > 0 && info.height > 0) info.format = found->format;
    return info;
}

bool raises_errors(const GlFunctions& gl) noexcept {
    constexpr GLint kNoAlignment = 3;   // 1, 2, 4 and 8 are
    GLint before = 0;
    gl.GetIntegerv(GL_PACK_ALIGNMENT, &before);
    gl.PixelStorei(GL_PACK_ALIGNMENT, kNoAlignment);
    const bool raised = gl.GetError() != GL_NO_ERROR;
    gl.PixelStorei(GL_PACK_ALIGNMENT, before);
    return raised;
}

}  // namespace fovea::render::extrapolation
