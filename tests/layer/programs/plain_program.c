/* A program that knows nothing of foveation: many state calls and draws, client arrays, a framebuffer, a texture.
 * usage: plain_program link|dlopen|dlsym|getproc FRAMES [GAIN]
 * With GAIN it does know: its framebuffer is foveated, with one focal point in the middle.
 * Prints a hash of the last frame, and on stderr the processor seconds per frame (all threads). How it gets at its GL functions: linked, from a
 * library it opens itself (by dlsym), or by eglGetProcAddress alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>

#include "gles_program.h"

static void (*p_glUniform4f)(GLint, GLfloat, GLfloat, GLfloat, GLfloat);
static void (*p_glDrawArrays)(GLenum, GLint, GLsizei);
static void (*p_glVertexAttribPointer)(GLuint, GLint, GLenum, GLboolean, GLsizei, const void *);
static void (*p_glBindTexture)(GLenum, GLuint);
static void (*p_glEnable)(GLenum);
static void (*p_glDisable)(GLenum);

static void *find(const char *how, const char *name) {
    void *found = NULL;
    if (!strcmp(how, "dlopen")) {
        void *library = dlopen("libGLESv2.so.2", RTLD_NOW | RTLD_LOCAL);
        found = library ? dlsym(library, name) : NULL;
    } else if (!strcmp(how, "getproc")) {
        found = (void *)eglGetProcAddress(name);
    } else {
        found = dlsym(RTLD_DEFAULT, name);
    }
    if (!found) fail(name);
    return found;
}

int main(int argc, char **argv) {
    enum { SIZE = 64, DRAWS = 2000 };
    const char *how = argc > 1 ? argv[1] : "link";
    const int frames = argc > 2 ? atoi(argv[2]) : 1;
    static uint8_t pixels[4 * SIZE * SIZE];
    GLuint program, fbo, textures[2];
    GLint tint;
    float triangle[6];
    struct timespec from, to;
    int frame, i;
    open_context();
    if (!strcmp(how, "link")) {
        p_glUniform4f = glUniform4f, p_glDrawArrays = glDrawArrays, p_glVertexAttribPointer = glVertexAttribPointer;
        p_glBindTexture = glBindTexture, p_glEnable = glEnable, p_glDisable = glDisable;
    } else {
        *(void **)&p_glUniform4f = find(how, "glUniform4f");
        *(void **)&p_glDrawArrays = find(how, "glDrawArrays");
        *(void **)&p_glVertexAttribPointer = find(how, "glVertexAttribPointer");
        *(void **)&p_glBindTexture = find(how, "glBindTexture");
        *(void **)&p_glEnable = find(how, "glEnable");
        *(void **)&p_glDisable = find(how, "glDisable");
    }
    program = make_program("#version 300 es\nin vec2 p; void main() { gl_Position = vec4(p, 0, 1); }",
                           "#version 300 es\nprecision highp float; uniform vec4 tint; uniform sampler2D image; out vec4 c;\n"
                           "void main() { c = tint + texture(image, gl_FragCoord.xy / 64.0) * 0.1; }");
    for (i = 0; i < 2; ++i) textures[i] = make_texture(4, 4);
    fbo = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    if (argc > 3) {
        GLuint provided = 0;
        const float gain = (float)atof(argv[3]);
        ((PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM"))(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
        ((PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM"))(fbo, 0, 0, 0, 0, gain, gain, 0);
    }
    glUseProgram(program);
    tint = glGetUniformLocation(program, "tint");
    glEnableVertexAttribArray((GLuint)glGetAttribLocation(program, "p"));
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (frame = 0; frame < frames; ++frame) {
        glClearColor(0, 0, 0, 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        for (i = 0; i < DRAWS; ++i) {
            const float x = (float)(i % 31) / 16.0f - 1.0f, y = (float)(i % 29) / 15.0f - 1.0f;
            triangle[0] = x, triangle[1] = y, triangle[2] = x + 0.05f, triangle[3] = y, triangle[4] = x, triangle[5] = y + 0.05f;
            p_glBindTexture(GL_TEXTURE_2D, textures[i & 1]);
            p_glUniform4f(tint, (float)(i % 7) / 7.0f, (float)(i % 5) / 5.0f, (float)(i % 3) / 3.0f, 1);
            i & 4 ? p_glEnable(GL_BLEND) : p_glDisable(GL_BLEND);
            p_glVertexAttribPointer((GLuint)glGetAttribLocation(program, "p"), 2, GL_FLOAT, GL_FALSE, 0, triangle);
            p_glDrawArrays(GL_TRIANGLES, 0, 3);
        }
        glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    check_gl("end");
    printf("%016llx\n", (unsigned long long)hash(pixels, sizeof pixels));
    fprintf(stderr, "%.6f\n", ((double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec) * 1e-9) / frames);
    close_context();
    return 0;
}
