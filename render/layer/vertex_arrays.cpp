// Buffers whose names were deleted while a vertex array that was not bound referred to them (OpenGL ES 3.2, 5.1.3: they live
// on in it). No function binds such a buffer again, so that an attribute which reads one cannot be put back for the run
// of a second level: where one is about to change, what is recorded is submitted first.
//
// Names in question are known: those that an array held when they were deleted. Few arrays of the context that deletes are looked
// through; with many, and for the arrays of the other contexts of its share group, every deleted name counts. A name that is
// given again stays in question, which costs lateness and nothing else.
#include <algorithm>

#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

constexpr std::size_t kLookedThrough = 32;  // arrays, of 17 queries each
constexpr GLuint kBindings = 16;

// Of the array that is bound.
void add_buffers(std::unordered_set<GLuint>& names) {
    for (GLuint i = 0; i < kBindings; ++i) {
        GLint name = 0;
        gl.GetIntegeri_v(GL_VERTEX_BINDING_BUFFER, i, &name);
        names.insert(static_cast<GLuint>(name));
    }
    names.insert(static_cast<GLuint>(get_integer(GL_ELEMENT_ARRAY_BUFFER_BINDING)));
}

}  // namespace

void Context::deleting_buffers(GLsizei count, const GLuint* names) {
    const auto bound = static_cast<GLuint>(get_integer(GL_VERTEX_ARRAY_BINDING));
    const bool alone = share_.use_count() <= 2;  // this context, and the table of contexts
    if (alone && vertex_arrays_.empty()) return;
    std::unordered_set<GLuint> held;
    const bool exact = vertex_arrays_.size() < kLookedThrough;
    if (exact) {
        keep_driver_error();
        for (const GLuint array : vertex_arrays_)
            if (array != bound) gl.BindVertexArray(array), add_buffers(held);
        if (bound != 0) gl.BindVertexArray(0), add_buffers(held);
        gl.BindVertexArray(bound);
        drop_errors();
    }
    using Held = DeletedBuffers::Held;
    for (GLsizei i = 0; i < count; ++i)
        if (names[i] != 0) share_->deleted_buffers.note(names[i], !exact || held.contains(names[i]) ? Held::perhaps : alone ? Held::nowhere : Held::perhaps_elsewhere, this);
}

bool Context::keeps_deleted(GLuint attribute) {
    const DeletedBuffers& deleted = share_->deleted_buffers;
    if (!deleted.any()) return false;
    GLint read = 0, bound = 0;
    gl.GetVertexAttribiv(attribute, GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING, &read);
    gl.GetIntegeri_v(GL_VERTEX_BINDING_BUFFER, attribute, &bound);
    return deleted.has(static_cast<GLuint>(read), this) || deleted.has(static_cast<GLuint>(bound), this);
}

bool Context::keeps_deleted_indices() {
    return share_->deleted_buffers.any() && share_->deleted_buffers.has(static_cast<GLuint>(get_integer(GL_ELEMENT_ARRAY_BUFFER_BINDING)), this);
}

void GL_APIENTRY layer_glDeleteBuffers(GLsizei n, const GLuint* buffers) {
    if (Context* c = engaged()) c->before_forget(Call::DeleteBuffers);
    if (Context* c = t_context; c && c->active() && n > 0 && buffers) c->deleting_buffers(n, buffers);
    gl.DeleteBuffers(n, buffers);
}

static void made_arrays(GLsizei n, const GLuint* arrays) {
    if (Context* c = t_context; c && c->active() && arrays)
        for (GLsizei i = 0; i < n; ++i) c->vertex_arrays().insert(arrays[i]);
}
void GL_APIENTRY layer_glGenVertexArrays(GLsizei n, GLuint* arrays) {
    gl.GenVertexArrays(n, arrays);
    made_arrays(n, arrays);
}
void GL_APIENTRY layer_glGenVertexArraysOES(GLsizei n, GLuint* arrays) {
    gl.GenVertexArraysOES(n, arrays);
    made_arrays(n, arrays);
}

template <class DriverCall>
static void delete_arrays(GLsizei n, const GLuint* arrays, DriverCall driver) {
    if (Context* c = engaged()) c->before_forget(Call::DeleteVertexArrays);
    driver(n, arrays);
    if (Context* c = t_context; c && c->active() && arrays)
        for (GLsizei i = 0; i < n; ++i) c->vertex_arrays().erase(arrays[i]);
}
void GL_APIENTRY layer_glDeleteVertexArrays(GLsizei n, const GLuint* arrays) { delete_arrays(n, arrays, gl.DeleteVertexArrays); }
void GL_APIENTRY layer_glDeleteVertexArraysOES(GLsizei n, const GLuint* arrays) { delete_arrays(n, arrays, gl.DeleteVertexArraysOES); }

}  // namespace fovea::layer
