// Auto mode: programs that know nothing of foveation, drawn foveated.
//
// The default framebuffer (and off-screen targets, if the settings say so) becomes a target like a framebuffer that a
// program has foveated itself, with one focal point: fovead's through libfovea, asked at the submission, or a fixed one.
// Draws that would look wrong at a lower density are named by FullRate and drawn at full density.
// Source of the settings: the environment (FOVEA_LAYER_AUTO), written by `fovea layer run --auto` from its options and
// from configs/layer/*.toml.
// Threads: settings and report from any thread; a FocusSource belongs to one context.
// Errors: settings that cannot be read are named on stderr once, and the program runs without auto mode.
#pragma once

#include <EGL/egl.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "layer_gl.hpp"
#include "render/layer/foveation_state.hpp"

struct fovea_client;

namespace fovea::layer {

// Why a draw, or a whole submission, is at full density in auto mode.
enum class FullRate : std::uint8_t {
    none,
    // of a draw
    frag_coord,        // its fragment shader reads gl_FragCoord, which counts pixels of the level
    texel_fetch,       // its fragment shader addresses texels by number
    no_source,         // its shaders came as a binary: nothing is known about them
    points,            // gl_PointSize counts pixels of the level
    lines,             // so does the width of a line
    blended_2d,        // blended without depth test: text and widgets
    textured_2d,       // textured quads (at most 6 vertices) without depth test, or by a program without a matrix: sprites, pictures
    full_screen_pass,  // the same, or any draw without depth test, from a texture that was drawn before: post-processing
    // of a submission
    no_clear,          // the frame did not begin with a clear of everything
    keeps_depth,       // it needs depth or stencil of before
    side_effects,      // shaders that write memory, occlusion queries, geometry shaders
    clears_only,       // nothing was drawn
    does_not_pay,      // a trial found that the levels take longer than full density
    full_density,      // the focal points ask for full density everywhere
    cannot_match,      // a format, a size or the memory
    count
};
[[nodiscard]] const char* full_rate_name(FullRate reason) noexcept;  // "gl_frag_coord", as in the settings
[[nodiscard]] std::optional<FullRate> full_rate_by_name(const std::string& name) noexcept;

struct AutoSettings {
    bool on = false;
    FocalPoint point{0, 0, 4, 4, 0};  // gains and area; x, y where `fixed`
    bool fixed = false;               // the point does not follow fovead
    double fov_rad = 0.7;             // horizontal angle that the target fills, > 0, < pi
    double offscreen_least = 0;       // off-screen targets with depth of at least this part of the surface, each axis; 0: none
    bool always = false;              // levels also where they take longer; gain 0: recorded and replayed all the same
    bool compare = false;             // draw all ways in turns, and measure them
    std::uint32_t reasons = ~0u;      // bit FullRate: that reason counts
};
// From FOVEA_LAYER_AUTO, read once. "gain_x=4;gain_y=4;area=0;fov_deg=40;focus=0,0;offscreen=0.9;except=points,lines"
[[nodiscard]] const AutoSettings& auto_settings();
// For tests: nullopt when it cannot be read; *error says what.
[[nodiscard]] std::optional<AutoSettings> parse_auto_settings(const std::string& text, std::string* error);

// Where the fovea is now.
class FocusSource {
public:
    FocusSource() = default;
    ~FocusSource();
    FocusSource(const FocusSource&) = delete;
    FocusSource& operator=(const FocusSource&) = delete;
    // For a target of this size. The photon time is one frame interval from now.
    [[nodiscard]] Latched latch(int width, int height);
    // A frame was handed over: its report goes to fovead. Pixels: of the plan, and of the target.
    void frame_ended(std::uint64_t pixels_shaded, std::uint64_t pixels_full);
    // Of the last latch.
    [[nodiscard]] bool live() const noexcept { return live_; }

private:
    fovea_client* client_ = nullptr;
    bool tried_ = false, live_ = false;
    std::int64_t last_frame_ns_ = 0, interval_ns_ = 16'666'667;
    struct Report;
    Report* report_ = nullptr;
};

// What one program's draws came to, for the report; lives as long as the process.
struct ProgramReport {
    std::string shader;  // a line that a reader can recognise the program by
    std::atomic<std::uint64_t> foveated{0};
    std::array<std::atomic<std::uint64_t>, static_cast<std::size_t>(FullRate::count)> full{};
};
[[nodiscard]] ProgramReport* new_program_report(std::string shader);
[[nodiscard]] std::string program_reports_json();

// What the sources of a program say, found when it is linked.
struct SourceFacts {
    bool known = false, frag_coord = false, texel_fetch = false;
    std::string shader;
};
[[nodiscard]] SourceFacts read_source_facts(GLuint program);                       // of the attached shaders
[[nodiscard]] SourceFacts source_facts(GLenum stage, const std::string& source);   // of one

// Width and height of an EGL surface as the driver knows them. False: no such surface.
[[nodiscard]] bool surface_size(EGLDisplay display, EGLSurface surface, int& width, int& height);

}  // namespace fovea::layer
