#include "render/foveation/cpu_resolve.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <system_error>
#include <thread>

namespace fovea::foveation {
namespace {

constexpr int kMostThreads = 4;       // more only wait for memory
constexpr std::size_t kSlots = 16;    // strips between two uploads: waking threads costs more than a strip
constexpr int kFewestRows = 8;        // fewer strips than this are made by the caller alone

GLenum binding_of(GLenum target) noexcept { return target == GL_TEXTURE_2D ? GL_TEXTURE_BINDING_2D : GL_TEXTURE_BINDING_2D_ARRAY; }

}  // namespace

bool CpuResolve::can_resolve(const ViewTarget& t, const gl::FramebufferShape& shape, const density::Plan& plan) {
    const gl::ColorShape& c = shape.color[0];
    if (shape.colors != 1 || shape.samples > 0 || c.format != GL_RGBA8) return false;
    if (c.texture_target != GL_TEXTURE_2D && c.texture_target != GL_TEXTURE_2D_ARRAY) return false;
    for (int level = 1; level < plan.settings().level_count; ++level) {
        const density::LevelScale s = plan.settings().levels[static_cast<std::size_t>(level)];
        if ((t.width_px & ((1 << s.x_shift) - 1)) != 0 || (t.height_px & ((1 << s.y_shift) - 1)) != 0) return false;
    }
    return true;
}

void CpuResolve::reserve(const density::Plan& plan, int threads) {
    if (threads == 0) threads = std::min(kMostThreads, static_cast<int>(std::thread::hardware_concurrency()));
    if (threads > 1 && pool_ == nullptr) {
        try {
            pool_ = std::make_unique<threads::ThreadPool>(threads);
            slots_ = kSlots;
        } catch (const std::system_error&) {
            // No more threads to be had: the caller does it all.
        }
    }
    const auto grow = [](auto& v, std::size_t n) {
        if (v.size() < n) v.resize(n);
    };
    const auto width = static_cast<std::size_t>(plan.settings().width_px);
    for (int level = 1; level < plan.settings().level_count; ++level)
        grow(small_[static_cast<std::size_t>(level)],
             static_cast<std::size_t>(plan.level_width_px(level)) * static_cast<std::size_t>(plan.level_height_px(level)) * 4);
    grow(strips_, slots_ * width * static_cast<std::size_t>(plan.bin_px()) * 4);
    grow(rows_, slots_ * (width + 2) * 4);
    grow(cubic_rows_, slots_ * (width + 4) * 4);
}

void CpuResolve::enlarge_strip(const density::Plan& plan, std::span<const SmallImage> images, int row, std::size_t slot, gl::Filter filter) noexcept {
    const int width = plan.settings().width_px, bin = plan.bin_px();
    const auto w = static_cast<std::size_t>(width), stride = w * 4;
    std::uint8_t* strip = strips_.data() + slot * stride * static_cast<std::size_t>(bin);
    const int y0 = row * bin, y1 = std::min(y0 + bin, plan.settings().height_px);
    for (int c = 0; c < plan.columns();) {
        const int level = plan.level_at(c, row), x0 = std::min(c * bin, width);
        while (c < plan.columns() && plan.level_at(c, row) == level) ++c;
        if (level == 0) continue;
        const int x1 = std::min(c * bin, width);
        const density::LevelScale s = plan.settings().levels[static_cast<std::size_t>(level)];
        const SmallImage& image = images[static_cast<std::size_t>(level)];
        std::uint8_t* out = strip + static_cast<std::size_t>(x0) * 4;
        switch (filter) {
            case gl::Filter::nearest: enlarge_nearest(image, s.x_shift, s.y_shift, x0, y0, x1, y1, out, stride); break;
            case gl::Filter::linear:
                enlarge(image, s.x_shift, s.y_shift, x0, y0, x1, y1, out, stride, std::span(rows_).subspan(slot * (w + 2) * 4, (w + 2) * 4));
                break;
            case gl::Filter::cubic:
                enlarge_cubic(image, s.x_shift, s.y_shift, x0, y0, x1, y1, out, stride, std::span(cubic_rows_).subspan(slot * (w + 4) * 4, (w + 4) * 4));
                break;
        }
    }
}

void CpuResolve::run(const density::Plan& plan, const ViewTarget& t, const gl::FramebufferShape& shape, std::span<const Level> levels,
                     gl::Filter filter) noexcept {
    std::array<SmallImage, density::kMaxLevels> images{};
    for (int level = 1; level < plan.settings().level_count; ++level) {
        const auto i = static_cast<std::size_t>(level);
        const Level& l = levels[i];
        if (!plan.uses(level)) continue;
        const std::size_t stride = static_cast<std::size_t>(l.x1 - l.x0) * 4;
        gl::read_pixels(l.framebuffer, l.at_x + l.x0, l.at_y + l.y0, l.x1 - l.x0, l.y1 - l.y0, small_[i]);
        images[i] = {small_[i].data(), stride, l.x0, l.y0, l.x1, l.y1};
    }
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    const gl::ColorShape& color = shape.color[0];
    GLint before = 0;
    glGetIntegerv(binding_of(color.texture_target), &before);
    glBindTexture(color.texture_target, gl::attached_object(0));
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, t.width_px);
    const auto upload = [&](int x0, int x1, int y0, int y1, const std::uint8_t* from) {
        if (color.texture_target == GL_TEXTURE_2D)
            glTexSubImage2D(GL_TEXTURE_2D, color.level, t.x_px + x0, t.y_px + y0, x1 - x0, y1 - y0, GL_RGBA, GL_UNSIGNED_BYTE, from);
        else
            glTexSubImage3D(GL_TEXTURE_2D_ARRAY, color.level, t.x_px + x0, t.y_px + y0, color.layer, x1 - x0, y1 - y0, 1, GL_RGBA, GL_UNSIGNED_BYTE, from);
    };
    const std::size_t strip_bytes = static_cast<std::size_t>(t.width_px) * static_cast<std::size_t>(plan.bin_px()) * 4;
    const bool alone = pool_ == nullptr || plan.rows() < kFewestRows;
    const int step = alone ? 1 : static_cast<int>(slots_);
    for (int first = 0; first < plan.rows(); first += step) {
        const int rows = std::min(step, plan.rows() - first);
        const auto make = [&](int begin, int end) {
            for (int r = begin; r < end; ++r) enlarge_strip(plan, images, first + r, static_cast<std::size_t>(r), filter);
        };
        if (alone) make(0, rows);
        else pool_->run(rows, 1, make);
        for (int r = 0; r < rows; ++r) {
            const std::uint8_t* strip = strips_.data() + static_cast<std::size_t>(r) * strip_bytes;
            const int y0 = (first + r) * plan.bin_px(), y1 = std::min(y0 + plan.bin_px(), t.height_px);
            // Runs of bins that are not level 0.
            for (int c = 0; c < plan.columns();) {
                const int from = c;
                while (c < plan.columns() && plan.level_at(c, first + r) != 0) ++c;
                const int x0 = from * plan.bin_px(), x1 = std::min(c * plan.bin_px(), t.width_px);
                if (x0 < x1) upload(x0, x1, y0, y1, strip + static_cast<std::size_t>(x0) * 4);
                while (c < plan.columns() && plan.level_at(c, first + r) == 0) ++c;
            }
        }
    }
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glBindTexture(color.texture_target, static_cast<GLuint>(before));
}

}  // namespace fovea::foveation
