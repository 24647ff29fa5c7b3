#include "render/extrapolation/gl_passes.hpp"

#include <algorithm>
#include <array>

#include "render/extrapolation/motion.hpp"

namespace fovea::render::extrapolation {

namespace {

int padded(int edge) noexcept { return edge == 1 ? 3 : (edge & (edge - 1)) == 0 ? edge + 1 : edge; }

}  // namespace

GlPasses::GlPasses(const GlFunctions& gl, Preset preset) noexcept : gl_(gl), tuning_(tuning_of(preset)), cell_px_(tuning_.cell_px), runner_(gl), regions_(runner_) {}

Result<std::unique_ptr<GlPasses>> GlPasses::create(const GlFunctions& gl, Preset preset, bool compute) {
    std::unique_ptr<GlPasses> p(new GlPasses(gl, preset));
    if (auto built = p->build(compute); !built) return std::unexpected(built.error());
    return p;
}

Result<void> GlPasses::build(bool compute) {
    compute_ = compute;
    if (auto built = runner_.build(compute, cell_px_, tuning_.cubic); !built) return built;
    // Every image in between is RGBA16F, luma R32F or R16F; can they be drawn to?
    GLint before = 0, bound = 0;
    gl_.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &before);
    gl_.GetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
    const auto drawable = [&](GLenum format) {
        GLuint texture = 0;
        gl_.GenTextures(1, &texture);
        gl_.BindTexture(GL_TEXTURE_2D, texture);
        gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, 4, 4);
        gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, runner_.framebuffer());
        gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
        const bool complete = gl_.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
        gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
        gl_.DeleteTextures(1, &texture);
        return complete;
    };
    const bool half = drawable(GL_RGBA16F) && drawable(GL_R16F);
    float_outputs_ = half && drawable(GL_RGBA32F) && drawable(GL_R32F);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(before));
    gl_.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    if (!half) return fail("the driver cannot draw to RGBA16F and R16F", "GL", "use the processor's backend");
    return {};
}

GlPasses::~GlPasses() { release_images(); }

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
    for (GLuint* t : {&key_columns_, &key_, &tiles_, &blocks_[0], &blocks_[1], &counts_, &verdict_, &background_, &rims_, &votes_, &kept_, &slopes_}) drop(*t);
    for (GLuint& t : spans_) drop(t);
    for (GLuint& t : dense_) drop(t);
    regions_.release();
    width_px_ = height_px_ = 0;
}

// Software drivers compile a shader anew for textures whose edges are powers of two: none of the large kernel's are.
GLuint GlPasses::make_padded(int width, int height, GLenum format) noexcept {
    return runner_.make_image(padded(width), padded(height), format);
}

bool GlPasses::prepare(int width_px, int height_px) noexcept {
    if (width_px == width_px_ && height_px == height_px_) return true;
    release_images();
    gl_.ActiveTexture(GL_TEXTURE0);
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
        l.patches = runner_.make_image(l.columns, l.rows, GL_RGBA32UI);
        for (GLuint& t : l.motion) t = make_padded(l.columns, l.rows);
        if (tuning_.backward_level >= 0)
            for (GLuint& t : l.back) t = make_padded(l.columns, l.rows);
        levels_.push_back(l);
        if (std::max(w, h) <= 32 || (std::min(w, h) + 1) / 2 < 8) break;
        w = (w + 1) / 2;
        h = (h + 1) / 2;
    }
    const Level& finest = levels_[0];
    regions_.resize(width_px, height_px, finest.width, finest.height, static_cast<int>(levels_.size()), compute_);
    key_columns_ = runner_.make_image(64, 1);
    key_ = runner_.make_image(1, 1);
    tiles_ = make_padded((width_px + 15) / 16, (height_px + 15) / 16);
    for (GLuint& t : blocks_) t = runner_.make_image((finest.width + 7) / 8, (finest.height + 7) / 8);
    counts_ = runner_.make_image(1, (finest.height + 7) / 8);
    verdict_ = runner_.make_image(1, 1);
    background_ = runner_.make_image(2, 1);
    for (GLuint* t : {&rims_, &kept_}) *t = runner_.make_image((width_px + 15) / 16, (height_px + 15) / 16);
    slopes_ = runner_.make_image((finest.width + 3) / 4, (finest.height + 3) / 4, GL_RGBA32UI);
    votes_ = runner_.make_image((width_px + 3) / 4, (height_px + 3) / 4);
    for (GLuint& t : spans_) t = runner_.make_image((finest.width + 7) / 8, (finest.height + 7) / 8);
    for (GLuint& t : dense_) t = runner_.make_image(finest.width, finest.height);
    if (gl_.GetError() == GL_OUT_OF_MEMORY) {
        release_images();
        return false;
    }
    width_px_ = width_px;
    height_px_ = height_px;
    return true;
}

