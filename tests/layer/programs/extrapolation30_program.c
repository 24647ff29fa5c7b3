/* Frame extrapolation in a context of OpenGL ES 3.0: prints the version, which of the layer's extensions are listed in both kinds of
 * list, and whether errors, a moving pair, a context destroyed while current and one after it are as they should be.
 * Started with MESA_GLES_VERSION_OVERRIDE=3.0. */
#include "gles_program.h"

enum { SIZE = 64, STEP = 4 };
typedef void(GL_APIENTRYP ExtrapolateTex2D)(GLuint src1, GLuint src2, GLuint output, GLfloat scale);

/* Two sines, `at` pixels to the right. */
static uint8_t value(int x, int y, int at) {
    const int u = (x - at + 640) % 32, v = (y + u) % 24;
    return (uint8_t)(40 + 4 * (u < 16 ? u : 32 - u) + 7 * (v < 12 ? v : 24 - v));
}
static GLuint picture(int at) {
    static uint8_t bytes[4 * SIZE * SIZE];
    GLuint t;
    for (int i = 0; i < 4 * SIZE * SIZE; ++i) bytes[i] = value(i / 4 % SIZE, i / 4 / SIZE, at);
    glGenTextures(1, &t);
    glBindTexture(GL_TEXTURE_2D, t);
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, SIZE, SIZE);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    glBindTexture(GL_TEXTURE_2D, 0);
    return t;
}
/* How far it is from the picture at that place, away from the border. */
static long off(GLuint t, int at) {
    static uint8_t bytes[4 * SIZE * SIZE];
    long sum = 0;
    GLuint fbo;
    glGenFramebuffers(1, &fbo);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t, 0);
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    glDeleteFramebuffers(1, &fbo);
    for (int y = 12; y < SIZE - 12; ++y)
        for (int x = 12; x < SIZE - 12; ++x) sum += labs((long)bytes[4 * (y * SIZE + x)] - value(x, y, at));
    return sum;
}

int main(void) {
    const ExtrapolateTex2D extrapolate = (ExtrapolateTex2D)eglGetProcAddress("glExtrapolateTex2DQCOM");
    const char *names[] = {"GL_QCOM_frame_extrapolation", "GL_QCOM_framebuffer_foveated", "GL_QCOM_texture_foveated", "GL_OVR_multiview2"};
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
    program_display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (!eglInitialize(program_display, NULL, NULL)) fail("eglInitialize");
    eglBindAPI(EGL_OPENGL_ES_API);
    if (!extrapolate) fail("no glExtrapolateTex2DQCOM");
    for (int turn = 0; turn < 2; ++turn) {
        GLint major = 0, minor = 0, count = 0;
        GLuint src1, src2, output;
        program_context = eglCreateContext(program_display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
        if (!eglMakeCurrent(program_display, EGL_NO_SURFACE, EGL_NO_SURFACE, program_context)) fail("eglMakeCurrent");
        glGetIntegerv(GL_MAJOR_VERSION, &major);
        glGetIntegerv(GL_MINOR_VERSION, &minor);
        glGetIntegerv(GL_NUM_EXTENSIONS, &count);
        printf("%d.%d:", major, minor);
        for (int n = 0; n < 4; ++n) {
            int times = 0;
            for (GLint i = 0; i < count; ++i) times += strcmp((const char *)glGetStringi(GL_EXTENSIONS, (GLuint)i), names[n]) == 0;
            if (times == 1 && strstr((const char *)glGetString(GL_EXTENSIONS), names[n])) printf(" %s", names[n]);
        }
        check_gl("lists");
        src1 = picture(0);
        src2 = picture(STEP);
        output = picture(0);
        glEnable(0x1234); /* an error of before stays the first */
        extrapolate(src1, src2, output, 0.0f);
        printf("\nerrors 0x%04x", glGetError());
        extrapolate(src1, src2, output, 0.0f);
        printf(" 0x%04x", glGetError());
        extrapolate(src1, 0, output, 1.0f);
        printf(" 0x%04x, output as before %d\n", glGetError(), off(output, 0) == 0);
        extrapolate(src1, src2, output, 0.5f);
        check_gl("extrapolation");
        printf("moved on %d\n", 2 * off(output, STEP + STEP / 2) < off(src2, STEP + STEP / 2));
        if (turn == 0) eglDestroyContext(program_display, program_context); /* while it is current */
    }
    close_context();
    return 0;
}
