// One GL context of the program, as the layer sees it: what is bound for drawing, what has been recorded, what was
// submitted, and the error that the program has yet to fetch.
//
// Life of a pass (the drawing into one foveated framebuffer between two clears or frames):
//
//   nothing --first draw--> recording --submit--> submitted (levels hold colour and depth) --resolve--> resolved
//      ^                        ^  |                  |                                              |
//      |                        |  +-- more draws ----+---- more draws: recording again -------------+
//      +------------------- frame ends, or the first call clears everything: a new plan -------------+
//
// Threads: a context is used by the thread that it is current on. ShareGroup state locks itself.
// Errors: those of the extensions, through the program's glGetError. Nothing else fails: what cannot be foveated is drawn
// at full density.
#pragma once

#include <array>
#include <climits>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "layer_gl.hpp"
#include "render/density/plan.hpp"
#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/layer/command_log.hpp"
#include "render/layer/auto_mode.hpp"
#include "render/layer/comparison.hpp"
#include "render/layer/entry_points.hpp"
#include "render/layer/foveation_state.hpp"
#include "render/layer/pay_test.hpp"
#include "render/layer/share_group.hpp"
#include "render/layer/stats.hpp"
#include "render/layer/targets.hpp"
#include "render/layer/undo.hpp"

namespace fovea::layer {

// What the driver supports itself is left to it.
struct NativeExtensions {
    bool multiview = false;
    bool framebuffer_foveated = false, texture_foveated = false, frame_extrapolation = false;
};

struct ProgramFacts {
    bool geometry_or_tessellation = false;
    bool side_effects = false;  // writes buffers, images or counters
    int num_views = 0;
    std::vector<std::pair<GLuint, GLint>> view_uniforms;  // program, location
    std::optional<std::vector<GLuint>> attributes;  // locations that its vertex shader reads; nullopt: not known
    // Auto mode only.
    bool frag_coord = false, texel_fetch = false, no_source = false;
    bool matrices = false;  // among its uniforms: it places what it draws in a world
    std::vector<GLint> samplers_2d;  // locations
    ProgramReport* report = nullptr;
};

// What glClear cleared a framebuffer to.
struct ClearValues {
    std::array<GLfloat, 4> color{};
    GLfloat depth = 1;
    GLint stencil = 0;
};

struct Pass {
    enum class Mode { none, native, levels };
    Mode mode = Mode::none;
    std::optional<density::Plan> plan;
    Latched latched;
    Targets* targets = nullptr;    // in Context::kept_; nullptr: lost to another pass
    std::uint64_t targets_use = 0;
    std::vector<Attachment> attachments;
    bool resolved = true;
    bool masked = true;
    bool top_bit_free = false;     // the program's stencil values in the levels are below 0x80
    bool masks_drawn = false;
    bool only_cleared = false;     // mode native, and nothing but clears so far: auto mode can still go to levels
    ClearValues cleared_to;
    int traced_as = 0;             // the submission whose "after" picture the next resolve takes
    bool depth_in_levels = false;  // mode native, but depth of the frame is still in the levels only
    Call submitted_by = Call::none;
    std::uint64_t frame = 0;  // Context::frame_ of the last submission
};

// An attachment point with several views: layers base to base + views - 1 of an array.
struct ViewAttachment {
    GLuint texture = 0;
    GLint level = 0, base = 0, views = 0;
    // Multisampled (view_samples.cpp): as many as asked for, and the renderbuffer of each view.
    GLsizei samples = 0;
    GLint actual_samples = 0;
    std::vector<GLuint> images;
    GLenum format = 0;
    GLint width = 0, height = 0;  // of the images
    bool stale = false;           // the array was written since
    [[nodiscard]] bool same_as(const ViewAttachment& o) const noexcept {
        return texture == o.texture && level == o.level && base == o.base && views == o.views && samples == o.samples;
    }
};

struct Framebuffer {
    std::optional<FramebufferFoveation> config;
    Pass pass;                               // of the first view
    std::deque<Pass> more;                   // of the others, when they are foveated
    std::map<GLenum, ViewAttachment> views;  // by attachment point; empty: not multiview
    bool samples_dirty = false;              // drawn to since they were resolved
    [[nodiscard]] bool has_samples() const noexcept;
    [[nodiscard]] ViewAttachment& samples_of(GLenum point);  // whose images the point has
    [[nodiscard]] Pass& pass_of(GLuint view) {
        if (view == 0) return pass;
        if (more.size() < view) more.resize(view);
        return more[view - 1];
    }
    template <class Function>
    void each_pass(Function function) {
        function(pass);
        for (Pass& p : more) function(p);
    }
};

// A glBufferSubData that is put off; the data lies in the log.
struct LateUpload {
    GLuint buffer = 0;
    GLintptr offset = 0;
    GLsizeiptr size = 0;
    const std::byte* data = nullptr;
};

// Of a texture that is written.
struct MipLevels {
    GLint first = 0, last = INT_MAX;
    [[nodiscard]] bool has(GLint level) const noexcept { return level >= first && level <= last; }
};

// What drawing to the framebuffer bound for drawing means.
struct DrawTarget {
    enum class Kind { plain, framebuffer, texture, incomplete, automatic, views };
    Kind kind = Kind::plain;
    GLuint texture = 0, layer = 0;  // Kind::texture; layer of the first view
    GLuint views = 1;
};

class Context {
public:
    explicit Context(std::shared_ptr<ShareGroup> share) : share_(std::move(share)) {}
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    // Reads what the driver is, the first time. The surface is the one to draw to, or EGL_NO_SURFACE.
    void made_current(EGLDisplay display, EGLSurface surface);
    void release_images();               // current, nothing pending: level images are given back
    void abandon();                      // the driver's context is gone
    void lose();                         // the driver's context is there, but everything in it is dead
    [[nodiscard]] GLenum reset_status(GLenum status);  // as the driver gave it to the program
    bool to_be_destroyed = false;        // eglDestroyContext came while it was current

