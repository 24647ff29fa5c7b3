// glExtrapolateTex2DQCOM for any OpenGL ES 3.x driver: the call, its checks and its errors.
//
// Source: GL_QCOM_frame_extrapolation. Formats are compared by effective format: an unsized RGBA of unsigned bytes is RGBA8.
// Backends: `processor` reads both sources back and runs Extrapolator; `compute` and `fragment` stay in the driver. A
// start-up probe picks: on a software rasteriser it times one small pair on each, elsewhere it takes compute, then fragment.
// Three-channel float pictures, outputs that are also a source, and swizzled sources always take the processor.
// Three-channel floats that cannot be attached are read through a pass, which honours a swizzle of theirs.
// A context of OpenGL ES 3.0 has neither compute shaders nor draws whose count the driver writes: the processor serves it. There
// formats and sizes are told by trial (gl_texture_info.hpp), so create() refuses a context that raises no errors.
// State: everything but the output's base level is as before; the output may be immutable or not. Transform feedback is paused
// meanwhile. While a query counts samples or primitives, or the program in use is deleted already, the processor does it, which
// draws nothing (but the pass that reads three-channel floats). GL_NV_conditional_render must not be active: it cannot be asked.
// Threads: the context's thread, the same for create, extrapolate and destruction; contexts do not share one.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/gl_functions.hpp"

namespace fovea::render::extrapolation {

enum class Backend : std::uint8_t { processor, compute, fragment };
[[nodiscard]] const char* backend_name(Backend b) noexcept;

struct GlSettings {
    Preset preset = Preset::balanced;
    int threads = 1;                   // of the processor's backend
    std::optional<Backend> backend;    // nothing: the probe chooses
};

// What the last call worked on, in tiles of 16x16 pixels (twice that for pictures of more than 8192 pixels).
struct GlWork {
    int tiles = 0;      // of the picture, and of the rim that the patches at its far edges need
    int searched = 0;   // where motion was looked for; none of a still pair
    int written = 0;    // where the output is more than a copy
};

class GlExtrapolator {
public:
    // Needs a current context. Leaves its state as it was. May take a second on a software rasteriser: it compiles and probes.
    [[nodiscard]] static Result<GlExtrapolator> create(GlLoader loader, const GlSettings& settings = {});
    GlExtrapolator(GlExtrapolator&&) noexcept;
    GlExtrapolator& operator=(GlExtrapolator&&) noexcept;
    ~GlExtrapolator();

    // Returns the error that the call generates: GL_NO_ERROR, GL_INVALID_VALUE (factor 0, a known motion of the wrong size),
    // GL_INVALID_OPERATION (names that are no 2D textures, formats or sizes that differ, formats outside table 8.28) or
    // GL_OUT_OF_MEMORY. Errors that were pending in the context before the call must have been taken by the caller; none is
    // pending after it.
    // Hints are the caller's extra knowledge, rows counted as the textures' own. Known motion is projected by the processor,
    // whatever the backend; the shaders spend the same effort everywhere that anything moves, so a gaze changes nothing there.
    [[nodiscard]] GLenum extrapolate(GLuint src1, GLuint src2, GLuint output, float factor, const Hints& hints = {}) noexcept;

    [[nodiscard]] Backend backend() const noexcept;
    // For counters and tests: on the shader backends it waits for the driver.
    [[nodiscard]] GlWork work() noexcept;
    // Why that backend: "asked for", or what the probe measured.
    [[nodiscard]] const std::string& reason() const noexcept;

private:
    struct State;
    explicit GlExtrapolator(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::render::extrapolation
