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

/* The footprint once more, with a statement in its fragment shader. */
static GLuint footprint_with(const char *version, const char *declaration, const char *statement) {
    char fragment[1024];
    snprintf(fragment, sizeof fragment,
             "%s\nprecision highp float; in vec2 at; uniform vec2 size; %s\nout vec4 color;\n"
             "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, dFdy(at.y) * size.y / 8.0, 0.0, 1.0); %s }",
             version, declaration, statement);
    {
        char vertex[512];
        snprintf(vertex, sizeof vertex,
                 "%s\nout highp vec2 at;\n"
                 "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
                 "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); gl_PointSize = 3.0; }", version);
        return make_program(vertex, fragment);
    }
}

/* The same program from its binary: nobody sees a source. 0: the driver has no binaries. */
static GLuint from_binary(GLuint program) {
    static char binary[1 << 20];
    GLint formats = 0, linked = 0;
    GLsizei length = 0;
    GLenum format = 0;
    const GLuint made = glCreateProgram();
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
    if (formats < 1) return 0;
    glGetProgramBinary(program, sizeof binary, &length, &format, binary);
    glProgramBinary(made, format, binary, length);
    glGetProgramiv(made, GL_LINK_STATUS, &linked);
    while (glGetError() != GL_NO_ERROR) {}
    return linked ? made : 0;
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
        } else if (!strcmp(name, "texel_fetch")) {
            clear();
            glBindTexture(GL_TEXTURE_2D, texture);
            draw(footprint_with("#version 310 es", "uniform sampler2D t;", "color.b = texelFetch(t, ivec2(1, 1), 0).b;"), W, H);
        } else if (!strcmp(name, "no_source")) {
            const GLuint program = from_binary(footprint);
            if (!program) puts("no binaries");
            clear();
            draw(program ? program : coord, W, H);
        } else if (!strcmp(name, "points") || !strcmp(name, "lines")) { /* one of them, then the scene */
            clear();
            glUseProgram(footprint_with("#version 310 es", "", ""));
            glDrawArrays(!strcmp(name, "points") ? GL_POINTS : GL_LINES, 0, 2);
            draw(footprint, W, H);
        } else if (!strcmp(name, "textured_2d")) { /* a picture, without depth */
            clear();
            glBindTexture(GL_TEXTURE_2D, make_texture(16, 16));
            glDisable(GL_DEPTH_TEST);
            draw(depthless, W, H);
            glEnable(GL_DEPTH_TEST);
        } else if (!strcmp(name, "picture_with_depth")) { /* the same, depth test left on */
            clear();
            glBindTexture(GL_TEXTURE_2D, make_texture(16, 16));
            draw(depthless, W, H);
        } else if (!strcmp(name, "quad_of_a_world")) {
            const GLuint placed = make_program(
                "#version 300 es\nout highp vec2 at; uniform mat4 world;\n"
                "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
                "  at = p * 0.5 + 0.5; gl_Position = world * vec4(p, 0.5, 1.0); }",
                "#version 300 es\nprecision highp float; in vec2 at; uniform vec2 size; uniform sampler2D picture; out vec4 color;\n"
                "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, dFdy(at.y) * size.y / 8.0, texture(picture, at).b, 1.0); }");
            const GLfloat same[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
            clear();
            glBindTexture(GL_TEXTURE_2D, make_texture(16, 16));
            glUseProgram(placed);
            glUniformMatrix4fv(glGetUniformLocation(placed, "world"), 1, GL_FALSE, same);
            draw(placed, W, H);
        } else if (!strcmp(name, "keeps_depth")) { /* clears the colours alone, and tests depth */
            glClear(GL_COLOR_BUFFER_BIT);
            draw(footprint, W, H);
        } else if (!strcmp(name, "side_effects")) {
            GLuint counter;
            const GLuint zero = 0;
            glGenBuffers(1, &counter);
            glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, counter);
            glBufferData(GL_ATOMIC_COUNTER_BUFFER, sizeof zero, &zero, GL_DYNAMIC_DRAW);
            clear();
            draw(footprint_with("#version 310 es", "layout(binding = 0) uniform atomic_uint n;", "atomicCounterIncrement(n);"), W, H);
        } else if (!strcmp(name, "clears_only")) {
            clear();
            eglSwapBuffers(program_display, surface);
            continue;
        } else if (!strcmp(name, "cannot_match")) { /* draws to no buffer, then to it */
            const GLenum none = GL_NONE, back = GL_BACK;
            glDrawBuffers(1, &none);
            clear();
            glDrawBuffers(1, &back);
            clear();
            draw(coord, W, H);
        } else if (!strcmp(name, "offscreen")) { /* a scene of the window's size goes through a texture */
            const GLuint scene = make_texture(W, H), through = make_framebuffer(scene, W, H);
            GLuint copy = make_program(
                "#version 300 es\nout highp vec2 at;\n"
                "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
                "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
                "#version 300 es\nprecision highp float; in vec2 at; uniform sampler2D picture; out vec4 color;\n"
                "void main() { color = texture(picture, at); }");
            glBindFramebuffer(GL_FRAMEBUFFER, through);
            clear();
            draw(footprint, W, H);
            glBindFramebuffer(GL_FRAMEBUFFER, 0);
            glBindTexture(GL_TEXTURE_2D, scene);
            glDisable(GL_DEPTH_TEST);
            clear();
            glUseProgram(copy);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            glEnable(GL_DEPTH_TEST);
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
