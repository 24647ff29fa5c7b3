/* Four views, as samples of foveated rendering with GL_OVR_multiview do it: two wide ones and two narrow insets are drawn
 * by one draw into four layers of an array, and a second pass puts them together. Prints what the layers and the
 * composition hold, and the answers of the extension. usage: multiview_program [foveated] */
#include "gles_program.h"

#ifndef GL_OVR_multiview
#define GL_MAX_VIEWS_OVR 0x9631
#define GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR 0x9630
#define GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_BASE_VIEW_INDEX_OVR 0x9632
#define GL_FRAMEBUFFER_INCOMPLETE_VIEW_TARGETS_OVR 0x9633
typedef void (GL_APIENTRYP PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC)(GLenum, GLenum, GLuint, GLint, GLint, GLsizei);
#endif

enum { VIEWS = 4, SIZE = 128 };
static uint8_t pixels[4 * 512 * 512];

static const char *const scene_vertex =
    "#version 300 es\n"
    "#extension GL_OVR_multiview2 : enable // layout(num_views = 9) in;\n"
    "#define VIEWS 4\n"
    "layout(num_views = VIEWS) in;\n"
    "uniform highp mat4 model_view_projection[VIEWS];\n"
    "out mediump vec3 tint;\n"
    "void main() {\n"
    "  highp vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));\n"
    "  gl_Position = model_view_projection[gl_ViewID_OVR] * vec4(p - 0.5, 0.0, 1.0);\n"
    "  tint = vec3(float(gl_ViewID_OVR) / 4.0, 1.0, 0.0);\n"
    "}\n";
static const char *const scene_fragment =
    "#version 300 es\nprecision mediump float;\nin vec3 tint;\nout vec4 color;\nvoid main() { color = vec4(tint, 1.0); }\n";

static GLuint make_array(GLenum format, int size) {
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format, size, size, VIEWS);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

static void read_layer(GLuint reader, GLuint array, int layer, int size) {
    glBindFramebuffer(GL_FRAMEBUFFER, reader);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, layer);
    glReadPixels(0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
}

static GLenum status_of(GLuint fbo) {
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    return glCheckFramebufferStatus(GL_FRAMEBUFFER);
}

static void foveated(PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC attach) {
    enum { WIDE = 512 };
    const PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC config =
        (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    const PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC parameters =
        (PFNGLFRAMEBUFFERFOVEATIONPARAMETERSQCOMPROC)eglGetProcAddress("glFramebufferFoveationParametersQCOM");
    GLuint fbo, reader, provided = 0, color = make_array(GL_RGBA8, WIDE), depth = make_array(GL_DEPTH_COMPONENT24, WIDE), program;
    int view;
    program = make_program(
        "#version 300 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 4) in;\nout highp vec2 at;\n"
        "void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\n#extension GL_OVR_multiview2 : require\nprecision highp float; in vec2 at; uniform vec2 size; out vec4 color;\n"
        "void main() { color = vec4(dFdx(at.x) * size.x / 8.0, float(gl_ViewID_OVR) / 8.0, 0.0, 1.0); }");
    glGenFramebuffers(1, &fbo);
    glGenFramebuffers(1, &reader);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, VIEWS);
    attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 0, VIEWS);
    config(fbo, VIEWS, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &provided);
    glViewport(0, 0, WIDE, WIDE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glUseProgram(program);
    glUniform2f(glGetUniformLocation(program, "size"), WIDE, WIDE);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    for (view = 0; view < VIEWS; ++view) /* each view looks into another corner */
        parameters(fbo, (GLuint)view, 0, view & 1 ? 0.75f : -0.75f, view & 2 ? 0.75f : -0.75f, 4, 4, 0);
    glFlush();
    for (view = 0; view < VIEWS; ++view) {
        read_layer(reader, color, view, WIDE);
        printf("view %d: corners %d %d %d %d, id %d\n", view, width_of(pixels, WIDE, 64, 64), width_of(pixels, WIDE, WIDE - 64, 64),
               width_of(pixels, WIDE, 64, WIDE - 64), width_of(pixels, WIDE, WIDE - 64, WIDE - 64), (pixels[1] + 16) / 32);
    }
    check_gl("foveated");
}

