#include "render/foveation/rate_map.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstring>
#include <utility>

namespace fovea::foveation {
namespace {

constexpr int kGroup = 64;   // words of the map per work group

// tile_rate() of density/shading_rate.cpp, line by line; the block has RateInput's layout.
constexpr std::string_view kShader = R"(#version 310 es
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Input {
    uint flags;
    int width, height, tile, gaze_x, gaze_y, inner, outer, focus_x0, focus_y0, focus_x1, focus_y1, lens_x, lens_y;
};
layout(std430, binding = 1) writeonly buffer Map { uint words[]; };
layout(location = 0) uniform uint tiles;
uint rate(int column, int row) {
    int x0 = column * tile, y0 = row * tile;
    int x1 = min(x0 + tile, width), y1 = min(y0 + tile, height);
    if ((flags & 4u) != 0u) {
        int cx = width / 2, cy = height / 2;
        int dx = max(max(x0 - cx, cx - x1), 0), dy = max(max(y0 - cy, cy - y1), 0);
        int u = min(dx * 256 / lens_x, 20000), v = min(dy * 256 / lens_y, 20000);
        if (u * u + v * v > 256 * 256) return 10u;
    }
    int coarse = 0;
    if ((flags & 1u) != 0u && (x1 <= focus_x0 || x0 >= focus_x1 || y1 <= focus_y0 || y0 >= focus_y1)) coarse = 1;
    if ((flags & 2u) != 0u) {
        int dx = max(max(x0 - gaze_x, gaze_x - x1), 0), dy = max(max(y0 - gaze_y, gaze_y - y1), 0);
        uint d2 = uint(dx) * uint(dx) + uint(dy) * uint(dy);
        uint i = uint(inner), o = uint(outer);
        coarse = max(coarse, d2 <= i * i ? 0 : d2 <= o * o ? 1 : 2);
    }
    return coarse == 0 ? 0u : coarse == 1 ? 5u : 10u;
}
void main() {
    uint word = gl_GlobalInvocationID.x;
    if (word * 4u >= tiles) return;
    int columns = (width + tile - 1) / tile;
    uint four = 0u;
    for (uint k = 0u; k < 4u; ++k) {
        uint i = word * 4u + k;
        if (i < tiles) four |= rate(int(i) % columns, int(i) / columns) << (8u * k);
    }
    words[word] = four;
})";

}  // namespace

Result<RateMap> RateMap::create(std::size_t tiles) {
    RateMap m;
    auto program = gl::build_compute_program("shading-rate map", kShader);
    if (!program) return std::unexpected(program.error());
    m.program_ = *std::move(program);
    m.words_ = (tiles + 3) / 4;
    m.map_ = gl::create_dynamic_buffer(m.words_ * 4);
    gl::Name name = 0;
    glGenBuffers(1, &name);
    m.input_ = gl::Buffer(name);
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, name);
    const density::RateInput initial;
    if (epoxy_has_gl_extension("GL_EXT_buffer_storage")) {
        constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT_EXT | GL_MAP_COHERENT_BIT_EXT;
        glBufferStorageEXT(GL_SHADER_STORAGE_BUFFER, sizeof initial, &initial, kAccess);
        m.mapped_ = static_cast<density::RateInput*>(glMapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, sizeof initial, kAccess));
    } else {
        glBufferData(GL_SHADER_STORAGE_BUFFER, sizeof initial, &initial, GL_DYNAMIC_DRAW);
    }
    return m;
}

RateMap::RateMap(RateMap&& o) noexcept
    : program_(std::move(o.program_)), input_(std::move(o.input_)), map_(std::move(o.map_)), mapped_(std::exchange(o.mapped_, nullptr)), words_(o.words_) {}

RateMap::~RateMap() {
    if (mapped_ == nullptr || eglGetCurrentContext() == EGL_NO_CONTEXT) return;
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, input_.name());
    glUnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

void RateMap::set_input(const density::RateInput& input) noexcept {
    if (mapped_ != nullptr) std::memcpy(mapped_, &input, sizeof input);
    else gl::update_buffer(input_, 0, std::as_bytes(std::span(&input, 1)));
}

void RateMap::dispatch(int columns, int rows) noexcept {
    const auto tiles = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    FOVEA_REQUIRE(tiles <= words_ * 4);
    glUseProgram(program_.name());
    glUniform1ui(0, static_cast<GLuint>(tiles));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, input_.name());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, map_.name());
    glDispatchCompute(static_cast<GLuint>(((tiles + 3) / 4 + kGroup - 1) / kGroup), 1, 1);
}

void RateMap::bind_for_unpacking() const noexcept {
    glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, map_.name());
}

void RateMap::read(int columns, int rows, std::span<std::uint8_t> rates) noexcept {
    const auto tiles = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    FOVEA_REQUIRE(rates.size() >= tiles && tiles <= words_ * 4);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, map_.name());
    const void* p = glMapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>((tiles + 3) / 4 * 4), GL_MAP_READ_BIT);
    if (p != nullptr) std::memcpy(rates.data(), p, tiles);   // the first rate of a word is in its lowest byte
    glUnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

}  // namespace fovea::foveation