bool GlPasses::read_floats(GLuint texture, int width_px, int height_px, void* rgba) noexcept {
    if (!float_outputs_) return false;
    gl_.ActiveTexture(GL_TEXTURE0);
    const GLuint target = runner_.make_image(width_px, height_px, GL_RGBA32F);
    runner_.begin();
    runner_.use(Kernel::copy);
    runner_.bind(0, texture);
    runner_.draw(target, 0, width_px, height_px, over_all());
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, runner_.framebuffer());
    gl_.ReadPixels(0, 0, width_px, height_px, GL_RGBA, GL_FLOAT, rgba);
    runner_.end();
    gl_.DeleteTextures(1, &target);
    return gl_.GetError() == GL_NO_ERROR;
}

void GlPasses::spoil() noexcept {
    constexpr float kWild[4] = {40, -40, 0, 1};
    constexpr GLuint kWildWords[4] = {0x42200000, 0xc2200000, 0, 0};   // as floats: the same
    for (const Level& l : levels_) {
        runner_.clear_words(l.patches, kWildWords);
        for (const GLuint m : l.motion) runner_.clear(m, kWild);
        for (const GLuint m : l.back)
            if (m != 0) runner_.clear(m, kWild);
    }
}

Over GlPasses::patches_of(std::size_t level) const noexcept {
    return level == 0 ? over(List::moving, 4 * cell_px_) : over_all_if_any(Args::kLevel + static_cast<int>(level));
}

void GlPasses::make_levels(GLuint near, GLuint far, Format format) noexcept {
    GlRunner& r = runner_;
    const Level& finest = levels_[0];
    if (is_float(format)) {
        r.use(Kernel::key_columns);
        r.bind(0, near);
        r.set_size(width_px_, height_px_);
        r.pass(Kernel::key_columns, key_columns_, 64, 1, over_all_if_any());
        r.use(Kernel::key);
        r.bind(0, key_columns_);
        r.pass(Kernel::key, key_, 1, 1, over_all_if_any());
    }
    r.use(is_float(format) ? Kernel::luma_floats : Kernel::luma_bytes);
    r.bind(0, near);
    r.bind(1, far);
    if (!is_float(format))
        for (const int unit : {0, 1}) r.sample(unit, Filter::linear);
    r.bind(3, key_);
    r.set_size(width_px_, height_px_);
    r.set_rounds(format == Format::r8 ? 1 : 0);
    r.draw_several(std::array{finest.near, finest.far}, padded(finest.width), padded(finest.height), over_all_if_any());
    for (const int unit : {0, 1}) r.sample(unit, Filter::nearest);
    r.use(Kernel::tiles);
    r.bind(0, regions_.still());
    r.bind(1, finest.near);
    r.set_size(finest.width, finest.height);
    r.pass(Kernel::tiles, tiles_, (width_px_ + 15) / 16, (height_px_ + 15) / 16, over_all_if_any());
    r.use(Kernel::halve);
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        r.bind(0, levels_[l - 1].near);
        r.bind(1, levels_[l - 1].far);
        r.set_size(levels_[l - 1].width, levels_[l - 1].height);
        r.draw_several(std::array{levels_[l].near, levels_[l].far}, padded(levels_[l].width), padded(levels_[l].height), over_all_if_any());
    }
}

