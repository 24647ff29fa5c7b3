/* Four views, as samples of foveated rendering with GL_OVR_multiview do it: two wide ones and two narrow insets are drawn
 * by one draw into four layers of an array, and a second pass puts them together. Prints what the layers and the
 * composition hold, and the answers of the extension. usage: multiview_program [foveated|cubes|masks]
 * cubes: three lit cubes from client memory seen by two wide and two narrow cameras, and each eye put together of both. */
#include <math.h>

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

/* The passes of Arm's sample: attachments with samples, near geometry that masks what the other view of the eye shows, the
 * scene by the white paper's shader (of its table 1, with four views), and one picture per eye put together of both. */
static void masks(void) {
    typedef void (GL_APIENTRYP attach_samples_function)(GLenum, GLenum, GLuint, GLint, GLsizei, GLint, GLsizei);
    enum { STEPS = 16 };
    static const float ratio = 0.5f;
    const attach_samples_function attach = (attach_samples_function)eglGetProcAddress("glFramebufferTextureMultisampleMultiviewOVR");
    const GLfloat quad[18] = {-1, -1, 0.5f, 1, -1, 0.5f, 1, 1, 0.5f, -1, -1, 0.5f, 1, 1, 0.5f, -1, 1, 0.5f};
    const float corners[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    float inset[STEPS][3] = {{0}}, outset[(STEPS + 4) * 3][3] = {{0}}, matrices[VIEWS][16] = {{0}};
    GLuint color, depth, fbo, reader, mask, scene, composition, out;
    int i, view, eye, vertices = 0;
    const char *paper = "#version 300 es\n#extension GL_OVR_multiview : enable\nlayout(num_views = 2) in;\nin vec3 vertexPosition;\n"
                        "uniform mat4 modelViewProjection[2];\nvoid main()\n{\n    gl_Position = modelViewProjection[gl_ViewID] * vec4(vertexPosition, 1.0);\n}\n";
    const GLuint printed = glCreateShader(GL_VERTEX_SHADER);
    GLint compiled = 1;
    if (!attach) fail("no glFramebufferTextureMultisampleMultiviewOVR");
    glShaderSource(printed, 1, &paper, NULL); /* names gl_ViewID, which no extension has */
    glCompileShader(printed);
    glGetShaderiv(printed, GL_COMPILE_STATUS, &compiled);
    printf("as printed %d\n", compiled);
    for (i = 0; i < STEPS; ++i) {
        const float angle = 6.2831853f * (float)i / STEPS, next = 6.2831853f * (float)(i + 1) / STEPS;
        const float *corner = corners[i / (STEPS / 4)];
        const float triangle[3][3] = {{corner[0], corner[1], 0}, {1.1f * cosf(angle), 1.1f * sinf(angle), 0}, {1.1f * cosf(next), 1.1f * sinf(next), 0}};
        inset[i][0] = 0.9f * ratio * cosf(angle);
        inset[i][1] = 0.9f * ratio * sinf(angle);
        memcpy(outset[vertices], triangle, sizeof triangle);
        vertices += 3;
    }
    color = make_array(GL_RGBA8, SIZE);
    depth = make_array(GL_DEPTH_COMPONENT24, SIZE);
    glGenFramebuffers(1, &reader);
    glGenFramebuffers(1, &fbo);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, fbo);
    attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 1000, 0, VIEWS);
    printf("1000 samples %04x", glGetError());
    attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, -1, 0, VIEWS);
    printf(", -1 samples %04x", glGetError());
    attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 4, 0, VIEWS);
    attach(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 4, 0, VIEWS);
    printf(", complete %d\n", glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
    mask = make_program(
        "#version 310 es\n#extension GL_OVR_multiview2 : enable\nin vec3 corner;\nuniform uint kind;\nlayout(num_views = 4) in;\n"
        "void main() { bool narrow = gl_ViewID_OVR == 2u || gl_ViewID_OVR == 3u; gl_Position = vec4(corner.xy, narrow == (kind == 2u) ? 0.0f : 1.0f, 1.0); }\n",
        "#version 310 es\nprecision mediump float;\nout vec4 color;\nvoid main() { color = vec4(1.0, 0.0, 0.0, 1.0); }\n");
    scene = make_program(
        "#version 300 es\n#extension GL_OVR_multiview : enable\nlayout(num_views = 4) in;\nin vec3 vertexPosition;\nuniform mat4 modelViewProjection[4];\n"
        "void main()\n{\n    gl_Position = modelViewProjection[gl_ViewID_OVR] * vec4(vertexPosition, 1.0);\n}\n",
        "#version 300 es\nprecision mediump float;\nout vec4 color;\nvoid main() { color = vec4(0.0, 1.0, 0.0, 1.0); }\n");
    composition = make_program(
        "#version 300 es\nin vec3 corner; uniform float ratio; out vec2 wide; out vec2 narrow;\n"
        "void main() { wide = corner.xy * 0.5 + 0.5; narrow = wide / ratio - (1.0 / ratio - 1.0) / 2.0; gl_Position = vec4(corner, 1.0); }\n",
        "#version 300 es\nprecision mediump float; precision mediump sampler2DArray; in vec2 wide; in vec2 narrow; uniform sampler2DArray views; uniform int eye; out vec4 color;\n"
        "void main() { vec2 far = vec2(0.5) - narrow; color = dot(far, far) > 0.25 ? textureLod(views, vec3(wide, eye), 0.0) : textureLod(views, vec3(narrow, eye + 2), 0.0); }\n");
    for (view = 0; view < VIEWS; ++view) {
        matrices[view][0] = matrices[view][5] = view < 2 ? 1 : 1 / ratio;
        matrices[view][10] = matrices[view][15] = 1;
    }
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glViewport(0, 0, SIZE, SIZE);
    glBindFramebuffer(GL_FRAMEBUFFER, fbo);
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glUseProgram(mask);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, inset);
    glUniform1ui(glGetUniformLocation(mask, "kind"), 1);
    glDrawArrays(GL_TRIANGLE_FAN, 0, STEPS);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, outset);
    glUniform1ui(glGetUniformLocation(mask, "kind"), 2);
    glDrawArrays(GL_TRIANGLES, 0, vertices);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glUseProgram(scene);
    glUniformMatrix4fv(glGetUniformLocation(scene, "modelViewProjection"), VIEWS, GL_FALSE, matrices[0]);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, quad);
    glDrawArrays(GL_TRIANGLES, 0, 6);
    check_gl("masks");
    for (view = 0; view < VIEWS; ++view) {
        int drawn = 0;
        read_layer(reader, color, view, SIZE);
        for (i = 0; i < SIZE * SIZE; ++i) drawn += pixels[4 * i + 1] == 255;
        i = 4 * (SIZE / 2 * SIZE + SIZE / 2);
        printf("view %d: %d of 100 drawn, middle %d, corner %d\n", view, (100 * drawn + SIZE * SIZE / 2) / (SIZE * SIZE), pixels[i + 1] == 255, pixels[1] == 255);
    }
    out = make_framebuffer(make_texture(SIZE, SIZE), SIZE, SIZE);
    glBindFramebuffer(GL_FRAMEBUFFER, out);
    glUseProgram(composition);
    glBindTexture(GL_TEXTURE_2D_ARRAY, color);
    glUniform1f(glGetUniformLocation(composition, "ratio"), ratio);
    for (eye = 0; eye < 2; ++eye) {
        int holes = 0;
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glUniform1i(glGetUniformLocation(composition, "eye"), eye);
        glDrawArrays(GL_TRIANGLES, 0, 6);
        glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
        for (i = 0; i < SIZE * SIZE; ++i) holes += pixels[4 * i + 1] != 255;
        printf("eye %d: %d holes\n", eye, holes);
    }
    check_gl("composition of masks");
}