    [[nodiscard]] bool active() const noexcept { return active_; }
    // The layer answers glExtrapolateTex2DQCOM. Below OpenGL ES 3.1 it does nothing else: such a context is not active.
    [[nodiscard]] bool extrapolates() const noexcept { return extrapolates_; }
    // Draws may concern the layer: foveated targets, auto mode, programs of several views.
    [[nodiscard]] bool watches_draws() const noexcept { return is_engaged() || share_->sources.any_multiview(); }
    [[nodiscard]] bool is_engaged() const noexcept { return auto_ || !framebuffers_.empty() || share_->textures.epoch() != 0; }
    [[nodiscard]] Undo& undo() noexcept { return undo_; }
    [[nodiscard]] CommandLog& log() noexcept { return log_; }
    [[nodiscard]] TextureFoveations& textures() noexcept { return share_->textures; }
    [[nodiscard]] ProgramSources& sources() noexcept { return share_->sources; }
    [[nodiscard]] const NativeExtensions& native() const noexcept { return native_; }
    [[nodiscard]] GLint version() const noexcept { return version_; }

    // Errors. A context has one error flag: the first error stays until glGetError.
    void raise(GLenum error);
    void keep_driver_error();
    [[nodiscard]] bool has_error() const noexcept { return error_ != GL_NO_ERROR; }
    [[nodiscard]] GLenum take_error();

    // Policies of calls.txt.
    // A clear uses nothing that the calls of this policy change: it may stay pending.
    void before_submit(Call call) { if (recording_ && batch_.drew) submit(call); }
    void before_forget(Call call) { if (recording_ && (batch_.drew || !undo_.empty())) submit(call); }
    void before_finish(Call call);
    void before_attach(Call call) { before_finish(call); }
    void before_remove(Call call) { before_finish(call); }
    void before_upload(Call call, GLenum target);
    void before_indexed(Call call);

