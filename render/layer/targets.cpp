#include "render/layer/targets.hpp"

#include <algorithm>

#include "render/layer/stats.hpp"
#include "render/layer/trace.hpp"
#include "render/layer/undo.hpp"

namespace fovea::layer {
namespace {

GLint attachment_value(GLenum target, GLenum point, GLenum name) {
    GLint value = 0;
    gl.GetFramebufferAttachmentParameteriv(target, point, name, &value);
    return value;
}

// The sized format that has these components.
GLenum color_format(GLenum target, GLenum point) {
    struct Row {
        GLint type, r, g, b, a;
        GLenum format;
    };
    static constexpr Row kTable[] = {
        {GL_UNSIGNED_NORMALIZED, 8, 8, 8, 8, GL_RGBA8}, {GL_UNSIGNED_NORMALIZED, 8, 8, 8, 0, GL_RGB8},
        {GL_UNSIGNED_NORMALIZED, 8, 0, 0, 0, GL_R8}, {GL_UNSIGNED_NORMALIZED, 8, 8, 0, 0, GL_RG8},
        {GL_UNSIGNED_NORMALIZED, 5, 6, 5, 0, GL_RGB565}, {GL_UNSIGNED_NORMALIZED, 4, 4, 4, 4, GL_RGBA4},
        {GL_UNSIGNED_NORMALIZED, 5, 5, 5, 1, GL_RGB5_A1}, {GL_UNSIGNED_NORMALIZED, 10, 10, 10, 2, GL_RGB10_A2},
        {GL_FLOAT, 16, 16, 16, 16, GL_RGBA16F}, {GL_FLOAT, 16, 16, 16, 0, GL_RGB16F}, {GL_FLOAT, 16, 16, 0, 0, GL_RG16F},
        {GL_FLOAT, 16, 0, 0, 0, GL_R16F}, {GL_FLOAT, 32, 32, 32, 32, GL_RGBA32F}, {GL_FLOAT, 32, 32, 0, 0, GL_RG32F},
        {GL_FLOAT, 32, 0, 0, 0, GL_R32F}, {GL_FLOAT, 11, 11, 10, 0, GL_R11F_G11F_B10F},
        {GL_INT, 8, 0, 0, 0, GL_R8I}, {GL_INT, 8, 8, 0, 0, GL_RG8I}, {GL_INT, 8, 8, 8, 8, GL_RGBA8I},
        {GL_INT, 16, 0, 0, 0, GL_R16I}, {GL_INT, 16, 16, 0, 0, GL_RG16I}, {GL_INT, 16, 16, 16, 16, GL_RGBA16I},
        {GL_INT, 32, 0, 0, 0, GL_R32I}, {GL_INT, 32, 32, 0, 0, GL_RG32I}, {GL_INT, 32, 32, 32, 32, GL_RGBA32I},
        {GL_UNSIGNED_INT, 8, 0, 0, 0, GL_R8UI}, {GL_UNSIGNED_INT, 8, 8, 0, 0, GL_RG8UI},
        {GL_UNSIGNED_INT, 8, 8, 8, 8, GL_RGBA8UI}, {GL_UNSIGNED_INT, 10, 10, 10, 2, GL_RGB10_A2UI},
        {GL_UNSIGNED_INT, 16, 0, 0, 0, GL_R16UI}, {GL_UNSIGNED_INT, 16, 16, 0, 0, GL_RG16UI},
        {GL_UNSIGNED_INT, 16, 16, 16, 16, GL_RGBA16UI}, {GL_UNSIGNED_INT, 32, 0, 0, 0, GL_R32UI},
        {GL_UNSIGNED_INT, 32, 32, 0, 0, GL_RG32UI}, {GL_UNSIGNED_INT, 32, 32, 32, 32, GL_RGBA32UI},
    };
    const auto get = [&](GLenum name) { return attachment_value(target, point, name); };
    const GLint type = get(GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE);
    const GLint r = get(GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE), g = get(GL_FRAMEBUFFER_ATTACHMENT_GREEN_SIZE);
    const GLint b = get(GL_FRAMEBUFFER_ATTACHMENT_BLUE_SIZE), a = get(GL_FRAMEBUFFER_ATTACHMENT_ALPHA_SIZE);
    for (const Row& row : kTable)
        if (row.type == type && row.r == r && row.g == g && row.b == b && row.a == a) {
            const bool srgb = get(GL_FRAMEBUFFER_ATTACHMENT_COLOR_ENCODING) == GL_SRGB;
            if (srgb) return row.format == GL_RGBA8 ? GL_SRGB8_ALPHA8 : 0;
            return row.format;
        }
    return 0;
}

char resolve_kind(GLenum format) {
    switch (format) {
        case GL_R8I: case GL_RG8I: case GL_RGBA8I: case GL_R16I: case GL_RG16I: case GL_RGBA16I: case GL_R32I:
        case GL_RG32I: case GL_RGBA32I: return 'i';
        case GL_R8UI: case GL_RG8UI: case GL_RGBA8UI: case GL_RGB10_A2UI: case GL_R16UI: case GL_RG16UI:
        case GL_RGBA16UI: case GL_R32UI: case GL_RG32UI: case GL_RGBA32UI: return 'u';
        case GL_RGBA32F: case GL_RG32F: case GL_R32F: return 'n';  // cannot be filtered without an extension
        default: return 'f';
    }
}

void attach(const Attachment& a) {
    if (a.type == GL_RENDERBUFFER)
        gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, a.point, GL_RENDERBUFFER, a.name);
    else if (a.face != 0 || a.target == GL_TEXTURE_CUBE_MAP)  // of all faces at once: the first, which draws go to
        gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, a.point, a.face != 0 ? static_cast<GLenum>(a.face) : GL_TEXTURE_CUBE_MAP_POSITIVE_X, a.name, a.level);
    else if (a.target == GL_TEXTURE_2D || a.target == GL_TEXTURE_2D_MULTISAMPLE)
        gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, a.point, a.target, a.name, a.level);
    else
        gl.FramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, a.point, a.name, a.level, a.layer);
}

}  // namespace

