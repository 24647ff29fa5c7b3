/* A program that knows nothing of foveation: it draws to the default framebuffer, of a pbuffer. Prints for each case how
 * many pixels wide the rendered pixels are in the middle and in a corner (1: full density), and at the end a hash of
 * everything that it read. usage: auto_program CASE... */
#include "gles_program.h"

enum { W = 512, H = 512 };
static uint8_t pixels[4 * W * H];
static uint64_t all = 1;
static EGLSurface surface, small;
static EGLConfig config;
static GLuint footprint;

static EGLSurface make_surface(int width, int height) {
    const EGLint attributes[] = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
    return eglCreatePbufferSurface(program_display, config, attributes);
}

static void open_default(void) {
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_RED_SIZE, 8,
                             EGL_DEPTH_SIZE, 24, EGL_STENCIL_SIZE, 8, EGL_NONE};
    EGLConfig configs[64];
    EGLint found = 0, red = 0, i;
    open_context();
    if (!eglChooseConfig(program_display, wanted, configs, 64, &found)) fail("eglChooseConfig");
    for (i = 0; i < found && red != 8; ++i) { /* the list begins with the most bits */
        config = configs[i];
        eglGetConfigAttrib(program_display, config, EGL_RED_SIZE, &red);
    }
    if (red != 8) fail("no config of 8 bits per channel");
    surface = make_surface(W, H);
    small = make_surface(256, 128);
    if (!eglMakeCurrent(program_display, surface, surface, program_context)) fail("eglMakeCurrent");
}

static void read_back(const char *name, int width, int height) {
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    all = all * 31 + hash(pixels, (size_t)(4 * width * height));
    if (name)
        printf("%s: middle %d corner %d\n", name, width_of(pixels, width, width / 2, height / 2), width_of(pixels, width, width - 8, height - 8));
}