    // Drawing. drawing_target() is plain where the layer has nothing to do.
    [[nodiscard]] const DrawTarget& drawing_target();
    enum class Op { draw, clear };
    bool allowed(Op op);  // raises the error of the extensions, if there is one
    // True when the call may be recorded: no error of the extension or of the driver (which `probe` asks).
    // `mode` and `count` (vertices; -1: not known) tell auto mode what kind of draw it is.
    template <class Probe>
    [[nodiscard]] bool begin(Op op, Probe probe, GLenum mode = GL_TRIANGLES, GLsizei count = -1) {
        if (!allowed(op)) return false;
        keep_driver_error();
        if (op == Op::draw && !late_uploads_.empty()) record_late_uploads();
        probe();
        if (const GLenum error = driver_error(); error != GL_NO_ERROR) return raise(error), false;
        if (lost_) return lose(), false;
        const FullRate full = op == Op::draw && target_.kind == DrawTarget::Kind::automatic ? judge_draw(mode, count) : FullRate::none;
        open();
        if (full != FullRate::none) batch_.must_be_native = true, batch_.reason = full;
        if (op == Op::draw) note_draw();
        return true;
    }
    // The error of the extension for a call that writes to the framebuffer bound for drawing, if there is one.
    [[nodiscard]] GLenum write_error();
    // color: the draw buffer that is cleared alone; -1: none alone.
    void note_clear(GLbitfield buffers, GLint color = -1, bool plain = false);
    void end() { if (log_.bytes() > kLogLimit) submit(kCallLogFull); }
    void submit(Call call);
    void frame_ended(Call call);
    void leave_levels(Call call);  // what is drawn next must be at full density
    void invalidate_pass();        // the image was written by other means: the levels no longer match it
    [[nodiscard]] const ProgramFacts& program_facts();
    void forget_program(GLuint program) { facts_.erase(program); }
    // False: no draw so far used it, and linking it changes none that is pending.
    [[nodiscard]] bool may_use_program(GLuint program) const { return facts_.contains(program) || get_integer(GL_PROGRAM_PIPELINE_BINDING) != 0; }

    // Framebuffer objects.
    void bound_framebuffer(GLenum target, GLuint name);
    void removed_framebuffer(GLuint name);
    void attachments_may_have_changed() noexcept { ++attachments_epoch_; }
    void check_configured_attachments();
    [[nodiscard]] Framebuffer* find_framebuffer(GLuint name);
    [[nodiscard]] Framebuffer& framebuffer(GLuint name) {
        engage();
        return framebuffers_[name];
    }
    [[nodiscard]] GLuint draw_framebuffer() const noexcept { return draw_framebuffer_; }
    [[nodiscard]] GLuint read_framebuffer() const noexcept { return read_framebuffer_; }
    [[nodiscard]] GLenum foveation_status(GLenum framebuffer_target);
    // A texture or renderbuffer is written by other means than drawing into it; by_framebuffer: by a draw to that one,
    // whose own passes go on.
    void image_written(GLuint name, const MipLevels& levels = {}, GLuint by_framebuffer = 0);
    void mipmaps_written(GLenum target);              // of the texture bound there
    void storing_images(GLuint by_framebuffer = 0);   // image_written() of all that shaders may write now
    void before_stores();                             // a draw follows: the same, if its program stores anything

    // Makes the images that a foveated framebuffer will need, as far as its attachments are known.
    enum class Reserved { yes, no_memory, never };  // never: its images cannot be foveated
    [[nodiscard]] Reserved reserve(GLuint framebuffer);

    // GL_INVALID_FRAMEBUFFER_OPERATION when the framebuffer to be read is incomplete by the rules of the extensions.
    [[nodiscard]] GLenum read_error();
    // A program in use that is deleted lives until another is used, but the layer uses its own in between: deletion
    // is put off. False: delete it now.
    [[nodiscard]] bool put_off_deletion(GLuint program);

