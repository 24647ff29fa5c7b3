#include "render/scene/model_builder.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::scene {
namespace {

constexpr float kTau = 6.28318530718f;
using P3 = ModelBuilder::P3;

P3 add(const P3& a, const P3& b, float s) noexcept { return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]}; }
P3 cross(const P3& a, const P3& b) noexcept { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
P3 unit(const P3& a) noexcept {
    const float l = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    return l > 0 ? P3{a[0] / l, a[1] / l, a[2] / l} : P3{0, 1, 0};
}

}  // namespace

int ModelBuilder::image(Image image) {
    model_.images.push_back(std::move(image));
    return static_cast<int>(model_.images.size()) - 1;
}

std::uint32_t ModelBuilder::material(const ModelMaterial& m) {
    if (part_first_ != model_.indices.size()) end_part();
    model_.materials.push_back(m);
    return material_ = static_cast<std::uint32_t>(model_.materials.size()) - 1;
}

std::uint32_t ModelBuilder::vertex(const P3& p, const P3& n, float u, float v) {
    model_.vertices.push_back({p, snorm16(n[0], n[1], n[2]), {u, v}});
    return static_cast<std::uint32_t>(model_.vertices.size()) - 1;
}

void ModelBuilder::quad(const P3& a, const P3& b, const P3& c, const P3& d) {
    const P3 n = unit(cross(add(b, a, -1), add(d, a, -1)));
    const auto i = vertex(a, n, 0, 1), j = vertex(b, n, 1, 1), k = vertex(c, n, 1, 0), l = vertex(d, n, 0, 0);
    triangle(i, j, k);
    triangle(i, k, l);
}

void ModelBuilder::box(const P3& lo, const P3& hi) {
    quad({lo[0], lo[1], hi[2]}, {hi[0], lo[1], hi[2]}, {hi[0], hi[1], hi[2]}, {lo[0], hi[1], hi[2]});
    quad({hi[0], lo[1], lo[2]}, {lo[0], lo[1], lo[2]}, {lo[0], hi[1], lo[2]}, {hi[0], hi[1], lo[2]});
    quad({hi[0], lo[1], hi[2]}, {hi[0], lo[1], lo[2]}, {hi[0], hi[1], lo[2]}, {hi[0], hi[1], hi[2]});
    quad({lo[0], lo[1], lo[2]}, {lo[0], lo[1], hi[2]}, {lo[0], hi[1], hi[2]}, {lo[0], hi[1], lo[2]});
    quad({lo[0], hi[1], hi[2]}, {hi[0], hi[1], hi[2]}, {hi[0], hi[1], lo[2]}, {lo[0], hi[1], lo[2]});
    quad({lo[0], lo[1], lo[2]}, {hi[0], lo[1], lo[2]}, {hi[0], lo[1], hi[2]}, {lo[0], lo[1], hi[2]});
}

void ModelBuilder::tube(const P3& from, const P3& to, float radius, int sides) {
    const P3 along = unit(add(to, from, -1));
    const P3 u = unit(cross(along, std::abs(along[1]) > 0.9f ? P3{1, 0, 0} : P3{0, 1, 0})), v = cross(along, u);
    for (int i = 0; i <= sides; ++i) {
        const float a = kTau * static_cast<float>(i) / static_cast<float>(sides), part = static_cast<float>(i) / static_cast<float>(sides);
        const P3 n = add(add({0, 0, 0}, u, std::cos(a)), v, std::sin(a));
        const auto low = vertex(add(from, n, radius), n, part, 1), high = vertex(add(to, n, radius), n, part, 0);
        if (i == 0) continue;
        triangle(low - 2, low, high);
        triangle(low - 2, high, high - 2);
    }
}

void ModelBuilder::sphere(const P3& middle, float radius, int around, int up) {
    const auto base = static_cast<std::uint32_t>(model_.vertices.size()), row = static_cast<std::uint32_t>(around) + 1;
    for (int j = 0; j <= up; ++j)
        for (int i = 0; i <= around; ++i) {
            const float a = kTau * static_cast<float>(i) / static_cast<float>(around), b = kTau / 2 * static_cast<float>(j) / static_cast<float>(up);
            const P3 n{std::sin(b) * std::sin(a), std::cos(b), std::sin(b) * std::cos(a)};
            vertex(add(middle, n, radius), n, static_cast<float>(i) / static_cast<float>(around), static_cast<float>(j) / static_cast<float>(up));
        }
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(up); ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t k = base + j * row + i;
            if (j != 0) triangle(k, k + row, k + 1);
            if (j + 1 != static_cast<std::uint32_t>(up)) triangle(k + 1, k + row, k + row + 1);
        }
}