static void draw(GLuint program, int width, int height) {
    glUseProgram(program);
    glUniform2f(glGetUniformLocation(program, "size"), (float)width, (float)height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static void clear(void) {
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

int main(int argc, char **argv) {
    GLuint coord, texture, other, depthless;
    int i;
    open_default();
    footprint = footprint_program();
    coord = make_program(
        "#version 300 es\nout highp vec2 at;\n"
        "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; in vec2 at; uniform vec2 size; out vec4 color;\n"
        "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, dFdy(at.y) * size.y / 8.0, fract(gl_FragCoord.x / 16.0), 1.0); }");
    depthless = make_program(
        "#version 300 es\nout highp vec2 at;\n"
        "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; in vec2 at; uniform vec2 size; uniform sampler2D picture; out vec4 color;\n"
        "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, dFdy(at.y) * size.y / 8.0, texture(picture, at).b, 1.0); }");
    texture = make_texture(64, 64);
    other = make_framebuffer(texture, 64, 64);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, W, H);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    for (i = 1; i < argc; ++i) {
        const char *name = argv[i];
        if (!strcmp(name, "scene")) {
            clear();
            draw(footprint, W, H);
        } else if (!strcmp(name, "no_clear")) {
            draw(footprint, W, H);
        } else if (!strcmp(name, "frag_coord")) {
            clear();
            draw(coord, W, H);
        } else if (!strcmp(name, "overlay")) { /* a scene, then text in the upper right corner */
            clear();
            draw(footprint, W, H);
            glDisable(GL_DEPTH_TEST);
            glEnable(GL_BLEND);
            glViewport(W - 64, H - 64, 64, 64);
            draw(footprint, 64, 64);
            glViewport(0, 0, W, H);
            glDisable(GL_BLEND);
            glEnable(GL_DEPTH_TEST);
            read_back(NULL, W, H);
            printf("overlay beside it: %d\n", width_of(pixels, W, 8, 8));
        } else if (!strcmp(name, "depth_after_overlay")) { /* depth of the scene still hides what comes behind it */
            clear();
            draw(footprint, W, H);
            glDisable(GL_DEPTH_TEST);
            glEnable(GL_BLEND);
            glViewport(0, 0, 16, 16);
            draw(footprint, 16, 16);
            glViewport(0, 0, W, H);
            glDisable(GL_BLEND);
            glEnable(GL_DEPTH_TEST);
            glDepthFunc(GL_LESS);
            draw(coord, W, H); /* as deep as the scene: not less */
            glDepthFunc(GL_LEQUAL);
            read_back(NULL, W, H);
            printf("depth_after_overlay: %d %d\n", pixels[4 * (W * 40 + 40) + 2], pixels[4 * (W * (H / 2) + W / 2) + 2]);
        } else if (!strcmp(name, "next_frame")) { /* a frame without a clear is hidden by the depth of the one before it */
            glDepthRangef(0, 1.0f - 0.01f * (float)i); /* nearer than what older frames left */
            clear();
            draw(footprint, W, H);
            eglSwapBuffers(program_display, surface);
            glDepthFunc(GL_LESS);
            draw(coord, W, H); /* as deep: not less */
            glDepthFunc(GL_LEQUAL);
            glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
            glDepthRangef(0, 1);
            printf("next_frame: %d %d\n", pixels[4 * (W * 40 + 40) + 2], pixels[4 * (W * (H / 2) + W / 2) + 2]);
            check_gl(name);
            eglSwapBuffers(program_display, surface);
            continue;
        } else if (!strcmp(name, "visit")) { /* clears, draws elsewhere, comes back */
            glClearColor(0.5f, 0, 0, 1);
            clear();
            glClearColor(0, 0, 0, 0);
            glBindFramebuffer(GL_FRAMEBUFFER, other);
            glViewport(0, 0, 64, 64);
            clear();
            draw(footprint, 64, 64);
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            glViewport(W / 4, 0, 3 * W / 4, H);
            draw(footprint, 3 * W / 4, H);
            glViewport(0, 0, W, H);
            read_back(NULL, W, H);
            printf("visit cleared to %d\n", pixels[4 * (W * 8 + 8)]);
        } else if (!strcmp(name, "full_screen_pass")) {
            glBindFramebuffer(GL_FRAMEBUFFER, other);
            glViewport(0, 0, 64, 64);
            clear();
            draw(footprint, 64, 64);
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            glViewport(0, 0, W, H);
            glBindTexture(GL_TEXTURE_2D, texture);
            glDisable(GL_DEPTH_TEST);
            clear();
            draw(depthless, W, H);
            glEnable(GL_DEPTH_TEST);
        } else if (!strcmp(name, "small")) { /* another surface, of another size */
            if (!eglMakeCurrent(program_display, small, small, program_context)) fail("eglMakeCurrent");
            glViewport(0, 0, 256, 128);
            clear();
            draw(footprint, 256, 128);
            read_back(name, 256, 128);
            eglSwapBuffers(program_display, small);
            if (!eglMakeCurrent(program_display, surface, surface, program_context)) fail("eglMakeCurrent");
            glViewport(0, 0, W, H);
            continue;
        } else if (!strcmp(name, "blit")) { /* what a blit reads is what was drawn */
            GLuint from = make_framebuffer(make_texture(W, H), W, H);
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            clear();
            draw(footprint, W, H);
            glBindFramebuffer(GL_DRAW_FRAMEBUFFER, from);
            glBlitFramebuffer(0, 0, W, H, 0, 0, W, H, GL_COLOR_BUFFER_BIT, GL_NEAREST);
            glBindFramebuffer(GL_FRAMEBUFFER, from);
            read_back(name, W, H);
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            eglSwapBuffers(program_display, surface);
            continue;
        } else if (!strcmp(name, "swap")) {
            eglSwapBuffers(program_display, surface);
            eglSwapBuffers(program_display, surface);
            continue;
        } else {
            fail(name);
        }
        read_back(name, W, H);
        check_gl(name);
        eglSwapBuffers(program_display, surface);
    }
    printf("hash %016llx\n", (unsigned long long)all);
    close_context();
    return 0;
}