    // Uploads: a buffer of the layer that holds a part of the program's as it is now, until the next submission is over.
    [[nodiscard]] bool has_draws() const noexcept { return batch_.drew; }
    [[nodiscard]] GLuint keep_buffer(GLuint buffer, GLintptr offset, GLsizeiptr size);
    void put_off(const LateUpload& upload) { late_uploads_.push_back(upload); }
    void record_late_uploads();  // a draw follows: each level's run begins before them
    [[nodiscard]] bool buffer_storage() const noexcept { return buffer_storage_; }

    // Made by the first extrapolation.
    [[nodiscard]] std::unique_ptr<render::extrapolation::GlExtrapolator>& extrapolator() noexcept { return extrapolator_; }

    // Vertex arrays that hold deleted buffers (vertex_arrays.cpp).
    [[nodiscard]] std::unordered_set<GLuint>& vertex_arrays() noexcept { return vertex_arrays_; }
    void deleting_buffers(GLsizei count, const GLuint* names);
    [[nodiscard]] bool keeps_deleted(GLuint attribute);  // of the array that is bound
    [[nodiscard]] bool keeps_deleted_indices();
    [[nodiscard]] bool is_recording() const noexcept { return recording_; }

    // Multiview (multiview.cpp).
    [[nodiscard]] GLuint views_of(GLuint framebuffer) const;
    [[nodiscard]] GLenum view_status(GLenum framebuffer_target);  // COMPLETE, or what the extension says
    [[nodiscard]] GLenum view_error();  // of a draw with the program in use to the framebuffer bound for drawing
    void forget_views(GLenum target, GLenum attachment);
    void set_view(GLint view);
    // Runs a call that is not recorded once per view of the framebuffer bound for drawing.
    template <class DriverCall>
    void for_each_view(DriverCall call) {
        const auto views = static_cast<GLint>(views_of(draw_framebuffer_));
        if (views <= 1) return call();
        for (GLint view = 0; view < views; ++view) {
            attach_view(view);
            set_view(view);
            call();
        }
        attach_view(0);
    }
    void note_link(GLuint program);
    // Views of several samples (view_samples.cpp).
    [[nodiscard]] bool may_have_samples(GLuint texture, GLint level, GLsizei samples);
    void make_samples(Framebuffer& f, GLenum target);  // f is bound to that target
    void forget_deleted_views(GLuint texture);
    [[nodiscard]] std::vector<Attachment> program_attachments(GLenum framebuffer_target, GLuint bound) const;  // as the program made them
    [[nodiscard]] std::vector<Attachment> program_attachments(GLenum framebuffer_target) const {
        return program_attachments(framebuffer_target, framebuffer_target == GL_READ_FRAMEBUFFER ? read_framebuffer_ : draw_framebuffer_);
    }
    [[nodiscard]] bool read_from_layer();  // true: until read_from_program()
    void read_from_program();

    // Auto mode.
    [[nodiscard]] bool automatic() const noexcept { return auto_; }
    [[nodiscard]] bool frame_is_foveated() const noexcept { return frame_levels_; }  // the one that frame_ended() ended
    void note_straight_draw(GLenum mode, GLsizei count);  // of a draw that goes straight to the driver
    void forget_drawn_texture(GLuint texture) { drawn_textures_.erase(texture); }

    // Queries and transform feedback.
    void begin_query(GLenum target, Call call);
    void end_query(GLenum target, Call call);
    void begin_feedback() noexcept { feedback_ = true; }
    void end_feedback() noexcept { feedback_ = false; }
    [[nodiscard]] bool captures() const noexcept { return feedback_; }

