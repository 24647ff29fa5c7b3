// How pending draws reach the driver: natively, or once per level.
#include <algorithm>
#include <utility>

#include "render/layer/context.hpp"
#include "render/layer/trace.hpp"

namespace fovea::layer {
namespace {

// Transform feedback must not capture the layer's own drawing, nor the second run of the program's.
class FeedbackPause {
public:
    explicit FeedbackPause(bool active) : paused_(active && get_integer(GL_TRANSFORM_FEEDBACK_PAUSED) == 0) {
        if (paused_) gl.PauseTransformFeedback();
    }
    ~FeedbackPause() { resume(); }
    FeedbackPause(const FeedbackPause&) = delete;
    FeedbackPause& operator=(const FeedbackPause&) = delete;
    void resume() {
        if (paused_ && !running_) gl.ResumeTransformFeedback();
        running_ = true;
    }
    void pause_again() {
        if (paused_) gl.PauseTransformFeedback();
        running_ = false;
    }

private:
    bool paused_, running_ = false;
};

}  // namespace

// One focal point whose density falls nowhere makes every pixel's density full.
static bool asks_for_everything(const Latched& latched) {
    return latched.count == 0 || std::any_of(latched.points.begin(), latched.points.begin() + latched.count, [](const FocalPoint& p) {
               return p.gain_x == 0 && p.gain_y == 0 && p.fovea_area >= 0;
           });
}

Latched Context::latch() {
    if (target_.kind == DrawTarget::Kind::automatic) {
        if (way_ == Way::recorded) return {.points = {FocalPoint{}}, .count = 1, .min_density = 0};
        (void)size_is_known();
        return focus_.latch(shape_.width, shape_.height);
    }
    if (target_.kind == DrawTarget::Kind::texture) return share_->textures.latch(target_.texture, target_.layer + view_);
    const auto it = framebuffers_.find(draw_framebuffer_);
    return it != framebuffers_.end() && it->second.config ? it->second.config->latch(view_) : Latched{};
}

void Context::submit(Call call) {
    if (!recording_) return;
    recording_ = false;
    t_recording = nullptr;
    keep_driver_error();
    if (lost_) return lose();
    count(stats.submitted_by[static_cast<unsigned>(call)]);
    const Batch batch = batch_;
    if (Framebuffer* f = find_framebuffer(draw_framebuffer_); f && f->has_samples()) {
        load_samples(*f);
        f->samples_dirty = true;
    }
    for (GLuint view = 0; view < target_.views; ++view) {
        batch_ = batch;
        if (target_.views > 1) attach_view(static_cast<GLint>(view));
        submit_view(view, call);
    }
    if (target_.views > 1) attach_view(0);
    view_ = 0;
    make_late_uploads();
    drop_errors();  // the program has had those of its own calls already
    log_.clear();
    undo_.clear();
    drop_kept_buffers();
}

void Context::submit_view(GLuint view, Call call) {
    view_ = view;
    Pass& pass = framebuffers_[draw_framebuffer_].pass_of(view);
    if (pass.frame != frame_) {
        // A pbuffer keeps its depth beyond the frame.
        if (pass.mode == Pass::Mode::levels) pass.depth_in_levels = draw_framebuffer_ == 0;
        pass.mode = Pass::Mode::none;
    }
    pass.frame = frame_;
    native_reason_ = FullRate::none;
    if (Trace::submissions()) (void)size_is_known();
    const bool levels = choose_levels(pass, call);
    if (Trace::submissions()) {
        pass.traced_as = trace_submission(pass, view, call, levels);
        if (levels) trace_before(pass.traced_as);
    }
    if (shape_.width == 0) (void)size_is_known();
    const std::uint64_t full = static_cast<std::uint64_t>(shape_.width) * static_cast<std::uint64_t>(shape_.height);
    if (levels) {
        if (shape_.layered) run_native(true);  // layers after the first get nothing but clears
        run_levels(pass);
        if (batch_.stencil_cleared) pass.cleared_to.stencil = cleared_to_.stencil;
        if (batch_.depth_cleared) pass.cleared_to.depth = cleared_to_.depth;
        pass.mode = Pass::Mode::levels;
        pass.resolved = false;
        count(stats.submissions_levels);
        std::uint64_t planned = 0;
        for (int i = 0; i < pass.plan->settings().level_count; ++i) planned += pass.plan->texels(i) + pass.plan->guard_texels(i);
        count(stats.pixels_planned, planned);
        frame_planned_ += planned;
        levels_now_ = true;
    } else {
        const bool automatic = target_.kind == DrawTarget::Kind::automatic;
        if (pass.mode == Pass::Mode::levels)
            levels_to_native(pass, !automatic || batch_.needs_depth);
        else if (pass.depth_in_levels && batch_.needs_depth)
            restore_depth(pass);
        if (automatic) count(stats.auto_native_by[static_cast<std::size_t>(native_reason_)]);
        run_native();
        if (batch_.depth_cleared) pass.depth_in_levels = false;
        pass.mode = Pass::Mode::native;
        pass.only_cleared = automatic && !batch_.drew && batch_.plain_clears && batch_.color_cleared &&
                            (batch_.depth_cleared || !shape_.has_depth) && (batch_.stencil_cleared || !shape_.has_stencil);
        pass.cleared_to = cleared_to_;
        count(stats.submissions_native);
        count(stats.pixels_planned, full);
        frame_planned_ += full;
    }
    frame_full_ += full;
    count(stats.pixels_full, full);
    pass.submitted_by = call;
}

bool Context::continues(const Pass& pass) const {
    return pass.mode == Pass::Mode::levels && pass.targets && pass.targets->shape() == shape_ &&
           std::equal(pass.attachments.begin(), pass.attachments.end(), attachments_.begin(), attachments_.end(),
                      [](const Attachment& a, const Attachment& b) { return a.same_image(b); });
}

bool Context::choose_levels(Pass& pass, Call call) {
    // In auto mode the focal point of a frame stays once it was used.
    const bool automatic = target_.kind == DrawTarget::Kind::automatic;
    // A clear of the colours alone leaves the depth of a pass in force, for draws that may still come.
    const bool depth_goes_on = pass.mode != Pass::Mode::none && shape_.has_depth && !batch_.depth_cleared;
    const bool keeps_way = depth_goes_on && (pass.mode == Pass::Mode::native || automatic || latch() == pass.latched);
    const bool fresh = batch_.color_cleared && !batch_.needs_depth && !keeps_way;
    if (!fresh && pass.mode != Pass::Mode::none) count(stats.lateness_lost_by[static_cast<unsigned>(pass.submitted_by)]);
    if (fresh) {
        pass.resolved = true;  // whatever the levels hold is cleared away
        pass.mode = Pass::Mode::none;
        pass.depth_in_levels = false;
    }
    if (batch_.must_be_native || target_.kind == DrawTarget::Kind::views) return keep_native(batch_.reason);
    if (shape_.layered && batch_.clear_after_draw) return keep_native(FullRate::cannot_match);  // its order would be lost
    if (automatic && continues(pass)) return true;
    if (automatic && !batch_.color_cleared) return keep_native(FullRate::no_clear);
    const Latched latched = latch();
    if (asks_for_everything(latched) && pass.mode != Pass::Mode::levels) {
        pass.latched = latched;
        return keep_native(FullRate::full_density);
    }
    if (!size_is_known()) return keep_native(FullRate::cannot_match);
    if (continues(pass)) {
        // Depth is known only where the pass has drawn it: a new plan waits for a clear.
        if (latched == pass.latched || batch_.needs_depth) return true;
        resolve(pass);
        return start_levels(pass, latched);
    }
    if (batch_.needs_depth || (pass.mode == Pass::Mode::native && depth_goes_on)) return keep_native(FullRate::keeps_depth);
    const bool ends_frame = call != Call::BindFramebuffer && call != Call::none;
    if (!batch_.drew && (ends_frame || automatic)) return keep_native(FullRate::clears_only);
    return start_levels(pass, latched);
}

bool Context::start_levels(Pass& pass, const Latched& latched) {
    density::PlanSettings settings;
    settings.width_px = shape_.width;
    settings.height_px = shape_.height;
    settings.reading = reading_;
    settings.min_density = latched.min_density;
    const bool same = pass.plan && pass.plan->settings().width_px == shape_.width &&
                      pass.plan->settings().height_px == shape_.height &&
                      pass.plan->settings().min_density == settings.min_density;
    if (!same) {
        auto plan = density::Plan::create(settings);
        if (!plan) return keep_native(FullRate::cannot_match);
        pass.plan.emplace(std::move(*plan));
    }
    const FocalPoint everything_full[1] = {};
    const std::span<const FocalPoint> points =
        latched.count == 0 ? std::span<const FocalPoint>(everything_full) : std::span(latched.points.data(), latched.count);
    const bool moved = pass.plan->update(points) || !same;
    pass.latched = latched;
    bool lower = false;
    for (int i = 1; i < pass.plan->settings().level_count; ++i) lower |= pass.plan->uses(i);
    if (!lower) return keep_native(FullRate::full_density);
    native_reason_ = FullRate::cannot_match;
    if (!batch_.color_cleared && shape_.samples > 0) return false;  // a multisampled image cannot be loaded scaled
    if (!own_.ready()) return false;
    Targets* targets = targets_for(shape_, pass);
    if (!targets) return false;
    if (moved || targets != pass.targets) pass.masks_drawn = false;
    pass.targets = targets;
    pass.attachments = attachments_;
    pass.masked = true;
    pass.top_bit_free = false;  // until a clear says so
    Undo state;
    save_for_own_drawing(state);
    if (!shape_.in_place) targets->attach_level0(attachments_);
    set_for_own_drawing();
    if (!batch_.color_cleared) targets->load_colors(*pass.plan);
    state.restore();
    return true;
}

Targets* Context::targets_for(const TargetShape& shape, Pass& pass) {
    ++use_;
    Kept* oldest = nullptr;
    for (Kept& kept : kept_) {
        if (kept.owner == &pass && kept.targets->shape() == shape) {
            kept.last_use = use_;
            return kept.targets.get();
        }
        if (!oldest || kept.last_use < oldest->last_use) oldest = &kept;
    }
    // Images of a pass that is over serve the next one; so do the oldest of all when there are many.
    Kept* take = nullptr;
    for (Kept& kept : kept_)
        if (kept.targets->shape() == shape && (!kept.owner || kept.owner->mode != Pass::Mode::levels || kept.owner->frame != frame_)) take = &kept;
    if (!take && kept_.size() >= kKeptTargets) take = oldest;
    if (take && take->owner) take->owner->targets = nullptr, take->owner->mode = Pass::Mode::none, take->owner->masks_drawn = false;
    if (take && !(take->targets->shape() == shape)) {
        kept_.erase(kept_.begin() + (take - kept_.data()));
        take = nullptr;
    }
    if (!take) {
        std::unique_ptr<Targets> made = make_targets(shape);
        if (!made) return nullptr;
        take = &kept_.emplace_back(Kept{std::move(made), 0, nullptr});
    }
    take->owner = &pass;
    take->last_use = use_;
    return take->targets.get();
}

std::unique_ptr<Targets> Context::make_targets(const TargetShape& shape, bool* out_of_memory) {
    const auto room = [&] {
        std::uint64_t used = Targets::bytes(shape) + sample_bytes();
        for (const Kept& kept : kept_)
            if (kept.targets) used += Targets::bytes(kept.targets->shape());
        return used <= memory_limit_;
    };
    // Images of passes that are over make room.
    while (!room()) {
        const auto old = std::find_if(kept_.begin(), kept_.end(), [this](const Kept& k) {
            return k.targets && (!k.owner || k.owner->mode != Pass::Mode::levels || k.owner->frame != frame_);
        });
        if (old == kept_.end()) {
            if (out_of_memory) *out_of_memory = true;
            return nullptr;
        }
        if (old->owner) old->owner->targets = nullptr, old->owner->mode = Pass::Mode::none, old->owner->masks_drawn = false;
        kept_.erase(old);
    }
    return Targets::create(shape, kLevels, out_of_memory);
}

Context::Reserved Context::reserve(GLuint framebuffer) {
    keep_driver_error();
    Undo state;
    state.framebuffers();
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    TargetShape shape;
    if (gl.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) {
        std::vector<Attachment> attachments = read_attachments(GL_DRAW_FRAMEBUFFER);
        shape = read_shape(attachments);
    }
    state.restore();
    drop_errors();
    if (shape.unknown_format) return Reserved::never;
    if (!shape.usable) return Reserved::yes;  // attachments come later
    const auto is_free = [&](const Kept& k) {
        return k.targets->shape() == shape && (!k.owner || k.owner->mode != Pass::Mode::levels || k.owner->frame != frame_);
    };
    auto have = static_cast<std::size_t>(std::count_if(kept_.begin(), kept_.end(), is_free));
    for (const GLuint views = views_of(framebuffer); have < views && kept_.size() < kKeptTargets; ++have) {
        bool out_of_memory = false;
        std::unique_ptr<Targets> made = make_targets(shape, &out_of_memory);
        if (!made) return out_of_memory ? Reserved::no_memory : Reserved::never;
        kept_.push_back({std::move(made), ++use_, nullptr});
    }
    return Reserved::yes;
}

void Context::save_for_own_drawing(Undo& own) const {
    if (per_draw_buffer_) own.per_draw_buffer();
    own.framebuffers();
    own.viewport();
    own.scissor();
    own.stencil();
    own.color_mask();
    own.depth();
    own.clear_values();
    own.program();
    own.vertex_array(0);
    own.buffer(GL_ARRAY_BUFFER, 0);
    own.active_texture(0);
    gl.ActiveTexture(GL_TEXTURE0);
    own.texture(GL_TEXTURE_2D, 0);
    own.sampler(0, 0);
    for (const GLenum cap : {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_RASTERIZER_DISCARD,
                             GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE, GL_SAMPLE_MASK, GL_DITHER, GL_POLYGON_OFFSET_FILL})
        own.cap(cap);
}

void Context::set_for_own_drawing() const {
    for (const GLenum cap : {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_RASTERIZER_DISCARD,
                             GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE, GL_SAMPLE_MASK, GL_DITHER, GL_POLYGON_OFFSET_FILL})
        gl.Disable(cap);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindSampler(0, 0);
}

void Context::run_native(bool clears_only) {
    FeedbackPause feedback(feedback_);
    undo_.restore();
    if (!clears_only) feedback.resume();
    Replay replay;
    LevelView as_it_is;
    as_it_is.clears_only = clears_only;
    if (target_.views > 1) as_it_is.view = static_cast<int>(view_);
    replay.begin(as_it_is);
    log_.run(replay);
}

void Context::run_levels(Pass& pass) {
    FeedbackPause feedback(feedback_);
    std::vector<GLenum> draw_buffers;
    for (GLenum i = 0; i < static_cast<GLenum>(std::min(get_integer(GL_MAX_DRAW_BUFFERS), static_cast<GLint>(kMaxColors))); ++i)
        draw_buffers.push_back(static_cast<GLenum>(get_integer(GL_DRAW_BUFFER0 + i)));
    if (shape_.in_place) draw_buffers = {GL_COLOR_ATTACHMENT0};
    Undo own;
    save_for_own_drawing(own);
    if (batch_.stencil_cleared) pass.top_bit_free = true;
    if (batch_.stencil_top_bit) pass.top_bit_free = false;
    if (batch_.uses_stencil && !pass.top_bit_free) pass.masked = false;
    if (pass.masked && !pass.masks_drawn) {
        set_for_own_drawing();
        pass.targets->draw_masks(own_, *pass.plan);
        pass.masks_drawn = true;
    } else if (!pass.masked && pass.masks_drawn) {
        set_for_own_drawing();
        pass.targets->clear_masks(*pass.plan, pass.cleared_to.stencil);
        pass.masks_drawn = false;
    }
    own.restore();
    if (batch_.inherits_clear) {  // level 0 is the framebuffer itself, and has been cleared, or follows here
        set_for_own_drawing();
        gl.ClearColor(cleared_to_.color[0], cleared_to_.color[1], cleared_to_.color[2], cleared_to_.color[3]);
        gl.ClearDepthf(cleared_to_.depth);
        gl.ClearStencil(cleared_to_.stencil);
        gl.DepthMask(GL_TRUE);
        gl.StencilMask(pass.masked ? ~kMaskBit : ~0u);
        for (int level = shape_.in_place ? 1 : 0; level < pass.plan->settings().level_count; ++level) {
            if (!pass.plan->uses(level)) continue;
            pass.targets->bind_for_drawing(level, draw_buffers);
            gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
        }
        own.restore();
        batch_.inherits_clear = false;
    }
    Undo seen;  // the program's viewport, scissor and stencil, which each level turns into its own
    seen.viewport();
    seen.scissor();
    seen.stencil();
    seen.cap(GL_SCISSOR_TEST);
    seen.cap(GL_STENCIL_TEST);
    bool first = true;
    Replay replay;
    for (int level = 0; level < pass.plan->settings().level_count; ++level) {
        if (!pass.plan->uses(level)) continue;
        const auto& scale = pass.plan->settings().levels[static_cast<std::size_t>(level)];
        density::PixelRect bounds = pass.plan->pixels(pass.plan->bounds(level));
        if (level > 0) {
            const int x = 1 << scale.x_shift, y = 1 << scale.y_shift;
            bounds = {std::max(0, bounds.x0 - x), std::max(0, bounds.y0 - y), bounds.x1 + x, bounds.y1 + y};
        }
        seen.restore();
        undo_.restore();
        pass.targets->bind_for_drawing(level, draw_buffers);
        if (first) feedback.resume();
        replay.begin({.native = false, .view = target_.views > 1 ? static_cast<int>(view_) : -1, .x_shift = scale.x_shift, .y_shift = scale.y_shift, .bounds = bounds,
                      .masked = pass.masked && !(shape_.in_place && level == 0), .float_viewport = float_viewport_});
        log_.run(replay);
        if (first) feedback.pause_again();
        first = false;
    }
    own.restore();
}

void Context::resolve(Pass& pass) {
    if (pass.mode != Pass::Mode::levels || pass.resolved || !pass.targets) return;
    keep_driver_error();
    const FeedbackPause feedback(feedback_);
    Undo own;
    save_for_own_drawing(own);
    set_for_own_drawing();
    pass.targets->resolve_colors(own_, *pass.plan);
    if (pass.traced_as != 0)
        if (Trace* trace = Trace::submissions()) {
            const TargetShape& shape = pass.targets->shape();
            trace->picture(pass.traced_as, "after", shape.width, shape.height, pass.targets->read_color());
            pass.traced_as = 0;
        }
    own.restore();
    pass.resolved = true;
    drop_errors();
}

void Context::levels_to_native(Pass& pass, bool depth) {
    resolve(pass);
    if (depth)
        restore_depth(pass);
    else
        pass.depth_in_levels = true;
}

void Context::restore_depth(Pass& pass) {
    pass.depth_in_levels = false;
    if (!pass.targets) return;
    const FeedbackPause feedback(feedback_);
    Undo own;
    save_for_own_drawing(own);
    set_for_own_drawing();
    const bool depth = pass.targets->resolve_depth(own_, *pass.plan, draw_framebuffer_);
    const bool stencil = pass.targets->resolve_stencil(own_, *pass.plan, draw_framebuffer_, pass.masked, pass.cleared_to.stencil);
    // What cannot be read is discarded, as the specifications allow: it holds what it was cleared to, and nothing older.
    const TargetShape& shape = pass.targets->shape();
    const GLbitfield lost = (shape.has_depth && !depth ? GL_DEPTH_BUFFER_BIT : 0u) | (shape.has_stencil && !stencil ? GL_STENCIL_BUFFER_BIT : 0u);
    if (lost != 0 && !shape.in_place) {
        gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, draw_framebuffer_);
        gl.DepthMask(GL_TRUE);
        gl.StencilMask(~0u);
        gl.ClearDepthf(pass.cleared_to.depth);
        gl.ClearStencil(pass.cleared_to.stencil);
        gl.Clear(lost);
    }
    own.restore();
    drop_errors();
}