char fetch_kind(GLenum format) {
    const char kind = resolve_kind(format);
    return kind == 'f' ? 'n' : kind;
}

std::vector<Attachment> read_attachments(GLenum target) {
    std::vector<Attachment> list;
    const int colors = std::min(get_integer(GL_MAX_COLOR_ATTACHMENTS), static_cast<GLint>(kMaxColors));
    const bool layers = get_integer(GL_MAJOR_VERSION) * 10 + get_integer(GL_MINOR_VERSION) >= 32;
    for (int i = 0; i < colors + 2; ++i) {
        Attachment a;
        a.point = i < colors ? GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i)
                             : (i == colors ? GL_DEPTH_ATTACHMENT : GL_STENCIL_ATTACHMENT);
        a.type = attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE);
        if (a.type != GL_TEXTURE && a.type != GL_RENDERBUFFER) continue;
        a.name = static_cast<GLuint>(attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
        if (a.type == GL_TEXTURE) {
            a.level = attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL);
            a.face = attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_CUBE_MAP_FACE);
            a.layer = attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER);
            if (layers)
                a.layered = attachment_value(target, a.point, GL_FRAMEBUFFER_ATTACHMENT_LAYERED);
        }
        list.push_back(a);
    }
    return list;
}

// OpenGL ES cannot be asked what kind a texture is: it can be bound to its own target only.
void find_target(Attachment& a) {
    if (a.type == GL_RENDERBUFFER) {
        const GLint bound = get_integer(GL_RENDERBUFFER_BINDING);
        gl.BindRenderbuffer(GL_RENDERBUFFER, a.name);
        gl.GetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_WIDTH, &a.width);
        gl.GetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_HEIGHT, &a.height);
        gl.BindRenderbuffer(GL_RENDERBUFFER, static_cast<GLuint>(bound));
        return;
    }
    static constexpr GLenum kTargets[] = {GL_TEXTURE_2D, GL_TEXTURE_2D_ARRAY, GL_TEXTURE_2D_MULTISAMPLE,
                                          GL_TEXTURE_CUBE_MAP, GL_TEXTURE_3D, GL_TEXTURE_2D_MULTISAMPLE_ARRAY,
                                          GL_TEXTURE_CUBE_MAP_ARRAY};
    drop_errors();
    for (const GLenum target : kTargets) {
        const auto bound = static_cast<GLuint>(get_integer(texture_binding_query(target)));
        if (bound != a.name) gl.BindTexture(target, a.name);
        if (gl.GetError() != GL_NO_ERROR) continue;
        const GLenum image = a.face != 0 ? static_cast<GLenum>(a.face) : target == GL_TEXTURE_CUBE_MAP ? GL_TEXTURE_CUBE_MAP_POSITIVE_X : target;
        gl.GetTexLevelParameteriv(image, a.level, GL_TEXTURE_WIDTH, &a.width);
        gl.GetTexLevelParameteriv(image, a.level, GL_TEXTURE_HEIGHT, &a.height);
        a.target = target;
        if (bound != a.name) gl.BindTexture(target, bound);
        break;
    }
    drop_errors();
}