void ModelBuilder::ring(const P3& middle, float radius, float thickness, int around, int sides) {
    const auto base = static_cast<std::uint32_t>(model_.vertices.size()), row = static_cast<std::uint32_t>(sides) + 1;
    for (int i = 0; i <= around; ++i)
        for (int j = 0; j <= sides; ++j) {
            const float a = kTau * static_cast<float>(i) / static_cast<float>(around), b = kTau * static_cast<float>(j) / static_cast<float>(sides);
            const P3 out{std::sin(a), 0, std::cos(a)}, n{std::cos(b) * out[0], std::sin(b), std::cos(b) * out[2]};
            vertex(add(add(middle, out, radius), n, thickness), n, 8 * static_cast<float>(i) / static_cast<float>(around), static_cast<float>(j) / static_cast<float>(sides));
        }
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(around); ++i)
        for (std::uint32_t j = 0; j + 1 < row; ++j) {
            const std::uint32_t k = base + i * row + j;
            triangle(k, k + row, k + 1);
            triangle(k + 1, k + row, k + row + 1);
        }
}

void ModelBuilder::sheet(float x0, float z0, float x1, float z1, int nx, int nz, const std::function<float(float, float)>& height) {
    const auto base = static_cast<std::uint32_t>(model_.vertices.size()), row = static_cast<std::uint32_t>(nx) + 1;
    constexpr float kStep_m = 0.002f;
    for (int j = 0; j <= nz; ++j)
        for (int i = 0; i <= nx; ++i) {
            const float u = static_cast<float>(i) / static_cast<float>(nx), v = static_cast<float>(j) / static_cast<float>(nz);
            const float x = x0 + (x1 - x0) * u, z = z0 + (z1 - z0) * v;
            const float dx = (height(x - kStep_m, z) - height(x + kStep_m, z)) / (2 * kStep_m), dz = (height(x, z - kStep_m) - height(x, z + kStep_m)) / (2 * kStep_m);
            vertex({x, height(x, z), z}, unit({dx, 1, dz}), u, v);
        }
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nz); ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t k = base + j * row + i;
            triangle(k, k + row, k + 1);
            triangle(k + 1, k + row, k + row + 1);
        }
}

void ModelBuilder::end_part() {
    Part part{.first_index = part_first_, .index_count = static_cast<std::uint32_t>(model_.indices.size()) - part_first_, .material = material_, .bounds = {}};
    for (std::uint32_t i = part_first_; i < model_.indices.size(); ++i)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float v = model_.vertices[model_.indices[i]].position[axis];
            part.bounds.low[axis] = std::min(part.bounds.low[axis], v);
            part.bounds.high[axis] = std::max(part.bounds.high[axis], v);
        }
    part_first_ = static_cast<std::uint32_t>(model_.indices.size());
    if (part.index_count != 0) model_.parts.push_back(part);
}

int ModelBuilder::end_mesh() {
    end_part();
    const auto count = static_cast<std::uint32_t>(model_.parts.size()) - mesh_first_;
    model_.meshes.push_back({mesh_first_, count});
    mesh_first_ += count;
    return static_cast<int>(model_.meshes.size()) - 1;
}

std::uint32_t ModelBuilder::node(int mesh, const Placement& placement, int parent) {
    model_.nodes.push_back({.parent = parent, .mesh = mesh, .placement = placement, .matrix = {}});
    return static_cast<std::uint32_t>(model_.nodes.size()) - 1;
}

void ModelBuilder::track(std::uint32_t node, Track::Path path, std::vector<float> times_s, std::vector<std::array<float, 4>> values) {
    model_.tracks.push_back({.node = node, .path = path, .times_s = std::move(times_s), .values = std::move(values)});
}

Model ModelBuilder::take(double duration_s) {
    model_.duration_s = duration_s;
    std::ranges::stable_sort(model_.tracks, {}, &Track::node);
    return std::move(model_);
}

}  // namespace fovea::scene
