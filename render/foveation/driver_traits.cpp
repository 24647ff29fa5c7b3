#include "render/foveation/driver_traits.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "render/foveation/rate_map.hpp"
#include "render/foveation/upsample.hpp"
#include "render/gl/objects.hpp"

namespace fovea::foveation {
namespace {

constexpr int kEdge_px = 256;       // of the probe's picture
constexpr int kTiles = 64;          // along each edge of its shading-rate map
constexpr int kRepeats = 3;         // the quickest counts
constexpr double kEarly = 0.5;      // rejected before shading if it costs less than this of a shaded picture

constexpr std::string_view kVertex = R"(#version 310 es
out highp vec2 uv;
void main() {
    uv = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 1.0;
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
})";

// Some hundred operations a pixel, so that shading outweighs everything else.
constexpr std::string_view kHeavy = R"(#version 310 es
precision highp float;
in highp vec2 uv;
layout(location = 0) out vec4 color;
void main() {
    vec2 p = uv;
    for (int i = 0; i < 24; ++i) p = fract(p * mat2(1.31, 0.73, -0.57, 1.17) + sin(p.yx * 3.0));
    color = vec4(p, 0.0, 1.0);
})";

constexpr std::string_view kCopy = R"(#version 310 es
precision highp float;
layout(binding = 0) uniform highp sampler2D level;
in highp vec2 uv;
layout(location = 0) out vec4 color;
void main() { color = texture(level, uv); }
)";

// Processor time of the whole process where the processor draws, wall time where a GPU does: the larger of the two.
double seconds_now(clockid_t clock) noexcept {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <class Draw>
double cost(bool software, Draw draw) {
    draw();   // compiles
    glFinish();
    double best = 1e9;
    for (int i = 0; i < kRepeats; ++i) {
        const clockid_t clock = software ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC;
        const double start = seconds_now(clock);
        draw();
        glFinish();
        best = std::min(best, seconds_now(clock) - start);
    }
    return std::max(best, 1e-9);
}

DriverTraits probe(bool software) {
    DriverTraits t;
    auto target = gl::RenderTarget::create({.width_px = kEdge_px, .height_px = kEdge_px});
    auto small = gl::RenderTarget::create({.width_px = kEdge_px / 4, .height_px = kEdge_px / 4});
    const auto heavy = gl::build_program("probe", kVertex, kHeavy), copy = gl::build_program("probe copy", kVertex, kCopy);
    if (!target || !small || !heavy || !copy) return t;
    const gl::VertexArray arrays = gl::create_vertex_array();
    glBindVertexArray(arrays.name());
    glBindFramebuffer(GL_FRAMEBUFFER, target->framebuffer());
    glViewport(0, 0, kEdge_px, kEdge_px);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glStencilMask(0xff);
    glClearDepthf(0);
    glClearStencil(0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    const auto quad = [] { glDrawArrays(GL_TRIANGLE_STRIP, 0, 4); };
    glUseProgram(heavy->name());
    const double shaded = cost(software, quad);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_EQUAL, 1, 0xff);   // fails everywhere
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    t.stencil_cost = cost(software, quad) / shaded;
    glDisable(GL_STENCIL_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);               // fails everywhere
    t.depth_cost = cost(software, quad) / shaded;
    glDisable(GL_DEPTH_TEST);
    t.early_stencil = t.stencil_cost < kEarly;
    t.early_depth = t.depth_cost < kEarly;
    t.depth_mask = !t.early_stencil && t.early_depth;
    if (software) {
        glUseProgram(copy->name());
        glActiveTexture(GL_TEXTURE0);
        glBindTexture(GL_TEXTURE_2D, small->color_texture());
        const double gpu = cost(true, quad);
        std::vector<std::uint8_t> low(kEdge_px * kEdge_px / 4), high(kEdge_px * kEdge_px * 4);
        std::vector<std::uint16_t> row((kEdge_px + 2) * 4);
        glBindTexture(GL_TEXTURE_2D, target->color_texture());
        const double processor = cost(true, [&] {
            constexpr int kSmall = kEdge_px / 4;
            gl::read_pixels(small->framebuffer(), 0, 0, kSmall, kSmall, low);
            enlarge({low.data(), kSmall * 4, 0, 0, kSmall, kSmall}, 2, 2, 0, 0, kEdge_px, kEdge_px, high.data(), kEdge_px * 4, row);
            glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kEdge_px, kEdge_px, GL_RGBA, GL_UNSIGNED_BYTE, high.data());
        });
        t.resolve_ratio = processor / gpu;
        t.processor_resolve = t.resolve_ratio < 1;
        glBindTexture(GL_TEXTURE_2D, 0);
    }
    if (auto map = RateMap::create(kTiles * kTiles)) {
        std::vector<std::uint8_t> rates(kTiles * kTiles);
        int step = 0;
        const auto input = [&] { return density::rate_input({}, kTiles * 16, kTiles * 16, {0.01 * (step++ % 50), 0.1}); };
        const double processor = cost(software, [&] { density::fill_rate_map(input(), rates); });
        const double gpu = cost(software, [&] {
            map->set_input(input());
            map->dispatch(kTiles, kTiles);
            map->read(kTiles, kTiles, rates);
        });
        t.rate_map_ratio = gpu / processor;
        t.gpu_rate_map = t.rate_map_ratio < 1;
    }
    return t;
}

}  // namespace

const DriverTraits& driver_traits() {
    static std::mutex mutex;
    static std::map<std::string, DriverTraits> known;
    const std::scoped_lock lock(mutex);
    const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string renderer = text != nullptr ? text : "";
    const auto found = known.find(renderer);
    if (found != known.end()) return found->second;
    bool software = false;
    for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"}) software = software || renderer.find(name) != std::string::npos;
    return known.emplace(renderer, probe(software)).first->second;
}

}  // namespace fovea::foveation
