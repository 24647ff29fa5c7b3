// An OpenGL ES context without a window: EGL on the surfaceless platform of Mesa.
//
// Source: EGL_MESA_platform_surfaceless, EGL_KHR_surfaceless_context, EGL_KHR_no_config_context.
// Threads: a context is current on the thread that created it until make_current() is called on another one.
// Errors: create() says what is missing (libEGL, driver, version) and which package supplies it. A missing libEGL is an
// error, never an abort.
#pragma once

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
    int max_samples = 0, max_texture_px = 0;
};

class Context {
public:
    // A new context, current on this thread. share: its objects are shared; may be null.
    [[nodiscard]] static Result<Context> create(const Context* share = nullptr);
    Context(Context&&) noexcept;
    Context& operator=(Context&&) noexcept;
    ~Context();   // releases it if it is current on this thread

    [[nodiscard]] const ContextInfo& info() const noexcept;
    [[nodiscard]] bool make_current() const noexcept;   // false: the driver refused
    static void release() noexcept;                      // no context is current on this thread afterwards

private:
    struct State;
    explicit Context(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

// The current driver's entry point of that name, for code that keeps its own table of them; null if it has none.
[[nodiscard]] void (*driver_function(const char* name))();

// The pending GL error of the current context as text, empty if there is none; clears all.
[[nodiscard]] std::string pending_error();

}  // namespace fovea::gl