TargetShape read_shape(std::vector<Attachment>& attachments) {
    TargetShape shape;
    shape.usable = true;
    for (Attachment& a : attachments) {
        find_target(a);
        const bool first = shape.width == 0;
        shape.width = first ? a.width : std::min(shape.width, a.width);
        shape.height = first ? a.height : std::min(shape.height, a.height);
    }
    shape.samples = get_integer(GL_SAMPLES);
    bool any = false;
    for (const Attachment& a : attachments) {
        shape.layered |= a.layered != 0;
        if (a.point == GL_STENCIL_ATTACHMENT) {
            shape.has_stencil = true;
        } else if (a.point == GL_DEPTH_ATTACHMENT) {
            shape.has_depth = true;
            const bool wide = attachment_value(GL_DRAW_FRAMEBUFFER, a.point, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE) == GL_FLOAT;
            shape.depth_stencil = wide ? GL_DEPTH32F_STENCIL8 : GL_DEPTH24_STENCIL8;
        } else {
            const GLenum format = color_format(GL_DRAW_FRAMEBUFFER, a.point);
            shape.color[a.point - GL_COLOR_ATTACHMENT0] = format;
            if (format == 0) shape.usable = false, shape.unknown_format = true;
            any = true;
        }
    }
    if (!shape.depth_stencil) shape.depth_stencil = GL_STENCIL_INDEX8;
    if (!any || shape.width < 1 || shape.height < 1) shape.usable = false;
    return shape;
}

TargetShape read_default_formats() {
    TargetShape shape;
    const auto present = [](GLenum point) {
        return attachment_value(GL_DRAW_FRAMEBUFFER, point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_NONE;
    };
    shape.color[0] = color_format(GL_DRAW_FRAMEBUFFER, GL_BACK);
    shape.has_depth = present(GL_DEPTH);
    shape.has_stencil = present(GL_STENCIL);
    const bool wide = shape.has_depth && attachment_value(GL_DRAW_FRAMEBUFFER, GL_DEPTH, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE) > 24;
    shape.depth_stencil = !shape.has_depth ? GL_STENCIL_INDEX8 : wide ? GL_DEPTH32F_STENCIL8 : GL_DEPTH24_STENCIL8;
    shape.samples = get_integer(GL_SAMPLES);
    shape.in_place = true;
    shape.usable = shape.color[0] != 0;
    drop_errors();
    return shape;
}

bool read_default_size(EGLDisplay display, EGLSurface surface, TargetShape& shape) {
    // A window that was resized is so for the driver when it is first drawn to: this draws nothing.
    Undo state;
    state.cap(GL_SCISSOR_TEST);
    state.scissor();
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT);
    state.restore();
    return surface_size(display, surface, shape.width, shape.height) && shape.width > 0 && shape.height > 0;
}