    static constexpr std::size_t kLogLimit = std::size_t{64} << 20;

private:
    void open();
    bool size_is_known();  // asks for the default framebuffer's; false: it is not usable
    void note_draw();
    struct Batch {
        bool drew = false, color_cleared = false, depth_cleared = false, stencil_cleared = false;
        bool needs_depth = false;  // or stencil, of before the batch
        bool uses_stencil = false, must_be_native = false;
        bool stencil_top_bit = false;  // a draw or clear reads or writes it: the mask must go
        FullRate reason = FullRate::none;  // of must_be_native
        bool inherits_clear = false;       // what this batch begins with was cleared before it, natively
        bool plain_clears = true;          // every clear was a glClear
        bool clear_after_draw = false;
    };
    [[nodiscard]] Latched latch();
    [[nodiscard]] bool choose_levels(Pass& pass, Call call);
    [[nodiscard]] bool start_levels(Pass& pass, const Latched& latched);
    [[nodiscard]] bool continues(const Pass& pass) const;
    // Traces for bug reports (trace.cpp).
    int trace_submission(const Pass& pass, GLuint view, Call call, bool levels);
    void trace_before(int submission);
    [[nodiscard]] GLenum first_color() const;
    void submit_view(GLuint view, Call call);
    void attach_view(GLint view);
    void drop_samples(ViewAttachment& a);
    [[nodiscard]] std::uint64_t sample_bytes() const;  // of the samples of all views, about
    void bind_view_samples(GLenum samples_target, GLenum layer_target, GLenum point, ViewAttachment& a, GLint view);
    void unbind_view_samples(GLenum samples_target, GLenum layer_target, GLenum point);
    void resolve_samples(Framebuffer& f);
    void load_samples(Framebuffer& f);
    void load_samples(GLenum point, ViewAttachment& a);
    void samples_overwritten(GLuint texture, GLuint by_framebuffer = 0, const MipLevels& levels = {});
    [[nodiscard]] bool keeps_images_beside(GLuint framebuffer);  // levels or samples, of other framebuffers, in this frame
    void note_shared_samples();  // the framebuffer bound for drawing has an array that another draws with samples
    void run_native(bool clears_only = false);
    [[nodiscard]] std::unique_ptr<Targets> make_targets(const TargetShape& shape, bool* out_of_memory = nullptr);  // within the limit
    void run_levels(Pass& pass);
    void resolve(Pass& pass);
    void levels_to_native(Pass& pass, bool depth);
    void restore_depth(Pass& pass);
    // Auto mode (auto_draws.cpp).
    [[nodiscard]] FullRate judge_draw(GLenum mode, GLsizei count);  // submits what is pending when this draw ends the levels
    [[nodiscard]] FullRate find_reason(GLenum mode, GLsizei count);
    [[nodiscard]] bool samples_drawn_texture(const ProgramFacts& facts);
    [[nodiscard]] bool is_main_offscreen();
    [[nodiscard]] bool find_main_offscreen();
    void note_drawn_textures();
    void add_source_facts(ProgramFacts& facts, GLuint program);
    void choose_way();          // of the frame that begins
    void enter_straight_frame();
    void note_straight_frame();
    bool keep_native(FullRate reason) noexcept { native_reason_ = reason; return false; }
    [[nodiscard]] Targets* targets_for(const TargetShape& shape, Pass& pass);
    void save_for_own_drawing(Undo& own) const;
    void drop_kept_buffers();
    void make_late_uploads();  // the draws before them have run
    void set_for_own_drawing() const;
    [[nodiscard]] static ProgramFacts ask_program(GLuint program, GLint version);

    [[nodiscard]] GLenum driver_error();
    void forget_objects(Graveyard& to);

    std::shared_ptr<ShareGroup> share_;
    bool active_ = false, extrapolates_ = false, lost_ = false;  // lost_: seen, but not yet dealt with by lose()
    GLint version_ = 0;  // 30, 31, 32
    NativeExtensions native_;
    bool float_viewport_ = false, buffer_storage_ = false;
    density::Reading reading_ = density::Reading::area;
    GLenum error_ = GL_NO_ERROR;

    GLuint draw_framebuffer_ = 0, read_framebuffer_ = 0;
    std::unordered_map<GLuint, Framebuffer> framebuffers_;  // those with foveation state only
    DrawTarget target_;
    bool target_known_ = false;
    std::uint32_t target_textures_epoch_ = 0, target_attachments_epoch_ = 0, attachments_epoch_ = 0;

