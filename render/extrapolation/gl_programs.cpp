#include "render/extrapolation/gl_programs.hpp"

#include <cstdio>
#include <string>

#include "render/extrapolation/gl_shaders.hpp"
#include "render/extrapolation/gl_shaders_field.hpp"

namespace fovea::render::extrapolation {

namespace {

// `computed`: worth a compute shader. `own_main`: draws to several images at once.
constexpr struct {
    const char* source;
    bool computed, own_main;
} kTable[] = {{shaders::kLuma, false, true},      {shaders::kTiles, false, false},  {shaders::kHalve, false, true},    {shaders::kSearch, true, false},
              {shaders::kBalance, true, false},   {shaders::kSpread, true, false},  {shaders::kSmooth, false, false},  {shaders::kJudge, true, false},
              {shaders::kCount, false, false},    {shaders::kVerdict, false, false}, {shaders::kCarry, false, false},  {shaders::kBackground, false, false},
              {shaders::kSpan, false, false},     {shaders::kWiden, false, false},  {shaders::kDisplacement, true, false}, {shaders::kFill, false, false}, {shaders::kCopy, false, false}};
static_assert(std::size(kTable) == kKernels);

GLuint compile(const GlFunctions& gl, GLenum kind, const std::string& text, std::string& log) {
    const GLuint shader = gl.CreateShader(kind);
    const char* source = text.c_str();
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    GLint ok = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok != 0) return shader;
    char buffer[1024] = {};
    gl.GetShaderInfoLog(shader, sizeof buffer, nullptr, buffer);
    log = buffer;
    gl.DeleteShader(shader);
    return 0;
}

// A name of 0 and a log where a stage does not compile or the program does not link. `image_format`: a compute shader's.
GlProgram link(const GlFunctions& gl, const std::string& body, const char* image_format, bool own_main, std::string& log) {
    const bool words = body == shaders::kSearch;   // its result is a packed patch
    const std::string text = std::string(shaders::kHead) + (words ? "#define RESULT uvec4\n#define IMAGE uimage2D\n" : "#define RESULT vec4\n#define IMAGE image2D\n") + shaders::kPatch + body;
    GLuint stages[2] = {};
    bool compiled;
    if (image_format != nullptr) {
        char main_text[512];
        std::snprintf(main_text, sizeof main_text, shaders::kComputeMain, image_format);
        stages[0] = compile(gl, GL_COMPUTE_SHADER, text + main_text, log);
        compiled = stages[0] != 0;
    } else {
        stages[0] = compile(gl, GL_VERTEX_SHADER, shaders::kVertex, log);
        stages[1] = compile(gl, GL_FRAGMENT_SHADER, own_main ? text : text + shaders::kFragmentMain, log);
        compiled = stages[0] != 0 && stages[1] != 0;
    }
    GlProgram p;
    if (compiled) p.name = gl.CreateProgram();
    for (const GLuint s : stages) {
        if (s == 0) continue;
        if (compiled) gl.AttachShader(p.name, s);
        gl.DeleteShader(s);
    }
    if (!compiled) return p;
    gl.LinkProgram(p.name);
    GLint ok = 0;
    gl.GetProgramiv(p.name, GL_LINK_STATUS, &ok);
    if (ok == 0) {
        char buffer[1024] = {};
        gl.GetProgramInfoLog(p.name, sizeof buffer, nullptr, buffer);
        log = buffer;
        gl.DeleteProgram(p.name);
        return {};
    }
    p.size = gl.GetUniformLocation(p.name, "size");
    p.cell = gl.GetUniformLocation(p.name, "cell");
    p.rounds = gl.GetUniformLocation(p.name, "rounds");
    p.step_px = gl.GetUniformLocation(p.name, "step_px");
    p.reach = gl.GetUniformLocation(p.name, "reach");
    return p;
}

}  // namespace

bool GlPrograms::is_computed(Kernel k) noexcept { return kTable[static_cast<int>(k)].computed; }

Result<void> GlPrograms::build(bool compute) {
    compute_ = compute;
    std::string log;
    const auto failed = [&] { return fail("an extrapolation shader does not build: " + log, "GL", "use the processor's backend"); };
    for (int k = 0; k < kKernels; ++k) {
        const bool words = kTable[k].source == shaders::kSearch;
        kernels_[k] = link(gl_, kTable[k].source, compute && kTable[k].computed ? (words ? "rgba32ui" : "rgba16f") : nullptr, kTable[k].own_main, log);
        if (kernels_[k].name == 0) return failed();
    }
    const std::string bytes = std::string(shaders::kGatherHead) + shaders::kGatherBytes, floats = std::string(shaders::kGatherHead) + shaders::kGatherFloats;
    for (int i = 0; i < 2; ++i) {
        gathers_[i] = link(gl_, i == 0 ? bytes : floats, nullptr, false, log);
        if (gathers_[i].name == 0) return failed();
    }
    return {};
}

GlPrograms::~GlPrograms() {
    const auto drop = [&](const GlProgram& p) {
        if (p.name != 0) gl_.DeleteProgram(p.name);
    };
    for (const GlProgram& p : kernels_) drop(p);
    for (const GlProgram& p : gathers_) drop(p);
}

}  // namespace fovea::render::extrapolation