/* column-major: a camera at (eye, 0, 5) that looks along -z with the tangent of half its angle, in front of a cube at x */
static void look(float *m, float tangent, float eye, float x, float angle) {
    const float c = cosf(angle), n = sinf(angle), near = 0.1f, far = 100, zoom = 1 / tangent;
    const float a = -(far + near) / (far - near), b = -2 * far * near / (far - near);
    const float matrix[16] = {zoom * c, 0, -a * n, n, 0, zoom, 0, 0, zoom * n, 0, a * c, -c, zoom * (x - eye), 0, -5 * a + b, 5};
    memcpy(m, matrix, sizeof matrix);
}

static void cubes(PFNGLFRAMEBUFFERTEXTUREMULTIVIEWOVRPROC attach) {
    enum { WIDE = 256 };
    static const float axes[6][3] = {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    float vertices[24][3], normals[24][3], matrices[VIEWS][16];
    GLushort indices[36];
    GLuint color = make_array(GL_RGBA8, WIDE), depth = make_array(GL_DEPTH_COMPONENT24, WIDE), fbo, reader, out, program, composition;
    long drawn[VIEWS] = {0};
    int face, corner, frame, cube, view, i, eye;
    uint8_t wide[4], inset[4];
    for (face = 0; face < 6; ++face)
        for (corner = 0; corner < 4; ++corner)
            for (i = 0; i < 3; ++i) {
                const int side = axes[face][i] != 0 ? 0 : i == (axes[face][(i + 1) % 3] != 0 ? (i + 2) % 3 : i) ? 1 : 2;
                const float across = side == 1 ? 1.0f : 0.0f, along = side == 2 ? 1.0f : 0.0f;
                vertices[4 * face + corner][i] = axes[face][i] + across * (corner == 0 || corner == 3 ? -1 : 1) + along * (corner < 2 ? -1 : 1);
                normals[4 * face + corner][i] = axes[face][i];
            }
    for (face = 0; face < 6; ++face)
        for (i = 0; i < 6; ++i) indices[6 * face + i] = (GLushort)(4 * face + "012023"[i] - '0');
    program = make_program(
        "#version 300 es\n#extension GL_OVR_multiview : enable\nlayout(num_views = 4) in;\n"
        "layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal; uniform mat4 transform[4]; out vec3 facing;\n"
        "void main() { gl_Position = transform[gl_ViewID_OVR] * vec4(position, 1.0); facing = normal; }",
        "#version 300 es\nprecision highp float; in vec3 facing; out vec4 color; void main() { color = vec4(abs(facing), 1.0); }");
    composition = make_program(
        "#version 300 es\nout highp vec2 at; void main() { vec2 p = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0;\n"
        "  at = p * 0.5 + 0.5; gl_Position = vec4(p, 0.5, 1.0); }",
        "#version 300 es\nprecision highp float; precision highp sampler2DArray; in vec2 at; uniform sampler2DArray views; uniform int eye; out vec4 color;\n"
        "void main() { vec2 inner = at * 2.0 - 0.5; float sharp = smoothstep(-0.25, -0.04, -dot(inner - 0.5, inner - 0.5));\n"
        "  color = mix(texture(views, vec3(at, eye)), texture(views, vec3(inner, eye + 2)), sharp); }");
    glGenFramebuffers(1, &fbo);
    glGenFramebuffers(1, &reader);
    out = make_framebuffer(make_texture(WIDE, WIDE), WIDE, WIDE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    for (frame = 0; frame < 3; ++frame) {
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, fbo);
        if (frame == 0) {
            attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0, 0, VIEWS);
            attach(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0, 0, VIEWS);
            if (glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) fail("four views incomplete");
        }
        glViewport(0, 0, WIDE, WIDE);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
        glUseProgram(program);
        glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, vertices);
        glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 0, normals);
        glEnableVertexAttribArray(0);
        glEnableVertexAttribArray(1);
        for (cube = 0; cube < 3; ++cube) { /* the outer two are out of sight of the narrow cameras */
            for (view = 0; view < VIEWS; ++view)
                look(matrices[view], view < 2 ? 1 : 0.5f, view & 1 ? 0.5f : -0.5f, cube == 0 ? 0 : cube == 1 ? -40 : 40, 0.02f * (float)frame);
            glUniformMatrix4fv(glGetUniformLocation(program, "transform"), VIEWS, GL_FALSE, matrices[0]);
            glDrawElements(GL_TRIANGLES, 36, GL_UNSIGNED_SHORT, indices);
        }
        glDisableVertexAttribArray(1);
        glBindFramebuffer(GL_FRAMEBUFFER, out);
        glUseProgram(composition);
        glBindTexture(GL_TEXTURE_2D_ARRAY, color);
        for (eye = 0; eye < 2; ++eye) {
            glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
            glUniform1i(glGetUniformLocation(composition, "eye"), eye);
            glDrawArrays(GL_TRIANGLES, 0, 3);
        }
    }
    glReadPixels(WIDE / 2 - 8, WIDE / 2, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, inset);
    glReadPixels(3, 3, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, wide);
    printf("right eye: middle faces us %d, corner empty %d\n", inset[2] == 255 && inset[0] == 0, wide[2] == 0);
    for (view = 0; view < VIEWS; ++view) {
        read_layer(reader, color, view, WIDE);
        for (i = 0; i < WIDE * WIDE; ++i) drawn[view] += pixels[4 * i + 3] == 255;
    }
    printf("wide %d, twice as large in the insets: %d %d\n", drawn[0] > 1000, (int)((drawn[2] + drawn[0] / 2) / drawn[0]), (int)((drawn[3] + drawn[1] / 2) / drawn[1]));
    check_gl("cubes");
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
    if (argc > 1 && !strcmp(argv[1], "cubes")) {
        cubes(attach);
        close_context();
        return 0;
    }
    if (argc > 1 && !strcmp(argv[1], "masks")) {
        masks();
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