// Forward from near to far; back: the other way, to be compared.
void GlPasses::search_level(std::size_t l, bool back) noexcept {
    GlRunner& r = runner_;
    Level& level = levels_[l];
    const bool coarsest = l + 1 == levels_.size();
    GLuint(&motion)[2] = back ? level.back : level.motion;
    const Level& above = levels_[coarsest ? l : l + 1];
    const Over where = patches_of(l);
    if (l == 0) {   // what is not worked on stands still
        r.clear_words(level.patches, {0, 0, 0, 0});
        for (const GLuint m : motion) r.clear(m, {0, 0, 0, 1});
    }
    r.use(Kernel::search);
    r.bind(0, back ? level.far : level.near);
    r.bind(1, back ? level.near : level.far);
    r.bind(2, (back ? above.back : above.motion)[0]);
    r.bind(3, tiles_);
    r.set_size(level.width, level.height);
    r.set_cell(cell_px_ << l);
    // Where the processor passes several times over the patches of a level, each time with what the neighbours found, all steps
    // are made at once here. The way back only has to tell right from wrong.
    const int steps = std::max(tuning_.iterations * tuning_.passes, 3);
    r.set_rounds(back ? (steps + 1) / 2 : steps);
    r.set_reach(coarsest ? 0.0f : -1.0f);
    r.pass(Kernel::search, level.patches, level.columns, level.rows, where, GL_RGBA32UI);
    r.bind(4, level.patches);
    // From afar, then from nearer: what many know spreads in fewer rounds than on the processor, where only neighbours talk.
    constexpr int kFar[] = {1, 2, 4};
    const int on_processor = back ? (tuning_.balance_rounds + 1) / 2 : tuning_.balance_rounds, balance = std::max((2 * on_processor + 4) / 5, 6);
    for (int i = 0; i < balance; ++i) {
        const Kernel kernel = i == 0 ? Kernel::balance_first : Kernel::balance;
        if (i < 2) {
            r.use(kernel);
            r.set_size(level.columns, level.rows);
            r.set_reach(tuning_.stiffness);
        }
        r.set_cell(kFar[(balance - 1 - i) % 3]);
        r.bind(0, motion[0]);
        r.pass(kernel, motion[1], level.columns, level.rows, where);
        std::swap(motion[0], motion[1]);
    }
}

GLuint GlPasses::find_motion() noexcept {
    GlRunner& r = runner_;
    const bool checks = tuning_.backward_level >= 0;
    const std::size_t back_to = checks ? std::min(static_cast<std::size_t>(tuning_.backward_level), levels_.size() - 1) : levels_.size();
    for (std::size_t l = levels_.size(); l-- > 0;) {
        search_level(l, false);
        if (checks && l >= back_to) search_level(l, true);
    }
    const Level& finest = levels_[0];
    for (const GLuint image : {dense_[0], dense_[1]}) r.clear(image, {0, 0, 0, 0});
    r.use(Kernel::rough);
    r.bind(0, regions_.map(List::moving));
    r.bind(2, finest.motion[0]);
    r.bind(3, checks ? levels_[back_to].back[0] : 0);
    r.set_size(finest.columns, finest.rows);
    r.set_cell(regions_.tile_px() / (4 * cell_px_));
    r.set_rounds(static_cast<int>(back_to));
    r.set_reach(checks ? 1.0f : 0.0f);
    regions_.find(List::rough);
    r.use(Kernel::glide);
    r.bind(0, finest.near);
    r.draw_several(std::array{dense_[0], dense_[1]}, finest.width, finest.height, over(List::moving, cell_px_));
    const Over cells = over(List::rough, cell_px_);
    r.use(Kernel::spread);
    r.bind(1, finest.far);
    r.set_size(finest.columns, finest.rows);
    r.set_rounds(static_cast<int>(back_to));
    r.set_reach(checks ? 1.0f : 0.0f);
    r.pass(Kernel::spread, dense_[0], finest.width, finest.height, cells);
    r.use(Kernel::smooth);
    r.set_size(finest.width, finest.height);
    for (int i = 0; i < tuning_.smoothing_passes; ++i) {
        r.bind(0, dense_[0]);
        r.set_rounds(1 << (tuning_.smoothing_passes - 1 - i));
        r.pass(Kernel::smooth, dense_[1], finest.width, finest.height, cells);
        std::swap(dense_[0], dense_[1]);
    }
    return dense_[0];
}

// 0 where more than a part of what the squares count, in y, is also counted in z.
void GlPasses::give_verdict(GLuint squares, int columns, int rows, float most) noexcept {
    GlRunner& r = runner_;
    r.use(Kernel::count);
    r.bind(0, squares);
    r.set_size(columns, rows);
    r.pass(Kernel::count, counts_, 1, rows, over_all_if_any());
    r.use(Kernel::verdict);
    r.bind(0, counts_);
    r.set_size(1, rows);
    r.set_reach(most);
    r.pass(Kernel::verdict, verdict_, 1, 1, over_all_if_any());
}

