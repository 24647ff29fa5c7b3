#include "render/extrapolation/gl_passes.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>

#include "render/extrapolation/gl_shaders.hpp"
#include "render/extrapolation/motion.hpp"

namespace fovea::render::extrapolation {

namespace {

enum Kernel { kTiles, kLuma, kHalve, kSearch, kRelax, kSpread, kCheck, kSmooth, kJudge, kVerdict, kCarry, kBackground, kDisplacement };
// `computed`: worth a compute shader; the others are one read and one write.
constexpr struct {
    const char* source;
    bool computed;
} kKernels[] = {{shaders::kTiles, false}, {shaders::kLuma, false}, {shaders::kHalve, false}, {shaders::kSearch, true}, {shaders::kRelax, true},
                {shaders::kSpread, true}, {shaders::kCheck, false}, {shaders::kSmooth, false}, {shaders::kJudge, true}, {shaders::kVerdict, false},
                {shaders::kCarry, false}, {shaders::kBackground, false}, {shaders::kDisplacement, true}};
constexpr int kRelaxRounds = 4;

// The image formats that a compute shader may store and that table 8.28 has.
struct Storable {
    Format format;
    GLenum internal;
    const char* qualifier;
};
constexpr Storable kStorable[] = {{Format::rgba8, GL_RGBA8, "rgba8"}, {Format::rgba16f, GL_RGBA16F, "rgba16f"}, {Format::rgba32f, GL_RGBA32F, "rgba32f"}};

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

// 0 and a log where a stage does not compile or the program does not link.
GLuint link(const GlFunctions& gl, const std::string& body, const char* image_format, std::string& log) {
    std::string text = shaders::kHead + body;
    GLuint stages[2] = {};
    if (image_format != nullptr) {
        char main_text[512];
        std::snprintf(main_text, sizeof main_text, shaders::kComputeMain, image_format);
        stages[0] = compile(gl, GL_COMPUTE_SHADER, text + main_text, log);
        if (stages[0] == 0) return 0;
    } else {
        stages[0] = compile(gl, GL_VERTEX_SHADER, shaders::kVertex, log);
        stages[1] = compile(gl, GL_FRAGMENT_SHADER, text + shaders::kFragmentMain, log);
        if (stages[0] == 0 || stages[1] == 0) return 0;
    }
    const GLuint program = gl.CreateProgram();
    for (const GLuint s : stages)
        if (s != 0) {
            gl.AttachShader(program, s);
            gl.DeleteShader(s);
        }
    gl.LinkProgram(program);
    GLint ok = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (ok != 0) return program;
    char buffer[1024] = {};
    gl.GetProgramInfoLog(program, sizeof buffer, nullptr, buffer);
    log = buffer;
    gl.DeleteProgram(program);
    return 0;
}

}  // namespace

GlPasses::GlPasses(const GlFunctions& gl, Preset preset, bool compute) noexcept : gl_(gl), preset_(preset), tuning_(tuning_of(preset)), compute_(compute) {}

Result<std::unique_ptr<GlPasses>> GlPasses::create(const GlFunctions& gl, Preset preset, bool compute) {
    std::unique_ptr<GlPasses> p(new GlPasses(gl, preset, compute));
    if (auto built = p->build(); !built) return std::unexpected(built.error());
    return p;
}

Result<void> GlPasses::build() {
    std::string log;
    static_assert(std::size(kKernels) == kKernelCount);
    for (int k = 0; k < kKernelCount; ++k) {
        const char* source = kKernels[k].source;
        const bool computed = compute_ && kKernels[k].computed;
        fragment_[k] = link(gl_, source, nullptr, log);
        if (computed) compute_programs_[k] = link(gl_, source, "rgba16f", log);
        if (fragment_[k] == 0 || (computed && compute_programs_[k] == 0)) return fail("an extrapolation shader does not build: " + log, "GL", "use the processor's backend");
    }
    fragment_gather_ = link(gl_, shaders::kGather, nullptr, log);
    copy_ = link(gl_, shaders::kCopy, nullptr, log);
    if (fragment_gather_ == 0 || copy_ == 0) return fail("an extrapolation shader does not build: " + log, "GL", "use the processor's backend");
    for (int i = 0; compute_ && i < 3; ++i) {
        gather_compute_[i] = link(gl_, shaders::kGather, kStorable[i].qualifier, log);
        if (gather_compute_[i] == 0) return fail("an extrapolation shader does not build: " + log, "GL", "use the processor's backend");
    }
    gl_.GenVertexArrays(1, &array_);
    gl_.GenFramebuffers(1, &framebuffer_);
    GLuint samplers[2];
    gl_.GenSamplers(2, samplers);
    linear_ = samplers[0];
    nearest_ = samplers[1];
    for (const GLuint s : samplers) {
        const GLint filter = s == linear_ ? GL_LINEAR : GL_NEAREST;
        gl_.SamplerParameteri(s, GL_TEXTURE_MIN_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_MAG_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    cell_px_ = tuning_.cell_px;
    // Every image in between is RGBA16F; can it be drawn to?
    GLint before = 0, bound = 0;
    gl_.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &before);
    gl_.GetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
    const auto drawable = [&](GLenum format) {
        GLuint texture = 0;
        gl_.GenTextures(1, &texture);
        gl_.BindTexture(GL_TEXTURE_2D, texture);
        gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, 4, 4);
        gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
        gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
        const bool complete = gl_.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
        gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
        gl_.DeleteTextures(1, &texture);
        return complete;
    };
    const bool half = drawable(GL_RGBA16F);
    float_outputs_ = half && drawable(GL_RGBA32F);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(before));
    gl_.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    if (!half) return fail("the driver cannot draw to RGBA16F", "GL", "use the processor's backend");
    return {};
}

