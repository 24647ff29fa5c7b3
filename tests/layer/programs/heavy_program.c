/* Two triangles with an expensive fragment shader, 1024 x 1024. usage: heavy_program FRAMES [GAIN]
 * Prints a hash of the last frame, and on stderr the processor seconds per frame (all threads). With GAIN its
 * framebuffer is foveated, with one focal point in the middle. */
#define _POSIX_C_SOURCE 200809L
#include <time.h>

#include "gles_program.h"

int main(int argc, char **argv) {
    enum { SIZE = 1024 };
    const int frames = argc > 1 ? atoi(argv[1]) : 1;
    static uint8_t pixels[4 * SIZE * SIZE];
    struct timespec from, to;
    GLuint fbo, program;
    int frame;
    open_context();
    program = make_program(
        "#version 300 es\nout highp vec2 at;\n"
        "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; in vec2 at; uniform float phase; out vec4 color;\n"
        "void main() { vec3 sum = vec3(0.0); vec2 q = at * 3.0;\n"
        "  for (int i = 0; i < 24; ++i) { q = vec2(sin(q.y * 1.7 + phase), cos(q.x * 1.3)) * 1.2 + at; sum += vec3(q, q.x * q.y) * 0.02; }\n"
        "  color = vec4(fract(sum), 1.0); }");
    fbo = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    if (argc > 2) {
        GLuint provided = 0;
        const float gain = (float)atof(argv[2]);
        ((PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM"))(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
        ((PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM"))(fbo, 0, 0, 0, 0, gain, gain, 0);
    }
    glUseProgram(program);
    for (frame = -2; frame < frames; ++frame) { /* two to warm up */
        if (frame == 0) clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glUniform1f(glGetUniformLocation(program, "phase"), (float)frame * 0.1f);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glFinish();
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    check_gl("end");
    printf("%016llx\n", (unsigned long long)hash(pixels, sizeof pixels));
    fprintf(stderr, "%.6f\n", ((double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec) * 1e-9) / frames);
    close_context();
    return 0;
}
