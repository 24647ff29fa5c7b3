/* What a layer that has nothing to do costs a program of many calls, measured in one process and one context.
 * usage: calls_program [TWO_PATHS_LIBRARY LAYER_LIBRARY [PAIRS]]
 *
 * Without arguments: draws one frame of each kind and prints a hash of the pictures.
 * With them: draws frames in pairs, one by the driver's own functions and one by the layer's (two_paths.c), now this one
 * first and now that, and prints for each kind of frame the median over the pairs of the ratio of their processor times
 * (all threads), the middle half of the ratios, and what that is per call. "The driver twice" is the error of this
 * measurement: both frames of a pair by the driver's functions. LAYER_LIBRARY may be the driver itself (libEGL_mesa.so.0):
 * "the idle layer" is then what the two kinds of stubs differ by, those of libglvnd for names that it knows and for others.
 *
 * Kinds of frames, all of 64 x 64 pixels:
 *   changing   1000 draws, 8 calls that change buffers, pointers, textures, uniforms and tests before each
 *   same       4000 draws, one uniform changed before each
 *   state      20000 calls of state, one draw: nothing but overhead */
#define _GNU_SOURCE
#include <time.h>

#include "gles_program.h"

#define FUNCTIONS(F)                                                                  \
    F(BindBuffer, (GLenum, GLuint))                                                   \
    F(VertexAttribPointer, (GLuint, GLint, GLenum, GLboolean, GLsizei, const void *)) \
    F(EnableVertexAttribArray, (GLuint))                                              \
    F(BindTexture, (GLenum, GLuint))                                                  \
    F(Uniform4f, (GLint, GLfloat, GLfloat, GLfloat, GLfloat))                         \
    F(Uniform2f, (GLint, GLfloat, GLfloat))                                           \
    F(Enable, (GLenum))                                                               \
    F(Disable, (GLenum))                                                              \
    F(DepthMask, (GLboolean))                                                         \
    F(DepthFunc, (GLenum))                                                            \
    F(ActiveTexture, (GLenum))                                                        \
    F(Viewport, (GLint, GLint, GLsizei, GLsizei))                                     \
    F(UseProgram, (GLuint))                                                           \
    F(ClearColor, (GLfloat, GLfloat, GLfloat, GLfloat))                               \
    F(Clear, (GLbitfield))                                                            \
    F(DrawArrays, (GLenum, GLint, GLsizei))                                           \
    F(Finish, (void))

struct Table {
#define MEMBER(name, parameters) void (*name) parameters;
    FUNCTIONS(MEMBER)
};

enum { SIZE = 64, KINDS = 3 };
static const char *const kKinds[KINDS] = {"changing", "same", "state"};
static const int kCalls[KINDS] = {9007, 8007, 20009};

static GLuint program, buffers[2], textures[2];
static GLint tint, place;
static GLuint position;
static EGLSurface surface;

