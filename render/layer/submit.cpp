// How pending draws reach the driver: natively, or once per level.
#include <algorithm>

#include "render/layer/context.hpp"

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

Latched Context::latch() const {
    if (target_.kind == DrawTarget::Kind::texture) return textures_->latch(target_.texture, target_.layer);
    const auto it = framebuffers_.find(draw_framebuffer_);
    return it != framebuffers_.end() && it->second.config ? it->second.config->latch(0) : Latched{};
}

void Context::submit(Call call) {
    if (!recording_) return;
    recording_ = false;
    keep_driver_error();
    count(stats.submitted_by[static_cast<unsigned>(call)]);
    Pass& pass = framebuffers_[draw_framebuffer_].pass;
    if (pass.frame != frame_) pass.mode = Pass::Mode::none;
    pass.frame = frame_;
    const std::uint64_t full = static_cast<std::uint64_t>(shape_.width) * static_cast<std::uint64_t>(shape_.height);
    if (choose_levels(pass, call)) {
        run_levels(pass);
        pass.mode = Pass::Mode::levels;
        pass.resolved = false;
        count(stats.submissions_levels);
        std::uint64_t planned = 0;
        for (int i = 0; i < pass.plan->settings().level_count; ++i) planned += pass.plan->texels(i) + pass.plan->guard_texels(i);
        count(stats.pixels_planned, planned);
    } else {
        if (pass.mode == Pass::Mode::levels) levels_to_native(pass);
        run_native();
        pass.mode = Pass::Mode::native;
        count(stats.submissions_native);
        count(stats.pixels_planned, full);
    }
    count(stats.pixels_full, full);
    pass.submitted_by = call;
    drop_errors();  // the program has had those of its own calls already
    log_.clear();
    undo_.clear();
    drop_kept_buffers();
}

bool Context::continues(const Pass& pass) const {
    return pass.mode == Pass::Mode::levels && pass.targets && pass.targets->shape() == shape_ &&
           std::equal(pass.attachments.begin(), pass.attachments.end(), attachments_.begin(), attachments_.end(),
                      [](const Attachment& a, const Attachment& b) { return a.same_image(b); });
}

bool Context::choose_levels(Pass& pass, Call call) {
    // A clear of the colours alone leaves the depth of a pass in force, for draws that may still come.
    const bool depth_goes_on = pass.mode != Pass::Mode::none && shape_.has_depth && !batch_.depth_cleared;
    const bool keeps_way = depth_goes_on && (pass.mode == Pass::Mode::native || latch() == pass.latched);
    const bool fresh = batch_.color_cleared && !batch_.needs_depth && !keeps_way;
    if (!fresh && pass.mode != Pass::Mode::none) count(stats.lateness_lost_by[static_cast<unsigned>(pass.submitted_by)]);
    if (fresh) {
        pass.resolved = true;  // whatever the levels hold is cleared away
        pass.mode = Pass::Mode::none;
    }
    if (batch_.must_be_native) return false;
    const Latched latched = latch();
    if (continues(pass)) {
        // Depth is known only where the pass has drawn it: a new plan waits for a clear.
        if (latched == pass.latched || batch_.needs_depth) return true;
        resolve(pass);
        return start_levels(pass, latched);
    }
    if (batch_.needs_depth || (pass.mode == Pass::Mode::native && depth_goes_on)) return false;
    const bool ends_frame = call != Call::BindFramebuffer && call != Call::none;
    if (!batch_.drew && ends_frame) return false;  // clears only
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
        if (!plan) return false;
        pass.plan.emplace(std::move(*plan));
    }
    const FocalPoint everything_full[1] = {};
    const std::span<const FocalPoint> points =
        latched.count == 0 ? std::span<const FocalPoint>(everything_full) : std::span(latched.points.data(), latched.count);
    const bool moved = pass.plan->update(points) || !same;
    pass.latched = latched;
    bool lower = false;
    for (int i = 1; i < pass.plan->settings().level_count; ++i) lower |= pass.plan->uses(i);
    if (!lower) return false;
    if (!batch_.color_cleared && shape_.samples > 0) return false;  // a multisampled image cannot be loaded scaled
    if (!own_.ready()) return false;
    Targets* targets = targets_for(shape_, pass);
    if (!targets) return false;
    if (moved || targets != pass.targets) pass.masks_drawn = false;
    pass.targets = targets;
    pass.attachments = attachments_;
    pass.masked = true;
    Undo state;
    save_for_own_drawing(state);
    targets->attach_level0(attachments_);
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
    if (take) {
        if (take->owner) take->owner->targets = nullptr, take->owner->mode = Pass::Mode::none, take->owner->masks_drawn = false;
        if (!(take->targets->shape() == shape)) take->targets = Targets::create(shape, 3);
        if (!take->targets) {
            kept_.erase(kept_.begin() + (take - kept_.data()));
            return nullptr;
        }
    } else {
        std::unique_ptr<Targets> made = Targets::create(shape, 3);
        if (!made) return nullptr;
        take = &kept_.emplace_back(Kept{std::move(made), 0, nullptr});
    }
    take->owner = &pass;
    take->last_use = use_;
    return take->targets.get();
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

void Context::run_native() {
    FeedbackPause feedback(feedback_);
    undo_.restore();
    feedback.resume();
    Replay replay;
    replay.begin({});
    log_.run(replay);
}

void Context::run_levels(Pass& pass) {
    FeedbackPause feedback(feedback_);
    std::vector<GLenum> draw_buffers;
    for (GLenum i = 0; i < static_cast<GLenum>(std::min(get_integer(GL_MAX_DRAW_BUFFERS), static_cast<GLint>(kMaxColors))); ++i)
        draw_buffers.push_back(static_cast<GLenum>(get_integer(GL_DRAW_BUFFER0 + i)));
    Undo own;
    save_for_own_drawing(own);
    if (batch_.uses_stencil) pass.masked = false;
    if (pass.masked && !pass.masks_drawn) {
        set_for_own_drawing();
        pass.targets->draw_masks(own_, *pass.plan);
        pass.masks_drawn = true;
    } else if (!pass.masked && pass.masks_drawn) {
        set_for_own_drawing();
        pass.targets->clear_masks(*pass.plan);
        pass.masks_drawn = false;
    }
    own.restore();
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
        replay.begin({.native = false, .x_shift = scale.x_shift, .y_shift = scale.y_shift, .bounds = bounds,
                      .masked = pass.masked, .float_viewport = float_viewport_});
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
    own.restore();
    pass.resolved = true;
    drop_errors();
}

void Context::levels_to_native(Pass& pass) {
    resolve(pass);
    if (!pass.targets) return;
    const FeedbackPause feedback(feedback_);
    Undo own;
    save_for_own_drawing(own);
    set_for_own_drawing();
    pass.targets->resolve_depth(own_, *pass.plan, draw_framebuffer_);
    own.restore();
    drop_errors();
}

void Context::leave_levels(Call call) {
    if (recording_) batch_.must_be_native = true;
    submit(call);
    if (Framebuffer* f = find_framebuffer(draw_framebuffer_); f && f->pass.mode == Pass::Mode::levels && f->pass.frame == frame_) {
        keep_driver_error();
        levels_to_native(f->pass);
        f->pass.mode = Pass::Mode::native;
    }
}

void Context::frame_ended(Call call) {
    before_finish(call);
    ++frame_;
    count(stats.frames);
}

}  // namespace fovea::layer
