/* An EGL vendor library for one measurement (calls_program.c): it loads the layer, which loads the driver, and gives a
 * program both ways to every function in one process and one context. glNAME is the layer's; glNAMEDirect is the driver's,
 * as a program without the layer gets it. Both are reached through stubs of libglvnd; the layer may rewrite its own.
 * Environment: TWO_PATHS_LAYER, the file of the layer. */
#include <dlfcn.h>
#include <glvnd/libeglabi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *(*layer_address)(const char *);
static void *(*driver_address)(const char *);

static void *address(const char *name) {
    static const char kSuffix[] = "Direct";
    const size_t length = strlen(name), suffix = sizeof kSuffix - 1;
    char stem[128];
    if (length <= suffix || length - suffix >= sizeof stem || strcmp(name + length - suffix, kSuffix) != 0) return layer_address(name);
    memcpy(stem, name, length - suffix);
    stem[length - suffix] = 0;
    return driver_address(stem);
}

static int load(const char *file, uint32_t version, const __EGLapiExports *exports, __EGLvendorInfo *vendor, __EGLapiImports *imports) {
    void *library = file ? dlopen(file, RTLD_NOW | RTLD_LOCAL) : NULL;
    __PFNEGLMAINPROC start = NULL;
    if (library) *(void **)&start = dlsym(library, __EGL_MAIN_PROTO_NAME);
    if (!start) fprintf(stderr, "two_paths: cannot load %s\n", file ? file : "the layer: TWO_PATHS_LAYER is not set");
    return start && start(version, exports, vendor, imports);
}

__attribute__((visibility("default"))) EGLBoolean __egl_Main(uint32_t version, const __EGLapiExports *exports, __EGLvendorInfo *vendor,
                                                             __EGLapiImports *imports) {
    __EGLapiImports driver = *imports;
    if (!load("libEGL_mesa.so.0", version, exports, vendor, &driver)) return EGL_FALSE;
    if (!load(getenv("TWO_PATHS_LAYER"), version, exports, vendor, imports)) return EGL_FALSE;
    driver_address = driver.getProcAddress;
    layer_address = imports->getProcAddress;
    imports->getProcAddress = address;
    return EGL_TRUE;
}
