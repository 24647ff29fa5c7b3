/* What the C programs of these tests share: a surfaceless OpenGL ES context, a program, a framebuffer, a hash.
 * The programs include the official headers only and know nothing of the layer. */
#ifndef GLES_PROGRAM_H
#define GLES_PROGRAM_H

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl32.h>
#include <GLES2/gl2ext.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef EGL_PLATFORM_SURFACELESS_MESA
#define EGL_PLATFORM_SURFACELESS_MESA 0x31DD
#endif

#if defined(__SANITIZE_ADDRESS__)
/* eglTerminate unloads the driver, and the leak sanitizer could not name whose memory it was: all libraries stay. */
int dlclose(void *library);
int dlclose(void *library) {
    (void)library;
    return 0;
}
#endif

static EGLDisplay program_display;
static EGLContext program_context;

static void fail(const char *what) {
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static void check_gl(const char *where) {
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        fprintf(stderr, "%s: GL error 0x%04x\n", where, error);
        exit(1);
    }
}

static void open_context(void) {
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1, EGL_NONE};
    program_display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (!eglInitialize(program_display, NULL, NULL)) fail("eglInitialize");
    eglBindAPI(EGL_OPENGL_ES_API);
    program_context = eglCreateContext(program_display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (!eglMakeCurrent(program_display, EGL_NO_SURFACE, EGL_NO_SURFACE, program_context)) fail("eglMakeCurrent");
}

static void close_context(void) {
    eglMakeCurrent(program_display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(program_display, program_context);
    eglTerminate(program_display);
}

static GLuint make_program(const char *vertex, const char *fragment) {
    const char *texts[2] = {vertex, fragment};
    const GLenum stages[2] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER};
    const GLuint program = glCreateProgram();
    GLint linked = 0;
    int i;
    for (i = 0; i < 2; ++i) {
        const GLuint shader = glCreateShader(stages[i]);
        glShaderSource(shader, 1, &texts[i], NULL);
        glCompileShader(shader);
        glAttachShader(program, shader);
    }
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) fail("a program does not link");
    return program;
}

static GLuint make_texture(int width, int height) {
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    return texture;
}

static GLuint make_framebuffer(GLuint texture, int width, int height) {
    GLuint framebuffer, depth;
    glGenRenderbuffers(1, &depth);
    glBindRenderbuffer(GL_RENDERBUFFER, depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) fail("framebuffer incomplete");
    glViewport(0, 0, width, height);
    return framebuffer;
}

/* red: rendered pixels are this many pixels wide, times 32 */
static GLuint footprint_program(void) {
    return make_program(
        "#version 300 es\nout highp vec2 at;\n"
        "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; in vec2 at; uniform vec2 size; out vec4 color;\n"
        "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, dFdy(at.y) * size.y / 8.0, 0.0, 1.0); }");
}

static int width_of(const uint8_t *pixels, int width, int x, int y) {
    return (pixels[4 * (y * width + x)] + 16) / 32;
}

static uint64_t hash(const void *data, size_t bytes) {
    const uint8_t *p = data;
    uint64_t h = 1469598103934665603u;
    while (bytes--) h = (h ^ *p++) * 1099511628211u;
    return h;
}

#endif