static int64_t processor_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static struct Table find_functions(const char *suffix) {
    struct Table table;
    char name[64];
#define FIND(function, parameters)                                    \
    snprintf(name, sizeof name, "gl%s%s", #function, suffix);         \
    *(void **)&table.function = (void *)eglGetProcAddress(name);      \
    if (!table.function) fail(name);
    FUNCTIONS(FIND)
    return table;
}

static void draw_frame(const struct Table *gl, int kind) {
    int i;
    gl->Viewport(0, 0, SIZE, SIZE);
    gl->ClearColor(0, 0, 0, 1);
    gl->Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl->UseProgram(program);
    gl->BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    gl->VertexAttribPointer(position, 2, GL_FLOAT, GL_FALSE, 0, NULL);
    if (kind == 0) {
        for (i = 0; i < 1000; ++i) {
            const float x = (float)(i % 31) / 16.0f - 1.0f, y = (float)(i % 29) / 15.0f - 1.0f;
            gl->BindBuffer(GL_ARRAY_BUFFER, buffers[i >> 3 & 1]);
            gl->VertexAttribPointer(position, 2, GL_FLOAT, GL_FALSE, 0, NULL);
            gl->EnableVertexAttribArray(position);
            gl->BindTexture(GL_TEXTURE_2D, textures[i >> 4 & 1]);
            gl->Uniform4f(tint, (float)(i % 7) / 7.0f, (float)(i % 5) / 5.0f, (float)(i % 3) / 3.0f, 1);
            gl->Uniform2f(place, x, y);
            i & 4 ? gl->Enable(GL_DEPTH_TEST) : gl->Disable(GL_DEPTH_TEST);
            gl->DepthMask(GL_TRUE);
            gl->DrawArrays(GL_TRIANGLES, 0, 3);
        }
    } else if (kind == 1) {
        for (i = 0; i < 4000; ++i) {
            gl->Uniform2f(place, (float)(i % 31) / 16.0f - 1.0f, (float)(i % 29) / 15.0f - 1.0f);
            gl->DrawArrays(GL_TRIANGLES, 0, 3);
        }
    } else {
        for (i = 0; i < 2500; ++i) {
            gl->BindTexture(GL_TEXTURE_2D, textures[i & 1]);
            gl->Uniform4f(tint, (float)(i % 7) / 7.0f, (float)(i % 5) / 5.0f, 0, 1);
            gl->Enable(GL_DEPTH_TEST);
            gl->DepthFunc(i & 1 ? GL_LESS : GL_LEQUAL);
            gl->BindBuffer(GL_ARRAY_BUFFER, buffers[i & 1]);
            gl->VertexAttribPointer(position, 2, GL_FLOAT, GL_FALSE, 0, NULL);
            gl->EnableVertexAttribArray(position);
            gl->ActiveTexture(GL_TEXTURE0);
        }
        gl->DrawArrays(GL_TRIANGLES, 0, 3);
    }
    gl->Finish();
}

static int64_t timed(const struct Table *gl, int kind) {
    const int64_t from = processor_ns();
    draw_frame(gl, kind);
    return processor_ns() - from;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void compare(const char *name, const struct Table *one, const struct Table *other, int kind, int pairs) {
    double *ratios = malloc(sizeof(double) * (size_t)pairs), *plain = malloc(sizeof(double) * (size_t)pairs);
    int i;
    for (i = 0; i < 10; ++i) draw_frame(one, kind), draw_frame(other, kind);
    for (i = 0; i < pairs; ++i) {
        int64_t a, b;
        if (i & 1) {
            b = timed(other, kind);
            a = timed(one, kind);
        } else {
            a = timed(one, kind);
            b = timed(other, kind);
        }
        plain[i] = (double)a;
        ratios[i] = (double)b / (double)a;
    }
    qsort(ratios, (size_t)pairs, sizeof(double), ascending);
    qsort(plain, (size_t)pairs, sizeof(double), ascending);
    printf("%-9s %-18s %.4f (%.4f to %.4f of %d pairs); %.2f ms a frame, %+.1f ns a call\n", kKinds[kind], name, ratios[pairs / 2],
           ratios[pairs / 4], ratios[pairs * 3 / 4], pairs, plain[pairs / 2] * 1e-6,
           (ratios[pairs / 2] - 1) * plain[pairs / 2] / kCalls[kind]);
    fflush(stdout);
    free(ratios);
    free(plain);
}

/* Tells libEGL, before its first use, to load the library of two paths. */
static void use_two_paths(const char *library, const char *layer) {
    char name[] = "/tmp/fovea-two-paths-XXXXXX";
    const int descriptor = mkstemp(name);
    FILE *json = descriptor < 0 ? NULL : fdopen(descriptor, "w");
    char *whole = realpath(library, NULL);
    if (!json || !whole) fail(library);
    fprintf(json, "{\"file_format_version\": \"1.0.0\", \"ICD\": {\"library_path\": \"%s\"}}\n", whole);
    fclose(json);
    setenv("__EGL_VENDOR_LIBRARY_FILENAMES", name, 1);
    setenv("TWO_PATHS_LAYER", layer, 1);
    (void)eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL); /* reads the file */
    remove(name);
    free(whole);
}

int main(int argc, char **argv) {
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_DEPTH_SIZE, 24, EGL_NONE};
    const EGLint size[] = {EGL_WIDTH, SIZE, EGL_HEIGHT, SIZE, EGL_NONE};
    const float triangle[2][6] = {{0, 0, 0.05f, 0, 0, 0.05f}, {0, 0, 0.08f, 0, 0, 0.08f}};
    const int pairs = argc > 3 ? atoi(argv[3]) : 200;
    static uint8_t pixels[4 * SIZE * SIZE];
    struct Table layer;
    EGLConfig config;
    EGLint found = 0;
    uint64_t all = 0;
    int i;
    if (argc > 2) use_two_paths(argv[1], argv[2]);
    open_context();
    if (!eglChooseConfig(program_display, wanted, &config, 1, &found) || found != 1) fail("eglChooseConfig");
    surface = eglCreatePbufferSurface(program_display, config, size);
    if (!eglMakeCurrent(program_display, surface, surface, program_context)) fail("eglMakeCurrent");
    program = make_program("#version 300 es\nin vec2 p; uniform vec2 place; void main() { gl_Position = vec4(p + place, 0, 1); }",
                           "#version 300 es\nprecision highp float; uniform vec4 tint; uniform sampler2D image; out vec4 c;\n"
                           "void main() { c = tint + texture(image, vec2(0.5)) * 0.1; }");
    tint = glGetUniformLocation(program, "tint");
    place = glGetUniformLocation(program, "place");
    position = (GLuint)glGetAttribLocation(program, "p");
    glEnableVertexAttribArray(position);
    glGenBuffers(2, buffers);
    for (i = 0; i < 2; ++i) {
        textures[i] = make_texture(4, 4);
        glBindBuffer(GL_ARRAY_BUFFER, buffers[i]);
        glBufferData(GL_ARRAY_BUFFER, sizeof triangle[i], triangle[i], GL_STATIC_DRAW);
    }
    layer = find_functions("");
    if (argc > 2) {
        const struct Table driver = find_functions("Direct");
        for (i = 0; i < KINDS; ++i) {
            compare("the driver twice", &driver, &driver, i, pairs);
            compare("the idle layer", &driver, &layer, i, pairs);
        }
    } else {
        for (i = 0; i < KINDS; ++i) {
            draw_frame(&layer, i);
            glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
            all = all * 31 + hash(pixels, sizeof pixels);
        }
        printf("%016llx\n", (unsigned long long)all);
    }
    check_gl("end");
    close_context();
    return 0;
}
