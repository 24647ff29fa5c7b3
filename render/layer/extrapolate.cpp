#include "render/layer/extrapolate.hpp"

#include <cstdio>
#include <cstring>

#include "render/layer/context.hpp"
#include "render/layer/trace.hpp"

namespace fovea::layer {
namespace {

thread_local Graveyard* t_graveyard = nullptr;

template <class DriverDelete>
void delete_all(GLsizei n, const GLuint* names, void (Graveyard::*bury)(GLuint), DriverDelete driver) {
    if (!t_graveyard) return driver(n, names);
    for (GLsizei i = 0; i < n; ++i) (t_graveyard->*bury)(names[i]);
}
void GL_APIENTRY delete_textures(GLsizei n, const GLuint* names) { delete_all(n, names, &Graveyard::texture, gl.DeleteTextures); }
void GL_APIENTRY delete_buffers(GLsizei n, const GLuint* names) { delete_all(n, names, &Graveyard::buffer, gl.DeleteBuffers); }
void GL_APIENTRY delete_samplers(GLsizei n, const GLuint* names) { delete_all(n, names, &Graveyard::sampler, gl.DeleteSamplers); }
void GL_APIENTRY delete_program(GLuint name) { t_graveyard ? t_graveyard->program(name) : gl.DeleteProgram(name); }
// Contexts do not share these: they go with theirs.
void GL_APIENTRY delete_framebuffers(GLsizei n, const GLuint* names) { if (!t_graveyard) gl.DeleteFramebuffers(n, names); }
void GL_APIENTRY delete_vertex_arrays(GLsizei n, const GLuint* names) { if (!t_graveyard) gl.DeleteVertexArrays(n, names); }

void (*engine_function(const char* name))() {
    static const struct {
        const char* name;
        void (*call)();
    } kDeletions[] = {{"glDeleteTextures", reinterpret_cast<void (*)()>(&delete_textures)},
                      {"glDeleteBuffers", reinterpret_cast<void (*)()>(&delete_buffers)},
                      {"glDeleteSamplers", reinterpret_cast<void (*)()>(&delete_samplers)},
                      {"glDeleteProgram", reinterpret_cast<void (*)()>(&delete_program)},
                      {"glDeleteFramebuffers", reinterpret_cast<void (*)()>(&delete_framebuffers)},
                      {"glDeleteVertexArrays", reinterpret_cast<void (*)()>(&delete_vertex_arrays)}};
    for (const auto& d : kDeletions)
        if (std::strcmp(d.name, name) == 0) return d.call;
    return driver_function(name);
}

}  // namespace

DeletionsGoTo::DeletionsGoTo(Graveyard& graveyard) { t_graveyard = &graveyard; }
DeletionsGoTo::~DeletionsGoTo() { t_graveyard = nullptr; }

void GL_APIENTRY layer_glExtrapolateTex2DQCOM(GLuint src1, GLuint src2, GLuint output, GLfloat scale) {
    Context* c = t_context;
    if (!c) return;
    if (c->native().frame_extrapolation) return gl.ExtrapolateTex2DQCOM(src1, src2, output, scale);
    if (!c->extrapolates()) return;
    trace_call("glExtrapolateTex2DQCOM", {static_cast<double>(src1), static_cast<double>(src2), static_cast<double>(output), static_cast<double>(scale)});
    if (scale == 0.0f) return c->raise(GL_INVALID_VALUE);
    if (c->active() && c->is_engaged()) c->before_finish(Call::ExtrapolateTex2DQCOM);
    c->keep_driver_error();
    auto& engine = c->extrapolator();
    if (!engine) {
        auto made = render::extrapolation::GlExtrapolator::create(&engine_function);
        if (!made) {
            std::fprintf(stderr, "fovea layer: %s\n", made.error().message().c_str());
            return c->raise(GL_OUT_OF_MEMORY);
        }
        engine = std::make_unique<render::extrapolation::GlExtrapolator>(std::move(*made));
    }
    const GLenum error = engine->extrapolate(src1, src2, output, scale);
    drop_errors();
    if (error != GL_NO_ERROR) return c->raise(error);
    count(stats.extrapolations);
    if (c->active()) c->image_written(output);
}

}  // namespace fovea::layer
