#include "render/foveation/view_images.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <string>

#include "render/gl/context.hpp"

namespace fovea::foveation {
namespace {

constexpr std::size_t kMostImages = 16;

}  // namespace

gl::ViewDrawing ViewImages::drawing_for(const Settings& s) noexcept {
    using enum gl::ViewDrawing;
    if (s.drawing == repeated) return repeated;
    const bool multisampled = gl::samples_for(s.format, s.samples) > 1;
    if (s.drawing.value_or(multiview2) == multiview2 && !multisampled && gl::can_draw(multiview2)) return multiview2;
    // Instances are asked for, or stand in for a multiview that was: of itself `repeated` is better, since what a view does
    // not show is left out of it (docs/render.md has the figures).
    if (s.drawing && gl::can_draw(instanced)) return instanced;
    return repeated;
}

Result<ViewImages> ViewImages::create(std::span<const Size> sizes, const Settings& settings) {
    FOVEA_REQUIRE(!sizes.empty() && sizes.size() <= kMostImages);
    ViewImages v;
    v.kind_ = drawing_for(settings);
    v.images_.resize(sizes.size());
    const bool equal = std::ranges::all_of(sizes, [&](const Size& s) { return s == sizes[0]; });
    const auto most = static_cast<std::size_t>(gl::kMostViewsAtOnce);
    // The views of a draw: all, or half of them (the wide ones, and the narrow ones).
    std::size_t per_draw = sizes.size();
    if (per_draw > most || (v.layered() && !equal)) per_draw = sizes.size() % 2 == 0 ? sizes.size() / 2 : 0;
    const auto alike = [&](std::size_t from) {
        return std::ranges::all_of(sizes.subspan(from, per_draw), [&](const Size& s) { return s == sizes[from]; });
    };
    if (v.kind_ == gl::ViewDrawing::repeated || per_draw < 2 || per_draw > most || (v.layered() && !(alike(0) && alike(sizes.size() - per_draw)))) per_draw = 1;
    if (per_draw > 1) v.at_once_ = {v.kind_, static_cast<int>(per_draw)};

    if (v.layered()) {
        for (std::size_t first = 0; first < sizes.size(); first += per_draw) {
            auto layers = make_layers(sizes[first], per_draw, settings.format);
            if (!layers) return std::unexpected(layers.error());
            if (per_draw > 1) v.groups_.push_back({first, per_draw, layers->all.name(), sizes[first]});
            for (std::size_t i = 0; i < per_draw; ++i) {
                const gl::Name framebuffer = layers->single[i].name();
                v.images_[first + i] = {framebuffer, 0, 0, sizes[first].width_px, sizes[first].height_px, framebuffer, layers->color.name(), static_cast<int>(i)};
            }
            v.layers_.push_back(*std::move(layers));
        }
        return v;
    }
    if (auto ok = v.make_targets(sizes, settings); !ok) return std::unexpected(ok.error());
    return v;
}

// One target per image, or per group of them, side by side.
Result<void> ViewImages::make_targets(std::span<const Size> sizes, const Settings& settings) {
    const int samples = gl::samples_for(settings.format, settings.samples);
    const auto per_target = static_cast<std::size_t>(at_once_.views);
    for (std::size_t first = 0; first < sizes.size(); first += per_target) {
        const auto part = sizes.subspan(first, per_target);
        Size whole;
        for (const Size& s : part) {
            whole.width_px += s.width_px;
            whole.height_px = std::max(whole.height_px, s.height_px);
        }
        auto drawn = gl::RenderTarget::create({.width_px = whole.width_px, .height_px = whole.height_px, .format = settings.format, .samples = samples});
        if (!drawn) return std::unexpected(drawn.error());
        const gl::RenderTarget* read = &targets_.emplace_back(*std::move(drawn));
        if (samples > 1) {
            auto single = gl::RenderTarget::create({.width_px = whole.width_px, .height_px = whole.height_px, .format = settings.format, .depth_stencil = false});
            if (!single) return std::unexpected(single.error());
            read = &resolved_.emplace_back(*std::move(single));
        }
        if (per_target > 1) groups_.push_back({first, per_target, targets_.back().framebuffer(), whole});
        int x = 0;
        for (std::size_t i = 0; i < part.size(); ++i) {
            images_[first + i] = {targets_.back().framebuffer(), x, 0, part[i].width_px, part[i].height_px, read->framebuffer(), read->color_texture(), 0};
            x += part[i].width_px;
        }
    }
    return {};
}

Result<ViewImages::Layers> ViewImages::make_layers(Size size, std::size_t count, gl::ColorFormat format) {
    Layers l;
    static_cast<void>(gl::pending_error());
    const auto array = [&](GLenum internal) {
        GLuint name = 0;
        glGenTextures(1, &name);
        glBindTexture(GL_TEXTURE_2D_ARRAY, name);
        glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, internal, size.width_px, size.height_px, static_cast<GLsizei>(count));
        for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) glTexParameteri(GL_TEXTURE_2D_ARRAY, wrap, GL_CLAMP_TO_EDGE);
        for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) glTexParameteri(GL_TEXTURE_2D_ARRAY, filter, GL_LINEAR);
        return gl::Texture(name);
    };
    const auto framebuffer = [] {
        GLuint name = 0;
        glGenFramebuffers(1, &name);
        glBindFramebuffer(GL_FRAMEBUFFER, name);
        return gl::Framebuffer(name);
    };
    l.color = array(gl::internal_format(format));
    l.depth_stencil = array(GL_DEPTH24_STENCIL8);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    bool complete = true;
    for (GLint i = 0; i < static_cast<GLint>(count); ++i) {
        l.single.push_back(framebuffer());
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, l.color.name(), 0, i);
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, l.depth_stencil.name(), 0, i);
        complete = complete && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    }
    if (count > 1) {
        const auto views = static_cast<GLsizei>(count);
        l.all = framebuffer();
        glFramebufferTextureMultiviewOVR(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, l.color.name(), 0, 0, views);
        glFramebufferTextureMultiviewOVR(GL_DRAW_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, l.depth_stencil.name(), 0, 0, views);
        complete = complete && glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    const std::string error = gl::pending_error();
    if (!complete || !error.empty())
        return fail(std::to_string(count) + " layers of " + std::to_string(size.width_px) + "x" + std::to_string(size.height_px) + " pixels cannot be drawn to" + (error.empty() ? "" : " (" + error + ")"),
                    "GL_OVR_multiview2", "use a smaller size, or views = repeated");
    return l;
}

