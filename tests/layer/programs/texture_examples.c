/* The three examples of GL_QCOM_texture_foveated, as a program would write them. Prints one line per example. */
#include "gles_program.h"

static PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC glTextureFoveationParametersQCOM_;

enum { W = 512, H = 512 };
static uint8_t pixels[4 * 1024 * 512];

static void draw(GLuint program, GLuint fbo, int width) {
    glUseProgram(program);
    glUniform2f(glGetUniformLocation(program, "size"), (float)width, (float)H);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

int main(void) {
    GLuint foveatedTexture, array, wide, fbo, program, eyes[2];
    GLint query = 0;
    int eye;
    open_context();
    glTextureFoveationParametersQCOM_ = (PFNGLTEXTUREFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glTextureFoveationParametersQCOM");
    program = footprint_program();

    /* (1) Setup a foveated texture */
    foveatedTexture = make_texture(W, H);
    glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM, &query);
    if (!(query & GL_FOVEATION_ENABLE_BIT_QCOM) || !(query & GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM)) fail("not supported");
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM,
                    GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM);
    fbo = make_framebuffer(foveatedTexture, W, H);
    draw(program, fbo, W);
    glTextureFoveationParametersQCOM_(foveatedTexture, 0, 0, 0.25f, 0.25f, 8.f, 8.f, 0.0f);
    glFlush();
    glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    printf("1 focus %d corner %d\n", width_of(pixels, W, 320, 320), width_of(pixels, W, 2, 2));

    /* (2) Setting parameters for a multiview stereo texture array */
    glGenTextures(1, &array);
    glBindTexture(GL_TEXTURE_2D_ARRAY, array);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, W, H, 2);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM,
                    GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM);
    {
        float focalX1 = 0.0f, focalY1 = 0.0f, focalX2 = 0.0f, focalY2 = 0.0f, gainX = 4.0f, gainY = 4.0f;
        glTextureFoveationParametersQCOM_(array, 0, 0, focalX1, focalY1, gainX, gainY, 2.0f);
        glTextureFoveationParametersQCOM_(array, 1, 0, focalX2, focalY2, gainX, gainY, 2.0f);
    }
    glGenFramebuffers(2, eyes);
    for (eye = 0; eye < 2; ++eye) {
        glBindFramebuffer(GL_FRAMEBUFFER, eyes[eye]);
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, eye);
        draw(program, eyes[eye], W);
        glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
        printf("2 eye %d centre %d corner %d\n", eye, width_of(pixels, W, 256, 256), width_of(pixels, W, 2, 2));
    }

    /* (3) Setting parameters for a double wide stereo texture */
    wide = make_texture(2 * W, H);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM,
                    GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM);
    fbo = make_framebuffer(wide, 2 * W, H);
    {
        float focalX1 = -0.5f, focalY1 = 0.0f, focalX2 = 0.5f, focalY2 = 0.0f, gainX = 8.0f, gainY = 8.0f;
        glTextureFoveationParametersQCOM_(wide, 0, 0, focalX1, focalY1, gainX * 2.0f, gainY, 8.0f);
        glTextureFoveationParametersQCOM_(wide, 0, 1, focalX2, focalY2, gainX * 2.0f, gainY, 8.0f);
    }
    draw(program, fbo, 2 * W);
    glReadPixels(0, 0, 2 * W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    printf("3 left %d right %d corner %d\n", width_of(pixels, 2 * W, 256, 256), width_of(pixels, 2 * W, 768, 256),
           width_of(pixels, 2 * W, 2, 2));
    check_gl("end");
    close_context();
    return 0;
}