std::uint64_t bytes_of(GLenum format) {
    switch (format) {
        case 0: return 0;
        case GL_R8: case GL_R8I: case GL_R8UI: case GL_STENCIL_INDEX8: return 1;
        case GL_RG8: case GL_RG8I: case GL_RG8UI: case GL_RGB565: case GL_RGBA4: case GL_RGB5_A1: case GL_R16F: case GL_R16I: case GL_R16UI: return 2;
        case GL_RGBA16F: case GL_RGB16F: case GL_RG32F: case GL_RGBA16I: case GL_RGBA16UI: case GL_RG32I: case GL_RG32UI: case GL_DEPTH32F_STENCIL8: return 8;
        case GL_RGBA32F: case GL_RGBA32I: case GL_RGBA32UI: return 16;
        default: return 4;
    }
}

std::uint64_t Targets::bytes(const TargetShape& shape) {
    std::uint64_t color = 0, all = 0;
    for (const GLenum format : shape.color) color += bytes_of(format);
    const auto levels = density::standard_levels();
    for (std::size_t i = shape.in_place ? 1 : 0; i < kLevels; ++i) {
        const auto pixels = static_cast<std::uint64_t>((shape.width >> levels[i].x_shift) + 1) * static_cast<std::uint64_t>((shape.height >> levels[i].y_shift) + 1);
        const auto samples = static_cast<std::uint64_t>(std::max(shape.samples, 1));
        all += pixels * samples * (bytes_of(shape.depth_stencil) + (i > 0 ? color : 0));
        if (i > 0 && shape.samples > 0) all += pixels * color;
    }
    return all;
}

std::unique_ptr<Targets> Targets::create(const TargetShape& shape, int level_count, bool* out_of_memory) {
    std::unique_ptr<Targets> targets(new Targets);
    drop_errors();
    targets->shape_ = shape;
    targets->levels_.resize(static_cast<std::size_t>(level_count));
    const bool stencil_textures = get_integer(GL_MAJOR_VERSION) * 10 + get_integer(GL_MINOR_VERSION) >= 32;
    targets->depth_stencil_textures_ = shape.samples == 0 && (shape.depth_stencil != GL_STENCIL_INDEX8 || stencil_textures);
    Undo state;
    state.framebuffers();
    state.active_texture(0);
    gl.ActiveTexture(GL_TEXTURE0);
    state.texture(GL_TEXTURE_2D, 0);
    const GLint renderbuffer = get_integer(GL_RENDERBUFFER_BINDING);
    bool good = true;
    GLenum error = GL_NO_ERROR;
    const auto levels = density::standard_levels();
    for (std::size_t i = 0; good && i < targets->levels_.size(); ++i) {
        if (i == 0 && shape.in_place) continue;
        Level& level = targets->levels_[i];
        level.width = (shape.width + (1 << levels[i].x_shift) - 1) >> levels[i].x_shift;
        level.height = (shape.height + (1 << levels[i].y_shift) - 1) >> levels[i].y_shift;
        good = targets->create_level(i, error);
    }
    if (out_of_memory) *out_of_memory = error == GL_OUT_OF_MEMORY;
    gl.GenFramebuffers(1, &targets->one_color_);
    gl.BindRenderbuffer(GL_RENDERBUFFER, static_cast<GLuint>(renderbuffer));
    state.restore();
    if (!good) return nullptr;
    count(stats.targets_created);
    return targets;
}

