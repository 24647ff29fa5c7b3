/* An EGL vendor library that is the real driver's, except that glLoseContextTEST() resets the graphics card: every context
 * is lost then, as GL_KHR_robustness describes it, until glFindContextTEST(). Calls that would touch an object of a lost
 * context do nothing and are counted; glTouchedTEST() gives their number. */
#include <GLES3/gl32.h>
#include <dlfcn.h>
#include <glvnd/libeglabi.h>
#include <stdatomic.h>
#include <stddef.h>
#include <string.h>

#define CONTEXT_LOST 0x0507
#define INNOCENT_CONTEXT_RESET 0x8254

static void *(*driver_address)(const char *);
static atomic_int lost, touched, error_pending;

static int touches(void) {
    if (!lost) return 0;
    ++touched;
    error_pending = 1;
    return 1;
}

/* name, parameters, arguments */
#define CALLS(X)                                                                                                          \
    X(DrawArrays, (GLenum a, GLint b, GLsizei c), (a, b, c))                                                               \
    X(DrawArraysInstanced, (GLenum a, GLint b, GLsizei c, GLsizei d), (a, b, c, d))                                        \
    X(Clear, (GLbitfield a), (a))                                                                                          \
    X(UseProgram, (GLuint a), (a))                                                                                         \
    X(BindFramebuffer, (GLenum a, GLuint b), (a, b))                                                                       \
    X(BindTexture, (GLenum a, GLuint b), (a, b))                                                                           \
    X(BindBuffer, (GLenum a, GLuint b), (a, b))                                                                            \
    X(BindVertexArray, (GLuint a), (a))                                                                                    \
    X(BindRenderbuffer, (GLenum a, GLuint b), (a, b))                                                                      \
    X(FramebufferTexture2D, (GLenum a, GLenum b, GLenum c, GLuint d, GLint e), (a, b, c, d, e))                            \
    X(FramebufferRenderbuffer, (GLenum a, GLenum b, GLenum c, GLuint d), (a, b, c, d))                                     \
    X(BufferData, (GLenum a, GLsizeiptr b, const void *c, GLenum d), (a, b, c, d))                                         \
    X(DeleteTextures, (GLsizei a, const GLuint *b), (a, b))                                                                \
    X(DeleteFramebuffers, (GLsizei a, const GLuint *b), (a, b))                                                            \
    X(DeleteRenderbuffers, (GLsizei a, const GLuint *b), (a, b))                                                           \
    X(DeleteBuffers, (GLsizei a, const GLuint *b), (a, b))                                                                 \
    X(DeleteSamplers, (GLsizei a, const GLuint *b), (a, b))                                                                \
    X(DeleteVertexArrays, (GLsizei a, const GLuint *b), (a, b))                                                            \
    X(DeleteProgram, (GLuint a), (a))

#define DEFINE(name, parameters, arguments)                                                                               \
    static void(*real_##name) parameters;                                                                                  \
    static void my_##name parameters {                                                                                     \
        if (!touches()) real_##name arguments;                                                                             \
    }
CALLS(DEFINE)

static GLenum (*real_GetError)(void);
static GLenum my_GetError(void) {
    if (!lost) return real_GetError();
    return atomic_exchange(&error_pending, 0) ? CONTEXT_LOST : GL_NO_ERROR;
}
static GLenum my_GetGraphicsResetStatus(void) { return lost ? INNOCENT_CONTEXT_RESET : GL_NO_ERROR; }
static void lose_context(void) { lost = error_pending = 1; }
static void find_context(void) { lost = 0; }
static int touched_calls(void) { return touched; }

static void *address(const char *name) {
    void *real = driver_address(name);
#define FIND(call, parameters, arguments)                                                                                 \
    if (!strcmp(name, "gl" #call)) return *(void **)&real_##call = real, (void *)my_##call;
    CALLS(FIND)
    if (!strcmp(name, "glGetError")) return *(void **)&real_GetError = real, (void *)my_GetError;
    if (!strncmp(name, "glGetGraphicsResetStatus", 24)) return (void *)my_GetGraphicsResetStatus;
    if (!strcmp(name, "glLoseContextTEST")) return (void *)lose_context;
    if (!strcmp(name, "glFindContextTEST")) return (void *)find_context;
    if (!strcmp(name, "glTouchedTEST")) return (void *)touched_calls;
    return real;
}

__attribute__((visibility("default"))) EGLBoolean __egl_Main(uint32_t version, const __EGLapiExports *exports,
                                                             __EGLvendorInfo *vendor, __EGLapiImports *imports) {
    void *library = dlopen("libEGL_mesa.so.0", RTLD_NOW | RTLD_LOCAL);
    __PFNEGLMAINPROC driver_main;
    if (!library) return EGL_FALSE;
    *(void **)&driver_main = dlsym(library, __EGL_MAIN_PROTO_NAME);
    if (!driver_main || !driver_main(version, exports, vendor, imports)) return EGL_FALSE;
    driver_address = imports->getProcAddress;
    imports->getProcAddress = address;
    return EGL_TRUE;
}