GlPasses::~GlPasses() {
    release_images();
    for (const GLuint p : fragment_)
        if (p != 0) gl_.DeleteProgram(p);
    for (const GLuint p : compute_programs_)
        if (p != 0) gl_.DeleteProgram(p);
    for (const GLuint p : gather_compute_)
        if (p != 0) gl_.DeleteProgram(p);
    if (fragment_gather_ != 0) gl_.DeleteProgram(fragment_gather_);
    if (copy_ != 0) gl_.DeleteProgram(copy_);
    const GLuint samplers[] = {linear_, nearest_};
    gl_.DeleteSamplers(2, samplers);
    gl_.DeleteVertexArrays(1, &array_);
    gl_.DeleteFramebuffers(1, &framebuffer_);
}

bool GlPasses::writes(Format format) const noexcept {
    switch (format) {
        case Format::rgba8:
        case Format::rgb8:
        case Format::r8: return true;
        case Format::rgba16f: return true;
        case Format::rgba32f: return float_outputs_;
        default: return false;   // three floats: no driver has to be able to draw them
    }
}

void GlPasses::release_images() noexcept {
    const auto drop = [&](GLuint& t) {
        if (t != 0) gl_.DeleteTextures(1, &t);
        t = 0;
    };
    for (Level& l : levels_) {
        drop(l.luma_near);
        drop(l.luma_far);
        for (GLuint& t : l.motion) drop(t);
        for (GLuint& t : l.back) drop(t);
    }
    levels_.clear();
    drop(tiles_);
    drop(blocks_);
    drop(verdict_);
    drop(background_);
    for (GLuint& t : dense_) drop(t);
    width_px_ = height_px_ = 0;
}

GLuint GlPasses::make_image(int width, int height) noexcept {
    GLuint t = 0;
    gl_.GenTextures(1, &t);
    gl_.BindTexture(GL_TEXTURE_2D, t);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA16F, width, height);
    return t;
}

bool GlPasses::prepare(int width_px, int height_px) noexcept {
    if (width_px == width_px_ && height_px == height_px_) return true;
    release_images();
    gl_.ActiveTexture(GL_TEXTURE0);
    // As on the processor: a small picture has no motion to spare for coarse cells.
    cell_px_ = std::min(width_px, height_px) < 256 ? 2 : tuning_.cell_px;
    int w = (width_px + cell_px_ - 1) / cell_px_, h = (height_px + cell_px_ - 1) / cell_px_;
    for (;;) {
        Level l;
        l.width = w;
        l.height = h;
        l.columns = (w + 3) / 4 + 1;
        l.rows = (h + 3) / 4 + 1;
        l.luma_near = make_image(w, h);
        l.luma_far = make_image(w, h);
        for (GLuint& t : l.motion) t = make_image(l.columns, l.rows);
        if (tuning_.backward_level >= 0)
            for (GLuint& t : l.back) t = make_image(l.columns, l.rows);
        levels_.push_back(l);
        if (std::max(w, h) <= 32 || (std::min(w, h) + 1) / 2 < 8) break;
        w = (w + 1) / 2;
        h = (h + 1) / 2;
    }
    tiles_ = make_image((width_px + 15) / 16, (height_px + 15) / 16);
    blocks_ = make_image((levels_[0].width + 7) / 8, (levels_[0].height + 7) / 8);
    verdict_ = make_image(1, 1);
    background_ = make_image(2, 1);
    for (GLuint& t : dense_) t = make_image(levels_[0].width, levels_[0].height);
    if (gl_.GetError() == GL_OUT_OF_MEMORY) {
        release_images();
        return false;
    }
    width_px_ = width_px;
    height_px_ = height_px;
    return true;
}

