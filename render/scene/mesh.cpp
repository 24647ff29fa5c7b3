#include "render/scene/mesh.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::scene {
namespace {

constexpr float kTau = 6.28318530718f;

Point sub(const Point& a, const Point& b) noexcept { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) noexcept {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point unit(const Point& a) noexcept {
    const float l = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    return l > 0 ? Point{a[0] / l, a[1] / l, a[2] / l} : Point{0, 1, 0};
}

}  // namespace

std::uint32_t MeshBuilder::vertex(const Point& p, const Point& n, std::array<float, 2> uv) {
    const auto snorm = [](float v) { return static_cast<std::int8_t>(std::lround(std::clamp(v, -1.0f, 1.0f) * 127.0f)); };
    mesh_.vertices.push_back({p, {snorm(n[0]), snorm(n[1]), snorm(n[2]), 0}, uv, material_});
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
}

void MeshBuilder::end_chunk() {
    const std::vector<std::uint32_t> added(mesh_.indices.begin() + chunk_start_, mesh_.indices.end());
    mesh_.indices.resize(chunk_start_);
    for (std::size_t f = 0; f < kFamilies; ++f) {
        Chunk chunk{.first_index = static_cast<std::uint32_t>(mesh_.indices.size()), .family = static_cast<Family>(f), .bounds = {}};
        for (std::size_t i = 0; i < added.size(); i += 3) {
            if (family_of(mesh_.vertices[added[i]].material[0]) != chunk.family) continue;
            for (std::size_t k = i; k < i + 3; ++k) {
                mesh_.indices.push_back(added[k]);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const float v = mesh_.vertices[added[k]].position[axis];
                    chunk.bounds.low[axis] = std::min(chunk.bounds.low[axis], v);
                    chunk.bounds.high[axis] = std::max(chunk.bounds.high[axis], v);
                }
            }
        }
        chunk.index_count = static_cast<std::uint32_t>(mesh_.indices.size()) - chunk.first_index;
        if (chunk.index_count != 0) mesh_.chunks.push_back(chunk);
    }
    chunk_start_ = static_cast<std::uint32_t>(mesh_.indices.size());
}

void MeshBuilder::quad(const Point& a, const Point& b, const Point& c, const Point& d, std::array<float, 2> uv0,
                       std::array<float, 2> uv1) {
    const Point n = unit(cross(sub(b, a), sub(d, a)));
    const auto i = vertex(a, n, uv0), j = vertex(b, n, {uv1[0], uv0[1]}), k = vertex(c, n, uv1), l = vertex(d, n, {uv0[0], uv1[1]});
    triangle(i, j, k);
    triangle(i, k, l);
}

void MeshBuilder::box(const Point& lo, const Point& hi, bool bottom, float bevel) {
    const float w = hi[0] - lo[0], h = hi[1] - lo[1], d = hi[2] - lo[2], e = bevel, top = hi[1] - e;
    quad({lo[0], lo[1], hi[2]}, {hi[0], lo[1], hi[2]}, {hi[0], top, hi[2]}, {lo[0], top, hi[2]}, {0, 0}, {w, h});   // +z
    quad({hi[0], lo[1], lo[2]}, {lo[0], lo[1], lo[2]}, {lo[0], top, lo[2]}, {hi[0], top, lo[2]}, {0, 0}, {w, h});   // -z
    quad({hi[0], lo[1], hi[2]}, {hi[0], lo[1], lo[2]}, {hi[0], top, lo[2]}, {hi[0], top, hi[2]}, {0, 0}, {d, h});   // +x
    quad({lo[0], lo[1], lo[2]}, {lo[0], lo[1], hi[2]}, {lo[0], top, hi[2]}, {lo[0], top, lo[2]}, {0, 0}, {d, h});   // -x
    if (e > 0) {
        const Point a{lo[0] + e, hi[1], hi[2] - e}, b{hi[0] - e, hi[1], hi[2] - e}, c{hi[0] - e, hi[1], lo[2] + e}, f{lo[0] + e, hi[1], lo[2] + e};
        quad({lo[0], top, hi[2]}, {hi[0], top, hi[2]}, b, a, {0, 0}, {w, e});
        quad({hi[0], top, hi[2]}, {hi[0], top, lo[2]}, c, b, {0, 0}, {d, e});
        quad({hi[0], top, lo[2]}, {lo[0], top, lo[2]}, f, c, {0, 0}, {w, e});
        quad({lo[0], top, lo[2]}, {lo[0], top, hi[2]}, a, f, {0, 0}, {d, e});
    }
    quad({lo[0] + e, hi[1], hi[2] - e}, {hi[0] - e, hi[1], hi[2] - e}, {hi[0] - e, hi[1], lo[2] + e}, {lo[0] + e, hi[1], lo[2] + e}, {0, 0}, {w, d});
    if (bottom) quad({lo[0], lo[1], lo[2]}, {hi[0], lo[1], lo[2]}, {hi[0], lo[1], hi[2]}, {lo[0], lo[1], hi[2]}, {0, 0}, {w, d});
}

