// The EGL vendor library that libglvnd loads in place of the driver's: it loads the driver's, and hands programs the
// layer's functions where calls.txt asks for them.
//
//   program -> libEGL/libGLESv2 (libglvnd) -> libfovea_layer -> driver (libEGL_mesa.so.0, or FOVEA_LAYER_VENDOR)
//
// Source: glvnd/libeglabi.h. Threads: as EGL. Errors: a driver that cannot be loaded is named on stderr, and libglvnd
// goes on without a vendor.
// First: the ABI header of libglvnd brings the declarations of desktop GL, which hide those of OpenGL ES.
#include "render/layer/context.hpp"

#include <dlfcn.h>
#include <glvnd/libeglabi.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>

#include "render/layer/entry_points.hpp"
#include "render/layer/extrapolate.hpp"

namespace fovea::layer {
namespace {

void* (*driver_address)(const char*) = nullptr;

struct Egl {
    EGLBoolean (*MakeCurrent)(EGLDisplay, EGLSurface, EGLSurface, EGLContext) = nullptr;
    EGLContext (*CreateContext)(EGLDisplay, EGLConfig, EGLContext, const EGLint*) = nullptr;
    EGLBoolean (*DestroyContext)(EGLDisplay, EGLContext) = nullptr;
    EGLBoolean (*SwapBuffers)(EGLDisplay, EGLSurface) = nullptr;
    EGLBoolean (*SwapBuffersWithDamageEXT)(EGLDisplay, EGLSurface, const EGLint*, EGLint) = nullptr;
    EGLBoolean (*SwapBuffersWithDamageKHR)(EGLDisplay, EGLSurface, const EGLint*, EGLint) = nullptr;
    EGLBoolean (*CopyBuffers)(EGLDisplay, EGLSurface, EGLNativePixmapType) = nullptr;
    EGLBoolean (*Terminate)(EGLDisplay) = nullptr;
    EGLBoolean (*ReleaseThread)() = nullptr;
    EGLBoolean (*WaitClient)() = nullptr;
    EGLBoolean (*WaitGL)() = nullptr;
    EGLSync (*CreateSync)(EGLDisplay, EGLenum, const EGLAttrib*) = nullptr;
    EGLSync (*CreateSyncKHR)(EGLDisplay, EGLenum, const EGLint*) = nullptr;
} egl;

struct Contexts {
    std::mutex mutex;
    std::map<EGLContext, std::shared_ptr<Context>> all;
    std::map<EGLContext, std::shared_ptr<ShareGroup>> shares;
};
// Never destroyed: threads and exit handlers of the program may still call in.
Contexts& contexts() {
    static auto* instance = new Contexts;
    return *instance;
}
thread_local std::shared_ptr<Context> t_owner;

void end_frame(Call call) {
    if (Context* c = t_context; c && c->active()) c->frame_ended(call);
}
// The program says what it changed, but the fovea may have moved elsewhere.
bool everything_changed() {
    const Context* c = t_context;
    return c && c->automatic() && c->frame_is_foveated();
}
void finish_pending(Call call) {
    if (Context* c = t_context; c && c->active()) c->before_finish(call);
}

EGLContext create_context(EGLDisplay display, EGLConfig config, EGLContext share, const EGLint* attributes) {
    const EGLContext made = egl.CreateContext(display, config, share, attributes);
    if (made == EGL_NO_CONTEXT) return made;
    const std::lock_guard lock(contexts().mutex);
    const auto shared = contexts().shares.find(share);
    auto group = share != EGL_NO_CONTEXT && shared != contexts().shares.end() ? shared->second : std::make_shared<ShareGroup>();
    contexts().shares[made] = group;
    contexts().all[made] = std::make_shared<Context>(std::move(group));
    return made;
}

EGLBoolean destroy_context(EGLDisplay display, EGLContext context) {
    const EGLBoolean done = egl.DestroyContext(display, context);
    if (!done) return done;
    std::shared_ptr<Context> gone;
    {
        const std::lock_guard lock(contexts().mutex);
        if (const auto it = contexts().all.find(context); it != contexts().all.end()) {
            gone = std::move(it->second);
            contexts().all.erase(it);
        }
        contexts().shares.erase(context);
    }
    // Still current somewhere: lives, in the driver and here, until it no longer is.
    if (!gone) return done;
    gone->to_be_destroyed = true;
    if (gone.use_count() == 1) gone->abandon();
    return done;
}

EGLBoolean make_current(EGLDisplay display, EGLSurface draw, EGLSurface read, EGLContext context) {
    const std::shared_ptr<Context> before = t_owner;
    std::shared_ptr<Context> next;
    {
        const std::lock_guard lock(contexts().mutex);
        if (const auto it = contexts().all.find(context); it != contexts().all.end()) next = it->second;
    }
    if (before && before->active()) {
        before->before_finish(kCallMakeCurrent);
    }
    if (before && before != next && before->to_be_destroyed && (before->active() || before->extrapolates())) before->release_images();
    const EGLBoolean done = egl.MakeCurrent(display, draw, read, context);
    if (!done) return done;
    t_owner = next;
    t_context = next.get();
    if (next) next->made_current(display, draw);
    if (before && before != next && before.use_count() == 1) before->abandon();  // destroyed while it was current
    return done;
}

EGLBoolean release_thread() {
    if (t_owner && t_owner->active()) t_owner->before_finish(kCallMakeCurrent);
    if (t_owner && t_owner->to_be_destroyed && (t_owner->active() || t_owner->extrapolates())) t_owner->release_images();
    const EGLBoolean done = egl.ReleaseThread();
    if (done) {
        t_context = nullptr;
        if (t_owner && t_owner.use_count() == 1) t_owner->abandon();
        t_owner.reset();
    }
    return done;
}

EGLBoolean swap_buffers(EGLDisplay display, EGLSurface surface) {
    end_frame(kCallSwapBuffers);
    return egl.SwapBuffers(display, surface);
}
EGLBoolean swap_with_damage_ext(EGLDisplay display, EGLSurface surface, const EGLint* rects, EGLint count) {
    end_frame(kCallSwapBuffers);
    if (everything_changed()) rects = nullptr, count = 0;
    return egl.SwapBuffersWithDamageEXT(display, surface, rects, count);
}
EGLBoolean swap_with_damage_khr(EGLDisplay display, EGLSurface surface, const EGLint* rects, EGLint count) {
    end_frame(kCallSwapBuffers);
    if (everything_changed()) rects = nullptr, count = 0;
    return egl.SwapBuffersWithDamageKHR(display, surface, rects, count);
}
EGLBoolean copy_buffers(EGLDisplay display, EGLSurface surface, EGLNativePixmapType pixmap) {
    finish_pending(kCallSwapBuffers);
    return egl.CopyBuffers(display, surface, pixmap);
}
EGLBoolean terminate(EGLDisplay display) {
    stats.write_if_asked();
    return egl.Terminate(display);
}
EGLBoolean wait_client() {
    finish_pending(kCallEglSync);
    return egl.WaitClient();
}
EGLBoolean wait_gl() {
    finish_pending(kCallEglSync);
    return egl.WaitGL();
}
EGLSync create_sync(EGLDisplay display, EGLenum type, const EGLAttrib* attributes) {
    finish_pending(kCallEglSync);
    return egl.CreateSync(display, type, attributes);
}
EGLSync create_sync_khr(EGLDisplay display, EGLenum type, const EGLint* attributes) {
    finish_pending(kCallEglSync);
    return egl.CreateSyncKHR(display, type, attributes);
}

struct EglRow {
    const char* name;
    void** slot;
    void* wrapper;
};

template <class Function>
EglRow row(const char* name, Function*& slot, Function* wrapper) {
    return {name, reinterpret_cast<void**>(&slot), reinterpret_cast<void*>(wrapper)};
}

const EglRow kEglRows[] = {
    row("eglMakeCurrent", egl.MakeCurrent, make_current),
    row("eglCreateContext", egl.CreateContext, create_context),
    row("eglDestroyContext", egl.DestroyContext, destroy_context),
    row("eglSwapBuffers", egl.SwapBuffers, swap_buffers),
    row("eglSwapBuffersWithDamageEXT", egl.SwapBuffersWithDamageEXT, swap_with_damage_ext),
    row("eglSwapBuffersWithDamageKHR", egl.SwapBuffersWithDamageKHR, swap_with_damage_khr),
    row("eglCopyBuffers", egl.CopyBuffers, copy_buffers),
    row("eglTerminate", egl.Terminate, terminate),
    row("eglReleaseThread", egl.ReleaseThread, release_thread),
    row("eglWaitClient", egl.WaitClient, wait_client),
    row("eglWaitGL", egl.WaitGL, wait_gl),
    row("eglCreateSync", egl.CreateSync, create_sync),
    row("eglCreateSyncKHR", egl.CreateSyncKHR, create_sync_khr),
};

bool is_ours(const char* name) {
    return std::strcmp(name, "glFramebufferFoveationConfigQCOM") == 0 || std::strcmp(name, "glFramebufferTextureMultiviewOVR") == 0 ||
           std::strcmp(name, "glFramebufferTextureMultisampleMultiviewOVR") == 0 || std::strcmp(name, "glExtrapolateTex2DQCOM") == 0 ||
           std::strcmp(name, "glFramebufferFoveationParametersQCOM") == 0 || std::strcmp(name, "glTextureFoveationParametersQCOM") == 0;
}

void* address(const char* name) {
    void* real = driver_address(name);
    for (const EglRow& r : kEglRows)
        if (std::strcmp(r.name, name) == 0) {
            if (!real) return nullptr;
            *r.slot = real;
            return r.wrapper;
        }
    const Row* end = kRows + kRowCount;
    const Row* found = std::lower_bound(kRows, end, name, [](const Row& r, const char* n) { return std::strcmp(r.name, n) < 0; });
    if (found == end || std::strcmp(found->name, name) != 0) return real;
    if (!real && !is_ours(name)) return nullptr;
    if (!*found->slot) *found->slot = real;
    return found->wrapper ? found->wrapper : real;
}

const char* vendor_name() {
    const char* name = std::getenv("FOVEA_LAYER_VENDOR");
    return name && *name ? name : "libEGL_mesa.so.0";
}

}  // namespace

bool surface_size(EGLDisplay display, EGLSurface surface, int& width, int& height) {
    static const auto query = reinterpret_cast<EGLBoolean (*)(EGLDisplay, EGLSurface, EGLint, EGLint*)>(driver_address("eglQuerySurface"));
    EGLint w = 0, h = 0;
    if (!query || !query(display, surface, EGL_WIDTH, &w) || !query(display, surface, EGL_HEIGHT, &h)) return false;
    width = w;
    height = h;
    return true;
}

void (*driver_function(const char* name))() { return reinterpret_cast<void (*)()>(driver_address(name)); }

}  // namespace fovea::layer

