/* A program with a window that knows nothing of foveation. It draws, resizes its window, draws again, and prints for each
 * size how many pixels wide the rendered pixels are in the middle and in a corner (1: full density), and on X11 whether the server
 * shows what the program has read. At the end a hash of all pictures. usage: window_program x11|wayland */
#include <wayland-client.h>
#include <wayland-egl.h>
#include <xcb/xcb.h>

#include "gles_program.h"
#include "xdg-shell-client-protocol.h"

#ifndef EGL_PLATFORM_XCB_EXT
#define EGL_PLATFORM_XCB_EXT 0x31DC
#endif
#ifndef EGL_PLATFORM_WAYLAND_EXT
#define EGL_PLATFORM_WAYLAND_EXT 0x31D8
#endif

enum { MOST = 512 * 512, FRAMES = 3 };
static uint8_t pixels[4 * MOST];
static EGLSurface surface;
static int width = 300, height = 200;

static xcb_connection_t *x_server;
static xcb_window_t x_window;
static const xcb_screen_t *x_screen;

static struct wl_display *compositor;
static struct wl_compositor *surfaces;
static struct xdg_wm_base *shell;
static struct wl_egl_window *wayland_window;
static int configured;

static void open_egl(EGLenum platform, void *native, EGLint visual) {
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_WINDOW_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_RED_SIZE, 8, EGL_DEPTH_SIZE, 24, EGL_NONE};
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1, EGL_NONE};
    EGLConfig configs[128], config = NULL;
    EGLint found = 0, i;
    program_display = eglGetPlatformDisplay(platform, native, NULL);
    if (!eglInitialize(program_display, NULL, NULL)) fail("eglInitialize");
    eglBindAPI(EGL_OPENGL_ES_API);
    if (!eglChooseConfig(program_display, wanted, configs, 128, &found)) fail("eglChooseConfig");
    for (i = 0; i < found && !config; ++i) {
        EGLint id = 0, red = 0;
        eglGetConfigAttrib(program_display, configs[i], EGL_NATIVE_VISUAL_ID, &id);
        eglGetConfigAttrib(program_display, configs[i], EGL_RED_SIZE, &red);
        if (red == 8 && (visual == 0 || id == visual)) config = configs[i];
    }
    if (!config) fail("no config for the window");
    program_context = eglCreateContext(program_display, config, EGL_NO_CONTEXT, attributes);
    surface = eglCreatePlatformWindowSurface(program_display, config, x_server ? (void *)&x_window : (void *)wayland_window, NULL);
    if (!eglMakeCurrent(program_display, surface, surface, program_context)) fail("eglMakeCurrent");
    eglSwapInterval(program_display, 0);
}

static void open_x11(void) {
    int screen;
    x_server = xcb_connect(NULL, &screen);
    if (xcb_connection_has_error(x_server)) fail("no X server");
    x_screen = xcb_setup_roots_iterator(xcb_get_setup(x_server)).data;
    x_window = xcb_generate_id(x_server);
    xcb_create_window(x_server, XCB_COPY_FROM_PARENT, x_window, x_screen->root, 0, 0, (uint16_t)width, (uint16_t)height, 0,
                      XCB_WINDOW_CLASS_INPUT_OUTPUT, x_screen->root_visual, 0, NULL);
    xcb_map_window(x_server, x_window);
    free(xcb_get_geometry_reply(x_server, xcb_get_geometry(x_server, x_window), NULL)); /* the window is there now */
    open_egl(EGL_PLATFORM_XCB_EXT, x_server, (EGLint)x_screen->root_visual);
}

static void add_global(void *data, struct wl_registry *registry, uint32_t name, const char *interface, uint32_t version) {
    (void)data, (void)version;
    if (!strcmp(interface, "wl_compositor")) surfaces = wl_registry_bind(registry, name, &wl_compositor_interface, 1);
    if (!strcmp(interface, "xdg_wm_base")) shell = wl_registry_bind(registry, name, &xdg_wm_base_interface, 1);
}
static void remove_global(void *data, struct wl_registry *registry, uint32_t name) { (void)data, (void)registry, (void)name; }
static void pong(void *data, struct xdg_wm_base *base, uint32_t serial) {
    (void)data;
    xdg_wm_base_pong(base, serial);
}
static void configure(void *data, struct xdg_surface *of, uint32_t serial) {
    (void)data;
    xdg_surface_ack_configure(of, serial);
    configured = 1;
}
static void configure_toplevel(void *data, struct xdg_toplevel *of, int32_t w, int32_t h, struct wl_array *states) {
    (void)data, (void)of, (void)w, (void)h, (void)states;
}
static void close_toplevel(void *data, struct xdg_toplevel *of) { (void)data, (void)of; }

