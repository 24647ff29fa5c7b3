/* A foveated target with stencil and no depth, whose frame goes on at full density: does the stencil of the levels come along? Prints the
 * version of OpenGL ES and where the values of before are found. Started with MESA_GLES_VERSION_OVERRIDE=3.1 it runs on a driver
 * that has no textures of stencil alone. */
#include "gles_program.h"

enum { SIZE = 256 };
static uint8_t pixels[4 * SIZE * SIZE];

static int green(int x, int y) { return pixels[4 * (y * SIZE + x) + 1] == 255; }

int main(void) {
    const PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config = (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    const PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters = (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    const GLuint zero = 0;
    GLuint fbo, stencil, counter, half, counting, provided = 0;
    GLint major = 0, minor = 0;
    open_context();
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    fbo = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, 0);
    glGenRenderbuffers(1, &stencil);
    glBindRenderbuffer(GL_RENDERBUFFER, stencil);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_STENCIL_INDEX8, SIZE, SIZE);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_STENCIL_ATTACHMENT, GL_RENDERBUFFER, stencil);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) fail("incomplete");
    half = make_program("#version 310 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 2.0 - 2.0, 0, 1); }",
                        "#version 310 es\nprecision mediump float; out vec4 c; void main() { c = vec4(0, 0, 1, 1); }");
    /* Counts, and so cannot be drawn more than once. */
    counting = make_program("#version 310 es\nvoid main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
                            "#version 310 es\nprecision highp float; layout(binding = 0) uniform atomic_uint n; out vec4 c; void main() { atomicCounterIncrement(n); c = vec4(0, 1, 0, 1); }");
    glGenBuffers(1, &counter);
    glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, counter);
    glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
    glViewport(0, 0, SIZE, SIZE);
    glClearStencil(0x55);
    glClear(GL_STENCIL_BUFFER_BIT); /* the program's own buffer: nothing of it may be seen later */
    glFinish();
    config(fbo, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    parameters(fbo, 0, 0, 0, 0, 16, 16, 0);
    glClearColor(1, 0, 0, 1);
    glClearStencil(0x12);
    glClear(GL_COLOR_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_ALWAYS, 0x25, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glUseProgram(half); /* below a line from the upper left of the picture's lower half */
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glFlush();
    glStencilFunc(GL_EQUAL, 0x12, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    glUseProgram(counting);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    check_gl("stencil");
    printf("%d.%d enabled %d, cleared where nothing was written: %d, where something was: %d\n", major, minor, provided & 1, green(250, 250) && green(128, 200), green(8, 8) || green(40, 20));
    close_context();
    return 0;
}
