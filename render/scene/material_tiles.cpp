#include "render/scene/material_tiles.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/gl/objects.hpp"

namespace fovea::scene {
namespace {

constexpr int kSheet_px = 2048;   // of the sheet that holds many tiles; every GLES 3.1 driver has it
constexpr std::size_t kViewBytes = 512;   // of the block `View`, all zeros: no lamp is lit

// The sheet's tiles from `first` on, as two triangles each.
std::vector<Vertex> corners(std::span<const MaterialTile> tiles, Family family, int across) {
    std::vector<Vertex> out;
    const float step = 2 / static_cast<float>(across);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const MaterialTile& t = tiles[i];
        if (family_of(t.material) != family) continue;
        const float x = step * static_cast<float>(i % static_cast<std::size_t>(across)) - 1, y = step * static_cast<float>(i / static_cast<std::size_t>(across)) - 1;
        Vertex v{};
        for (std::size_t axis = 0; axis < 3; ++axis) v.normal[axis] = static_cast<std::int8_t>(std::lround(std::clamp(t.normal[axis], -1.0f, 1.0f) * 127));
        v.material = {t.material, t.variant, 0, 0};
        for (const auto& [right, up] : {std::pair{0.0f, 0.0f}, {1.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}}) {
            v.position = {x + step * right, y + step * up, 0};
            v.uv = {t.middle[0] + (right - 0.5f) * t.edge, t.middle[1] + (up - 0.5f) * t.edge};
            out.push_back(v);
        }
    }
    return out;
}

}  // namespace

Result<std::vector<Image>> draw_tiles(std::span<const MaterialTile> tiles, int edge_px) {
    FOVEA_REQUIRE(edge_px >= 1 && edge_px <= 512);
    std::vector<Image> images;
    if (tiles.empty()) return images;
    const int across = kSheet_px / edge_px;
    auto target = gl::RenderTarget::create({.width_px = across * edge_px, .height_px = across * edge_px, .depth_stencil = false, .filter = gl::Filter::nearest});
    if (!target) return std::unexpected(target.error());
    const std::vector<std::byte> dark(kViewBytes);
    const gl::Buffer view = gl::create_vertex_buffer(dark);
    const gl::VertexArray arrays = gl::create_vertex_array();
    std::array<gl::Program, kFamilies> programs;
    std::vector<std::uint8_t> sheet(static_cast<std::size_t>(target->width()) * static_cast<std::size_t>(target->height()) * 4);
    for (const GLenum c : {GL_DEPTH_TEST, GL_STENCIL_TEST, GL_SCISSOR_TEST, GL_BLEND, GL_CULL_FACE}) glDisable(c);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    for (const auto most = static_cast<std::size_t>(across) * static_cast<std::size_t>(across); !tiles.empty();) {
        const auto part = tiles.first(std::min(most, tiles.size()));
        tiles = tiles.subspan(part.size());
        glBindFramebuffer(GL_FRAMEBUFFER, target->framebuffer());
        glViewport(0, 0, target->width(), target->height());
        for (std::size_t f = 0; f < kFamilies; ++f) {
            const auto family = static_cast<Family>(f);
            const std::vector<Vertex> vertices = corners(part, family, across);
            if (vertices.empty()) continue;
            if (!programs[f]) {
                auto built = gl::build_program("material tiles", tile_vertex_shader(), fragment_shader({.family = family, .unlit = true}));
                if (!built) return std::unexpected(built.error());
                programs[f] = *std::move(built);
            }
            const gl::Buffer buffer = gl::create_vertex_buffer(std::as_bytes(std::span(vertices)));
            glBindVertexArray(arrays.name());
            glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
            const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
            glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(offsetof(Vertex, position)));
            glVertexAttribPointer(1, 4, GL_BYTE, GL_TRUE, sizeof(Vertex), offset(offsetof(Vertex, normal)));
            glVertexAttribPointer(2, 2, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(offsetof(Vertex, uv)));
            glVertexAttribIPointer(3, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offset(offsetof(Vertex, material)));
            for (GLuint i = 0; i < 4; ++i) glEnableVertexAttribArray(i);
            glUseProgram(programs[f].name());
            glBindBufferBase(GL_UNIFORM_BUFFER, 0, view.name());
            glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
        }
        gl::read_pixels(target->framebuffer(), 0, 0, target->width(), target->height(), sheet);
        const auto edge = static_cast<std::size_t>(edge_px);
        for (std::size_t i = 0; i < part.size(); ++i) {
            Image& image = images.emplace_back(Image{edge_px, edge_px, {}});
            const std::size_t x = i % static_cast<std::size_t>(across) * edge, y = i / static_cast<std::size_t>(across) * edge;
            for (std::size_t row = 0; row < edge; ++row) {
                const auto from = sheet.begin() + static_cast<std::ptrdiff_t>(((y + row) * static_cast<std::size_t>(target->width()) + x) * 4);
                image.rgba.insert(image.rgba.end(), from, from + static_cast<std::ptrdiff_t>(edge * 4));
            }
        }
    }
    glUseProgram(0);
    glBindVertexArray(0);
    glBindBuffer(GL_ARRAY_BUFFER, 0);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return images;
}

}  // namespace fovea::scene
