#include "render/effects/lens_pass.hpp"

#include <epoxy/gl.h>

#include <string>

namespace fovea::effects {
namespace {

constexpr std::string_view kVertex = R"(
layout(location = 0) uniform vec3 radial;
layout(location = 1) uniform vec4 middle;    // of the lens; tangential
layout(location = 2) uniform vec3 channels;  // magnification of red and blue; aspect
out highp vec2 red;
out highp vec2 green;
out highp vec2 blue;
void main() {
    int cell = gl_VertexID / 6, corner = gl_VertexID % 6;
    ivec2 at = ivec2(cell % MESH, cell / MESH) + ivec2(corner == 1 || corner == 2 || corner == 4, corner == 2 || corner == 4 || corner == 5);
    vec2 panel = vec2(at) / float(MESH) * 2.0 - 1.0, q = (panel - middle.xy) * vec2(channels.z, 1.0);
    float r2 = dot(q, q), k = 1.0 + r2 * (radial.x + r2 * (radial.y + r2 * radial.z));
    vec2 t = middle.z * vec2(2.0 * q.x * q.y, r2 + 2.0 * q.y * q.y) + middle.w * vec2(r2 + 2.0 * q.x * q.x, 2.0 * q.x * q.y);
    vec2 bent = (q * k + t) / vec2(channels.z, 1.0);
    red = (middle.xy + channels.x * bent) * 0.5 + 0.5;
    green = (middle.xy + bent) * 0.5 + 0.5;
    blue = (middle.xy + channels.y * bent) * 0.5 + 0.5;
    gl_Position = vec4(panel, 0.0, 1.0);
})";
constexpr std::string_view kFragment = R"(#version 310 es
precision highp float;
layout(binding = 0) uniform highp sampler2D picture;
in highp vec2 red;
in highp vec2 green;
in highp vec2 blue;
layout(location = 0) out vec4 color;
float inside(vec2 at) { return at == clamp(at, 0.0, 1.0) ? 1.0 : 0.0; }
void main() {
    vec4 g = texture(picture, green);
    color = vec4(texture(picture, red).r * inside(red), g.g * inside(green), texture(picture, blue).b * inside(blue), 1.0);
}
)";

}  // namespace

Result<LensPass> LensPass::create(const Lens& lens) {
    if (auto fine = check_lens(lens, "lens"); !fine) return std::unexpected(fine.error());
    LensPass p;
    p.lenses_ = {lens, mirrored(lens)};
    auto program = gl::build_program("lens", "#version 310 es\n#define MESH " + std::to_string(kLensMesh) + "\n" + std::string(kVertex), kFragment);
    if (!program) return std::unexpected(program.error());
    p.warp_ = *std::move(program);
    p.arrays_ = gl::create_vertex_array();
    return p;
}

Result<void> LensPass::prepare(int width_px, int height_px, std::size_t views) {
    if (results_.size() == views && views > 0 && results_[0].width() == width_px && results_[0].height() == height_px) return {};
    results_.clear();
    for (std::size_t i = 0; i < views; ++i) {
        auto t = gl::RenderTarget::create({.width_px = width_px, .height_px = height_px, .depth_stencil = false});
        if (!t) return std::unexpected(t.error());
        results_.push_back(*std::move(t));
    }
    aspect_ = static_cast<double>(width_px) / height_px;
    return {};
}

void LensPass::draw(std::size_t view, gl::Name picture) const noexcept {
    const Lens& l = lenses_[view % 2];
    const auto f = [](double v) { return static_cast<float>(v); };
    glBindFramebuffer(GL_FRAMEBUFFER, results_[view].framebuffer());
    glViewport(0, 0, results_[view].width(), results_[view].height());
    for (const GLenum what : {GL_DEPTH_TEST, GL_STENCIL_TEST, GL_SCISSOR_TEST, GL_CULL_FACE, GL_BLEND}) glDisable(what);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glUseProgram(warp_.name());
    glBindVertexArray(arrays_.name());
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, picture);
    glUniform3f(0, f(l.k1), f(l.k2), f(l.k3));
    glUniform4f(1, f(l.x), f(l.y), f(l.p1), f(l.p2));
    glUniform3f(2, f(l.red), f(l.blue), f(aspect_));
    glDrawArrays(GL_TRIANGLES, 0, kLensMesh * kLensMesh * 6);
}

}  // namespace fovea::effects
