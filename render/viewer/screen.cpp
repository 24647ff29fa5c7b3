#include "render/viewer/screen.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

#include "render/viewer/text.hpp"

namespace fovea::viewer {
namespace {

// A rectangle of the window in NDC: centre and half size.
constexpr const char* kVertex = R"(#version 310 es
layout(location = 0) uniform vec4 rect;
out vec2 at;   // [-1, 1] over the rectangle
void main() {
    at = vec2((gl_VertexID & 1) != 0 ? 1.0 : -1.0, (gl_VertexID & 2) != 0 ? 1.0 : -1.0);
    gl_Position = vec4(rect.xy + at * rect.zw, 0.0, 1.0);
}
)";
// Texel for pixel: the places have the size of the pictures.
constexpr const char* kPicture = R"(#version 310 es
precision highp float;
layout(location = 1) uniform ivec2 origin;
layout(binding = 0) uniform highp sampler2D picture;
in vec2 at;
out vec4 color;
void main() { color = texelFetch(picture, ivec2(gl_FragCoord.xy) - origin, 0); }
)";
constexpr const char* kTint = R"(#version 310 es
precision highp float;
precision highp usampler2D;
layout(location = 1) uniform ivec2 origin;
layout(location = 2) uniform int bin_px;
layout(binding = 0) uniform usampler2D levels;
out vec4 color;
uint level(ivec2 p) { return texelFetch(levels, clamp(p / bin_px, ivec2(0), textureSize(levels, 0) - 1), 0).r; }
void main() {
    ivec2 p = ivec2(gl_FragCoord.xy) - origin;
    uint l = level(p);
    bool edge = level(p - ivec2(1, 0)) != l || level(p - ivec2(0, 1)) != l;
    vec3 c = l == 0u ? vec3(0.27, 0.47, 1.0) : l == 1u ? vec3(0.24, 0.82, 0.35) : l == 2u ? vec3(0.92, 0.27, 0.24) : vec3(1.0, 0.67, 0.16);
    color = vec4(c, edge ? 0.9 : l == 0u ? 0.08 : 0.25);
}
)";
// Signed by `kind`: a dot, or a ring in dashes with a cross of `arm` in its middle.
constexpr const char* kMarker = R"(#version 310 es
precision highp float;
layout(location = 1) uniform vec2 half_px;
layout(location = 2) uniform int kind;
layout(location = 3) uniform float line_px;
in vec2 at;
out vec4 color;
void main() {
    float r = length(at);
    vec2 px = abs(at) * half_px;
    float from_ring = abs(r - 1.0 + line_px / min(half_px.x, half_px.y)) * min(half_px.x, half_px.y);
    bool dash = fract(atan(at.y, at.x) * 3.8197186) < 0.5;   // 24 of them
    bool cross = (px.x < line_px && px.y < 10.0 * line_px) || (px.y < line_px && px.x < 10.0 * line_px);
    bool halo = (px.x < 2.0 * line_px && px.y < 11.0 * line_px) || (px.y < 2.0 * line_px && px.x < 11.0 * line_px);
    if (kind == 0) color = r > 1.0 ? vec4(0.0) : r > 0.7 ? vec4(0.0, 0.0, 0.0, 0.8) : vec4(1.0, 0.85, 0.1, 1.0);
    else color = cross ? vec4(1.0) : dash && from_ring < line_px ? vec4(1.0) : halo ? vec4(0.0, 0.0, 0.0, 0.5) : vec4(0.0);
}
)";
constexpr double kTextLinePx = 16;   // of an unscaled desktop

void draw_rect(double x, double y, double w, double h, int surface_w, int surface_h) noexcept {
    glUniform4f(0, static_cast<float>((2 * x + w) / surface_w - 1), static_cast<float>((2 * y + h) / surface_h - 1), static_cast<float>(w / surface_w),
                static_cast<float>(h / surface_h));
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

gl::Texture texture(GLenum format, int width, int height) noexcept {
    GLuint name = 0;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return gl::Texture(name);
}

}  // namespace

Result<Screen> Screen::create() {
    Screen s;
    struct {
        gl::Program& program;
        const char* name;
        const char* fragment;
    } const wanted[] = {{s.picture_, "window picture", kPicture}, {s.tint_, "window levels", kTint}, {s.marker_, "window marker", kMarker}};
    for (const auto& w : wanted) {
        auto p = gl::build_program(w.name, kVertex, w.fragment);
        if (!p) return std::unexpected(p.error());
        w.program = *std::move(p);
    }
    s.nothing_ = gl::create_vertex_array();
    return s;
}

void Screen::set_text(const std::vector<std::string>& lines, double scale) {
    if (lines == lines_ && scale == text_scale_) return;
    lines_ = lines;
    text_scale_ = scale;
    if (lines.empty()) return;
    const TextPicture picture = draw_text(lines, static_cast<int>(std::lround(kTextLinePx * scale)));
    glActiveTexture(GL_TEXTURE0);
    if (!text_texture_ || picture.width_px != text_width_ || picture.height_px != text_height_) {
        text_texture_ = texture(GL_RGBA8, picture.width_px, picture.height_px);
        text_width_ = picture.width_px;
        text_height_ = picture.height_px;
    }
    glBindTexture(GL_TEXTURE_2D, text_texture_.name());
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, picture.width_px, picture.height_px, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
}

