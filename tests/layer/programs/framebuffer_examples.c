/* The five examples of GL_QCOM_framebuffer_foveated, as a program would write them. Prints one line per example. */
#include "gles_program.h"

static PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC glFramebufferFoveationConfigQCOM_;
static PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC glFramebufferFoveationParametersQCOM_;

enum { W = 512, H = 512 };
static uint8_t pixels[4 * 1024 * 512];

static void draw_and_read(GLuint program, GLuint fbo, int width) {
    glUseProgram(program);
    glUniform2f(glGetUniformLocation(program, "size"), (float)width, (float)H);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

int main(void) {
    GLuint fbo, providedFeatures = 0, program, wide, layered, array, multiview_provided = 0;
    open_context();
    if (!strstr((const char *)glGetString(GL_EXTENSIONS), "GL_QCOM_framebuffer_foveated")) fail("no extension");
    glFramebufferFoveationConfigQCOM_ = (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    glFramebufferFoveationParametersQCOM_ = (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    program = footprint_program();

    /* (1) Initialize a foveated framebuffer */
    fbo = make_framebuffer(make_texture(W, H), W, H);
    glFramebufferFoveationConfigQCOM_(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &providedFeatures);
    if (!(providedFeatures & GL_FOVEATION_ENABLE_BIT_QCOM)) fail("Failed to enable foveation");
    printf("1 enabled\n");

    /* (2) Setup static foveated rendering */
    {
        GLfloat focalX = 0.f, focalY = 0.f; /* Setup focal point at the center of screen */
        GLfloat gainX = 4.f, gainY = 4.f;   /* Increase these for stronger foveation */
        glFramebufferFoveationParametersQCOM_(fbo, 0, 0, focalX, focalY, gainX, gainY, 0.f);
        draw_and_read(program, fbo, W);
        glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
        printf("2 centre %d corner %d\n", width_of(pixels, W, 256, 256), width_of(pixels, W, 2, 2));
    }

    /* (3) Change eye position: before rendering anything, and right before Flush */
    {
        int frame;
        for (frame = 0; frame < 4; ++frame) {
            const float early = -0.75f, late = -0.6f + 0.4f * (float)frame;
            glFramebufferFoveationParametersQCOM_(fbo, 0, 0, early, early, 8.f, 8.f, 0.f);
            draw_and_read(program, fbo, W);
            glFramebufferFoveationParametersQCOM_(fbo, 0, 0, late, 0.f, 8.f, 8.f, 0.f);
            glFlush();
            glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
            printf("3 frame %d late %d early %d\n", frame, width_of(pixels, W, (int)((late * 0.5f + 0.5f) * W), 256), width_of(pixels, W, 64, 64));
        }
    }

    /* (4) Parameters for a multiview stereo framebuffer: an array, focalPointsPerLayer 1 */
    glGenTextures(1, &array);
    glBindTexture(GL_TEXTURE_2D_ARRAY, array);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, W, H, 2);
    glGenFramebuffers(1, &layered);
    glBindFramebuffer(GL_FRAMEBUFFER, layered);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, 0);
    glFramebufferFoveationConfigQCOM_(layered, 2, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &multiview_provided);
    {
        float focalX1 = 0.f, focalY1 = 0.f, focalX2 = 0.f, focalY2 = 0.f, gainX = 10.f, gainY = 10.f;
        glFramebufferFoveationParametersQCOM_(layered, 0, 0, focalX1, focalY1, gainX, gainY, 0.f);
        glFramebufferFoveationParametersQCOM_(layered, 1, 0, focalX2, focalY2, gainX, gainY, 0.f);
        draw_and_read(program, layered, W);
        glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
        printf("4 enabled %d centre %d corner %d\n", multiview_provided & GL_FOVEATION_ENABLE_BIT_QCOM ? 1 : 0,
               width_of(pixels, W, 256, 256), width_of(pixels, W, 2, 2));
    }

    /* (5) Parameters for a double wide stereo framebuffer: focalPointsPerLayer 2 */
    wide = make_framebuffer(make_texture(2 * W, H), 2 * W, H);
    glFramebufferFoveationConfigQCOM_(wide, 1, 2, GL_FOVEATION_ENABLE_BIT_QCOM, &providedFeatures);
    {
        float focalX1 = 0.f, focalY1 = 0.f, focalX2 = 0.f, focalY2 = 0.f, gainX = 10.f, gainY = 10.f;
        glFramebufferFoveationParametersQCOM_(wide, 0, 0, focalX1 * 0.5f - 0.5f, focalY1, gainX * 2.f, gainY, 0.f);
        glFramebufferFoveationParametersQCOM_(wide, 0, 1, focalX2 * 0.5f + 0.5f, focalY2, gainX * 2.f, gainY, 0.f);
        draw_and_read(program, wide, 2 * W);
        glReadPixels(0, 0, 2 * W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
        printf("5 left %d right %d middle %d\n", width_of(pixels, 2 * W, 256, 256), width_of(pixels, 2 * W, 768, 256),
               width_of(pixels, 2 * W, 512, 256));
    }
    check_gl("end");
    close_context();
    return 0;
}
