#include "render/extrapolation/gl_programs.hpp"

#include <cstdio>
#include <string>

#include "render/extrapolation/gl_shaders.hpp"
#include "render/extrapolation/gl_shaders_edges.hpp"
#include "render/extrapolation/gl_shaders_field.hpp"
#include "render/extrapolation/gl_shaders_regions.hpp"
#include "render/extrapolation/gl_shaders_standing.hpp"

namespace fovea::render::extrapolation {

namespace {

// `computed`: worth a compute shader. `words`: RESULT is a uvec4. `own_main`: draws to two images at once.
struct Row {
    const char* source;
    bool computed = false, words = false, own_main = false;
};
constexpr Row kTable[] = {{.source = shaders::kCompare, .words = true},
                          {.source = shaders::kStill},
                          {.source = shaders::kMoving},
                          {.source = shaders::kReached},
                          {.source = shaders::kBlocks},
                          {.source = shaders::kRuns},
                          {.source = shaders::kRectangles},
                          {.source = shaders::kRowCount, .words = true},
                          {.source = shaders::kPrefix, .words = true},
                          {.source = shaders::kList, .words = true},
                          {.source = shaders::kArgs, .words = true},
                          {.source = shaders::kKeyColumns},
                          {.source = shaders::kKey},
                          {.source = shaders::kLumaBytes, .own_main = true},
                          {.source = shaders::kLumaFloats, .own_main = true},
                          {.source = shaders::kTiles},
                          {.source = shaders::kHalve, .own_main = true},
                          {.source = shaders::kSearch, .computed = true, .words = true},
                          {.source = shaders::kBalanceFirst, .computed = true},
                          {.source = shaders::kBalance, .computed = true},
                          {.source = shaders::kRough},
                          {.source = shaders::kGlide, .own_main = true},
                          {.source = shaders::kSpread},
                          {.source = shaders::kSmooth},
                          {.source = shaders::kJudge},
                          {.source = shaders::kJudgeFinest},
                          {.source = shaders::kCount},
                          {.source = shaders::kVerdict},
                          {.source = shaders::kCarry},
                          {.source = shaders::kBackground},
                          {.source = shaders::kSpan},
                          {.source = shaders::kWiden},
                          {.source = shaders::kHem},
                          {.source = shaders::kSlope, .words = true},
                          {.source = shaders::kAlike, .own_main = true},
                          {.source = shaders::kDisplacement},
                          {.source = shaders::kFill},
                          {.source = shaders::kEdges},
                          {.source = shaders::kRims},
                          {.source = shaders::kAny},
                          {.source = shaders::kVote},
                          {.source = shaders::kKeep},
                          {.source = shaders::kNearEdges},
                          {.source = shaders::kSides},
                          {.source = shaders::kStand},
                          {.source = shaders::kCopy}};
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

struct Built {
    int cell_px;
    bool cubic;
};
// A name of 0 and a log where a stage does not compile or the program does not link.
GlProgram link(const GlFunctions& gl, const std::string& body, const Built& how, bool compute, const Row& row, std::string& log) {
    const std::string text = std::string(shaders::kHead) + "const int kCell = " + std::to_string(how.cell_px) + ";\nconst bool kCubic = " + (how.cubic ? "true" : "false") + ";\n" + (row.words ? "#define RESULT uvec4\n#define IMAGE uimage2D\n" : "#define RESULT vec4\n#define IMAGE image2D\n") + shaders::kPatch + body;
    GLuint stages[2] = {};
    bool compiled;
    if (compute) {
        char main_text[1024];
        std::snprintf(main_text, sizeof main_text, shaders::kComputeMain, row.words ? "rgba32ui" : "rgba16f");
        stages[0] = compile(gl, GL_COMPUTE_SHADER, text + main_text, log);
        compiled = stages[0] != 0;
    } else {
        stages[0] = compile(gl, GL_VERTEX_SHADER, shaders::kVertex, log);
        stages[1] = compile(gl, GL_FRAGMENT_SHADER, row.own_main ? text : text + shaders::kFragmentMain, log);
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
    p.place = gl.GetUniformLocation(p.name, "place");
    return p;
}

}  // namespace

bool GlPrograms::is_computed(Kernel k) noexcept { return kTable[static_cast<int>(k)].computed; }

Result<void> GlPrograms::build(bool compute, int cell_px, bool cubic) {
    compute_ = compute;
    const Built how{cell_px, cubic};
    std::string log;
    const auto failed = [&] { return fail("an extrapolation shader does not build: " + log, "GL", "use the processor's backend"); };
    for (int k = 0; k < kKernels; ++k) {
        const Row& row = kTable[k];
        kernels_[k] = link(gl_, row.source, how, compute && row.computed, row, log);
        if (kernels_[k].name == 0) return failed();
    }
    for (int i = 0; i < 6; ++i) {
        const bool floats = i % 2 == 1;
        const auto which = static_cast<Gathered>(i / 2);
        std::string body = std::string(shaders::kGatherHead) + (floats ? shaders::kGatherFloats : shaders::kGatherBytes);
        if (which == Gathered::judged) body += floats ? shaders::kJudgedFloats : shaders::kJudgedBytes;
        body += which == Gathered::calm ? shaders::kCalm : which == Gathered::torn ? shaders::kDisplaced : shaders::kJudged;
        gathers_[i] = link(gl_, body, how, false, {}, log);
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
