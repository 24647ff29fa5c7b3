#include "render/effects/glance.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::effects {
namespace {

using scene::Mat4;

// How rough the procedural materials are where they are smoothest (shaders.cpp), by scene::Material.
constexpr std::array<float, 11> kRoughness{0.30f, 0.45f, 0.25f, 0.28f, 0.45f, 0.10f, 0.36f, 1.0f, 0.25f, 0.45f, 0.35f};

constexpr int kVariants = 256;   // what Vertex::material tells apart

struct Corner {
    std::array<double, 4> clip;
    std::array<float, 3> world, normal;
    std::array<float, 2> uv;
};

Corner between(const Corner& a, const Corner& b, double part) noexcept {
    Corner c;
    const auto f = static_cast<float>(part);
    for (std::size_t i = 0; i < 4; ++i) c.clip[i] = a.clip[i] + part * (b.clip[i] - a.clip[i]);
    for (std::size_t i = 0; i < 3; ++i) {
        c.world[i] = a.world[i] + f * (b.world[i] - a.world[i]);
        c.normal[i] = a.normal[i] + f * (b.normal[i] - a.normal[i]);
    }
    for (std::size_t i = 0; i < 2; ++i) c.uv[i] = a.uv[i] + f * (b.uv[i] - a.uv[i]);
    return c;
}

class Painter {
public:
    Painter(Glance& g) : g_(g) {}

    void triangle(const std::array<Corner, 3>& c, std::uint32_t surface, bool cull) {
        constexpr double kNear = 1e-3;
        std::array<Corner, 4> kept;
        std::size_t n = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Corner& a = c[i];
            const Corner& b = c[(i + 1) % 3];
            const bool in_a = a.clip[3] > kNear, in_b = b.clip[3] > kNear;
            if (in_a) kept[n++] = a;
            if (in_a != in_b) kept[n++] = between(a, b, (kNear - a.clip[3]) / (b.clip[3] - a.clip[3]));
        }
        if (n < 3) return;
        const auto id = static_cast<std::uint32_t>(g_.triangle_px.size());
        g_.triangle_px.push_back(0);
        piece(kept[0], kept[1], kept[2], id, surface, cull);
        if (n == 4) piece(kept[0], kept[2], kept[3], id, surface, cull);
    }

private:
    void piece(const Corner& a, const Corner& b, const Corner& c, std::uint32_t id, std::uint32_t surface, bool cull) {
        const std::array<const Corner*, 3> p{&a, &b, &c};
        std::array<double, 3> x{}, y{}, v{};
        for (std::size_t i = 0; i < 3; ++i) {
            v[i] = 1 / p[i]->clip[3];
            x[i] = (p[i]->clip[0] * v[i] + 1) / 2 * g_.width;
            y[i] = (p[i]->clip[1] * v[i] + 1) / 2 * g_.height;
        }
        const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        if (area == 0 || !std::isfinite(area) || (cull && area < 0)) return;
        g_.triangle_px[id] += static_cast<float>(std::abs(area) / 2);
        const auto whole = [](double value, int most) { return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most))); };
        const auto [x_low, x_high] = std::minmax({x[0], x[1], x[2]});
        const auto [y_low, y_high] = std::minmax({y[0], y[1], y[2]});
        const int x0 = whole(std::floor(x_low), g_.width), x1 = whole(std::ceil(x_high), g_.width), y0 = whole(std::floor(y_low), g_.height), y1 = whole(std::ceil(y_high), g_.height);
        const Surface& s = g_.surfaces[surface];
        for (int py = y0; py < y1; ++py)
            for (int px = x0; px < x1; ++px) {
                const double qx = px + 0.5, qy = py + 0.5;
                std::array<double, 3> w{};   // barycentric, on the screen
                for (std::size_t i = 0; i < 3; ++i) {
                    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
                    w[i] = ((x[j] - qx) * (y[k] - qy) - (x[k] - qx) * (y[j] - qy)) / area;
                }
                if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
                const double inverse = w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
                const auto at = static_cast<std::size_t>(py) * static_cast<std::size_t>(g_.width) + static_cast<std::size_t>(px);
                Glimpse& to = g_.pixels[at];
                const auto depth = static_cast<float>(1 / inverse);
                if (to.w > 0 && depth >= to.w) continue;
                if (s.blended) {
                    g_.blended[at] = true;
                    continue;
                }
                g_.blended[at] = false;
                to.w = depth;
                to.triangle = id;
                to.surface = surface;
                std::array<float, 3> share{};
                for (std::size_t i = 0; i < 3; ++i) share[i] = static_cast<float>(w[i] * v[i] / inverse);
                const auto mix = [&](auto member, std::size_t k) { return share[0] * (a.*member)[k] + share[1] * (b.*member)[k] + share[2] * (c.*member)[k]; };
                for (std::size_t k = 0; k < 3; ++k) {
                    to.world[k] = mix(&Corner::world, k);
                    to.normal[k] = mix(&Corner::normal, k);
                }
                for (std::size_t k = 0; k < 2; ++k) to.uv[k] = mix(&Corner::uv, k);
            }
    }
    Glance& g_;
};

