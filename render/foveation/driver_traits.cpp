#include "render/foveation/driver_traits.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "render/foveation/rate_map.hpp"
#include "render/foveation/traits_file.hpp"
#include "render/foveation/upsample.hpp"
#include "render/gl/objects.hpp"

namespace fovea::foveation {
namespace {

constexpr int kEdge_px = 256;       // of the probe's picture
constexpr int kTiles = 64;          // along each edge of its shading-rate map
constexpr int kRepeats = 3;         // the quickest counts
constexpr double kEarly = 0.5;      // rejected before shading if it costs less than this of a shaded picture
constexpr double kClear = 1.5;      // a finding is kept on disk if it is so far from turning

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

std::optional<TraitsNumbers> probe(bool software) {
    TraitsNumbers t;
    auto target = gl::RenderTarget::create({.width_px = kEdge_px, .height_px = kEdge_px});
    auto small = gl::RenderTarget::create({.width_px = kEdge_px / 4, .height_px = kEdge_px / 4});
    const auto heavy = gl::build_program("probe", kVertex, kHeavy), copy = gl::build_program("probe copy", kVertex, kCopy);
    if (!target || !small || !heavy || !copy) return std::nullopt;
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
    }
    return t;
}

DriverTraits decide(const TraitsNumbers& n) {
    DriverTraits t;
    t.stencil_cost = n.stencil_cost;
    t.depth_cost = n.depth_cost;
    t.resolve_ratio = n.resolve_ratio;
    t.rate_map_ratio = n.rate_map_ratio;
    t.early_stencil = n.stencil_cost < kEarly;
    t.early_depth = n.depth_cost < kEarly;
    t.depth_mask = !t.early_stencil && t.early_depth;
    t.processor_resolve = n.resolve_ratio > 0 && n.resolve_ratio < 1;
    t.gpu_rate_map = n.rate_map_ratio > 0 && n.rate_map_ratio < 1;
    return t;
}

// Measured in a busy moment, a close finding could be wrong for ever.
bool clear_cut(const TraitsNumbers& n) {
    const auto far = [](double value, double from) { return value == 0 || value * kClear < from || value > from * kClear; };
    return far(n.stencil_cost, kEarly) && far(n.depth_cost, kEarly) && far(n.resolve_ratio, 1) && far(n.rate_map_ratio, 1);
}

std::string gl_text(GLenum name) {
    const auto* text = reinterpret_cast<const char*>(glGetString(name));
    return text != nullptr ? text : "";
}

std::mutex mutex;
std::filesystem::path kept_in;

}  // namespace

void keep_driver_traits_in(std::filesystem::path folder) {
    const std::scoped_lock lock(mutex);
    kept_in = std::move(folder);
}

std::filesystem::path traits_folder() {
    const auto named = [](const char* variable) -> std::filesystem::path {
        const char* text = ::secure_getenv(variable);
        return text != nullptr ? text : "";
    };
    if (const auto own = named("FOVEA_PROBE_CACHE"); !own.empty()) return own.is_absolute() ? own : std::filesystem::path{};
    if (const auto cache = named("XDG_CACHE_HOME"); cache.is_absolute()) return cache / "fovea";
    if (const auto home = named("HOME"); home.is_absolute()) return home / ".cache" / "fovea";
    return {};
}

DriverTraits find_driver_traits(const std::filesystem::path& folder) {
    const TraitsKey key{gl_text(GL_RENDERER), gl_text(GL_VERSION), FOVEA_VERSION, std::thread::hardware_concurrency()};
    const std::filesystem::path file = folder.empty() ? folder : traits_file(folder, key);
    std::string trouble;
    if (!file.empty()) {
        const TraitsRead known = read_traits(file, key);
        if (known.numbers) {
            DriverTraits t = decide(*known.numbers);
            t.origin = "remembered in " + file.string();
            return t;
        }
        if (!known.why_not.empty()) trouble = "; " + known.why_not;
    }
    bool software = false;
    for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"}) software = software || key.renderer.find(name) != std::string::npos;
    const auto numbers = probe(software);
    DriverTraits t = numbers ? decide(*numbers) : DriverTraits{};
    if (numbers && !file.empty() && clear_cut(*numbers))
        if (const std::string why = write_traits(file, key, *numbers); !why.empty()) trouble += "; cannot be kept: " + why;
    t.origin = (numbers ? "measured" : "not measured: the probe cannot draw") + trouble;
    return t;
}

const DriverTraits& driver_traits() {
    static std::map<std::string, DriverTraits> known;
    const std::scoped_lock lock(mutex);
    const std::string renderer = gl_text(GL_RENDERER);
    const auto found = known.find(renderer);
    if (found != known.end()) return found->second;
    return known.emplace(renderer, find_driver_traits(kept_in)).first->second;
}

}  // namespace fovea::foveation
