// How a context ends: destroyed by the program, or lost with the GPU it was on.
//
//   current --eglDestroyContext--> to be destroyed --another is made current--> images deleted, the rest abandoned
//   not current --eglDestroyContext--> abandoned: its own objects are gone with it, shared ones wait in the graveyard
//   current --reset of the graphics card--> lost: everything is forgotten, no name is touched, calls go to the driver
#include "render/layer/context.hpp"
#include "render/layer/extrapolate.hpp"

namespace fovea::layer {

Context::~Context() { abandon(); }

void Context::release_images() {
    for (Kept& kept : kept_)
        if (kept.owner) kept.owner->targets = nullptr, kept.owner->mode = Pass::Mode::none;
    kept_.clear();
    extrapolator_.reset();
}

void Context::forget_objects(Graveyard& to) {
    for (Kept& kept : kept_) {
        if (kept.owner) kept.owner->targets = nullptr, kept.owner->mode = Pass::Mode::none;
        kept.targets->abandon(to);
    }
    kept_.clear();
    for (auto& [name, f] : framebuffers_)
        for (auto& [point, a] : f.views) {
            for (const GLuint image : a.images) to.renderbuffer(image);
            a.images.clear();
        }
    sample_framebuffers_ = {};
    own_.abandon(to);
    for (const GLuint b : kept_buffers_) to.buffer(b);
    kept_buffers_.clear();
    if (extrapolator_) {
        const DeletionsGoTo graveyard(to);
        extrapolator_.reset();
    }
}

void Context::abandon() { forget_objects(share_->dead); }

void Context::lose() {
    if (!active_ && !extrapolates_) return;
    active_ = extrapolates_ = recording_ = auto_ = false;
    if (t_recording == this) t_recording = nullptr;
    late_uploads_.clear();
    log_.clear();
    undo_.clear();
    deletions_.clear();
    facts_.clear();
    noted_.clear();
    Graveyard unburied;  // the share group is lost as a whole: nobody will delete these
    forget_objects(unburied);
    share_->dead.forget();
    framebuffers_.clear();
    target_known_ = false;
    count(stats.contexts_lost);
}

GLenum Context::reset_status(GLenum status) {
    if (status != GL_NO_ERROR) lose();
    return status;
}

// The same call under three names; each goes to the driver under its own.
template <class DriverCall>
static GLenum reset_status(DriverCall driver) {
    const GLenum status = driver();
    Context* c = t_context;
    return c && (c->active() || c->extrapolates()) ? c->reset_status(status) : status;
}
GLenum GL_APIENTRY layer_glGetGraphicsResetStatus() { return reset_status(gl.GetGraphicsResetStatus); }
GLenum GL_APIENTRY layer_glGetGraphicsResetStatusEXT() { return reset_status(gl.GetGraphicsResetStatusEXT); }
GLenum GL_APIENTRY layer_glGetGraphicsResetStatusKHR() { return reset_status(gl.GetGraphicsResetStatusKHR); }

}  // namespace fovea::layer