GLuint GlPasses::carry(GLuint motion, float step) noexcept {
    GlRunner& r = runner_;
    const int w = levels_[0].width, h = levels_[0].height;
    const int judged = cell_px_ < 4 && levels_.size() > 1 ? 1 : 0;
    const Level& level = levels_[static_cast<std::size_t>(judged)];
    const int blocks_wide = (level.width + 7) / 8, blocks_high = (level.height + 7) / 8;
    r.use(Kernel::judge);
    r.bind(0, motion);
    r.bind(1, level.near);
    r.bind(2, level.far);
    r.bind(3, tiles_);
    r.set_size(level.width, level.height);
    r.set_rounds(judged);
    r.pass(Kernel::judge, blocks_[0], blocks_wide, blocks_high, over_all_if_any());
    if (judged > 0) {
        r.use(Kernel::judge_finest);
        r.bind(1, levels_[0].near);
        r.bind(2, levels_[0].far);
        r.bind(3, blocks_[0]);
        r.set_size(w, h);
        r.set_rounds(judged);
        r.pass(Kernel::judge_finest, blocks_[1], blocks_wide, blocks_high, over_all_if_any());
    }
    const GLuint blocks = blocks_[judged];
    give_verdict(blocks, blocks_wide, blocks_high, kCutFraction);
    r.use(Kernel::carry);
    r.bind(0, motion);
    r.bind(0, motion);
    r.bind(1, blocks);
    r.bind(2, verdict_);
    r.bind(3, tiles_);
    r.set_rounds(judged);
    r.set_step(step * static_cast<float>(cell_px_));
    r.set_reach(std::max(1.0f, kMaxReach * static_cast<float>(std::max(width_px_, height_px_))));
    const GLuint carried = dense_[1], displacement = dense_[2];
    r.pass(Kernel::carry, carried, w, h, over(List::moving, cell_px_));
    r.use(Kernel::background);
    r.bind(0, carried);
    r.set_size(w, h);
    r.pass(Kernel::background, background_, 2, 1, over_all_if_any());
    const int spans_wide = (w + 7) / 8, spans_high = (h + 7) / 8;
    r.clear(spans_[0], {0, 0, 0, 0});
    r.use(Kernel::span);
    r.bind(0, carried);
    r.set_size(w, h);
    r.pass(Kernel::span, spans_[0], spans_wide, spans_high, over(List::moving, 8 * cell_px_));
    r.use(Kernel::widen);
    r.bind(0, spans_[0]);
    r.set_size(spans_wide, spans_high);
    r.pass(Kernel::widen, spans_[1], spans_wide, spans_high, over_all_if_any());
    for (const List list : {List::calm, List::torn}) {
        r.use(Kernel::reached);
        r.bind(0, spans_[1]);
        r.set_size(spans_wide, spans_high);
        r.set_cell(regions_.tile_px() / (8 * cell_px_));
        r.set_rounds(list == List::torn ? 1 : 0);
        regions_.find(list);
    }
    for (const GLuint image : {displacement, dense_[0]}) r.clear(image, {0, 0, 0, -1});
    r.use(Kernel::hem);
    r.bind(0, regions_.map(List::calm));
    r.bind(1, regions_.map(List::torn));
    r.set_size(regions_.columns(), regions_.rows());
    regions_.find(List::hem);
    r.bind(0, carried);
    r.use(Kernel::slope);
    r.set_size(w, h);
    r.pass(Kernel::slope, slopes_, (w + 3) / 4, (h + 3) / 4, over(List::calm, 4 * cell_px_), GL_RGBA32UI);
    r.use(Kernel::alike);
    r.set_size(w, h);
    r.draw_several(std::array{displacement, dense_[0]}, w, h, over(List::hem, cell_px_));
    r.use(Kernel::displacement);
    r.bind(1, background_);
    r.bind(2, spans_[1]);
    r.set_size(w, h);
    r.pass(Kernel::displacement, displacement, w, h, over(List::torn, cell_px_));
    r.use(Kernel::fill);
    r.bind(0, displacement);
    r.set_size(w, h);
    r.pass(Kernel::fill, dense_[0], w, h, over(List::torn, cell_px_));
    return dense_[0];
}

