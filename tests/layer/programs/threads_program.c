/* Several threads, each with a context of one share group, foveate, draw and extrapolate at the same time; then a recorded frame goes from one
 * thread to another. Prints how many pictures were wrong. usage: threads_program [THREADS [FRAMES]] */
#include <pthread.h>

#include "gles_program.h"

enum { SIZE = 128, MOST_THREADS = 8 };
static PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config;
static PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters;
static PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC texture_parameters;
static PFNGLEXTRAPOLATETEX2DQCOMPROC extrapolate;
static EGLContext contexts[MOST_THREADS];
static GLuint shared[MOST_THREADS]; /* foveated textures: each is drawn to by one thread, and steered by all */
static int frames = 10, threads = 4;
static int wrong[MOST_THREADS];

static EGLContext shared_context(void) {
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1, EGL_NONE};
    const EGLContext made = eglCreateContext(program_display, EGL_NO_CONFIG_KHR, program_context, attributes);
    if (!made) fail("eglCreateContext");
    return made;
}

static void use(EGLContext context) {
    if (!eglMakeCurrent(program_display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) fail("eglMakeCurrent");
}

static void draw(GLuint program) {
    glViewport(0, 0, SIZE, SIZE);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUseProgram(program);
    glUniform2f(glGetUniformLocation(program, "size"), SIZE, SIZE);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static int is_wrong(void) {
    uint8_t pixels[4 * SIZE * SIZE];
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    return width_of(pixels, SIZE, SIZE / 2, SIZE / 2) != 1 || width_of(pixels, SIZE, SIZE - 4, SIZE - 4) != 4;
}

static void *run(void *number) {
    const int me = *(const int *)number;
    int frame, other, i;
    use(contexts[me]);
    for (frame = 0; frame < frames; ++frame) {
        const GLuint program = footprint_program(), texture = make_texture(SIZE, SIZE), own = make_framebuffer(texture, SIZE, SIZE);
        const GLuint ahead = make_texture(SIZE, SIZE);
        GLuint with_shared, with_ahead, provided = 0;
        config(own, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
        parameters(own, 0, 0, 0, 0, 8, 8, 0);
        draw(program);
        wrong[me] += is_wrong();
        extrapolate(texture, texture, ahead, 0.5f); /* the first call of a context tries out both of its sides */
        with_ahead = make_framebuffer(ahead, SIZE, SIZE);
        wrong[me] += is_wrong();
        /* Many times: between calls of the driver its locks order the threads, and would hide what is not ordered here. */
        for (i = 0; i < 500; ++i)
            for (other = 0; other < threads; ++other) texture_parameters(shared[other], 0, 0, 0, 0, 8, 8, 0);
        with_shared = make_framebuffer(shared[me], SIZE, SIZE);
        draw(program);
        wrong[me] += is_wrong();
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glDeleteFramebuffers(1, &own);
        glDeleteFramebuffers(1, &with_shared);
        glDeleteFramebuffers(1, &with_ahead);
        glDeleteTextures(1, &ahead);
        glDeleteTextures(1, &texture);
        glUseProgram(0);
        glDeleteProgram(program);
    }
    check_gl("a thread");
    /* A frame that is recorded and not submitted, for another thread. */
    {
        const GLuint framebuffer = make_framebuffer(shared[me], SIZE, SIZE);
        (void)framebuffer;
        draw(footprint_program());
    }
    use(EGL_NO_CONTEXT);
    eglReleaseThread();
    return NULL;
}

int main(int argc, char **argv) {
    pthread_t started[MOST_THREADS];
    int numbers[MOST_THREADS], i, all = 0;
    if (argc > 1) threads = atoi(argv[1]);
    if (argc > 2) frames = atoi(argv[2]);
    if (threads < 1 || threads > MOST_THREADS) fail("1 to 8 threads");
    open_context();
    config = (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    parameters = (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    texture_parameters = (PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glTextureFoveationParametersQCOM");
    extrapolate = (PFNGLEXTRAPOLATETEX2DQCOMPROC)eglGetProcAddress("glExtrapolateTex2DQCOM");
    for (i = 0; i < threads; ++i) {
        shared[i] = make_texture(SIZE, SIZE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
        contexts[i] = shared_context();
        numbers[i] = i;
    }
    check_gl("set up");
    glFinish();
    for (i = 0; i < threads; ++i)
        if (pthread_create(&started[i], NULL, run, &numbers[i])) fail("pthread_create");
    for (i = 0; i < threads; ++i) pthread_join(started[i], NULL);
    for (i = 0; i < threads; ++i) { /* what the thread recorded was submitted when it let go of the context */
        use(contexts[i]);
        wrong[i] += is_wrong();
        use(program_context);
        eglDestroyContext(program_display, contexts[i]);
        all += wrong[i];
    }
    check_gl("end");
    close_context();
    printf("%d threads, %d of %d pictures wrong\n", threads, all, threads * (3 * frames + 1));
    return all != 0;
}