bool Targets::create_level(std::size_t index, GLenum& error) {
    Level& level = levels_[index];
    const auto clean = [&error] { return (error = gl.GetError()) == GL_NO_ERROR; };
    gl.GenFramebuffers(1, &level.framebuffer);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, level.framebuffer);
    const auto renderbuffer = [&](GLuint& name, GLenum format) {
        gl.GenRenderbuffers(1, &name);
        gl.BindRenderbuffer(GL_RENDERBUFFER, name);
        if (shape_.samples > 0)
            gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, shape_.samples, format, level.width, level.height);
        else
            gl.RenderbufferStorage(GL_RENDERBUFFER, format, level.width, level.height);
    };
    const auto texture = [&](GLuint& name, GLenum format, GLint filter) {
        gl.GenTextures(1, &name);
        gl.BindTexture(GL_TEXTURE_2D, name);
        gl.TexStorage2D(GL_TEXTURE_2D, 1, format, level.width, level.height);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    };
    const bool stencil_only = shape_.depth_stencil == GL_STENCIL_INDEX8;
    const GLenum point = stencil_only ? GL_STENCIL_ATTACHMENT : GL_DEPTH_STENCIL_ATTACHMENT;
    if (!depth_stencil_textures_) {
        renderbuffer(level.depth_stencil, shape_.depth_stencil);
        gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, point, GL_RENDERBUFFER, level.depth_stencil);
    } else {
        texture(level.depth_stencil, shape_.depth_stencil, GL_NEAREST);
        gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, point, GL_TEXTURE_2D, level.depth_stencil, 0);
    }
    if (index == 0) return clean();  // its colours come with attach_level0
    for (std::size_t c = 0; c < kMaxColors; ++c) {
        const GLenum format = shape_.color[c];
        if (!format) continue;
        const GLint filter = resolve_kind(format) == 'f' ? GL_LINEAR : GL_NEAREST;
        const GLenum to = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(c);
        if (shape_.samples > 0) {
            renderbuffer(level.color[c], format);
            gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, to, GL_RENDERBUFFER, level.color[c]);
            texture(level.resolved[c], format, filter);
        } else {
            texture(level.color[c], format, filter);
            gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, to, GL_TEXTURE_2D, level.color[c], 0);
        }
    }
    if (!clean() || gl.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) return false;
    if (shape_.samples > 0) gl.GenFramebuffers(1, &level.resolve_framebuffer);
    return clean();
}

void Targets::abandon(Graveyard& to) {
    const bool textures = shape_.samples == 0;
    for (const Level& level : levels_) {
        for (std::size_t c = 0; c < kMaxColors; ++c) {
            textures ? to.texture(level.color[c]) : to.renderbuffer(level.color[c]);
            to.texture(level.resolved[c]);
        }
        depth_stencil_textures_ ? to.texture(level.depth_stencil) : to.renderbuffer(level.depth_stencil);
    }
    levels_.clear();
    one_color_ = 0;
}

Targets::~Targets() {
    if (levels_.empty()) return;
    for (Level& level : levels_) {
        gl.DeleteFramebuffers(1, &level.framebuffer);
        gl.DeleteFramebuffers(1, &level.resolve_framebuffer);
        const bool textures = shape_.samples == 0;
        for (std::size_t c = 0; c < kMaxColors; ++c) {
            textures ? gl.DeleteTextures(1, &level.color[c]) : gl.DeleteRenderbuffers(1, &level.color[c]);
            gl.DeleteTextures(1, &level.resolved[c]);
        }
        depth_stencil_textures_ ? gl.DeleteTextures(1, &level.depth_stencil) : gl.DeleteRenderbuffers(1, &level.depth_stencil);
    }
    gl.DeleteFramebuffers(1, &one_color_);
}

void Targets::attach_level0(const std::vector<Attachment>& attachments) {
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, levels_[0].framebuffer);
    for (const Attachment& old : level0_)
        gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, old.point, GL_RENDERBUFFER, 0);
    level0_.clear();
    for (const Attachment& a : attachments)
        if (a.point >= GL_COLOR_ATTACHMENT0 && a.point < GL_COLOR_ATTACHMENT0 + kMaxColors) {
            attach(a);
            level0_.push_back(a);
        }
}

void Targets::bind_for_drawing(int level, const std::vector<GLenum>& draw_buffers) {
    if (shape_.in_place && level == 0) return gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, levels_[static_cast<std::size_t>(level)].framebuffer);
    gl.DrawBuffers(static_cast<GLsizei>(draw_buffers.size()), draw_buffers.data());
}