static void open_wayland(void) {
    static const struct wl_registry_listener globals = {add_global, remove_global};
    static const struct xdg_wm_base_listener pings = {pong};
    static const struct xdg_surface_listener configures = {configure};
    static const struct xdg_toplevel_listener toplevels = {.configure = configure_toplevel, .close = close_toplevel};
    struct wl_surface *wayland_surface;
    struct xdg_surface *role;
    struct xdg_toplevel *toplevel;
    compositor = wl_display_connect(NULL);
    if (!compositor) fail("no Wayland compositor");
    wl_registry_add_listener(wl_display_get_registry(compositor), &globals, NULL);
    wl_display_roundtrip(compositor);
    if (!surfaces || !shell) fail("the compositor has no xdg_wm_base");
    xdg_wm_base_add_listener(shell, &pings, NULL);
    wayland_surface = wl_compositor_create_surface(surfaces);
    role = xdg_wm_base_get_xdg_surface(shell, wayland_surface);
    xdg_surface_add_listener(role, &configures, NULL);
    toplevel = xdg_surface_get_toplevel(role);
    xdg_toplevel_add_listener(toplevel, &toplevels, NULL);
    wl_surface_commit(wayland_surface);
    while (!configured)
        if (wl_display_dispatch(compositor) < 0) fail("the compositor has gone away");
    wayland_window = wl_egl_window_create(wayland_surface, width, height);
    open_egl(EGL_PLATFORM_WAYLAND_EXT, compositor, 0);
}

static void resize(int w, int h) {
    const uint32_t values[] = {(uint32_t)w, (uint32_t)h};
    width = w, height = h;
    if (wayland_window) {
        wl_egl_window_resize(wayland_window, w, h, 0, 0);
    } else {
        xcb_configure_window(x_server, x_window, XCB_CONFIG_WINDOW_WIDTH | XCB_CONFIG_WINDOW_HEIGHT, values);
        free(xcb_get_geometry_reply(x_server, xcb_get_geometry(x_server, x_window), NULL));
    }
}

/* Whether the server shows in the window what was read from it: its rows begin at the top, and its pixels are BGRX. */
static int shown_as_read(void) {
    xcb_get_image_reply_t *image = xcb_get_image_reply(
        x_server, xcb_get_image(x_server, XCB_IMAGE_FORMAT_Z_PIXMAP, x_window, 0, 0, (uint16_t)width, (uint16_t)height, ~0u), NULL);
    int x, y, same = image != NULL;
    for (y = 0; same && y < height; ++y)
        for (x = 0; x < width; ++x) {
            const uint8_t *shown = xcb_get_image_data(image) + 4 * (y * width + x), *read = pixels + 4 * ((height - 1 - y) * width + x);
            if (shown[2] != read[0] || shown[1] != read[1] || shown[0] != read[2]) same = 0;
        }
    free(image);
    return same;
}

int main(int argc, char **argv) {
    static const int kSizes[][2] = {{300, 200}, {512, 320}, {200, 300}, {300, 200}};
    uint64_t all = 1;
    GLuint footprint;
    GLint size;
    unsigned i, frame;
    if (argc > 1 && !strcmp(argv[1], "wayland")) open_wayland();
    else open_x11();
    footprint = footprint_program();
    size = glGetUniformLocation(footprint, "size");
    glEnable(GL_DEPTH_TEST);
    glUseProgram(footprint);
    for (i = 0; i < sizeof kSizes / sizeof kSizes[0]; ++i) {
        if (i > 0) resize(kSizes[i][0], kSizes[i][1]);
        for (frame = 0; frame < FRAMES; ++frame) {
            glViewport(0, 0, width, height);
            glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
            glUniform2f(size, (float)width, (float)height);
            glDrawArrays(GL_TRIANGLES, 0, 3);
            if (frame == FRAMES - 1) glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
            if (!eglSwapBuffers(program_display, surface)) fail("eglSwapBuffers");
            if (compositor && wl_display_roundtrip(compositor) < 0) fail("the compositor has gone away");
        }
        all = all * 31 + hash(pixels, (size_t)(4 * width * height));
        printf("%dx%d: middle %d corner %d%s\n", width, height, width_of(pixels, width, width / 2, height / 2),
               width_of(pixels, width, width - 4, height - 4), !x_server ? "" : shown_as_read() ? ", shown" : ", NOT shown");
    }
    check_gl("end");
    printf("hash %016llx\n", (unsigned long long)all);
    close_context();
    return 0;
}