void ViewImages::draw(const gl::CommandList& draws, std::span<View> views, bool count, FrameCost& cost) const noexcept {
    FOVEA_REQUIRE(views.size() == images_.size());
    glDisable(GL_SCISSOR_TEST);
    const bool all = std::ranges::none_of(views, [](const View& v) { return v.only_in.empty(); });
    if (all && draws.draws_at_once(at_once_, count)) {
        for (const Group& g : groups_) {
            const auto part = views.subspan(g.first, g.count);
            for (std::size_t i = 0; i < g.count && !layered(); ++i) {
                const Image& image = images_[g.first + i];
                const float w = static_cast<float>(g.size.width_px), h = static_cast<float>(g.size.height_px);
                const float sx = static_cast<float>(image.width_px) / w, sy = static_cast<float>(image.height_px) / h;
                part[i].part = {sx, sy, 2 * static_cast<float>(image.x_px) / w + sx - 1, 2 * static_cast<float>(image.y_px) / h + sy - 1};
            }
            glBindFramebuffer(GL_FRAMEBUFFER, g.framebuffer);
            glViewport(0, 0, g.size.width_px, g.size.height_px);
            cost.draws += static_cast<std::uint32_t>(draws.submit_views({.views = part, .count_fragments = count}));
            ++cost.submissions;
        }
        cost.drawing = at_once_.drawing;
        return;
    }
    for (std::size_t i = 0; i < images_.size(); ++i) {
        const Image& image = images_[i];
        if (views[i].only_in.empty()) continue;
        glBindFramebuffer(GL_FRAMEBUFFER, image.framebuffer);
        glViewport(image.x_px, image.y_px, image.width_px, image.height_px);
        glEnable(GL_SCISSOR_TEST);
        glScissor(image.x_px, image.y_px, image.width_px, image.height_px);   // wide lines and a guard band reach over the edge
        cost.draws += static_cast<std::uint32_t>(
            draws.submit({.view = views[i].view, .crop = views[i].crop, .only_in = {&views[i].only_in, 1}, .count_fragments = count}));
        ++cost.submissions;
    }
    glDisable(GL_SCISSOR_TEST);
    cost.drawing = gl::ViewDrawing::repeated;
}

void ViewImages::resolve() const noexcept {
    if (resolved_.empty()) return;
    glDisable(GL_SCISSOR_TEST);
    for (std::size_t i = 0; i < resolved_.size(); ++i) {
        const int w = resolved_[i].width(), h = resolved_[i].height();
        glBindFramebuffer(GL_READ_FRAMEBUFFER, targets_[i].framebuffer());
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_[i].framebuffer());
        glBlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
}

}  // namespace fovea::foveation
