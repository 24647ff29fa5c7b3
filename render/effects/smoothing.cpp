#include "render/effects/smoothing.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace fovea::effects {
namespace {

using Mat3 = std::array<double, 9>;   // row by row

Mat3 multiply(const Mat3& a, const Mat3& b) noexcept {
    Mat3 r{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 3; ++k) r[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    return r;
}

// View from world, as in scene::view_from_world().
Mat3 rotation(const scene::Pose& p) noexcept {
    const scene::Mat4 m = scene::view_from_world(p, 0);
    return {m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]};
}

constexpr std::string_view kVertex = R"(#version 310 es
out highp vec2 at;
void main() {
    at = vec2((gl_VertexID & 1) != 0 ? 1.0 : -1.0, (gl_VertexID & 2) != 0 ? 1.0 : -1.0);
    gl_Position = vec4(at, 0.0, 1.0);
})";
constexpr std::string_view kFragment = R"(
precision highp float;
precision highp int;
layout(binding = 0) uniform highp sampler2D now;
layout(binding = 1) uniform highp sampler2D before;
layout(location = 0) uniform mat3 before_from_now;
layout(location = 1) uniform float share;
#ifdef BY_LEVELS
layout(binding = 2) uniform highp usampler2D levels;
layout(location = 2) uniform int bin_px;
int level_of(ivec2 p) { return int(texelFetch(levels, min(p / bin_px, textureSize(levels, 0) - 1), 0).r); }
#else
layout(location = 3) uniform vec4 region;   // middle, half sizes: NDC
layout(location = 4) uniform int outside;   // level
int level_of(ivec2 p) {
    vec2 d = ((vec2(p) + 0.5) / vec2(textureSize(now, 0)) * 2.0 - 1.0 - region.xy) / region.zw;
    return dot(d, d) < 1.0 ? 0 : outside;
}
#endif
in highp vec2 at;
layout(location = 0) out vec4 color;
void main() {
    ivec2 p = ivec2(gl_FragCoord.xy), most = textureSize(now, 0) - 1;
    color = texelFetch(now, p, 0);
    int level = level_of(p);
    vec3 b = before_from_now * vec3(at, 1.0);
    if (level == 0 || share == 0.0 || b.z <= 0.0 || any(greaterThan(abs(b.xy), vec2(b.z)))) return;
    int d = 1 << level;
    vec4 left = texelFetch(now, ivec2(max(p.x - d, 0), p.y), 0), right = texelFetch(now, ivec2(min(p.x + d, most.x), p.y), 0);
    vec4 down = texelFetch(now, ivec2(p.x, max(p.y - d, 0)), 0), up = texelFetch(now, ivec2(p.x, min(p.y + d, most.y)), 0);
    vec4 least = min(color, min(min(left, right), min(down, up))), largest = max(color, max(max(left, right), max(down, up)));
    color = mix(color, clamp(texture(before, b.xy / b.z * 0.5 + 0.5), least, largest), share);
}
)";

}  // namespace

std::array<double, 9> before_from_now(const FieldOfView& f, const scene::Pose& before, const scene::Pose& now) noexcept {
    const double w = f.tan_right - f.tan_left, h = f.tan_up - f.tan_down;
    // A direction (x right, y up, z backward) of an NDC point, and back.
    const Mat3 direction{w / 2, 0, (f.tan_left + f.tan_right) / 2, 0, h / 2, (f.tan_down + f.tan_up) / 2, 0, 0, -1};
    const Mat3 ndc{2 / w, 0, (f.tan_left + f.tan_right) / w, 0, 2 / h, (f.tan_down + f.tan_up) / h, 0, 0, -1};
    const Mat3 n = rotation(now);
    const Mat3 world{n[0], n[3], n[6], n[1], n[4], n[7], n[2], n[5], n[8]};
    return multiply(ndc, multiply(multiply(rotation(before), world), direction));
}

Result<Smoothing> Smoothing::create() {
    Smoothing s;
    for (const bool levels : {false, true}) {
        auto p = gl::build_program("smoothing", kVertex, std::string(levels ? "#version 310 es\n#define BY_LEVELS\n" : "#version 310 es\n") + std::string(kFragment));
        if (!p) return std::unexpected(p.error());
        (levels ? s.by_levels_ : s.by_region_) = *std::move(p);
    }
    s.arrays_ = gl::create_vertex_array();
    return s;
}