void GlPasses::use(int kernel, bool compute) noexcept {
    current_ = compute ? compute_programs_[kernel] : fragment_[kernel];
    gl_.UseProgram(current_);
}
void GlPasses::bind(int unit, GLuint texture, GLuint sampler) noexcept {
    gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl_.BindTexture(GL_TEXTURE_2D, texture);
    gl_.BindSampler(static_cast<GLuint>(unit), sampler);
}
void GlPasses::set(const char* name, float value) noexcept { gl_.Uniform1f(gl_.GetUniformLocation(current_, name), value); }
void GlPasses::set(const char* name, int x, int y) noexcept { gl_.Uniform2i(gl_.GetUniformLocation(current_, name), x, y); }
void GlPasses::set(const char* name, int x) noexcept { gl_.Uniform1i(gl_.GetUniformLocation(current_, name), x); }

void GlPasses::write(GLuint texture, int level, int width, int height, bool compute, GLenum format) noexcept {
    if (compute) {
        gl_.BindImageTexture(0, texture, level, GL_FALSE, 0, GL_WRITE_ONLY, format);
        gl_.DispatchCompute(static_cast<GLuint>((width + 7) / 8), static_cast<GLuint>((height + 7) / 8), 1);
        gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
        return;
    }
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, level);
    gl_.Viewport(0, 0, width, height);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

bool GlPasses::read_floats(GLuint texture, int width_px, int height_px, void* rgba) noexcept {
    if (!float_outputs_) return false;
    GLuint target = 0;
    gl_.GenTextures(1, &target);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, target);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width_px, height_px);
    gl_.BindVertexArray(array_);
    current_ = copy_;
    gl_.UseProgram(copy_);
    bind(0, texture, nearest_);
    write(target, 0, width_px, height_px, false, 0);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    gl_.ReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_FLOAT, rgba);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    gl_.DeleteTextures(1, &target);
    return gl_.GetError() == GL_NO_ERROR;
}

void GlPasses::pass(int kernel, GLuint target, int width, int height) noexcept { write(target, 0, width, height, compute_ && kKernels[kernel].computed, GL_RGBA16F); }

// Forward from near to far; back: the other way, to be compared.
void GlPasses::search_level(std::size_t l, bool back, int rounds) noexcept {
    Level& level = levels_[l];
    const bool coarsest = l + 1 == levels_.size();
    GLuint(&motion)[2] = back ? level.back : level.motion;
    const Level& above = levels_[coarsest ? l : l + 1];
    use(kSearch, compute_);
    bind(0, back ? level.luma_far : level.luma_near, linear_);
    bind(1, back ? level.luma_near : level.luma_far, linear_);
    bind(2, (back ? above.back : above.motion)[coarsest ? 1 : 0], nearest_);
    bind(3, tiles_, nearest_);
    set("size", level.width, level.height);
    set("cell", cell_px_ << l);
    set("rounds", rounds);
    set("reach", coarsest ? 0.0f : -1.0f);
    pass(kSearch, motion[0], level.columns, level.rows);
    use(kRelax, compute_);
    set("size", level.columns, level.rows);
    for (int r = 0; r < kRelaxRounds; ++r) {
        bind(0, motion[r % 2], nearest_);
        pass(kRelax, motion[1 - r % 2], level.columns, level.rows);
    }
    static_assert(kRelaxRounds % 2 == 0, "the result is in [0]");
}

