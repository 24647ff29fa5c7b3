#include "render/gl/context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <mutex>
#include <string_view>
#include <utility>

namespace fovea::gl {
namespace {

constexpr const char* kInstall = "install a driver: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri";

#ifndef EGL_PLATFORM_XCB_EXT
#define EGL_PLATFORM_XCB_EXT 0x31DC
#endif

struct PlatformName {
    EGLenum platform;
    const char* extension;   // any of them, separated by a space
    const char* text;
};
PlatformName name_of(Platform platform) noexcept {
    switch (platform) {
        case Platform::wayland: return {EGL_PLATFORM_WAYLAND_EXT, "EGL_EXT_platform_wayland EGL_KHR_platform_wayland", "Wayland"};
        case Platform::xcb: return {EGL_PLATFORM_XCB_EXT, "EGL_EXT_platform_xcb", "X11 (xcb)"};
        case Platform::gbm: return {EGL_PLATFORM_GBM_MESA, "EGL_KHR_platform_gbm EGL_MESA_platform_gbm", "GBM"};
        case Platform::surfaceless: break;
    }
    return {EGL_PLATFORM_SURFACELESS_MESA, "EGL_MESA_platform_surfaceless", "surfaceless"};
}

// The surfaceless one is there once for the whole process: eglTerminate would pull it from under every other context.
struct Display {
    EGLDisplay handle = EGL_NO_DISPLAY;
    Error error;
};

bool lists(std::string_view extensions, std::string_view any_of) {
    while (!any_of.empty()) {
        const auto end = std::min(any_of.find(' '), any_of.size());
        if (extensions.find(any_of.substr(0, end)) != std::string_view::npos) return true;
        any_of.remove_prefix(std::min(end + 1, any_of.size()));
    }
    return false;
}

Display open_display(const NativeDisplay& native) {
    Display d;
    const PlatformName platform = name_of(native.platform);
    // epoxy aborts the process when it cannot load libEGL; look first.
    void* library = dlopen("libEGL.so.1", RTLD_LAZY | RTLD_LOCAL);
    if (library == nullptr) {
        d.error = {"libEGL.so.1 cannot be loaded", "EGL", kInstall};
        return d;
    }
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (client == nullptr || !lists(client, platform.extension)) {
        d.error = {std::string("no EGL driver offers the platform ") + platform.text, "EGL", kInstall};
        return d;
    }
    const EGLDisplay display = eglGetPlatformDisplayEXT(platform.platform, native.handle, nullptr);
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

const Display& surfaceless_display() {
    static const Display d = open_display({});
    return d;
}

const char* text(GLenum name) {
    const auto* s = reinterpret_cast<const char*>(glGetString(name));
    return s != nullptr ? s : "";
}

}  // namespace

struct Context::State {
    EGLDisplay display = EGL_NO_DISPLAY;
    bool own_display = false;
    EGLContext handle = EGL_NO_CONTEXT;
    ContextInfo info;
    ~State() {
        if (handle != EGL_NO_CONTEXT) {
            if (eglGetCurrentContext() == handle) eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
            eglDestroyContext(display, handle);
        }
        if (own_display) eglTerminate(display);
    }
};

Context::Context(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Context::Context(Context&&) noexcept = default;
Context& Context::operator=(Context&&) noexcept = default;
Context::~Context() = default;

Result<Context> Context::create(const Context* share) {
    const Display& d = surfaceless_display();
    if (d.handle == EGL_NO_DISPLAY) return std::unexpected(d.error);
    auto state = std::make_unique<State>();
    state->display = d.handle;
    return finish(std::move(state), share);
}

Result<Context> Context::create(const NativeDisplay& native) {
    if (native.platform == Platform::surfaceless) return create();
    const Display d = open_display(native);
    if (d.handle == EGL_NO_DISPLAY) return std::unexpected(d.error);
    auto state = std::make_unique<State>();
    state->display = d.handle;
    state->own_display = true;
    return finish(std::move(state), nullptr);
}

Result<Context> Context::finish(std::unique_ptr<State> state, const Context* share) {
    eglBindAPI(EGL_OPENGL_ES_API);
    // A driver that can is asked to tell when it has lost the context; shared contexts must agree, and all of ours do.
    const char* have = eglQueryString(state->display, EGL_EXTENSIONS);
    const bool robust = have != nullptr && std::string_view(have).find("EGL_EXT_create_context_robustness") != std::string_view::npos;
    struct Try {
        EGLint minor;
        bool tells;
    };
    for (const Try t : {Try{2, true}, {2, false}, {1, true}, {1, false}}) {
        if (t.tells && !robust) continue;
        std::array<EGLint, 7> attributes{EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, t.minor, EGL_NONE};
        if (t.tells) {
            attributes[4] = EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_EXT;
            attributes[5] = EGL_LOSE_CONTEXT_ON_RESET_EXT;
            attributes[6] = EGL_NONE;
        }
        state->handle = eglCreateContext(state->display, EGL_NO_CONFIG_KHR, share != nullptr ? share->state_->handle : EGL_NO_CONTEXT,
                                         attributes.data());
        if (state->handle != EGL_NO_CONTEXT) break;
    }
    if (state->handle == EGL_NO_CONTEXT)
        return fail("the driver offers no OpenGL ES 3.1 context", "EGL", "use a newer driver, or unset GALLIUM_DRIVER and LIBGL_* overrides");
    if (eglMakeCurrent(state->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state->handle) == EGL_FALSE)
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
    if (epoxy_has_gl_extension("GL_EXT_robustness") || epoxy_has_gl_extension("GL_KHR_robustness")) {
        GLint strategy = GL_NO_RESET_NOTIFICATION;
        glGetIntegerv(GL_RESET_NOTIFICATION_STRATEGY_EXT, &strategy);
        info.tells_resets = strategy == GL_LOSE_CONTEXT_ON_RESET;
    }
    info.multiview2 = epoxy_has_gl_extension("GL_OVR_multiview2");
    info.fragment_shading_rate = epoxy_has_gl_extension("GL_EXT_fragment_shading_rate");
    info.qcom_framebuffer_foveated = epoxy_has_gl_extension("GL_QCOM_framebuffer_foveated");
    info.qcom_texture_foveated = epoxy_has_gl_extension("GL_QCOM_texture_foveated");
    return Context(std::move(state));
}

const ContextInfo& Context::info() const noexcept { return state_->info; }

const char* reset_name(Reset reset) noexcept {
    switch (reset) {
        case Reset::guilty: return "by what was drawn";
        case Reset::innocent: return "by another program";
        case Reset::unknown: return "for an unknown reason";
        case Reset::none: break;
    }
    return "not lost";
}

Reset poll_reset() noexcept {
    if (eglGetCurrentContext() == EGL_NO_CONTEXT) return Reset::none;
    GLenum status = GL_NO_ERROR;
    if (epoxy_has_gl_extension("GL_EXT_robustness")) status = glGetGraphicsResetStatusEXT();
    else if (epoxy_has_gl_extension("GL_KHR_robustness")) status = glGetGraphicsResetStatusKHR();
    switch (status) {
        case GL_NO_ERROR: return Reset::none;
        case GL_GUILTY_CONTEXT_RESET: return Reset::guilty;
        case GL_INNOCENT_CONTEXT_RESET: return Reset::innocent;
        default: return Reset::unknown;
    }
}

bool Context::make_current() const noexcept {
    return eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->handle) == EGL_TRUE;
}

void Context::release() noexcept {
    const EGLDisplay display = eglGetCurrentDisplay();
    if (display != EGL_NO_DISPLAY) eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

namespace {

// A configuration for windows with 8 bits per channel, of this visual (0: any).
EGLConfig window_config(EGLDisplay display, std::uint32_t wanted) {
    const std::array<EGLint, 13> attributes{EGL_SURFACE_TYPE, EGL_WINDOW_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_RED_SIZE, 8,
                                            EGL_GREEN_SIZE, 8, EGL_BLUE_SIZE, 8, EGL_ALPHA_SIZE, 0, EGL_NONE};
    std::array<EGLConfig, 256> configs{};
    EGLint count = 0;
    eglChooseConfig(display, attributes.data(), configs.data(), static_cast<EGLint>(configs.size()), &count);
    for (EGLint i = 0; i < count; ++i) {
        EGLint visual = 0, red = 0, alpha = 0;
        const EGLConfig config = configs[static_cast<std::size_t>(i)];
        eglGetConfigAttrib(display, config, EGL_NATIVE_VISUAL_ID, &visual);
        eglGetConfigAttrib(display, config, EGL_RED_SIZE, &red);
        eglGetConfigAttrib(display, config, EGL_ALPHA_SIZE, &alpha);
        // Sorted by EGL: the deepest colours come first. A window with alpha would be blended with what is behind it.
        if (red == 8 && (wanted != 0 ? static_cast<std::uint32_t>(visual) == wanted : alpha == 0)) return config;
    }
    return nullptr;
}

}  // namespace

Result<std::uint32_t> WindowSurface::visual(const Context& context, std::uint32_t wanted) {
    const EGLDisplay display = context.state_->display;
    const EGLConfig config = window_config(display, wanted);
    if (config == nullptr) return fail("the EGL driver has no configuration for a window with 8 bits per channel", "EGL", kInstall);
    EGLint visual = 0;
    eglGetConfigAttrib(display, config, EGL_NATIVE_VISUAL_ID, &visual);
    return static_cast<std::uint32_t>(visual);
}

Result<WindowSurface> WindowSurface::create(const Context& context, void* window, std::uint32_t visual) {
    WindowSurface s;
    const EGLDisplay display = context.state_->display;
    const EGLConfig config = window_config(display, visual);
    if (config != nullptr) s.surface_ = eglCreatePlatformWindowSurfaceEXT(display, config, window, nullptr);
    if (s.surface_ == nullptr) return fail("the EGL driver cannot draw into this window", "EGL", kInstall);
    s.display_ = display;
    s.context_ = context.state_->handle;
    if (eglMakeCurrent(display, s.surface_, s.surface_, s.context_) == EGL_FALSE)
        return fail("the context cannot be made current with this window", "EGL", kInstall);
    eglSwapInterval(display, 0);   // pacing is ours: a swap that waits would wait for ever while the window is hidden
    return s;
}

WindowSurface::WindowSurface(WindowSurface&& o) noexcept
    : display_(std::exchange(o.display_, nullptr)), surface_(std::exchange(o.surface_, nullptr)), context_(std::exchange(o.context_, nullptr)) {}

WindowSurface& WindowSurface::operator=(WindowSurface&& o) noexcept {
    std::swap(display_, o.display_);
    std::swap(surface_, o.surface_);
    std::swap(context_, o.context_);
    return *this;
}

WindowSurface::~WindowSurface() {
    if (surface_ == nullptr) return;
    if (eglGetCurrentSurface(EGL_DRAW) == surface_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
    eglDestroySurface(display_, surface_);
}

bool WindowSurface::swap() noexcept { return eglSwapBuffers(display_, surface_) == EGL_TRUE; }

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
                           : e == GL_CONTEXT_LOST      ? "GL_CONTEXT_LOST"
                           : e == GL_INVALID_FRAMEBUFFER_OPERATION ? "GL_INVALID_FRAMEBUFFER_OPERATION"
                                                                   : "unknown GL error";
        all += (all.empty() ? "" : ", ") + std::string(name);
    }
    return all;
}

}  // namespace fovea::gl
