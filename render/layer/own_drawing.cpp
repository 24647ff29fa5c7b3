#include <algorithm>
#include <string>

#include "render/layer/targets.hpp"

namespace fovea::layer {
namespace {

constexpr const char* kVertexShader = R"(#version 300 es
precision highp float;
layout(location = 0) in vec4 rect;   // x0 y0 x1 y1, full-resolution pixels
uniform vec4 image;                  // width, height, grow x, grow y
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 p = mix(rect.xy - image.zw, rect.zw + image.zw, corner);
    gl_Position = vec4(p / image.xy * 2.0 - 1.0, 0.0, 1.0);
}
)";

// `level`: 1/2^shift along x and y, then 1/width and 1/height of the level's image; for 's', then the bit.
std::string fragment_shader(char kind) {
    const std::string head = "#version 300 es\nprecision highp float;\nprecision highp int;\nuniform vec4 level;\n";
    const std::string fetch = "texelFetch(source, ivec2(gl_FragCoord.xy * level.xy), 0)";
    switch (kind) {
        case 'm': return head + "void main() {}\n";
        case 'n':
            return head + "uniform highp sampler2D source;\nout vec4 color;\nvoid main() { color = " + fetch + "; }\n";
        case 'i':
            return head + "uniform highp isampler2D source;\nout ivec4 color;\nvoid main() { color = " + fetch + "; }\n";
        case 'u':
            return head + "uniform highp usampler2D source;\nout uvec4 color;\nvoid main() { color = " + fetch + "; }\n";
        case 's':
            return head + "uniform highp usampler2D source;\nvoid main() { if ((" + fetch + ".r & uint(level.z)) == 0u) discard; }\n";
        case 'd':
            return head + "uniform highp sampler2D source;\nvoid main() { gl_FragDepth = " + fetch + ".r; }\n";
        default:
            return head + "uniform highp sampler2D source;\nout vec4 color;\n"
                          "void main() { color = texture(source, gl_FragCoord.xy * level.xy * level.zw); }\n";
    }
}

GLuint compile(GLenum stage, const char* text) {
    const GLuint shader = gl.CreateShader(stage);
    gl.ShaderSource(shader, 1, &text, nullptr);
    gl.CompileShader(shader);
    return shader;
}

}  // namespace

OwnDrawing::~OwnDrawing() {
    for (const GLuint p : programs_)
        if (p) gl.DeleteProgram(p);
    if (array_) gl.DeleteVertexArrays(1, &array_);
    if (buffer_) gl.DeleteBuffers(1, &buffer_);
    if (copy_framebuffer_) gl.DeleteFramebuffers(1, &copy_framebuffer_);
}

void OwnDrawing::abandon(Graveyard& to) {
    for (const GLuint p : programs_) to.program(p);
    to.buffer(buffer_);
    array_ = buffer_ = copy_framebuffer_ = 0;
    programs_ = {};
}

bool OwnDrawing::ready() {
    if (array_ || failed_) return !failed_;
    GLint array = 0, buffer = 0;
    gl.GetIntegerv(GL_VERTEX_ARRAY_BINDING, &array);
    gl.GetIntegerv(GL_ARRAY_BUFFER_BINDING, &buffer);
    gl.GenVertexArrays(1, &array_);
    gl.GenBuffers(1, &buffer_);
    gl.BindVertexArray(array_);
    gl.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    gl.EnableVertexAttribArray(0);
    gl.VertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    gl.VertexAttribDivisor(0, 1);
    gl.BindVertexArray(static_cast<GLuint>(array));
    gl.BindBuffer(GL_ARRAY_BUFFER, static_cast<GLuint>(buffer));
    failed_ = program('m') == 0;
    return !failed_;
}

GLuint OwnDrawing::program(char kind) {
    GLuint& program = programs_[static_cast<std::size_t>(kind)];
    if (program) return program;
    const GLuint vertex = compile(GL_VERTEX_SHADER, kVertexShader);
    const GLuint fragment = compile(GL_FRAGMENT_SHADER, fragment_shader(kind).c_str());
    program = gl.CreateProgram();
    gl.AttachShader(program, vertex);
    gl.AttachShader(program, fragment);
    gl.LinkProgram(program);
    gl.DeleteShader(vertex);
    gl.DeleteShader(fragment);
    GLint linked = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        gl.DeleteProgram(program);
        program = 0;
    }
    return program;
}

void OwnDrawing::draw(GLuint program, const Rects& rects) {
    const density::Plan& plan = *rects.plan;
    const auto w = static_cast<float>(plan.settings().width_px), h = static_cast<float>(plan.settings().height_px);
    instances_.clear();
    for (const density::BinRect& r : plan.rectangles(rects.level)) {
        const density::PixelRect p = plan.pixels(r);
        instances_.push_back({static_cast<float>(p.x0), static_cast<float>(p.y0),
                              std::min(static_cast<float>(p.x1), w), std::min(static_cast<float>(p.y1), h)});
    }
    if (!instances_.empty()) draw_instances(program, rects);
}

void OwnDrawing::draw_instances(GLuint program, const Rects& rects) {
    gl.UseProgram(program);
    gl.Uniform4f(gl.GetUniformLocation(program, "image"), static_cast<float>(rects.width),
                 static_cast<float>(rects.height), rects.grow_x, rects.grow_y);
    gl.BindVertexArray(array_);
    gl.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances_.size() * sizeof instances_[0]), instances_.data(),
                  GL_STREAM_DRAW);
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(instances_.size()));
}

GLuint OwnDrawing::copy_framebuffer() {
    if (copy_framebuffer_ == 0) gl.GenFramebuffers(1, &copy_framebuffer_);
    return copy_framebuffer_;
}

void OwnDrawing::draw_copy(GLuint texture, char kind, int width, int height, GLuint stencil_bit) {
    const GLuint p = program(kind);
    if (!p) return;
    gl.UseProgram(p);
    gl.Uniform4f(gl.GetUniformLocation(p, "level"), 1, 1, kind == 's' ? static_cast<float>(stencil_bit) : 1.0f / static_cast<float>(width), 1.0f / static_cast<float>(height));
    gl.BindTexture(GL_TEXTURE_2D, texture);
    instances_.assign(1, {0, 0, static_cast<float>(width), static_cast<float>(height)});
    draw_instances(p, {.plan = nullptr, .level = 0, .width = width, .height = height, .grow_x = 0, .grow_y = 0});
}

void OwnDrawing::draw_mask(const Rects& rects) { draw(program('m'), rects); }

void OwnDrawing::draw_resolve(const Rects& rects, GLuint texture, char kind, int level_width, int level_height, GLuint stencil_bit) {
    const GLuint p = program(kind);
    if (!p) return;
    const auto& scale = rects.plan->settings().levels[static_cast<std::size_t>(rects.level)];
    gl.UseProgram(p);
    gl.Uniform4f(gl.GetUniformLocation(p, "level"), 1.0f / static_cast<float>(1 << scale.x_shift),
                 1.0f / static_cast<float>(1 << scale.y_shift), kind == 's' ? static_cast<float>(stencil_bit) : 1.0f / static_cast<float>(level_width),
                 1.0f / static_cast<float>(level_height));
    gl.BindTexture(GL_TEXTURE_2D, texture);
    draw(p, rects);
}

}  // namespace fovea::layer
