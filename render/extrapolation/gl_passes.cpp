#include "render/extrapolation/gl_passes.hpp"

#include <algorithm>
#include <array>

#include "render/extrapolation/motion.hpp"

namespace fovea::render::extrapolation {

namespace {

int padded(int edge) noexcept { return edge == 1 ? 3 : (edge & (edge - 1)) == 0 ? edge + 1 : edge; }

}  // namespace

GlPasses::GlPasses(const GlFunctions& gl, Preset preset) noexcept : gl_(gl), tuning_(tuning_of(preset)), programs_(gl) {}

Result<std::unique_ptr<GlPasses>> GlPasses::create(const GlFunctions& gl, Preset preset, bool compute) {
    std::unique_ptr<GlPasses> p(new GlPasses(gl, preset));
    if (auto built = p->build(compute); !built) return std::unexpected(built.error());
    return p;
}

Result<void> GlPasses::build(bool compute) {
    if (auto built = programs_.build(compute); !built) return built;
    gl_.GenVertexArrays(1, &array_);
    GLuint names[2];
    gl_.GenFramebuffers(2, names);
    framebuffer_ = names[0];
    several_ = names[1];
    gl_.GenSamplers(2, names);
    linear_ = names[0];
    nearest_ = names[1];
    for (const GLuint s : names) {
        const GLint filter = s == linear_ ? GL_LINEAR : GL_NEAREST;
        gl_.SamplerParameteri(s, GL_TEXTURE_MIN_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_MAG_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    // Every image in between is RGBA16F, luma R32F or R16F; can they be drawn to?
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
    const bool half = drawable(GL_RGBA16F) && drawable(GL_R16F);
    float_outputs_ = half && drawable(GL_RGBA32F) && drawable(GL_R32F);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, several_);
    constexpr GLenum kAttachments[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
    gl_.DrawBuffers(3, kAttachments);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(before));
    gl_.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    if (!half) return fail("the driver cannot draw to RGBA16F and R16F", "GL", "use the processor's backend");
    return {};
}

GlPasses::~GlPasses() {
    release_images();
    const GLuint samplers[] = {linear_, nearest_}, framebuffers[] = {framebuffer_, several_};
    gl_.DeleteSamplers(2, samplers);
    gl_.DeleteVertexArrays(1, &array_);
    gl_.DeleteFramebuffers(2, framebuffers);
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
        for (GLuint* t : {&l.near, &l.far, &l.patches}) drop(*t);
        for (GLuint& t : l.motion) drop(t);
        for (GLuint& t : l.back) drop(t);
    }
    levels_.clear();
    for (GLuint* t : {&same_, &tiles_, &blocks_, &counts_, &verdict_, &background_}) drop(*t);
    for (GLuint& t : spans_) drop(t);
    for (GLuint& t : dense_) drop(t);
    width_px_ = height_px_ = 0;
}

GLuint GlPasses::make_image(int width, int height, GLenum format) noexcept {
    GLuint t = 0;
    gl_.GenTextures(1, &t);
    gl_.BindTexture(GL_TEXTURE_2D, t);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    return t;
}

// Software drivers compile a shader anew for textures whose edges are powers of two: none of the large kernel's are.
GLuint GlPasses::make_padded(int width, int height, GLenum format) noexcept {
    return make_image(padded(width), padded(height), format);
}

bool GlPasses::prepare(int width_px, int height_px) noexcept {
    if (width_px == width_px_ && height_px == height_px_) return true;
    release_images();
    gl_.ActiveTexture(GL_TEXTURE0);
    // As on the processor: a small picture has no motion to spare for coarse cells.
    cell_px_ = std::min(width_px, height_px) < 256 ? 2 : tuning_.cell_px;
    const GLenum luma = float_outputs_ ? GL_R32F : GL_R16F;
    int w = (width_px + cell_px_ - 1) / cell_px_, h = (height_px + cell_px_ - 1) / cell_px_;
    for (;;) {
        Level l;
        l.width = w;
        l.height = h;
        l.columns = (w + 3) / 4 + 1;
        l.rows = (h + 3) / 4 + 1;
        l.near = make_padded(w, h, luma);
        l.far = make_padded(w, h, luma);
        l.patches = make_image(l.columns, l.rows, GL_RGBA32UI);
        for (GLuint& t : l.motion) t = make_padded(l.columns, l.rows);
        if (tuning_.backward_level >= 0)
            for (GLuint& t : l.back) t = make_padded(l.columns, l.rows);
        levels_.push_back(l);
        if (std::max(w, h) <= 32 || (std::min(w, h) + 1) / 2 < 8) break;
        w = (w + 1) / 2;
        h = (h + 1) / 2;
    }
    const Level& finest = levels_[0];
    same_ = make_padded(finest.width, finest.height, GL_R8);
    tiles_ = make_padded((width_px + 15) / 16, (height_px + 15) / 16);
    blocks_ = make_image((finest.width + 7) / 8, (finest.height + 7) / 8);
    counts_ = make_image(1, (finest.height + 7) / 8);
    verdict_ = make_image(1, 1);
    background_ = make_image(2, 1);
    for (GLuint& t : spans_) t = make_image((finest.width + 7) / 8, (finest.height + 7) / 8);
    for (GLuint& t : dense_) t = make_image(finest.width, finest.height);
    if (gl_.GetError() == GL_OUT_OF_MEMORY) {
        release_images();
        return false;
    }
    width_px_ = width_px;
    height_px_ = height_px;
    return true;
}

void GlPasses::use(const GlProgram& program) noexcept {
    current_ = program;
    gl_.UseProgram(program.name);
}
void GlPasses::bind(int unit, GLuint texture) noexcept {
    gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl_.BindTexture(GL_TEXTURE_2D, texture);
}

void GlPasses::draw(GLuint texture, int level, int width, int height) noexcept {
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, level);
    gl_.Viewport(0, 0, width, height);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

void GlPasses::draw_several(std::span<const GLuint> textures, int width, int height) noexcept {
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, several_);
    for (GLenum i = 0; i < 3; ++i) gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0 + i, GL_TEXTURE_2D, i < textures.size() ? textures[i] : 0, 0);
    gl_.Viewport(0, 0, width, height);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

