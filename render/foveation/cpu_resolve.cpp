#include "render/foveation/cpu_resolve.hpp"

#include <epoxy/gl.h>

#include <algorithm>

#include "render/foveation/upsample.hpp"

namespace fovea::foveation {
namespace {

GLint attachment(GLenum what) noexcept {
    GLint value = 0;
    glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, what, &value);
    return value;
}

}  // namespace

bool CpuResolve::can_resolve(const ViewTarget& t, const density::Plan& plan) {
    if (t.framebuffer == 0) return false;
    for (int level = 1; level < plan.settings().level_count; ++level) {
        const density::LevelScale s = plan.settings().levels[static_cast<std::size_t>(level)];
        if ((t.width_px & ((1 << s.x_shift) - 1)) != 0 || (t.height_px & ((1 << s.y_shift) - 1)) != 0) return false;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    if (attachment(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_TEXTURE || attachment(GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL) != 0 ||
        attachment(GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LAYER) != 0 || attachment(GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_CUBE_MAP_FACE) != 0)
        return false;
    GLint before = 0, format = 0;
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &before);
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(attachment(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME)));
    glGetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    const bool plain = glGetError() == GL_NO_ERROR && format == GL_RGBA8;   // a texture of another target fails to bind
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(before));
    return plain;
}

void CpuResolve::reserve(const density::Plan& plan) {
    const auto grow = [](auto& v, std::size_t n) {
        if (v.size() < n) v.resize(n);
    };
    const auto width = static_cast<std::size_t>(plan.settings().width_px);
    for (int level = 1; level < plan.settings().level_count; ++level)
        grow(small_[static_cast<std::size_t>(level)],
             static_cast<std::size_t>(plan.level_width_px(level)) * static_cast<std::size_t>(plan.level_height_px(level)) * 4);
    grow(strip_, width * static_cast<std::size_t>(plan.bin_px()) * 4);
    grow(row_, (width + 2) * 4);
}

void CpuResolve::run(const density::Plan& plan, const ViewTarget& t, std::span<const Level> levels) noexcept {
    std::array<SmallImage, density::kMaxLevels> images{};
    for (int level = 1; level < plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        const Level& l = levels[i];
        if (!plan.uses(level)) continue;
        const std::size_t stride = static_cast<std::size_t>(l.x1 - l.x0) * 4;
        gl::read_pixels(l.framebuffer, l.x0, l.y0, l.x1 - l.x0, l.y1 - l.y0, small_[i]);
        images[i] = {small_[i].data(), stride, l.x0, l.y0, l.x1, l.y1};
    }
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    GLint before = 0;
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &before);
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(attachment(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME)));
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, t.width_px);
    const std::size_t stride = static_cast<std::size_t>(t.width_px) * 4;
    const int bin = plan.bin_px();
    for (int r = 0; r < plan.rows(); ++r) {
        const int y0 = r * bin, y1 = std::min(y0 + bin, t.height_px);
        int from = -1;   // first pixel of the run of bins that are not level 0
        for (int c = 0; c <= plan.columns();) {
            const int level = c < plan.columns() ? plan.level_at(c, r) : 0;
            const int x0 = std::min(c * bin, t.width_px);
            if (level == 0) {
                if (from >= 0)
                    glTexSubImage2D(GL_TEXTURE_2D, 0, t.x_px + from, t.y_px + y0, x0 - from, y1 - y0, GL_RGBA, GL_UNSIGNED_BYTE,
                                    strip_.data() + static_cast<std::size_t>(from) * 4);
                from = -1;
                ++c;
                continue;
            }
            if (from < 0) from = x0;
            while (c < plan.columns() && plan.level_at(c, r) == level) ++c;
            const int x1 = std::min(c * bin, t.width_px);
            const density::LevelScale s = plan.settings().levels[static_cast<std::size_t>(level)];
            enlarge(images[static_cast<std::size_t>(level)], s.x_shift, s.y_shift, x0, y0, x1, y1,
                    strip_.data() + static_cast<std::size_t>(x0) * 4, stride, row_);
        }
    }
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(before));
}

}  // namespace fovea::foveation
