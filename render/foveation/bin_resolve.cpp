#include "render/foveation/bin_resolve.hpp"

#include <string_view>

namespace fovea::foveation {
namespace {

constexpr std::string_view kCubic = R"(
vec4 spline(float t) {
    return vec4(((-0.5 * t + 1.0) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0, ((-1.5 * t + 2.0) * t + 0.5) * t, (0.5 * t - 0.5) * t * t);
}
vec4 cubic(highp sampler2D s, vec2 at) {
    ivec2 last = textureSize(s, 0) - 1;
    vec2 p = at * vec2(last + 1) - 0.5, i = floor(p);
    vec4 wx = spline(p.x - i.x), wy = spline(p.y - i.y);
    ivec4 x = clamp(ivec4(i.x) + ivec4(-1, 0, 1, 2), 0, last.x), y = clamp(ivec4(i.y) + ivec4(-1, 0, 1, 2), 0, last.y);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 4; ++j)
        sum += wy[j] * (wx.x * texelFetch(s, ivec2(x.x, y[j]), 0) + wx.y * texelFetch(s, ivec2(x.y, y[j]), 0) +
                        wx.z * texelFetch(s, ivec2(x.z, y[j]), 0) + wx.w * texelFetch(s, ivec2(x.w, y[j]), 0));
    return sum;
}
)";

const char* prefix(gl::ColorKind kind) noexcept { return kind == gl::ColorKind::whole ? "i" : kind == gl::ColorKind::natural ? "u" : ""; }
bool integer(gl::ColorKind kind) noexcept { return kind == gl::ColorKind::whole || kind == gl::ColorKind::natural; }

std::string resolve_fragment(const gl::FramebufferShape& shape, gl::Filter filter, bool color, bool depth) {
    std::string head = "#version 310 es\nprecision highp float;\nprecision highp int;\nin highp vec2 uv;\n", body;
    if (filter == gl::Filter::cubic) head += kCubic;
    for (int i = 0; color && i < shape.colors; ++i) {
        const gl::ColorKind kind = shape.color[static_cast<std::size_t>(i)].kind;
        if (kind == gl::ColorKind::none) continue;
        const std::string n = std::to_string(i);
        head += "layout(binding = " + n + ") uniform highp " + prefix(kind) + "sampler2D level" + n + ";\n";
        head += "layout(location = " + n + ") out highp " + prefix(kind) + "vec4 color" + n + ";\n";
        if (integer(kind)) body += "color" + n + " = texelFetch(level" + n + ", ivec2(uv * vec2(textureSize(level" + n + ", 0))), 0);\n";
        else if (filter == gl::Filter::cubic) body += "color" + n + " = cubic(level" + n + ", uv);\n";
        else body += "color" + n + " = texture(level" + n + ", uv);\n";
    }
    if (depth) {
        head += "layout(binding = 8) uniform highp sampler2D depths;\n";
        body += "gl_FragDepth = texelFetch(depths, ivec2(uv * vec2(textureSize(depths, 0))), 0).r;\n";
    }
    return head + "void main() {\n" + body + "}\n";
}

}  // namespace

const char* const kRectVertex = R"(#version 310 es
layout(location = 0) in vec4 rect;   // x0 y0 x1 y1, NDC
layout(location = 1) uniform float depth;
out highp vec2 uv;
void main() {
    vec2 p = vec2((gl_VertexID & 1) == 0 ? rect.x : rect.z, (gl_VertexID & 2) == 0 ? rect.y : rect.w);
    uv = p * 0.5 + 0.5;
    gl_Position = vec4(p, depth * 2.0 - 1.0, 1.0);
})";

Result<gl::Name> BinResolve::program(const gl::FramebufferShape& shape, gl::Filter filter, bool color, bool depth) {
    std::string source = resolve_fragment(shape, filter, color, depth);
    for (const Entry& e : programs_)
        if (e.source == source) return e.program.name();
    auto program = gl::build_program("level resolve", kRectVertex, source);
    if (!program) return std::unexpected(program.error());
    programs_.push_back({std::move(source), *std::move(program)});
    return programs_.back().program.name();
}

std::string clearing_fragment(const gl::FramebufferShape& shape) {
    std::string head = "#version 310 es\nprecision highp float;\nprecision highp int;\nlayout(location = 0) uniform vec4 clear_color;\n", body;
    for (int i = 0; i < shape.colors; ++i) {
        const gl::ColorKind kind = shape.color[static_cast<std::size_t>(i)].kind;
        if (kind == gl::ColorKind::none) continue;
        const std::string n = std::to_string(i), type = std::string(prefix(kind)) + "vec4";
        head += "layout(location = " + n + ") out highp " + type + " color" + n + ";\n";
        body += "color" + n + " = " + (integer(kind) ? type + "(0)" : "clear_color") + ";\n";
    }
    return head + "void main() {\n" + body + "}\n";
}

}  // namespace fovea::foveation