void Targets::draw_masks(OwnDrawing& own, const density::Plan& plan) {
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);  // a shader without output would write anything
    for (int i = 0; i < static_cast<int>(levels_.size()); ++i) {
        const Level& level = levels_[static_cast<std::size_t>(i)];
        if (!plan.uses(i) || (i == 0 && shape_.in_place)) continue;
        const auto& scale = plan.settings().levels[static_cast<std::size_t>(i)];
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, level.framebuffer);
        gl.Disable(GL_SCISSOR_TEST);
        gl.StencilMask(kMaskBit);
        gl.ClearStencil(0);
        gl.Clear(GL_STENCIL_BUFFER_BIT);
        gl.Enable(GL_STENCIL_TEST);
        gl.StencilFunc(GL_ALWAYS, static_cast<GLint>(kMaskBit), 0xff);
        gl.StencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
        gl.Viewport(0, 0, level.width, level.height);
        // A lower level is drawn one texel beyond its bins, because the resolve filters.
        const int x_texel = 1 << scale.x_shift, y_texel = 1 << scale.y_shift;
        own.draw_mask({.plan = &plan, .level = i, .width = level.width * x_texel, .height = level.height * y_texel,
                       .grow_x = i > 0 ? static_cast<float>(x_texel) : 0.0f,
                       .grow_y = i > 0 ? static_cast<float>(y_texel) : 0.0f});
    }
}

void Targets::clear_masks(const density::Plan& plan, GLint cleared_to) {
    for (int i = 0; i < static_cast<int>(levels_.size()); ++i) {
        if (!plan.uses(i) || (i == 0 && shape_.in_place)) continue;
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, levels_[static_cast<std::size_t>(i)].framebuffer);
        gl.Disable(GL_SCISSOR_TEST);
        gl.StencilMask(kMaskBit);
        gl.ClearStencil(cleared_to);
        gl.Clear(GL_STENCIL_BUFFER_BIT);
    }
}

void Targets::load_colors(const density::Plan& plan) {
    gl.Disable(GL_SCISSOR_TEST);
    for (std::size_t i = 1; i < levels_.size(); ++i) {
        if (!plan.uses(static_cast<int>(i))) continue;
        for (std::size_t c = 0; c < kMaxColors; ++c) {
            if (!shape_.color[c]) continue;
            const GLenum point = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(c);
            std::array<GLenum, kMaxColors> buffers{};
            buffers.fill(GL_NONE);
            buffers[c] = point;
            gl.BindFramebuffer(GL_READ_FRAMEBUFFER, levels_[0].framebuffer);
            gl.ReadBuffer(point);
            gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, levels_[i].framebuffer);
            gl.DrawBuffers(static_cast<GLsizei>(c + 1), buffers.data());
            gl.BlitFramebuffer(0, 0, shape_.width, shape_.height, 0, 0, levels_[i].width, levels_[i].height,
                               GL_COLOR_BUFFER_BIT, resolve_kind(shape_.color[c]) == 'f' ? GL_LINEAR : GL_NEAREST);
        }
    }
}

void Targets::resolve_colors(OwnDrawing& own, const density::Plan& plan) {
    for (std::size_t c = 0; c < kMaxColors; ++c) {
        if (!shape_.color[c]) continue;
        const auto image = std::find_if(level0_.begin(), level0_.end(), [c](const Attachment& a) {
            return a.point == GL_COLOR_ATTACHMENT0 + c;
        });
        if (image == level0_.end() && !shape_.in_place) continue;
        bool bound = false;
        for (std::size_t i = 1; i < levels_.size(); ++i) {
            Level& level = levels_[i];
            if (!plan.uses(static_cast<int>(i))) continue;
            GLuint source = level.color[c];
            if (shape_.samples > 0) {
                const GLenum point = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(c);
                gl.Disable(GL_SCISSOR_TEST);
                gl.BindFramebuffer(GL_READ_FRAMEBUFFER, level.framebuffer);
                gl.ReadBuffer(point);
                gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, level.resolve_framebuffer);
                gl.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, level.resolved[c], 0);
                gl.BlitFramebuffer(0, 0, level.width, level.height, 0, 0, level.width, level.height,
                                   GL_COLOR_BUFFER_BIT, GL_NEAREST);
                source = level.resolved[c];
                bound = false;
            }
            if (!bound && shape_.in_place) {
                gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
                bound = true;
            }
            if (!bound) {
                gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, one_color_);
                Attachment a = *image;
                a.point = GL_COLOR_ATTACHMENT0;
                attach(a);
                bound = true;
            }
            gl.Viewport(0, 0, shape_.width, shape_.height);
            own.draw_resolve({.plan = &plan, .level = static_cast<int>(i), .width = shape_.width,
                              .height = shape_.height, .grow_x = 0, .grow_y = 0}, source,
                             resolve_kind(shape_.color[c]), level.width, level.height);
        }
    }
    count(stats.resolves);
    if (shape_.in_place) return;
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, one_color_);
    gl.FramebufferRenderbuffer(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, 0);
}