std::array<double, 4> to_clip(const Mat4& m, const std::array<float, 3>& p) noexcept {
    std::array<double, 4> r{};
    for (std::size_t i = 0; i < 4; ++i)
        r[i] = m[i] * static_cast<double>(p[0]) + m[4 + i] * static_cast<double>(p[1]) + m[8 + i] * static_cast<double>(p[2]) + m[12 + i];
    return r;
}

void paint_mesh(const scene::Mesh& mesh, const Mat4& clip, Glance& g, Painter& painter) {
    const auto base = static_cast<std::uint32_t>(g.surfaces.size());
    for (std::size_t m = 0; m < kRoughness.size(); ++m)
        for (int variant = 0; variant < kVariants; ++variant) g.surfaces.push_back({.roughness = kRoughness[m], .material = static_cast<int>(m), .variant = variant});
    for (const scene::Chunk& chunk : mesh.chunks) {
        if (scene::project_bounds(clip, chunk.bounds).empty()) continue;
        for (std::uint32_t i = chunk.first_index; i + 2 < chunk.first_index + chunk.index_count; i += 3) {
            std::array<Corner, 3> c;
            std::uint32_t material = 0, variant = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const scene::Vertex& v = mesh.vertices[mesh.indices[i + k]];
                c[k] = {to_clip(clip, v.position), v.position, {}, v.uv};
                for (std::size_t axis = 0; axis < 3; ++axis) c[k].normal[axis] = static_cast<float>(v.normal[axis]) / 127;
                material = v.material[0];
                variant = v.material[1];
            }
            painter.triangle(c, base + std::min<std::uint32_t>(material, kRoughness.size() - 1) * kVariants + variant, true);
        }
    }
}

void paint_model(const scene::Model& model, double time_s, const Mat4& clip, bool blended, Glance& g, Painter& painter) {
    std::vector<Mat4> world(model.nodes.size());
    scene::place_nodes(model, time_s, world);
    const std::vector<bool> moving = scene::moving_nodes(model);
    for (std::size_t n = 0; n < model.nodes.size(); ++n) {
        if (model.nodes[n].mesh < 0) continue;
        const scene::PartRange range = model.meshes[static_cast<std::size_t>(model.nodes[n].mesh)];
        for (std::uint32_t p = range.first; p < range.first + range.count; ++p) {
            const scene::Part& part = model.parts[p];
            const scene::ModelMaterial& m = model.materials[part.material];
            if (m.blend != blended || scene::project_bounds(clip, scene::transformed(world[n], part.bounds)).empty()) continue;
            const auto surface = static_cast<std::uint32_t>(g.surfaces.size());
            g.surfaces.push_back({.roughness = m.roughness, .image = m.color_image, .node = static_cast<int>(n), .moving = moving[n], .blended = m.blend, .cut_out = m.alpha_cutoff > 0});
            for (std::uint32_t i = part.first_index; i + 2 < part.first_index + part.index_count; i += 3) {
                std::array<Corner, 3> c;
                for (std::size_t k = 0; k < 3; ++k) {
                    const scene::ModelVertex& v = model.vertices[model.indices[i + k]];
                    const auto at = to_clip(world[n], v.position);
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        c[k].world[axis] = static_cast<float>(at[axis]);
                        double turned = 0;   // good enough for what normals are asked for here: no uneven scales
                        for (std::size_t j = 0; j < 3; ++j) turned += world[n][j * 4 + axis] * v.normal[j];
                        c[k].normal[axis] = static_cast<float>(turned);
                    }
                    c[k].clip = to_clip(clip, c[k].world);
                    c[k].uv = v.uv;
                }
                painter.triangle(c, surface, !m.double_sided);
            }
        }
    }
}

}  // namespace

Mat4 clip_from_world(const scene::Source& source, const scene::SceneView& view, double time_s) noexcept {
    return scene::multiply(scene::projection(view.fov, source.near_m, source.far_m), scene::view_from_world(source.pose(time_s), view.offset_m));
}

Glance glance(const scene::Source& source, const scene::SceneView& view, double time_s, int width, int height) {
    Glance g{.width = width, .height = height, .pixels = {}, .blended = {}, .triangle_px = {}, .surfaces = {}};
    g.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    g.blended.resize(g.pixels.size());
    const Mat4 clip = clip_from_world(source, view, time_s);
    Painter painter(g);
    paint_mesh(source.mesh, clip, g, painter);
    if (source.model)
        for (const bool blended : {false, true}) paint_model(*source.model, time_s, clip, blended, g, painter);
    return g;
}

}  // namespace fovea::effects