GLuint GlPasses::find_sides(GLuint displacement) noexcept {
    GlRunner& r = runner_;
    const int w = levels_[0].width, h = levels_[0].height, squares_wide = (w + 7) / 8, squares_high = (h + 7) / 8;
    constexpr float kMostEdges = 1.0f / 16;   // of the cells
    r.clear(spans_[0], {0, 64, 0, 0});
    r.use(Kernel::edges);
    r.bind(0, displacement);
    r.set_size(w, h);
    r.pass(Kernel::edges, spans_[0], squares_wide, squares_high, over(List::torn, 8 * cell_px_));
    give_verdict(spans_[0], squares_wide, squares_high, kMostEdges);
    r.use(Kernel::near_edges);
    r.bind(0, spans_[0]);
    r.bind(1, verdict_);
    r.set_size(squares_wide, squares_high);
    r.set_cell(regions_.tile_px() / (8 * cell_px_));
    regions_.find(List::edges);
    r.use(Kernel::sides);
    r.bind(0, displacement);
    r.bind(1, background_);
    r.set_size(w, h);
    r.pass(Kernel::sides, dense_[1], w, h, over(List::edges, cell_px_));
    return dense_[1];
}

// After kEdges, in spans_[0].
void GlPasses::find_rims(GLuint displacement, GLuint near, GLuint far, Format format, float step) noexcept {
    GlRunner& r = runner_;
    const int tiles_wide = (width_px_ + 15) / 16, tiles_high = (height_px_ + 15) / 16;
    r.use(Kernel::rims);
    r.bind(0, spans_[0]);
    r.bind(1, regions_.still());
    r.set_size(tiles_wide, tiles_high);
    r.draw(rims_, 0, tiles_wide, tiles_high, over_all_if_any());
    r.use(Kernel::any);
    r.bind(0, rims_);
    r.set_size(tiles_wide, tiles_high);
    r.set_cell(regions_.tile_px() / 16);
    regions_.find(List::rims);
    r.use(Kernel::vote);
    r.bind(0, near);
    r.bind(1, displacement);
    r.bind(2, far);
    r.bind(3, rims_);
    r.bind(4, regions_.same());
    r.set_size(width_px_, height_px_);
    r.set_step(step);
    r.set_reach(is_float(format) ? 1.0f : 0.0f);
    r.set_rounds(format == Format::r8 ? 1 : 0);
    r.draw(votes_, 0, (width_px_ + 3) / 4, (height_px_ + 3) / 4, over(List::rims, 4));
    r.use(Kernel::keep);
    r.bind(0, votes_);
    r.bind(1, rims_);
    r.set_size(tiles_wide, tiles_high);
    r.draw(kept_, 0, tiles_wide, tiles_high, over_all_if_any());
}

bool GlPasses::run(GLuint near, int near_level, GLuint far, GLuint output, int output_level, int width_px, int height_px, Format format, float step) noexcept {
    if (!prepare(width_px, height_px)) return false;
    GlRunner& r = runner_;
    r.begin();
    r.copy(near, near_level, output, output_level, width_px, height_px);
    regions_.find_moving(near, far);
    make_levels(near, far, format);
    const GLuint displacement = carry(find_motion(), step), sides = find_sides(displacement);
    find_rims(displacement, near, far, format, step);
    constexpr std::pair<Gathered, List> kGathers[] = {{Gathered::calm, List::calm}, {Gathered::torn, List::torn}, {Gathered::judged, List::edges}};
    for (const auto& [which, list] : kGathers) {
        r.use(r.programs().of(which, format));
        if (!is_float(format))
            for (const int unit : {0, 2}) r.sample(unit, Filter::linear);
        r.bind(0, near);
        r.bind(1, which == Gathered::judged ? sides : displacement);
        r.bind(2, far);
        r.bind(4, slopes_);
        r.set_size(width_px, height_px);
        r.set_step(step);
        r.set_rounds(format == Format::r8 ? 1 : 0);
        r.draw(output, output_level, width_px, height_px, over(list, 1));
    }
    r.sample(0, Filter::nearest);
    r.use(Kernel::stand);
    r.bind(0, near);
    r.bind(1, displacement);
    r.bind(2, kept_);
    r.bind(4, regions_.same());
    r.set_size(width_px, height_px);
    r.draw(output, output_level, width_px, height_px, over(List::rims, 1));
    r.end();
    return true;
}

}  // namespace fovea::render::extrapolation
