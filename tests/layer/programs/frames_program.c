/* Draws many foveated frames with a moving focal point and prints how much memory the process holds after a quarter of
 * them and at the end, in kilobytes. usage: frames_program FRAMES [map]
 * With map, a buffer is mapped between two draws of each frame. */
#include <unistd.h>

#include "gles_program.h"

static long resident_kb(void) {
    long total = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &total, &resident) != 2) fail("/proc/self/statm");
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

int main(int argc, char **argv) {
    enum { SIZE = 64 };
    const int frames = argc > 1 ? atoi(argv[1]) : 1000;
    PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config;
    PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters;
    const int maps = argc > 2 && !strcmp(argv[2], "map");
    GLuint fbo, buffer, provided = 0, program;
    int frame;
    open_context();
    config = (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    parameters = (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    program = footprint_program();
    fbo = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    config(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    glUseProgram(program);
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_UNIFORM_BUFFER, buffer);
    glBufferData(GL_UNIFORM_BUFFER, 64, NULL, GL_DYNAMIC_DRAW);
    for (frame = 0; frame < frames; ++frame) {
        float triangle[6] = {-1, -1, 3, -1, -1, 3};
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, triangle);
        glUniform2f(glGetUniformLocation(program, "size"), SIZE, SIZE);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        if (maps) {
            glMapBufferRange(GL_UNIFORM_BUFFER, 0, 64, GL_MAP_WRITE_BIT);
            glUnmapBuffer(GL_UNIFORM_BUFFER);
            glDrawArrays(GL_TRIANGLES, 0, 3);
        }
        parameters(fbo, 0, 0, (float)(frame % 100) / 50.0f - 1.0f, 0, 8, 8, 0);
        glFinish();
        if (frame == frames / 4) printf("%ld\n", resident_kb());
    }
    check_gl("end");
    printf("%ld\n", resident_kb());
    close_context();
    return 0;
}
