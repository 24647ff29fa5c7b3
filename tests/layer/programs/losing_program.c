/* Loses its GL context in the middle of a foveated frame (losing_driver.c is the driver), destroys it, makes a new one and
 * draws again. usage: losing_program status|error|silent
 * status: asks glGetGraphicsResetStatus after the loss; error: asks glGetError; silent: asks nothing. Prints the answers,
 * how many calls touched objects of a lost context before the new one was made, and a pixel of the new one. */
#include "gles_program.h"

typedef void (*Call)(void);

static EGLContext make_context(EGLContext share) {
    static const EGLint robust[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 2, EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE,
                                    EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET, EGL_NONE};
    static const EGLint plain[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 2, EGL_NONE};
    EGLContext context = eglCreateContext(program_display, EGL_NO_CONFIG_KHR, share, robust);
    if (context == EGL_NO_CONTEXT) context = eglCreateContext(program_display, EGL_NO_CONFIG_KHR, share, plain);
    return context;
}
static void use(EGLContext context) {
    if (!eglMakeCurrent(program_display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) fail("eglMakeCurrent");
}

static GLuint begin_frame(void) {
    enum { SIZE = 64 };
    const PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config =
        (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    const PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters =
        (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    const GLuint program = footprint_program(), fbo = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    GLuint provided = 0;
    int frame;
    config(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    parameters(fbo, 0, 0, 0, 0, 16, 16, 0);
    glUseProgram(program);
    for (frame = 0; frame < 2; ++frame) {
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glUniform2f(glGetUniformLocation(program, "size"), SIZE, SIZE);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        if (frame == 0) glFinish(); /* the second one stays recorded */
    }
    return fbo;
}

int main(int argc, char **argv) {
    const char *how = argc > 1 ? argv[1] : "status";
    const PFNGLEXTRAPOLATETEX2DQCOMPROC extrapolate = (PFNGLEXTRAPOLATETEX2DQCOMPROC)eglGetProcAddress("glExtrapolateTex2DQCOM");
    const Call lose = eglGetProcAddress("glLoseContextTEST"), find = eglGetProcAddress("glFindContextTEST");
    int (*const touched)(void) = (int (*)(void))eglGetProcAddress("glTouchedTEST");
    EGLContext first, shared, again;
    uint8_t pixel[4] = {0};
    int before;
    open_context();
    first = make_context(EGL_NO_CONTEXT);
    shared = make_context(first);
    use(first);
    extrapolate(make_texture(32, 32), make_texture(32, 32), make_texture(32, 32), 0.5f);
    begin_frame();
    check_gl("before the loss");
    lose();
    before = touched();
    if (!strcmp(how, "status")) printf("status %04x\n", glGetGraphicsResetStatus());
    if (!strcmp(how, "error")) {
        const GLenum error = glGetError();
        printf("error %04x, then %04x\n", error, glGetError());
    }
    glFlush();
    use(shared);
    use(program_context); /* it shares nothing with them; without a current context no GL call reaches the driver */
    eglDestroyContext(program_display, first);
    eglDestroyContext(program_display, shared);
    printf("touched %d\n", touched() - before);
    find();
    again = make_context(EGL_NO_CONTEXT);
    use(again);
    begin_frame();
    glReadPixels(1, 1, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel);
    check_gl("after the loss");
    printf("status %04x, a pixel of the periphery %d\n", glGetGraphicsResetStatus(), pixel[0] > 100);
    eglDestroyContext(program_display, again);
    close_context();
    return 0;
}