bool GlPasses::run(GLuint near, GLuint far, GLuint output, int output_level, int width_px, int height_px, Format format, float step) noexcept {
    if (!prepare(width_px, height_px)) return false;
    gl_.BindVertexArray(array_);
    const int rounds = preset_ == Preset::draft ? 3 : preset_ == Preset::fast ? 6 : preset_ == Preset::balanced ? 8 : 16;

    use(kTiles, false);
    bind(0, near, nearest_);
    bind(1, far, nearest_);
    set("size", width_px, height_px);
    write(tiles_, 0, (width_px + 15) / 16, (height_px + 15) / 16, false, 0);

    for (const bool of_near : {true, false}) {
        use(kLuma, false);
        bind(0, of_near ? near : far, nearest_);
        set("size", width_px, height_px);
        set("cell", cell_px_);
        set("reach", is_float(format) ? 1.0f : 0.0f);
        set("rounds", format == Format::r8 ? 1 : 0);
        write(of_near ? levels_[0].luma_near : levels_[0].luma_far, 0, levels_[0].width, levels_[0].height, false, 0);
        use(kHalve, false);
        for (std::size_t l = 1; l < levels_.size(); ++l) {
            bind(0, of_near ? levels_[l - 1].luma_near : levels_[l - 1].luma_far, linear_);
            set("size", levels_[l - 1].width, levels_[l - 1].height);
            write(of_near ? levels_[l].luma_near : levels_[l].luma_far, 0, levels_[l].width, levels_[l].height, false, 0);
        }
    }
    const bool checks = tuning_.backward_level >= 0;
    for (std::size_t l = levels_.size(); l-- > 0;) {
        search_level(l, false, rounds);
        if (checks) search_level(l, true, (rounds + 1) / 2);
    }
    const Level& finest = levels_[0];
    const int w = finest.width, h = finest.height;
    for (const bool back : {false, true}) {
        if (back && !checks) break;
        use(kSpread, compute_);
        bind(0, back ? finest.luma_far : finest.luma_near, nearest_);
        bind(1, back ? finest.luma_near : finest.luma_far, linear_);
        bind(2, (back ? finest.back : finest.motion)[0], nearest_);
        set("size", finest.columns, finest.rows);
        pass(kSpread, dense_[back ? 1 : 0], w, h);
    }
    int motion = 0;
    if (checks) {
        use(kCheck, false);
        bind(0, dense_[0], nearest_);
        bind(1, dense_[1], nearest_);
        set("size", w, h);
        pass(kCheck, dense_[2], w, h);
        motion = 2;
    }
    use(kSmooth, false);
    bind(1, finest.luma_near, nearest_);
    set("size", w, h);
    for (int i = 0; i < tuning_.smoothing_passes; ++i) {
        bind(0, dense_[motion], nearest_);
        set("rounds", 1 << (tuning_.smoothing_passes - 1 - i));
        motion = (motion + 1) % 3;
        pass(kSmooth, dense_[motion], w, h);
    }
    const std::size_t judged = cell_px_ < 4 && levels_.size() > 1 ? 1 : 0;
    const int blocks_wide = (levels_[judged].width + 7) / 8, blocks_high = (levels_[judged].height + 7) / 8;
    use(kJudge, compute_);
    bind(0, dense_[motion], nearest_);
    bind(1, levels_[judged].luma_near, linear_);
    bind(2, levels_[judged].luma_far, linear_);
    bind(3, tiles_, nearest_);
    set("rounds", static_cast<int>(judged));
    set("cell", cell_px_);
    pass(kJudge, blocks_, blocks_wide, blocks_high);
    use(kVerdict, false);
    bind(0, blocks_, nearest_);
    set("size", blocks_wide, blocks_high);
    set("reach", kCutFraction);
    write(verdict_, 0, 1, 1, false, 0);
    const int carried = (motion + 1) % 3, displacement = (motion + 2) % 3;
    use(kCarry, false);
    bind(0, dense_[motion], nearest_);
    bind(1, blocks_, nearest_);
    set("rounds", static_cast<int>(judged));
    set("step_px", step * static_cast<float>(cell_px_));
    set("reach", std::max(1.0f, kMaxReach * static_cast<float>(std::max(width_px, height_px))));
    pass(kCarry, dense_[carried], w, h);
    use(kBackground, false);
    bind(0, dense_[carried], nearest_);
    set("size", w, h);
    pass(kBackground, background_, 2, 1);
    use(kDisplacement, compute_);
    bind(1, background_, nearest_);
    set("size", w, h);
    set("cell", cell_px_);
    pass(kDisplacement, dense_[displacement], w, h);

    current_ = fragment_gather_;
    GLenum image_format = 0;
    for (int i = 0; compute_ && i < 3; ++i)
        if (kStorable[i].format == format) {
            current_ = gather_compute_[i];
            image_format = kStorable[i].internal;
        }
    gl_.UseProgram(current_);
    bind(0, near, nearest_);
    bind(1, dense_[displacement], nearest_);
    bind(2, verdict_, nearest_);
    bind(3, tiles_, nearest_);
    set("size", width_px, height_px);
    set("cell", cell_px_);
    set("rounds", (is_float(format) ? 1 : 0) + (tuning_.cubic ? 2 : 0));
    write(output, output_level, width_px, height_px, image_format != 0, image_format);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    return true;
}

}  // namespace fovea::render::extrapolation
