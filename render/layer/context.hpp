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

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "layer_gl.hpp"
#include "render/density/plan.hpp"
#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/layer/command_log.hpp"
#include "render/layer/foveation_state.hpp"
#include "render/layer/stats.hpp"
#include "render/layer/targets.hpp"
#include "render/layer/undo.hpp"

namespace fovea::layer {

// What the driver supports itself is left to it.
struct NativeExtensions {
    bool framebuffer_foveated = false, texture_foveated = false, frame_extrapolation = false;
};

struct ProgramFacts {
    bool geometry_or_tessellation = false;
    bool side_effects = false;  // writes buffers, images or counters
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
    bool masks_drawn = false;
    Call submitted_by = Call::none;
    std::uint64_t frame = 0;  // Context::frame_ of the last submission
};

struct Framebuffer {
    std::optional<FramebufferFoveation> config;
    Pass pass;
};

// What drawing to the framebuffer bound for drawing means.
struct DrawTarget {
    enum class Kind { plain, framebuffer, texture, incomplete };
    Kind kind = Kind::plain;
    GLuint texture = 0, layer = 0;  // Kind::texture
};

class Context {
public:
    explicit Context(std::shared_ptr<TextureFoveations> textures) : textures_(std::move(textures)) {}
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    void made_current();                 // the first time, reads what the driver is
    void release_images();               // current, nothing pending: level images are given back
    void abandon() noexcept;             // the driver's context is gone
    bool to_be_destroyed = false;        // eglDestroyContext came while it was current

    [[nodiscard]] bool active() const noexcept { return active_; }
    [[nodiscard]] bool is_recording() const noexcept { return recording_; }
    [[nodiscard]] bool is_engaged() const noexcept { return !framebuffers_.empty() || textures_->epoch() != 0; }
    [[nodiscard]] Undo& undo() noexcept { return undo_; }
    [[nodiscard]] CommandLog& log() noexcept { return log_; }
    [[nodiscard]] TextureFoveations& textures() noexcept { return *textures_; }
    [[nodiscard]] const NativeExtensions& native() const noexcept { return native_; }
    [[nodiscard]] GLint version() const noexcept { return version_; }

    // Errors. A context has one error flag: the first error stays until glGetError.
    void raise(GLenum error);
    void keep_driver_error();
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
    // True when the call may be recorded: no error of the extension or of the driver (which `probe` asks).
    template <class Probe>
    [[nodiscard]] bool begin(Op op, Probe probe) {
        if (!allowed(op)) return false;
        keep_driver_error();
        probe();
        if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) return raise(error), false;
        open();
        if (op == Op::draw) note_draw();
        return true;
    }
    // The error of the extension for a call that writes to the framebuffer bound for drawing, if there is one.
    [[nodiscard]] GLenum write_error();
    // color: the draw buffer that is cleared alone; -1: none alone.
    void note_clear(GLbitfield buffers, GLint color = -1);
    void end() { if (log_.bytes() > kLogLimit) submit(kCallLogFull); }
    void submit(Call call);
    void frame_ended(Call call);
    void leave_levels(Call call);  // what is drawn next must be at full density
    void invalidate_pass();        // the image was written by other means: the levels no longer match it
    [[nodiscard]] ProgramFacts program_facts();
    void forget_program(GLuint program) { facts_.erase(program); }

    // Framebuffer objects.
    void bound_framebuffer(GLenum target, GLuint name);
    void removed_framebuffer(GLuint name);
    void attachments_may_have_changed() noexcept { ++attachments_epoch_; }
    void check_configured_attachments();
    [[nodiscard]] Framebuffer* find_framebuffer(GLuint name);
    [[nodiscard]] Framebuffer& framebuffer(GLuint name) { return framebuffers_[name]; }
    [[nodiscard]] GLuint draw_framebuffer() const noexcept { return draw_framebuffer_; }
    [[nodiscard]] GLuint read_framebuffer() const noexcept { return read_framebuffer_; }
    [[nodiscard]] GLenum foveation_status(GLenum framebuffer_target);
    void image_written(GLuint name);  // a texture or renderbuffer was written by other means than drawing

    // GL_INVALID_FRAMEBUFFER_OPERATION when the framebuffer to be read is incomplete by the rules of the extensions.
    [[nodiscard]] GLenum read_error();
    // A program in use that is deleted lives until another is used, but the layer uses its own in between: deletion
    // is put off. False: delete it now.
    [[nodiscard]] bool put_off_deletion(GLuint program);

    // Uploads: a buffer of the layer that holds a part of the program's as it is now, until the next submission is over.
    [[nodiscard]] bool has_draws() const noexcept { return batch_.drew; }
    [[nodiscard]] GLuint keep_buffer(GLuint buffer, GLintptr offset, GLsizeiptr size);
    [[nodiscard]] bool buffer_storage() const noexcept { return buffer_storage_; }

    // Made by the first extrapolation.
    [[nodiscard]] std::unique_ptr<render::extrapolation::GlExtrapolator>& extrapolator() noexcept { return extrapolator_; }

    // Queries and transform feedback.
    void begin_query(GLenum target, Call call);
    void end_query(GLenum target, Call call);
    void begin_feedback() noexcept { feedback_ = true; }
    void end_feedback() noexcept { feedback_ = false; }
    [[nodiscard]] bool captures() const noexcept { return feedback_; }

    static constexpr std::size_t kLogLimit = std::size_t{64} << 20;

private:
    bool allowed(Op op);
    void open();
    void note_draw();
    struct Batch {
        bool drew = false, color_cleared = false, depth_cleared = false, stencil_cleared = false;
        bool needs_depth = false;  // or stencil, of before the batch
        bool uses_stencil = false, must_be_native = false;
    };
    [[nodiscard]] Latched latch() const;
    [[nodiscard]] bool choose_levels(Pass& pass, Call call);
    [[nodiscard]] bool start_levels(Pass& pass, const Latched& latched);
    [[nodiscard]] bool continues(const Pass& pass) const;
    void run_native();
    void run_levels(Pass& pass);
    void resolve(Pass& pass);
    void levels_to_native(Pass& pass);
    [[nodiscard]] Targets* targets_for(const TargetShape& shape, Pass& pass);
    void save_for_own_drawing(Undo& own) const;
    void drop_kept_buffers();
    void set_for_own_drawing() const;
    [[nodiscard]] static ProgramFacts ask_program(GLuint program, GLint version);

    std::shared_ptr<TextureFoveations> textures_;
    bool active_ = false;
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
    OwnDrawing own_;
    std::unique_ptr<render::extrapolation::GlExtrapolator> extrapolator_;
    std::uint64_t frame_ = 1;
    std::vector<GLuint> deletions_, kept_buffers_;
    std::unordered_map<GLuint, ProgramFacts> facts_;
};

extern thread_local Context* t_context __attribute__((tls_model("initial-exec")));

// The context whose draws are being recorded on this thread.
[[nodiscard]] inline Context* recording() noexcept {
    Context* c = t_context;
    return c && c->is_recording() ? c : nullptr;
}
// The context of this thread if it has anything to do with foveation.
[[nodiscard]] inline Context* engaged() noexcept {
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