void Context::leave_levels(Call call) {
    if (recording_) batch_.must_be_native = true;
    submit(call);
    Framebuffer* f = find_framebuffer(draw_framebuffer_);
    if (!f) return;
    for (GLuint view = 0; view <= f->more.size(); ++view) {
        Pass& pass = f->pass_of(view);
        if (pass.mode != Pass::Mode::levels || pass.frame != frame_) continue;
        keep_driver_error();
        if (!f->views.empty()) attach_view(static_cast<GLint>(view));
        levels_to_native(pass, true);
        pass.mode = Pass::Mode::native;
    }
    if (!f->views.empty()) attach_view(0);
}

void Context::frame_ended(Call call) {
    before_finish(call);
    share_->dead.bury();
    ++frame_;
    frame_levels_ = std::exchange(levels_now_, false);
    if (auto_) {
        if (straight_frame_) note_straight_frame();
        focus_.frame_ended(frame_planned_, frame_full_);
        if (!auto_settings().always) {
            const FrameClocks clocks = read_frame_clocks();
            comparison_ ? comparison_->frame_ended(clocks.now_ns, clocks.processor_ns) : pay_.frame_ended(clocks.now_ns, clocks.processor_ns);
        }
        choose_way();
    }
    frame_planned_ = frame_full_ = 0;
    stats.write_once_a_second();
    if (Trace* trace = Trace::submissions()) trace->frame_ended();
    count(stats.frames);
}

}  // namespace fovea::layer