void Screen::draw(const present::Surface& surface, const std::array<Place, kEyes>& places, const std::array<gl::Name, kEyes>& pictures,
                  const Overlay& overlay) noexcept {
    width_px_ = surface.width_px;
    height_px_ = surface.height_px;
    glBindFramebuffer(GL_FRAMEBUFFER, surface.framebuffer);
    glViewport(0, 0, width_px_, height_px_);
    for (const GLenum what : {GL_DEPTH_TEST, GL_STENCIL_TEST, GL_SCISSOR_TEST, GL_CULL_FACE, GL_BLEND}) glDisable(what);
    glBindVertexArray(nothing_.name());
    glActiveTexture(GL_TEXTURE0);
    const bool covered = 2 * places[0].width_px >= width_px_ && places[0].height_px >= height_px_;
    if (!covered) {
        glClearColor(0.05f, 0.05f, 0.06f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    glUseProgram(picture_.name());
    for (std::size_t i = 0; i < kEyes; ++i) {
        const Place& p = places[i];
        glUniform2i(1, p.x_px, p.y_px);
        glBindTexture(GL_TEXTURE_2D, pictures[i]);
        draw_rect(p.x_px, p.y_px, p.width_px, p.height_px, width_px_, height_px_);
    }
    const bool text = !lines_.empty();
    if (overlay.levels[0] != nullptr || overlay.predicted != nullptr || overlay.actual != nullptr || text) {
        glEnable(GL_BLEND);
        glBlendEquation(GL_FUNC_ADD);
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE);
        for (std::size_t i = 0; i < kEyes; ++i)
            if (overlay.levels[i] != nullptr) draw_levels(places[i], *overlay.levels[i]);
        if (text) {
            const int margin = static_cast<int>(std::lround(kTextLinePx * text_scale_ / 2));
            glUseProgram(picture_.name());
            glUniform2i(1, margin, margin);
            glBindTexture(GL_TEXTURE_2D, text_texture_.name());
            draw_rect(margin, margin, text_width_, text_height_, width_px_, height_px_);
        }
        for (std::size_t i = 0; i < kEyes; ++i) {
            const effects::Lens* lens = overlay.lens != nullptr ? &overlay.lens->lens(i) : nullptr;
            if (overlay.predicted != nullptr) draw_markers(places[i], overlay.predicted->focals[i], true, lens);
            if (overlay.actual != nullptr) draw_markers(places[i], overlay.actual->focals[i], false, lens);
        }
        glDisable(GL_BLEND);
    }
    glBindVertexArray(0);
}

void Screen::draw_levels(const Place& place, const density::Plan& plan) noexcept {
    const std::array size{plan.columns(), plan.rows()};
    if (size != levels_size_) {
        levels_ = texture(GL_R8UI, size[0], size[1]);
        levels_size_ = size;
        level_bytes_.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]));
    }
    auto out = level_bytes_.begin();
    for (int r = 0; r < size[1]; ++r)
        for (int c = 0; c < size[0]; ++c) *out++ = static_cast<std::uint8_t>(plan.level_at(c, r));
    glBindTexture(GL_TEXTURE_2D, levels_.name());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size[0], size[1], GL_RED_INTEGER, GL_UNSIGNED_BYTE, level_bytes_.data());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glUseProgram(tint_.name());
    glUniform2i(1, place.x_px, place.y_px);
    glUniform1i(2, plan.bin_px());
    draw_rect(place.x_px, place.y_px, place.width_px, place.height_px, width_px_, height_px_);
}

void Screen::draw_markers(const Place& place, const fovea_focal& f, bool predicted, const effects::Lens* lens) noexcept {
    NdcPoint at{f.x_ndc, f.y_ndc};
    if (lens != nullptr) {
        const auto panel = effects::panel_of(*lens, at, static_cast<double>(place.width_px) / place.height_px);
        if (!panel) return;   // the lens does not show it
        at = *panel;
    }
    const double line = std::max(1.0, place.width_px / 600.0);
    const double cx = place.x_px + (at.x + 1.0) / 2 * place.width_px, cy = place.y_px + (at.y + 1.0) / 2 * place.height_px;
    double rx = 3.5 * line, ry = rx;
    if (predicted) {
        rx = std::clamp(static_cast<double>(f.radius95_rad * f.ndc_per_rad_x) / 2 * place.width_px, 14 * line, 2.0 * place.width_px);
        ry = std::clamp(static_cast<double>(f.radius95_rad * f.ndc_per_rad_y) / 2 * place.height_px, 14 * line, 2.0 * place.height_px);
    }
    glEnable(GL_SCISSOR_TEST);   // the other eye is not to be drawn into
    glScissor(place.x_px, place.y_px, place.width_px, place.height_px);
    glUseProgram(marker_.name());
    glUniform2f(1, static_cast<float>(rx), static_cast<float>(ry));
    glUniform1i(2, predicted ? 1 : 0);
    glUniform1f(3, static_cast<float>(line));
    draw_rect(cx - rx, cy - ry, 2 * rx, 2 * ry, width_px_, height_px_);
    glDisable(GL_SCISSOR_TEST);
}

}  // namespace fovea::viewer