void GlPasses::pass(Kernel kernel, GLuint target, int width, int height, GLenum format) noexcept {
    if (!programs_.computes(kernel)) return draw(target, 0, width, height);
    gl_.BindImageTexture(0, target, 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
    gl_.DispatchCompute(static_cast<GLuint>((width + 7) / 8), static_cast<GLuint>((height + 7) / 8), 1);
    gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
}

bool GlPasses::read_floats(GLuint texture, int width_px, int height_px, void* rgba) noexcept {
    if (!float_outputs_) return false;
    GLuint target = 0;
    gl_.GenTextures(1, &target);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, target);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width_px, height_px);
    gl_.BindVertexArray(array_);
    use(Kernel::copy);
    gl_.BindSampler(0, nearest_);
    bind(0, texture);
    draw(target, 0, width_px, height_px);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    gl_.ReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_FLOAT, rgba);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    gl_.DeleteTextures(1, &target);
    return gl_.GetError() == GL_NO_ERROR;
}

void GlPasses::make_levels(GLuint near, GLuint far, Format format) noexcept {
    const Level& finest = levels_[0];
    use(Kernel::luma);
    bind(0, near);
    bind(1, far);
    set_size(width_px_, height_px_);
    set_cell(cell_px_);
    set_reach(is_float(format) ? 1.0f : 0.0f);
    set_rounds(format == Format::r8 ? 1 : 0);
    draw_several(std::array{finest.near, finest.far, same_}, padded(finest.width), padded(finest.height));
    use(Kernel::tiles);
    bind(0, same_);
    bind(1, finest.near);
    set_size(finest.width, finest.height);
    set_cell(cell_px_);
    pass(Kernel::tiles, tiles_, (width_px_ + 15) / 16, (height_px_ + 15) / 16);
    use(Kernel::halve);
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        bind(0, levels_[l - 1].near);
        bind(1, levels_[l - 1].far);
        set_size(levels_[l - 1].width, levels_[l - 1].height);
        draw_several(std::array{levels_[l].near, levels_[l].far}, padded(levels_[l].width), padded(levels_[l].height));
    }
}

// Forward from near to far; back: the other way, to be compared.
void GlPasses::search_level(std::size_t l, bool back) noexcept {
    Level& level = levels_[l];
    const bool coarsest = l + 1 == levels_.size();
    GLuint(&motion)[2] = back ? level.back : level.motion;
    const Level& above = levels_[coarsest ? l : l + 1];
    use(Kernel::search);
    bind(0, back ? level.far : level.near);
    bind(1, back ? level.near : level.far);
    bind(2, (back ? above.back : above.motion)[0]);
    bind(3, tiles_);
    set_size(level.width, level.height);
    set_cell(cell_px_ << l);
    // Where the processor passes several times over the patches of a level, each time with what the neighbours found, all steps
    // are made at once here. The way back only has to tell right from wrong.
    const int steps = std::max(tuning_.iterations * tuning_.passes, 3);
    set_rounds(back ? (steps + 1) / 2 : steps);
    set_reach(coarsest ? 0.0f : -1.0f);
    pass(Kernel::search, level.patches, level.columns, level.rows, GL_RGBA32UI);
    use(Kernel::balance);
    bind(4, level.patches);
    set_size(level.columns, level.rows);
    set_reach(tuning_.stiffness);
    // From afar, then from nearer: what many know spreads in fewer rounds than on the processor, where only neighbours talk.
    constexpr int kFar[] = {1, 2, 4};
    const int on_processor = back ? (tuning_.balance_rounds + 1) / 2 : tuning_.balance_rounds, balance = std::max((2 * on_processor + 4) / 5, 6);
    for (int r = 0; r < balance; ++r) {
        set_cell(kFar[(balance - 1 - r) % 3]);
        set_rounds(r == 0 ? 1 : 0);
        bind(0, motion[0]);
        pass(Kernel::balance, motion[1], level.columns, level.rows);
        std::swap(motion[0], motion[1]);
    }
}

