#include "tests/render/gl_calls.hpp"

#include <epoxy/gl.h>

// The entry points that render's sources call: a test holds those that make or draw something against this list.
#define COUNTED_CALLS(X) \
    X(glActiveTexture) X(glAttachShader) X(glBindBuffer) X(glBindBufferBase) X(glBindBufferRange) \
    X(glBindFramebuffer) X(glBindRenderbuffer) X(glBindTexture) X(glBindVertexArray) X(glBlendFuncSeparate) \
    X(glBlitFramebuffer) X(glBufferData) X(glBufferStorageEXT) X(glBufferSubData) X(glCheckFramebufferStatus) \
    X(glClear) X(glClearBufferfv) X(glClearBufferiv) X(glClearBufferuiv) X(glClearColor) \
    X(glClearDepthf) X(glClearStencil) X(glClientWaitSync) X(glColorMask) X(glCompileShader) \
    X(glCreateProgram) X(glCreateShader) X(glCullFace) X(glDeleteBuffers) X(glDeleteFramebuffers) \
    X(glDeleteProgram) X(glDeleteRenderbuffers) X(glDeleteShader) X(glDeleteSync) X(glDeleteTextures) \
    X(glDeleteVertexArrays) X(glDepthFunc) X(glDepthMask) X(glDetachShader) X(glDisable) \
    X(glDispatchCompute) X(glDrawArrays) X(glDrawArraysInstanced) X(glDrawBuffers) X(glDrawElements) \
    X(glDrawElementsInstanced) X(glEnable) X(glEnableVertexAttribArray) X(glFenceSync) X(glFinish) \
    X(glFlush) X(glFramebufferRenderbuffer) X(glFramebufferTexture2D) X(glGenBuffers) X(glGenFramebuffers) \
    X(glGenRenderbuffers) X(glGenTextures) X(glGenVertexArrays) X(glGenerateMipmap) X(glGetError) \
    X(glGetFramebufferAttachmentParameteriv) X(glGetIntegerv) X(glGetProgramInfoLog) X(glGetProgramiv) X(glGetShaderInfoLog) \
    X(glGetShaderiv) X(glGetString) X(glIsFramebuffer) X(glLinkProgram) X(glMapBufferRange) \
    X(glMemoryBarrier) X(glPixelStorei) X(glReadBuffer) X(glReadPixels) X(glRenderbufferStorageMultisample) \
    X(glScissor) X(glShaderSource) X(glStencilFunc) X(glStencilMask) X(glStencilOp) \
    X(glTexParameteri) X(glTexStorage2D) X(glTexStorage3D) X(glFramebufferTextureLayer) X(glFramebufferTextureMultiviewOVR) X(glGetInternalformativ) X(glTexSubImage2D) X(glTexSubImage3D) X(glUniform1f) \
    X(glUniform1ui) X(glUniform2f) X(glUniform4f) X(glUniform4fv) X(glUniformMatrix3fv) X(glUnmapBuffer) \
    X(glGetRenderbufferParameteriv) X(glGetTexLevelParameteriv) X(glGetTexParameteriv) X(glTexParameterf) \
    X(glUseProgram) X(glVertexAttribDivisor) X(glVertexAttribIPointer) X(glVertexAttribPointer) X(glViewport) \


namespace fovea::test {
namespace {

std::vector<std::string> sources;

void spy(GLuint, GLsizei count, const GLchar* const* strings, const GLint* lengths) {
    std::string all;
    for (GLsizei i = 0; i < count; ++i) all += lengths != nullptr && lengths[i] >= 0 ? std::string(strings[i], static_cast<std::size_t>(lengths[i])) : std::string(strings[i]);
    sources.push_back(all);
}
void spy(auto...) {}   // all other signatures

// libepoxy calls through a global pointer per function, which first points at code that looks the function up and then
// replaces the pointer: so the pointer is put back around each call, and taken over again after it.
template <class F, F* Slot>
struct Hook;
template <class R, class... A, R (**Slot)(A...)>
struct Hook<R (*)(A...), Slot> {
    static inline R (*original)(A...) = nullptr;
    static inline std::uint64_t count = 0;
    struct Restore {
        Restore() { *Slot = original; }
        ~Restore() {
            original = *Slot;
            *Slot = &call;
        }
    };
    static R call(A... a) {
        ++count;
        spy(a...);
        const Restore around;
        return original(a...);
    }
    static void install() {
        original = *Slot;
        *Slot = &call;
    }
};

struct Row {
    const char* name;
    void (*install)();
    std::uint64_t* count;
};
#define ROW(name) {#name, &Hook<decltype(epoxy_##name), &epoxy_##name>::install, &Hook<decltype(epoxy_##name), &epoxy_##name>::count},
const Row kRows[] = {COUNTED_CALLS(ROW)};

}  // namespace

std::uint64_t GlCalls::of(const std::string& name) const {
    const auto at = by_name.find(name);
    return at != by_name.end() ? at->second : 0;
}

std::uint64_t GlCalls::of_all(const std::string& beginning) const {
    std::uint64_t sum = 0;
    for (const auto& [name, n] : by_name)
        if (name.starts_with(beginning)) sum += n;
    return sum;
}

bool GlCalls::any_shader_has(const std::string& text) const {
    for (const std::string& s : shaders)
        if (s.find(text) != s.npos) return true;
    return false;
}

GlCalls take_gl_calls() {
    static const bool installed = [] {
        for (const Row& r : kRows) r.install();
        return true;
    }();
    GlCalls calls;
    for (const Row& r : kRows) {
        if (installed && *r.count != 0) calls.by_name[r.name] = *r.count;
        *r.count = 0;
    }
    calls.shaders.swap(sources);
    return calls;
}

std::vector<std::string> counted_gl_calls() {
    std::vector<std::string> names;
    for (const Row& r : kRows) names.emplace_back(r.name);
    return names;
}

}  // namespace fovea::test