std::vector<std::uint8_t> Targets::read_color() {
    if (shape_.samples > 0) return {};
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, shape_.in_place ? 0 : levels_[0].framebuffer);
    if (shape_.in_place) return read_colors(GL_BACK, shape_.width, shape_.height);
    return level0_.empty() ? std::vector<std::uint8_t>{} : read_colors(level0_[0].point, shape_.width, shape_.height);
}

bool Targets::resolve_depth(OwnDrawing& own, const density::Plan& plan, GLuint program_framebuffer) {
    if (shape_.samples > 0 || !shape_.has_depth) return false;
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, program_framebuffer);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_ALWAYS);
    gl.DepthMask(GL_TRUE);
    gl.Viewport(0, 0, shape_.width, shape_.height);
    for (std::size_t i = shape_.in_place ? 1 : 0; i < levels_.size(); ++i)
        if (plan.uses(static_cast<int>(i)))
            own.draw_resolve({.plan = &plan, .level = static_cast<int>(i), .width = shape_.width,
                              .height = shape_.height, .grow_x = 0, .grow_y = 0},
                             levels_[i].depth_stencil, 'd', levels_[i].width, levels_[i].height);
    count(stats.depth_restored);
    return true;
}

bool Targets::resolve_stencil(OwnDrawing& own, const density::Plan& plan, GLuint program_framebuffer, bool masked, GLint cleared_to) {
    if (!depth_stencil_textures_ || !shape_.has_stencil) return false;
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, program_framebuffer);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.Disable(GL_DEPTH_TEST);
    gl.Enable(GL_STENCIL_TEST);
    gl.StencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
    gl.Viewport(0, 0, shape_.width, shape_.height);
    const GLuint copied = masked ? ~kMaskBit & 0xffu : 0xffu;
    for (std::size_t i = shape_.in_place ? 1 : 0; i < levels_.size(); ++i) {
        if (!plan.uses(static_cast<int>(i))) continue;
        const OwnDrawing::Rects rects{.plan = &plan, .level = static_cast<int>(i), .width = shape_.width, .height = shape_.height, .grow_x = 0, .grow_y = 0};
        gl.StencilMask(0xff);
        gl.StencilFunc(GL_ALWAYS, cleared_to & static_cast<GLint>(0xffu & ~copied), 0xff);
        own.draw_mask(rects);
        const bool packed = shape_.depth_stencil != GL_STENCIL_INDEX8;
        gl.BindTexture(GL_TEXTURE_2D, levels_[i].depth_stencil);
        if (packed) gl.TexParameteri(GL_TEXTURE_2D, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
        gl.StencilFunc(GL_ALWAYS, 0xff, 0xff);
        // No shader of OpenGL ES writes stencil values: one pass per bit.
        for (GLuint bit = 1; bit < 0x100; bit <<= 1) {
            if (!(bit & copied)) continue;
            gl.StencilMask(bit);
            own.draw_resolve(rects, levels_[i].depth_stencil, 's', levels_[i].width, levels_[i].height, bit);
        }
        gl.BindTexture(GL_TEXTURE_2D, levels_[i].depth_stencil);
        if (packed) gl.TexParameteri(GL_TEXTURE_2D, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_DEPTH_COMPONENT);
    }
    return true;
}

}  // namespace fovea::layer
