// An OpenGL ES context, without a window (EGL on the surfaceless platform of Mesa) or on the connection to a window
// system; and the surface of a window.
//
// Source: EGL_MESA_platform_surfaceless, EGL_EXT_platform_wayland, EGL_EXT_platform_xcb, EGL_KHR_platform_gbm,
// EGL_KHR_surfaceless_context, EGL_KHR_no_config_context.
// Threads: a context is current on the thread that created it until make_current() is called on another one.
// Errors: create() says what is missing (libEGL, driver, version) and which package supplies it. A missing libEGL is an
// error, never an abort.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "protocol/error.hpp"

namespace fovea::gl {

struct ContextInfo {
    std::string renderer;   // GL_RENDERER, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)"
    std::string vendor, version;
    int major = 0, minor = 0;   // OpenGL ES, at least 3.1
    bool software = false;      // the rasteriser is the processor: llvmpipe, softpipe, swrast
    bool multiview2 = false;             // GL_OVR_multiview2
    bool fragment_shading_rate = false;  // GL_EXT_fragment_shading_rate
    bool qcom_framebuffer_foveated = false, qcom_texture_foveated = false;
    bool tells_resets = false;           // poll_reset() knows: the driver loses a context and says so, rather than going on with garbage
    int max_samples = 0, max_texture_px = 0;
};

// What took a context's contents away (a GPU hang, a driver that was updated): nothing in it can be used any more, whatever
// its calls return, although it is still current. Destroy its objects and itself, make a new one and everything in it anew.
enum class Reset : std::uint8_t { none, guilty, innocent, unknown };   // guilty: by what this context drew
[[nodiscard]] const char* reset_name(Reset reset) noexcept;
// Of the current context; once a frame is enough. none where the driver does not tell, or no context is current.
// Source: EGL_EXT_create_context_robustness, GL_EXT_robustness, GL_KHR_robustness.
[[nodiscard]] Reset poll_reset() noexcept;

// A connection to a window system, as EGL takes it.
enum class Platform : std::uint8_t { surfaceless, wayland, xcb, gbm };
struct NativeDisplay {
    Platform platform = Platform::surfaceless;
    void* handle = nullptr;   // wl_display*, xcb_connection_t*, gbm_device*; must outlive the contexts made from it
};

class Context {
public:
    // A new context, current on this thread. share: its objects are shared; may be null.
    [[nodiscard]] static Result<Context> create(const Context* share = nullptr);
    [[nodiscard]] static Result<Context> create(const NativeDisplay& native);
    Context(Context&&) noexcept;
    Context& operator=(Context&&) noexcept;
    ~Context();   // releases it if it is current on this thread

    [[nodiscard]] const ContextInfo& info() const noexcept;
    [[nodiscard]] bool make_current() const noexcept;   // false: the driver refused
    static void release() noexcept;                      // no context is current on this thread afterwards

private:
    friend class WindowSurface;
    struct State;
    explicit Context(std::unique_ptr<State> state) noexcept;
    [[nodiscard]] static Result<Context> finish(std::unique_ptr<State> state, const Context* share);
    std::unique_ptr<State> state_;
};

// The current driver's entry point of that name, for code that keeps its own table of them; null if it has none.
[[nodiscard]] void (*driver_function(const char* name))();
// What EGL draws a window into: framebuffer 0 of the context that it is current with.
class WindowSurface {
public:
    // The visual that a window needs, of 8 bits per channel: an X visual, a GBM format (wanted: only this one is good
    // enough; 0: any will do). Wayland windows need none.
    [[nodiscard]] static Result<std::uint32_t> visual(const Context& context, std::uint32_t wanted = 0);
    // window: wl_egl_window*, pointer to xcb_window_t, gbm_surface*; must outlive this, as must the context, on whose
    // display it lives. Current with the context afterwards. swap() will not wait for the display.
    [[nodiscard]] static Result<WindowSurface> create(const Context& context, void* window, std::uint32_t visual = 0);
    WindowSurface() noexcept = default;
    WindowSurface(WindowSurface&&) noexcept;
    WindowSurface& operator=(WindowSurface&&) noexcept;
    ~WindowSurface();

    // Hands what was drawn to the window system. False: the window or its server is gone.
    [[nodiscard]] bool swap() noexcept;

private:
    void* display_ = nullptr;
    void* surface_ = nullptr;
    void* context_ = nullptr;
};

// The pending GL error of the current context as text, empty if there is none; clears all.
[[nodiscard]] std::string pending_error();

}  // namespace fovea::gl