extern "C" __attribute__((visibility("default"))) EGLBoolean __egl_Main(uint32_t version, const __EGLapiExports* exports,
                                                                        __EGLvendorInfo* vendor, __EGLapiImports* imports) {
    using namespace fovea::layer;
    const char* name = vendor_name();
    void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        std::fprintf(stderr, "fovea layer: cannot load the driver: %s (FOVEA_LAYER_VENDOR names another)\n", dlerror());
        return EGL_FALSE;
    }
    const auto driver_main = reinterpret_cast<__PFNEGLMAINPROC>(dlsym(library, __EGL_MAIN_PROTO_NAME));
    if (!driver_main) {
        std::fprintf(stderr, "fovea layer: %s is no EGL vendor library (it has no %s; FOVEA_LAYER_VENDOR names another)\n",
                     name, __EGL_MAIN_PROTO_NAME);
        return EGL_FALSE;
    }
    if (reinterpret_cast<void*>(driver_main) == reinterpret_cast<void*>(&__egl_Main)) {
        std::fprintf(stderr, "fovea layer: FOVEA_LAYER_VENDOR names the layer itself\n");
        return EGL_FALSE;
    }
    if (!driver_main(version, exports, vendor, imports)) return EGL_FALSE;
    driver_address = imports->getProcAddress;
    imports->getProcAddress = address;
    // Not the driver's: they would take the layer out of the way.
    imports->isPatchSupported = [](int type, int bytes) -> GLboolean { return type == __GLDISPATCH_STUB_X86_64 && can_rewrite_stubs(bytes); };
    imports->initiatePatch = [](int, int, DispatchPatchLookupStubOffset lookup) -> GLboolean {
        rewrite_stubs(lookup, address, driver_address);
        return GL_TRUE;
    };
    imports->releasePatch = nullptr;
    imports->patchThreadAttach = nullptr;
    for (unsigned i = 0; i < kRowCount; ++i)
        if (kRows[i].core && !*kRows[i].slot) *kRows[i].slot = driver_address(kRows[i].name);
    for (const char* extra : {"glViewportIndexedfOES"}) (void)address(extra);
    std::atexit([] { stats.write_if_asked(); });
    return EGL_TRUE;
}
