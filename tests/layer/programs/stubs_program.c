/* Where the stubs of libglvnd lead that a program calls: prints for four functions the library that each call goes to, before and
 * after the program foveates a framebuffer. Stubs that libglvnd has not let the layer rewrite are "not rewritten". */
#define _GNU_SOURCE
#include <dlfcn.h>

#include "gles_program.h"

static const char *leads_to(const char *function) {
    const unsigned char *stub = (const unsigned char *)eglGetProcAddress(function);
    void *const *slot = NULL;
    Dl_info library;
    if (!stub) fail(function);
#if defined(__x86_64__)
    if (stub[0] == 0xff && stub[1] == 0x25) { /* jmp [rip + distance] */
        int32_t distance;
        memcpy(&distance, stub + 2, sizeof distance);
        slot = (void *const *)(stub + 6 + distance);
    } else if (stub[0] == 0x49 && stub[1] == 0xbb && stub[10] == 0x41 && stub[11] == 0xff && stub[12] == 0x23) {
        memcpy(&slot, stub + 2, sizeof slot); /* movabs r11, slot; jmp [r11] */
    }
#endif
    if (!slot) return "not rewritten";
    if (!dladdr(*slot, &library)) fail("dladdr");
    return strstr(library.dli_fname, "fovea_layer") ? "layer" : "driver";
}

static void print(const char *when) {
    static const char *const kFunctions[] = {"glUniform2f", "glDrawArrays", "glGenTextures", "glGetError"};
    int i;
    printf("%s:", when);
    for (i = 0; i < 4; ++i) printf(" %s %s%s", kFunctions[i], leads_to(kFunctions[i]), i < 3 ? "," : "\n");
}

int main(void) {
    PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC configure;
    GLuint framebuffer, made = 0;
    open_context();
    print("idle");
    configure = (PFNGLFRAMEBUFFERFOVEATIONCONFIGQCOMPROC)eglGetProcAddress("glFramebufferFoveationConfigQCOM");
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, make_texture(64, 64), 0);
    configure(framebuffer, 1, 1, GL_FOVEATION_ENABLE_BIT_QCOM, &made);
    check_gl("configure");
    print("foveated");
    close_context();
    return 0;
}
