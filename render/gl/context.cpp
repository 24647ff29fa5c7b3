#include "render/gl/context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdio>
#include <mutex>
#include <string_view>

namespace fovea::gl {
namespace {

constexpr const char* kInstall = "install a driver: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri";

// One display for the whole process: eglTerminate would pull it from under every other context.
struct Display {
    EGLDisplay handle = EGL_NO_DISPLAY;
    Error error;
};

Display open_display() {
    Display d;
    // epoxy aborts the process when it cannot load libEGL; look first.
    void* library = dlopen("libEGL.so.1", RTLD_LAZY | RTLD_LOCAL);
    if (library == nullptr) {
        d.error = {"libEGL.so.1 cannot be loaded", "EGL", kInstall};
        return d;
    }
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (client == nullptr || std::string_view(client).find("EGL_MESA_platform_surfaceless") == std::string_view::npos) {
        d.error = {"no EGL driver offers the surfaceless platform", "EGL", kInstall};
        return d;
    }
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || eglInitialize(display, &major, &minor) == EGL_FALSE) {
        std::array<char, 32> code{};
        std::snprintf(code.data(), code.size(), "0x%04x", static_cast<unsigned>(eglGetError()));
        d.error = {"the EGL display cannot be initialised (EGL error " + std::string(code.data()) + ")", "EGL", kInstall};
        return d;
    }
    const char* have = eglQueryString(display, EGL_EXTENSIONS);
    for (const char* need : {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"})
        if (have == nullptr || std::string_view(have).find(need) == std::string_view::npos) {
            d.error = {std::string("the EGL driver lacks ") + need, "EGL", kInstall};
            return d;
        }
    d.handle = display;
    return d;
}

const Display& display() {
    static const Display d = open_display();
    return d;
}

const char* text(GLenum name) {
    const auto* s = reinterpret_cast<const char*>(glGetString(name));
    return s != nullptr ? s : "";
}

}  // namespace

struct Context::State {
    EGLContext handle = EGL_NO_CONTEXT;
    ContextInfo info;
    ~State() {
        if (handle == EGL_NO_CONTEXT) return;
        if (eglGetCurrentContext() == handle) release();
        eglDestroyContext(display().handle, handle);
    }
};

Context::Context(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Context::Context(Context&&) noexcept = default;
Context& Context::operator=(Context&&) noexcept = default;
Context::~Context() = default;

Result<Context> Context::create(const Context* share) {
    const Display& d = display();
    if (d.handle == EGL_NO_DISPLAY) return std::unexpected(d.error);
    eglBindAPI(EGL_OPENGL_ES_API);
    auto state = std::make_unique<State>();
    for (const EGLint minor : {2, 1}) {
        const std::array<EGLint, 5> attributes{EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, minor, EGL_NONE};
        state->handle = eglCreateContext(d.handle, EGL_NO_CONFIG_KHR, share != nullptr ? share->state_->handle : EGL_NO_CONTEXT,
                                         attributes.data());
        if (state->handle != EGL_NO_CONTEXT) break;
    }
    if (state->handle == EGL_NO_CONTEXT)
        return fail("the driver offers no OpenGL ES 3.1 context", "EGL", "use a newer driver, or unset GALLIUM_DRIVER and LIBGL_* overrides");
    if (eglMakeCurrent(d.handle, EGL_NO_SURFACE, EGL_NO_SURFACE, state->handle) == EGL_FALSE)
        return fail("the context cannot be made current without a surface", "EGL", kInstall);
    ContextInfo& info = state->info;
    info.renderer = text(GL_RENDERER);
    info.vendor = text(GL_VENDOR);
    info.version = text(GL_VERSION);
    glGetIntegerv(GL_MAJOR_VERSION, &info.major);
    glGetIntegerv(GL_MINOR_VERSION, &info.minor);
    glGetIntegerv(GL_MAX_SAMPLES, &info.max_samples);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &info.max_texture_px);
    for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"})
        info.software = info.software || info.renderer.find(name) != std::string::npos;
    info.multiview2 = epoxy_has_gl_extension("GL_OVR_multiview2");
    info.fragment_shading_rate = epoxy_has_gl_extension("GL_EXT_fragment_shading_rate");
    info.qcom_framebuffer_foveated = epoxy_has_gl_extension("GL_QCOM_framebuffer_foveated");
    info.qcom_texture_foveated = epoxy_has_gl_extension("GL_QCOM_texture_foveated");
    return Context(std::move(state));
}

const ContextInfo& Context::info() const noexcept { return state_->info; }

bool Context::make_current() const noexcept {
    return eglMakeCurrent(display().handle, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->handle) == EGL_TRUE;
}

void Context::release() noexcept { eglMakeCurrent(display().handle, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

void (*driver_function(const char* name))() { return eglGetProcAddress(name); }

std::string pending_error() {
    std::string all;
    for (int i = 0; i < 16; ++i) {
        const GLenum e = glGetError();
        if (e == GL_NO_ERROR) break;
        const char* name = e == GL_INVALID_ENUM        ? "GL_INVALID_ENUM"
                           : e == GL_INVALID_VALUE     ? "GL_INVALID_VALUE"
                           : e == GL_INVALID_OPERATION ? "GL_INVALID_OPERATION"
                           : e == GL_OUT_OF_MEMORY     ? "GL_OUT_OF_MEMORY"
                           : e == GL_INVALID_FRAMEBUFFER_OPERATION ? "GL_INVALID_FRAMEBUFFER_OPERATION"
                                                                   : "unknown GL error";
        all += (all.empty() ? "" : ", ") + std::string(name);
    }
    return all;
}

}  // namespace fovea::gl
