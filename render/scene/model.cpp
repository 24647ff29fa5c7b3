#include "render/scene/model.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace fovea::scene {
namespace {

// Where a time lies between the keys: the earlier key and the part of the way to the next.
struct Between {
    std::size_t key = 0;
    double part = 0;
};
Between find(const Track& t, double time_s) noexcept {
    const auto after = std::upper_bound(t.times_s.begin(), t.times_s.end(), time_s);
    if (after == t.times_s.begin()) return {};
    const auto key = static_cast<std::size_t>(after - t.times_s.begin()) - 1;
    if (key + 1 >= t.times_s.size() || t.step) return {key, 0};
    const double a = static_cast<double>(t.times_s[key]), b = static_cast<double>(t.times_s[key + 1]);
    return {key, b > a ? (time_s - a) / (b - a) : 0};
}

Quaternion slerp(const Quaternion& a, Quaternion b, double part) noexcept {
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot += a[i] * b[i];
    if (dot < 0) {
        for (double& v : b) v = -v;
        dot = -dot;
    }
    double wa = 1 - part, wb = part;
    if (dot < 0.9995) {
        const double angle = std::acos(std::min(dot, 1.0)), s = std::sin(angle);
        wa = std::sin((1 - part) * angle) / s;
        wb = std::sin(part * angle) / s;
    }
    Quaternion q;
    for (std::size_t i = 0; i < 4; ++i) q[i] = wa * a[i] + wb * b[i];
    return q;
}

void apply(const Track& t, double time_s, Placement& p) noexcept {
    if (t.times_s.empty()) return;
    const Between at = find(t, time_s);
    const auto& a = t.values[at.key];
    const auto& b = t.values[std::min(at.key + 1, t.values.size() - 1)];
    const auto d = [](float v) { return static_cast<double>(v); };
    if (t.path == Track::Path::rotation) {
        p.rotation = slerp({d(a[0]), d(a[1]), d(a[2]), d(a[3])}, {d(b[0]), d(b[1]), d(b[2]), d(b[3])}, at.part);
        return;
    }
    auto& to = t.path == Track::Path::translation ? p.translation : p.scale;
    for (std::size_t i = 0; i < 3; ++i) to[i] = d(a[i]) + at.part * (d(b[i]) - d(a[i]));
}

}  // namespace

Mat4 matrix_of(const Placement& p) noexcept {
    const auto& q = p.rotation;
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], s = n > 0 ? 2 / n : 0;
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double r[9] = {1 - s * (y * y + z * z), s * (x * y + z * w), s * (x * z - y * w),
                         s * (x * y - z * w), 1 - s * (x * x + z * z), s * (y * z + x * w),
                         s * (x * z + y * w), s * (y * z - x * w), 1 - s * (x * x + y * y)};
    Mat4 m{};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < 3; ++i) m[c * 4 + i] = r[c * 3 + i] * p.scale[c];
    for (std::size_t i = 0; i < 3; ++i) m[12 + i] = p.translation[i];
    m[15] = 1;
    return m;
}

void place_nodes(const Model& model, double time_s, std::span<Mat4> world) noexcept {
    const double t = model.duration_s > 0 ? time_s - std::floor(time_s / model.duration_s) * model.duration_s : 0;
    std::size_t next = 0;   // tracks are sorted by node
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const Node& n = model.nodes[i];
        Placement p = n.placement;
        bool moved = false;
        for (; next < model.tracks.size() && model.tracks[next].node == i; ++next) {
            apply(model.tracks[next], t, p);
            moved = true;
        }
        const Mat4 local = n.matrix && !moved ? *n.matrix : matrix_of(p);
        world[i] = n.parent >= 0 ? multiply(world[static_cast<std::size_t>(n.parent)], local) : local;
    }
}

std::vector<bool> moving_nodes(const Model& model) {
    std::vector<bool> moving(model.nodes.size());
    for (const Track& t : model.tracks) moving[t.node] = true;
    for (std::size_t i = 0; i < model.nodes.size(); ++i)
        if (model.nodes[i].parent >= 0 && moving[static_cast<std::size_t>(model.nodes[i].parent)]) moving[i] = true;
    return moving;
}

Aabb transformed(const Mat4& m, const Aabb& b) noexcept {
    Aabb r;
    if (b.low[0] > b.high[0]) return r;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double low = m[12 + axis], high = low;
        for (std::size_t k = 0; k < 3; ++k) {
            const double u = m[k * 4 + axis] * static_cast<double>(b.low[k]), v = m[k * 4 + axis] * static_cast<double>(b.high[k]);
            low += std::min(u, v);
            high += std::max(u, v);
        }
        r.low[axis] = static_cast<float>(low);
        r.high[axis] = static_cast<float>(high);
    }
    return r;
}

Aabb bounds_of(const Model& model) {
    std::vector<Mat4> world(model.nodes.size());
    place_nodes(model, 0, world);
    Aabb all;
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        if (model.nodes[i].mesh < 0) continue;
        const PartRange r = model.meshes[static_cast<std::size_t>(model.nodes[i].mesh)];
        for (std::uint32_t p = r.first; p < r.first + r.count; ++p) {
            const Aabb b = transformed(world[i], model.parts[p].bounds);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                all.low[axis] = std::min(all.low[axis], b.low[axis]);
                all.high[axis] = std::max(all.high[axis], b.high[axis]);
            }
        }
    }
    return all;
}

std::array<std::int16_t, 4> snorm16(float x, float y, float z) noexcept {
    const auto s = [](float v) { return static_cast<std::int16_t>(std::lround(std::clamp(v, -1.0f, 1.0f) * 32767.0f)); };
    return {s(x), s(y), s(z), 0};
}

}  // namespace fovea::scene