int main(int argc, char **argv) {
    /* scale of each view: left and right wide, left and right inset */
    static const float scale[VIEWS] = {0.5f, 0.5f, 1.0f, 1.0f}, shift[VIEWS] = {-0.25f, 0.25f, -0.25f, 0.25f};
    float matrices[VIEWS][16] = {{0}};
    GLuint color, depth, fbo, reader, program, plain, composition, out;
    GLint value = 0, view;
    PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC attach;
    open_context();
    if (!strstr((const char *)glGetString(GL_EXTENSIONS), "GL_OVR_multiview2")) fail("no GL_OVR_multiview2");
    attach = (PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC)eglGetProcAddress("glFramebufferTextureMultiviewOVR");
    if (!attach) fail("no glFramebufferTextureMultiviewOVR");
    if (argc > 1 && !strcmp(argv[1], "foveated")) {
        foveated(attach);
        close_context();
        return 0;
    }
    glGetIntegerv(GL_MAX_VIEWS_OVR, &value);
    printf("at least four views: %d\n", value >= VIEWS);

    color = make_array(GL_RGBA8, SIZE);
    depth = make_array(GL_DEPTH_COMPONENT24, SIZE);
    glGenFramebuffers(1, &fbo);
    glGenFramebuffers(1, &reader);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, fbo);
    attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, VIEWS);
    printf("depth without views: %d\n", (glFramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 0),
                                        glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_INCOMPLETE_VIEW_TARGETS_OVR));
    attach(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 1, VIEWS);
    printf("layers that the texture has not: %d\n", glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT);
    glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_BASE_VIEW_INDEX_OVR, &value);
    printf("base view %d", value);
    attach(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 0, VIEWS);
    glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_NUM_VIEWS_OVR, &value);
    printf(", views %d, complete %d\n", value, status_of(fbo) == GL_FRAMEBUFFER_COMPLETE);
    check_gl("attach");

    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, 0);
    printf("errors: no views %04x", glGetError());
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, -1, 2);
    printf(", base -1 %04x", glGetError());
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, 1000);
    printf(", 1000 views %04x", glGetError());
    attach(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, make_texture(8, 8), 0, 0, 2);
    printf(", no array %04x", glGetError());
    glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    printf(", reading %04x", glGetError());
    plain = footprint_program();
    glUseProgram(plain);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    printf(", program of one view %04x\n", glGetError());

    program = make_program(scene_vertex, scene_fragment);
    for (view = 0; view < VIEWS; ++view) {
        matrices[view][0] = matrices[view][5] = scale[view];
        matrices[view][10] = matrices[view][15] = 1;
        matrices[view][12] = shift[view];
    }
    glUseProgram(program);
    glUniformMatrix4fv(glGetUniformLocation(program, "model_view_projection"), VIEWS, GL_FALSE, matrices[0]);
    glViewport(0, 0, SIZE, SIZE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    check_gl("scene");
    for (view = 0; view < VIEWS; ++view) {
        int inside = 0, i;
        read_layer(reader, color, view, SIZE);
        for (i = 0; i < SIZE * SIZE; ++i) inside += pixels[4 * i + 1] == 255;
        i = 4 * (SIZE / 2 * SIZE + (view & 1 ? SIZE * 5 / 8 : SIZE * 3 / 8));
        printf("view %d: %d pixels, red %d, cleared %d\n", view, inside, (pixels[i] + 32) / 64, pixels[2] == 255);
    }
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    printf("four views into a framebuffer of one: %04x\n", glGetError());

    /* wide views below, insets above */
    composition = make_program(
        "#version 300 es\nout highp vec2 at;\nvoid main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; precision highp sampler2DArray; in vec2 at; uniform sampler2DArray views; out vec4 color;\n"
        "void main() { vec2 q = floor(at * 2.0); color = texture(views, vec3(fract(at * 2.0), q.x + 2.0 * q.y)); }");
    out = make_framebuffer(make_texture(2 * SIZE, 2 * SIZE), 2 * SIZE, 2 * SIZE);
    glBindFramebuffer(GL_FRAMEBUFFER, out);
    glUseProgram(composition);
    glBindTexture(GL_TEXTURE_2D_ARRAY, color);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glReadPixels(0, 0, 2 * SIZE, 2 * SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    printf("composition:");
    for (view = 0; view < VIEWS; ++view) {
        const int x = SIZE * (view & 1) + (view & 1 ? SIZE * 5 / 8 : SIZE * 3 / 8), y = SIZE * (view >> 1) + SIZE / 2;
        printf(" %d", (pixels[4 * (y * 2 * SIZE + x)] + 32) / 64);
    }
    printf("\n");
    check_gl("composition");
    close_context();
    return 0;
}