GLuint GlPasses::find_motion() noexcept {
    const bool checks = tuning_.backward_level >= 0;
    const std::size_t back_to = checks ? std::min(static_cast<std::size_t>(tuning_.backward_level), levels_.size() - 1) : levels_.size();
    for (std::size_t l = levels_.size(); l-- > 0;) {
        search_level(l, false);
        if (checks && l >= back_to) search_level(l, true);
    }
    const Level& finest = levels_[0];
    use(Kernel::spread);
    bind(0, finest.near);
    bind(1, finest.far);
    bind(2, finest.motion[0]);
    bind(3, checks ? levels_[back_to].back[0] : 0);
    set_size(finest.columns, finest.rows);
    set_rounds(static_cast<int>(back_to));
    set_reach(checks ? 1.0f : 0.0f);
    pass(Kernel::spread, dense_[0], finest.width, finest.height);
    use(Kernel::smooth);
    set_size(finest.width, finest.height);
    for (int i = 0; i < tuning_.smoothing_passes; ++i) {
        bind(0, dense_[0]);
        set_rounds(1 << (tuning_.smoothing_passes - 1 - i));
        pass(Kernel::smooth, dense_[1], finest.width, finest.height);
        std::swap(dense_[0], dense_[1]);
    }
    return dense_[0];
}

GLuint GlPasses::carry(GLuint motion, float step) noexcept {
    const int w = levels_[0].width, h = levels_[0].height;
    const std::size_t judged = cell_px_ < 4 && levels_.size() > 1 ? 1 : 0;
    const int blocks_wide = (levels_[judged].width + 7) / 8, blocks_high = (levels_[judged].height + 7) / 8;
    use(Kernel::judge);
    bind(0, motion);
    bind(1, levels_[judged].near);
    bind(2, levels_[judged].far);
    bind(3, tiles_);
    set_size(levels_[judged].width, levels_[judged].height);
    set_rounds(static_cast<int>(judged));
    set_cell(cell_px_);
    pass(Kernel::judge, blocks_, blocks_wide, blocks_high);
    use(Kernel::count);
    bind(0, blocks_);
    set_size(blocks_wide, blocks_high);
    pass(Kernel::count, counts_, 1, blocks_high);
    use(Kernel::verdict);
    bind(0, counts_);
    set_size(1, blocks_high);
    set_reach(kCutFraction);
    pass(Kernel::verdict, verdict_, 1, 1);
    use(Kernel::carry);
    bind(0, motion);
    bind(1, blocks_);
    bind(2, verdict_);
    bind(3, tiles_);
    set_rounds(static_cast<int>(judged));
    set_cell(cell_px_);
    gl_.Uniform1f(current_.step_px, step * static_cast<float>(cell_px_));
    set_reach(std::max(1.0f, kMaxReach * static_cast<float>(std::max(width_px_, height_px_))));
    const GLuint carried = dense_[1], displacement = dense_[2];
    pass(Kernel::carry, carried, w, h);
    use(Kernel::background);
    bind(0, carried);
    set_size(w, h);
    pass(Kernel::background, background_, 2, 1);
    use(Kernel::span);
    set_size(w, h);
    const int spans_wide = (w + 7) / 8, spans_high = (h + 7) / 8;
    pass(Kernel::span, spans_[0], spans_wide, spans_high);
    use(Kernel::widen);
    bind(0, spans_[0]);
    set_size(spans_wide, spans_high);
    set_cell(cell_px_);
    pass(Kernel::widen, spans_[1], spans_wide, spans_high);
    use(Kernel::displacement);
    bind(0, carried);
    bind(1, background_);
    bind(2, spans_[1]);
    set_size(w, h);
    set_cell(cell_px_);
    pass(Kernel::displacement, displacement, w, h);
    use(Kernel::fill);
    bind(0, displacement);
    set_size(w, h);
    pass(Kernel::fill, dense_[0], w, h);
    return dense_[0];
}

bool GlPasses::run(GLuint near, GLuint far, GLuint output, int output_level, int width_px, int height_px, Format format, float step) noexcept {
    if (!prepare(width_px, height_px)) return false;
    gl_.BindVertexArray(array_);
    for (GLuint unit = 0; unit < 5; ++unit) gl_.BindSampler(unit, nearest_);
    make_levels(near, far, format);
    const GLuint displacement = carry(find_motion(), step);

    use(programs_.gather(format));
    if (!is_float(format)) gl_.BindSampler(0, linear_);
    bind(0, near);
    bind(1, displacement);
    set_size(width_px, height_px);
    set_cell(cell_px_);
    set_rounds(tuning_.cubic ? 1 : 0);
    draw(output, output_level, width_px, height_px);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    return true;
}

}  // namespace fovea::render::extrapolation
