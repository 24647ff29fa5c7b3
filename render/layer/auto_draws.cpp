// Auto mode, draw by draw: which draws keep full density, and why.
#include <algorithm>

#include "render/layer/context.hpp"
#include "render/layer/multiview_source.hpp"

namespace fovea::layer {

void Context::add_source_facts(ProgramFacts& facts, GLuint program) {
    if (share_->sources.any_multiview_shader()) {
        if (const GLint location = gl.GetUniformLocation(program, kViewUniform); location >= 0) facts.view_uniforms.emplace_back(program, location);
        facts.num_views = share_->sources.get(program).num_views;
    }
    if (!auto_) return;
    const ProgramSources::Entry entry = share_->sources.get(program);
    facts.frag_coord = entry.facts.frag_coord;
    facts.texel_fetch = entry.facts.texel_fetch;
    facts.no_source = !entry.facts.known;
    facts.report = entry.report;
}

// Textures that belong to the framebuffer now bound for drawing: what samples them later reads a picture of the screen.
void Context::note_drawn_textures() {
    if (draw_framebuffer_ == 0) return;
    const auto [entry, fresh] = noted_.try_emplace(draw_framebuffer_, attachments_epoch_);
    if (!fresh && entry->second == attachments_epoch_) return;
    entry->second = attachments_epoch_;
    for (const Attachment& a : read_attachments(GL_DRAW_FRAMEBUFFER))
        if (a.type == GL_TEXTURE) drawn_textures_.insert(a.name);
}

bool Context::samples_drawn_texture(const ProgramFacts& facts) {
    if (drawn_textures_.empty() || facts.samplers_2d.empty()) return false;
    const auto program = static_cast<GLuint>(get_integer(GL_CURRENT_PROGRAM));
    if (program == 0) return false;
    const GLint active = get_integer(GL_ACTIVE_TEXTURE);
    const bool found = std::any_of(facts.samplers_2d.begin(), facts.samplers_2d.end(), [&](GLint location) {
        GLint unit = 0;
        gl.GetUniformiv(program, location, &unit);
        gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
        return drawn_textures_.contains(static_cast<GLuint>(get_integer(GL_TEXTURE_BINDING_2D)));
    });
    gl.ActiveTexture(static_cast<GLenum>(active));
    return found;
}

FullRate Context::find_reason(GLenum mode, GLsizei count) {
    const auto counts = [](FullRate reason) { return (auto_settings().reasons >> static_cast<unsigned>(reason) & 1u) != 0; };
    const ProgramFacts& facts = program_facts();
    if (facts.frag_coord && counts(FullRate::frag_coord)) return FullRate::frag_coord;
    if (facts.texel_fetch && counts(FullRate::texel_fetch)) return FullRate::texel_fetch;
    if (facts.no_source && counts(FullRate::no_source)) return FullRate::no_source;
    if (mode == GL_POINTS && counts(FullRate::points)) return FullRate::points;
    const bool lines = mode == GL_LINES || mode == GL_LINE_STRIP || mode == GL_LINE_LOOP;
    if (lines && counts(FullRate::lines)) return FullRate::lines;
    // Depth that is neither tested nor written is no depth.
    GLboolean writes = GL_FALSE;
    gl.GetBooleanv(GL_DEPTH_WRITEMASK, &writes);
    const bool depth = gl.IsEnabled(GL_DEPTH_TEST) && (writes || get_integer(GL_DEPTH_FUNC) != GL_ALWAYS);
    constexpr GLsizei kQuadVertices = 6;
    const bool quad = !facts.samplers_2d.empty() && count >= 0 && count <= kQuadVertices;
    // Nor is it where a textured quad is drawn by a program that knows of no world: some programs leave the test on for all they draw.
    if (depth && (!quad || facts.matrices)) return FullRate::none;
    if (!depth && gl.IsEnabled(GL_BLEND) && counts(FullRate::blended_2d)) return FullRate::blended_2d;
    if (counts(FullRate::full_screen_pass) && samples_drawn_texture(facts)) return FullRate::full_screen_pass;
    if (quad && counts(FullRate::textured_2d)) return FullRate::textured_2d;
    return FullRate::none;
}

FullRate Context::judge_draw(GLenum mode, GLsizei vertices) {
    const FullRate reason = find_reason(mode, vertices);
    if (ProgramReport* report = program_facts().report)
        count(reason == FullRate::none ? report->foveated : report->full[static_cast<std::size_t>(reason)]);
    // What was recorded up to here is foveated; from here on the frame is at full density.
    if (reason != FullRate::none && recording_ && batch_.drew && !batch_.must_be_native) submit(kCallFullRateDraw);
    return reason;
}

// The parameters of auto mode are known when the frame begins: where they cannot ask for less than full density, or a trial
// found that levels take longer, nothing is recorded, and the frame is the driver's own.
void Context::choose_way() {
    const AutoSettings& s = auto_settings();
    const bool full = s.point.gain_x == 0 && s.point.gain_y == 0;
    const Way way = s.always     ? Way::levels
                    : comparison_ ? comparison_->way()
                    : full || !pay_.levels_now() ? Way::straight
                                                 : Way::levels;
    if (way != way_) target_known_ = false;
    way_ = way;
}

// Depth of a pbuffer outlives the frame; it may still be in the levels.
void Context::enter_straight_frame() {
    straight_frame_ = true;
    Framebuffer* f = find_framebuffer(0);
    if (!f) return;
    if (f->pass.mode == Pass::Mode::levels || f->pass.depth_in_levels) {
        keep_driver_error();
        resolve(f->pass);
        restore_depth(f->pass);
    }
    f->pass.mode = Pass::Mode::none;
}

void Context::note_straight_frame() {
    straight_frame_ = false;
    if (default_shape_.width == 0) (void)surface_size(display_, surface_, default_shape_.width, default_shape_.height);
    const std::uint64_t full = static_cast<std::uint64_t>(default_shape_.width) * static_cast<std::uint64_t>(default_shape_.height);
    frame_planned_ += full;
    frame_full_ += full;
    count(stats.pixels_full, full);
    count(stats.pixels_planned, full);
    count(stats.submissions_native);
    const bool asked_for = auto_settings().point.gain_x == 0 && auto_settings().point.gain_y == 0;
    count(stats.auto_native_by[static_cast<std::size_t>(asked_for ? FullRate::full_density : FullRate::does_not_pay)]);
}

void Context::note_straight_draw(GLenum mode, GLsizei vertices) {
    if (!Stats::asked() || !auto_ || way_ != Way::straight || draw_framebuffer_ != 0 || !active_) return;
    const FullRate reason = find_reason(mode, vertices);
    if (ProgramReport* report = program_facts().report)
        count(reason == FullRate::none ? report->foveated : report->full[static_cast<std::size_t>(reason)]);
}

// By rule: as large as the settings say, with depth, so that it holds the scene and not a shadow or a filter.
bool Context::is_main_offscreen() {
    if (auto_settings().offscreen_least <= 0 || draw_framebuffer_ == 0) return false;
    if (window_frame_ != frame_) {
        window_frame_ = frame_;
        if (!surface_size(display_, surface_, window_width_, window_height_)) window_width_ = window_height_ = 0;
    }
    if (window_width_ == 0) return false;
    MainOffscreen& known = main_offscreen_[draw_framebuffer_];
    if (known.window_width != window_width_ || known.window_height != window_height_ || known.attachments_epoch != attachments_epoch_)
        known = {attachments_epoch_, window_width_, window_height_, find_main_offscreen()};
    return known.yes;
}

bool Context::find_main_offscreen() {
    const double least = auto_settings().offscreen_least;
    const int width = window_width_, height = window_height_;
    bool depth = false, color = false;
    for (Attachment a : read_attachments(GL_DRAW_FRAMEBUFFER)) {
        if (a.point == GL_DEPTH_ATTACHMENT) depth = true;
        if (a.point != GL_COLOR_ATTACHMENT0) continue;
        find_target(a);
        color = a.width >= least * width && a.height >= least * height && a.width * height * 2 >= a.height * width &&
                a.height * width * 2 >= a.width * height;  // and about as wide as it is high, as the surface is
    }
    return depth && color;
}

}  // namespace fovea::layer