    bool recording_ = false;
    Batch batch_;
    CommandLog log_;
    Undo undo_;
    TargetShape shape_;                    // of the framebuffer being recorded
    std::vector<Attachment> attachments_;  // the same
    int occlusion_queries_ = 0;
    bool feedback_ = false;
    bool per_draw_buffer_ = false;

    struct Kept {
        std::unique_ptr<Targets> targets;
        std::uint64_t last_use = 0;
        Pass* owner = nullptr;
    };
    std::vector<Kept> kept_;
    std::uint64_t use_ = 0;
    std::uint64_t memory_limit_ = UINT64_MAX;  // bytes of all kept_, and of the samples of views beside them
    OwnDrawing own_;
    std::array<GLuint, 2> sample_framebuffers_{};  // of one view's samples, and of its layer
    bool made_samples_ = false;  // ever: asked at each draw, where looking at all framebuffers would cost
    std::unique_ptr<render::extrapolation::GlExtrapolator> extrapolator_;
    std::uint64_t frame_ = 1;
    std::vector<GLuint> deletions_, kept_buffers_;
    std::vector<LateUpload> late_uploads_;  // after the last recorded draw
    std::unordered_set<GLuint> vertex_arrays_;  // without the default one
    std::unordered_map<GLuint, ProgramFacts> facts_;
    ProgramFacts pipeline_facts_;

    TargetShape default_shape_;
    bool default_known_ = false;       // its formats
    std::uint64_t default_frame_ = 0;  // when its size was read
    std::uint64_t window_frame_ = 0;   // when window_width_ and window_height_ were read
    int window_width_ = 0, window_height_ = 0;
    struct MainOffscreen {
        std::uint32_t attachments_epoch = 0;
        int window_width = 0, window_height = 0;
        bool yes = false;
    };
    std::unordered_map<GLuint, MainOffscreen> main_offscreen_;  // by framebuffer
    std::unordered_map<GLuint, std::uint32_t> noted_;  // framebuffer, and its attachments_epoch_ in note_drawn_textures()
    ClearValues cleared_to_;  // by the last glClear of the batch
    PayTest pay_;
    Comparison* comparison_ = nullptr;  // instead of pay_
    Way way_ = Way::levels;             // of this frame, in auto mode
    bool straight_frame_ = false;       // something was drawn straight into the default framebuffer
    bool auto_ = false, frame_levels_ = false, levels_now_ = false;
    EGLDisplay display_ = EGL_NO_DISPLAY;
    EGLSurface surface_ = EGL_NO_SURFACE;
    FocusSource focus_;
    GLuint view_ = 0;  // that is being submitted
    FullRate native_reason_ = FullRate::none;  // of the last choose_levels()
    std::uint64_t frame_planned_ = 0, frame_full_ = 0;  // pixels
    std::unordered_set<GLuint> drawn_textures_;         // that were attached to a framebuffer drawn to
};

// constinit: no test whether it has been made, at each use.
extern constinit thread_local Context* t_context __attribute__((tls_model("initial-exec")));
// The same while its draws are being recorded, else nullptr: what an idle layer tests at most calls.
extern constinit thread_local Context* t_recording __attribute__((tls_model("initial-exec")));

// The context whose draws are being recorded on this thread.
[[nodiscard]] inline Context* recording() noexcept {
    if (!gl.anything_to_do.load(std::memory_order_relaxed)) [[likely]] return nullptr;
    return t_recording;
}
// The context of this thread if it has anything to do with foveation.
[[nodiscard]] inline Context* engaged() noexcept {
    if (!gl.anything_to_do.load(std::memory_order_relaxed)) return nullptr;
    Context* c = t_context;
    return c && c->is_engaged() ? c : nullptr;
}
// Notices, when it ends, that the attachments of a foveated framebuffer were changed.
struct AttachmentWatch {
    AttachmentWatch() = default;
    AttachmentWatch(const AttachmentWatch&) = delete;
    AttachmentWatch& operator=(const AttachmentWatch&) = delete;
    ~AttachmentWatch() {
        if (Context* c = engaged()) c->check_configured_attachments();
    }
};

}  // namespace fovea::layer