void MeshBuilder::ball_box(const Point& centre, float radius) {
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (unsigned corner = 0; corner < 8; ++corner) {
        Point n{};
        for (unsigned axis = 0; axis < 3; ++axis) n[axis] = (corner >> axis & 1) != 0 ? 1.0f : -1.0f;
        static_cast<void>(vertex({centre[0] + radius * n[0], centre[1] + radius * n[1], centre[2] + radius * n[2]}, n, {radius, 0}));
    }
    for (const auto& face : {std::array{4u, 5u, 7u, 6u}, {1u, 0u, 2u, 3u}, {5u, 1u, 3u, 7u}, {0u, 4u, 6u, 2u}, {6u, 7u, 3u, 2u}, {0u, 1u, 5u, 4u}}) {
        triangle(first + face[0], first + face[1], first + face[2]);
        triangle(first + face[0], first + face[2], first + face[3]);
    }
}

void MeshBuilder::cylinder(const Point& base, float radius, float height, int segments, float bevel) {
    const float inner = radius - bevel, shoulder = height - bevel;
    const auto centre = vertex({base[0], base[1] + height, base[2]}, {0, 1, 0}, {0, 0});
    const auto ring = [&](float r, float y, float ny, float uv_scale) {
        const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
        for (int i = 0; i <= segments; ++i) {
            const float a = kTau * static_cast<float>(i) / static_cast<float>(segments), c = std::cos(a), s = -std::sin(a);
            const Point n = unit({ny < 1 ? c : 0, ny < 1 ? ny : 1, ny < 1 ? s : 0});
            const std::array<float, 2> uv = uv_scale > 0 ? std::array{c * uv_scale, s * uv_scale}
                                                         : std::array{static_cast<float>(i) / static_cast<float>(segments), y};
            static_cast<void>(vertex({base[0] + r * c, base[1] + y, base[2] + r * s}, n, uv));
        }
        return first;
    };
    const auto band = [&](std::uint32_t lower, std::uint32_t upper) {
        for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(segments); ++i) {
            triangle(lower + i, lower + i + 1, upper + i + 1);
            triangle(lower + i, upper + i + 1, upper + i);
        }
    };
    const auto bottom = ring(radius, 0, 0, 0), side = ring(radius, shoulder, 0, 0);
    band(bottom, side);
    if (bevel > 0) band(ring(radius, shoulder, 0, 0), ring(inner, height, 0.8f, 0));
    const auto top = ring(inner, height, 1, 1);
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(segments); ++i) triangle(centre, top + i, top + i + 1);
}

void MeshBuilder::dome(const Point& base, float radius, float height, int segments, int rings) {
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (int r = 0; r <= rings; ++r) {
        const float e = kTau / 4 * static_cast<float>(r) / static_cast<float>(rings), ce = std::cos(e), se = std::sin(e);
        for (int i = 0; i <= segments; ++i) {
            const float a = kTau * static_cast<float>(i) / static_cast<float>(segments), c = std::cos(a), s = -std::sin(a);
            static_cast<void>(vertex({base[0] + radius * ce * c, base[1] + height * se, base[2] + radius * ce * s},
                                     unit({c * ce / radius, se / height, s * ce / radius}),
                                     {static_cast<float>(i) / static_cast<float>(segments), se}));
        }
    }
    const auto row = static_cast<std::uint32_t>(segments + 1);
    for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(rings); ++r)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const auto a = first + r * row + i;
            triangle(a, a + 1, a + row + 1);
            if (r + 1 < static_cast<std::uint32_t>(rings)) triangle(a, a + row + 1, a + row);
        }
}

void MeshBuilder::floor(float x0, float z0, float x1, float z1, float y, int nx, int nz) {
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (int j = 0; j <= nz; ++j)
        for (int i = 0; i <= nx; ++i) {
            const float x = x0 + (x1 - x0) * static_cast<float>(i) / static_cast<float>(nx);
            const float z = z0 + (z1 - z0) * static_cast<float>(j) / static_cast<float>(nz);
            static_cast<void>(vertex({x, y, z}, {0, 1, 0}, {x, z}));
        }
    const auto row = static_cast<std::uint32_t>(nx + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nz); ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const auto a = first + j * row + i;
            triangle(a, a + row, a + row + 1);
            triangle(a, a + row + 1, a + 1);
        }
}

void MeshBuilder::room(const Point& lo, const Point& hi, int n) {
    const auto wall = [&](const Point& origin, const Point& u, const Point& v) {
        const float step = 1.0f / static_cast<float>(n);
        const auto at = [&](int i, int j) {
            const float a = static_cast<float>(i) * step, b = static_cast<float>(j) * step;
            return Point{origin[0] + a * u[0] + b * v[0], origin[1] + a * u[1] + b * v[1], origin[2] + a * u[2] + b * v[2]};
        };
        const float lu = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), lv = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i)
                quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1),
                     {lu * static_cast<float>(i) * step, lv * static_cast<float>(j) * step},
                     {lu * static_cast<float>(i + 1) * step, lv * static_cast<float>(j + 1) * step});
    };
    const float w = hi[0] - lo[0], h = hi[1] - lo[1], d = hi[2] - lo[2];
    wall({lo[0], lo[1], lo[2]}, {w, 0, 0}, {0, h, 0});    // far wall, seen from +z
    wall({hi[0], lo[1], hi[2]}, {-w, 0, 0}, {0, h, 0});   // near wall
    wall({lo[0], lo[1], hi[2]}, {0, 0, -d}, {0, h, 0});   // left
    wall({hi[0], lo[1], lo[2]}, {0, 0, d}, {0, h, 0});    // right
    wall({lo[0], lo[1], hi[2]}, {w, 0, 0}, {0, 0, -d});   // floor
    wall({lo[0], hi[1], lo[2]}, {w, 0, 0}, {0, 0, d});    // ceiling
}

}  // namespace fovea::scene