Result<void> Smoothing::prepare(int width_px, int height_px, std::size_t views) {
    if (views_.size() == views && views > 0 && views_[0].results[0].width() == width_px && views_[0].results[0].height() == height_px) return {};
    views_.clear();
    std::vector<View> made(views);
    for (View& v : made)
        for (gl::RenderTarget& result : v.results) {
            auto t = gl::RenderTarget::create({.width_px = width_px, .height_px = height_px, .depth_stencil = false});
            if (!t) return std::unexpected(t.error());
            result = *std::move(t);
        }
    views_ = std::move(made);
    return {};
}

void Smoothing::forget() noexcept {
    for (View& v : views_) v.has_history = false;
}

bool Smoothing::draw(std::size_t index, gl::Name picture, const density::Plan* plan, const foveation::Method::Region& region, const FieldOfView& fov,
                     const scene::Pose& pose) noexcept {
    View& v = views_[index];
    const auto corner = [&](double x, double y) { return std::hypot((x - region.x_ndc) / region.half_width_ndc, (y - region.y_ndc) / region.half_height_ndc); };
    const bool all = plan == nullptr ? std::max({corner(-1, -1), corner(1, -1), corner(-1, 1), corner(1, 1)}) < 1 : ![&] {
        for (int level = 1; level < plan->settings().level_count; ++level)
            if (plan->uses(level)) return true;
        return false;
    }();
    if (all) {
        v.has_history = false;
        return false;
    }
    glActiveTexture(GL_TEXTURE2);
    if (plan != nullptr) {
        if (v.columns != plan->columns() || v.rows != plan->rows()) {
            v.columns = plan->columns();
            v.rows = plan->rows();
            GLuint name = 0;
            glGenTextures(1, &name);
            v.levels = gl::Texture(name);
            glBindTexture(GL_TEXTURE_2D, name);
            glTexStorage2D(GL_TEXTURE_2D, 1, GL_R8UI, v.columns, v.rows);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
            level_bytes_.resize(static_cast<std::size_t>(v.columns) * static_cast<std::size_t>(v.rows));
        }
        auto out = level_bytes_.begin();
        for (int r = 0; r < v.rows; ++r)
            for (int c = 0; c < v.columns; ++c) *out++ = static_cast<std::uint8_t>(plan->level_at(c, r));
        glBindTexture(GL_TEXTURE_2D, v.levels.name());
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, v.columns, v.rows, GL_RED_INTEGER, GL_UNSIGNED_BYTE, level_bytes_.data());
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    }
    const gl::RenderTarget &before = v.results[v.newest], &result = v.results[1 - v.newest];
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, before.color_texture());
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, picture);
    glBindFramebuffer(GL_FRAMEBUFFER, result.framebuffer());
    glViewport(0, 0, result.width(), result.height());
    for (const GLenum what : {GL_DEPTH_TEST, GL_STENCIL_TEST, GL_SCISSOR_TEST, GL_CULL_FACE, GL_BLEND}) glDisable(what);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glBindVertexArray(arrays_.name());
    glUseProgram((plan != nullptr ? by_levels_ : by_region_).name());
    const Mat3 m = before_from_now(fov, v.pose, pose);
    std::array<float, 9> columns{};
    for (std::size_t i = 0; i < 9; ++i) columns[i] = static_cast<float>(m[(i % 3) * 3 + i / 3]);
    glUniformMatrix3fv(0, 1, GL_FALSE, columns.data());
    glUniform1f(1, v.has_history ? kHistoryShare : 0.0f);
    if (plan != nullptr) {
        glUniform1i(2, plan->bin_px());
    } else {
        glUniform4f(3, static_cast<float>(region.x_ndc), static_cast<float>(region.y_ndc), static_cast<float>(region.half_width_ndc), static_cast<float>(region.half_height_ndc));
        glUniform1i(4, 1);
    }
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    v.newest = 1 - v.newest;
    v.has_history = true;
    v.pose = pose;
    return true;
}

}  // namespace fovea::effects
