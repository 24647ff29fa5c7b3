#include "render/extrapolation/gl_float_reader.hpp"

namespace fovea::render::extrapolation {

namespace {

constexpr const char* kVertex = R"(#version 300 es
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
})";
constexpr const char* kFragment = R"(#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D picture;
layout(location = 0) out highp uvec4 bits;
void main() {
    bits = floatBitsToUint(texelFetch(picture, ivec2(gl_FragCoord.xy), 0));
})";

}  // namespace

std::unique_ptr<GlFloatReader> GlFloatReader::create(const GlFunctions& gl) {
    std::unique_ptr<GlFloatReader> r(new GlFloatReader(gl));
    r->program_ = gl.CreateProgram();
    for (const GLenum stage : {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER}) {
        const GLuint shader = gl.CreateShader(stage);
        gl.ShaderSource(shader, 1, stage == GL_VERTEX_SHADER ? &kVertex : &kFragment, nullptr);
        gl.CompileShader(shader);
        gl.AttachShader(r->program_, shader);
        gl.DeleteShader(shader);
    }
    gl.LinkProgram(r->program_);
    GLint linked = GL_FALSE;
    gl.GetProgramiv(r->program_, GL_LINK_STATUS, &linked);
    if (linked == GL_FALSE) return nullptr;
    gl.GenVertexArrays(1, &r->array_);
    gl.GenFramebuffers(1, &r->framebuffer_);
    gl.GenSamplers(1, &r->sampler_);   // nearest: what is not filterable, or has no further levels, is complete with it
    gl.SamplerParameteri(r->sampler_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.SamplerParameteri(r->sampler_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return r;
}

GlFloatReader::~GlFloatReader() {
    gl_.DeleteProgram(program_);
    if (array_ != 0) gl_.DeleteVertexArrays(1, &array_);
    if (framebuffer_ != 0) gl_.DeleteFramebuffers(1, &framebuffer_);
    if (sampler_ != 0) gl_.DeleteSamplers(1, &sampler_);
}

bool GlFloatReader::read(GLuint texture, int width, int height, void* rgba) noexcept {
    GLuint target = 0;
    gl_.GenTextures(1, &target);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, target);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32UI, width, height);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
    const bool complete = gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    if (complete) {
        gl_.BindTexture(GL_TEXTURE_2D, texture);
        gl_.BindSampler(0, sampler_);
        gl_.BindVertexArray(array_);
        gl_.UseProgram(program_);
        gl_.Viewport(0, 0, width, height);
        gl_.DrawArrays(GL_TRIANGLES, 0, 3);
        gl_.ReadPixels(0, 0, width, height, GL_RGBA_INTEGER, GL_UNSIGNED_INT, rgba);
    }
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    gl_.DeleteTextures(1, &target);
    return gl_.GetError() == GL_NO_ERROR && complete;
}

}  // namespace fovea::render::extrapolation
