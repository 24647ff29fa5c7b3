#include "render/effects/contents.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::effects {
namespace {

constexpr float kStep = 0.03f;          // of its distance: something this much further away lies behind
constexpr double kHighlight_px = 8;     // and so is a highlight of two
constexpr float kGloss = 0.32f;         // roughness above which highlights have no edge
constexpr int kGrid_px = 20;            // between spots, in the glance

double median(std::vector<float>& v) noexcept {
    if (v.empty()) return 0;
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return static_cast<double>(*middle);
}

// Is the surface at (x, y) at most `most` pixels wide along (dx, dy), with something further away on both sides?
bool narrow(const Glance& g, int x, int y, int dx, int dy, int most) noexcept {
    const float here = g.at(x, y).w;
    int run = 1;
    for (const int way : {-1, 1}) {
        int k = 1;
        for (;; ++k) {
            const int px = x + way * k * dx, py = y + way * k * dy;
            if (px < 0 || py < 0 || px >= g.width || py >= g.height) return false;
            const float there = g.at(px, py).w;
            if (there == 0 || there > here * (1 + kStep)) break;   // behind
            if (there < here * (1 - kStep)) return false;          // covered: no edge of its own
            if (++run > most) return false;
        }
    }
    return run <= most;
}

struct Point {
    double x = 0, y = 0;
    bool seen = false;
};
Point project(const scene::Mat4& m, const std::array<double, 3>& p, double width, double height) noexcept {
    const auto row = [&](std::size_t i) { return m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]; };
    const double w = row(3);
    return {row(0) / w * width / 2, row(1) / w * height / 2, w > 1e-3};
}

// Affine.
scene::Mat4 inverse(const scene::Mat4& m) noexcept {
    const double a = m[0], b = m[4], c = m[8], d = m[1], e = m[5], f = m[9], g = m[2], h = m[6], i = m[10];
    const double det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g), s = det != 0 ? 1 / det : 0;
    scene::Mat4 r{s * (e * i - f * h), s * (f * g - d * i), s * (d * h - e * g), 0, s * (c * h - b * i), s * (a * i - c * g), s * (b * g - a * h), 0,
                  s * (b * f - c * e), s * (c * d - a * f), s * (a * e - b * d), 0, 0, 0, 0, 1};
    for (std::size_t k = 0; k < 3; ++k) r[12 + k] = -(r[k] * m[12] + r[4 + k] * m[13] + r[8 + k] * m[14]);
    return r;
}

std::array<double, 3> moved(const scene::Mat4& m, const std::array<double, 3>& p) noexcept {
    std::array<double, 3> r{};
    for (std::size_t i = 0; i < 3; ++i) r[i] = m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i];
    return r;
}

// Sums over the pixels of all glances.
struct Sums {
    double covered = 0, thin = 0, text = 0, glossy = 0, transparent = 0, moving = 0;
    std::vector<float> object_px, camera_px, triangle_px;
};

// Turning of the normal and texels passed, per pixel of the real picture; from the right-hand neighbour on the same surface.
struct Slope {
    double turn_rad = 0, texels = 0;
};
Slope slope(const Glance& g, int x, int y, double scale, const scene::Image* image) noexcept {
    Slope s;
    const Glimpse& a = g.at(x, y);
    for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}}) {
        if (x + dx >= g.width || y + dy >= g.height) continue;
        const Glimpse& b = g.at(x + dx, y + dy);
        if (b.w == 0 || b.surface != a.surface) continue;
        double dot = 0, aa = 0, bb = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            dot += static_cast<double>(a.normal[i] * b.normal[i]);
            aa += static_cast<double>(a.normal[i] * a.normal[i]);
            bb += static_cast<double>(b.normal[i] * b.normal[i]);
        }
        if (aa > 0 && bb > 0) s.turn_rad = std::max(s.turn_rad, std::acos(std::clamp(dot / std::sqrt(aa * bb), -1.0, 1.0)) * scale);
        if (image != nullptr) {
            const double u = static_cast<double>(a.uv[0] - b.uv[0]) * image->width, v = static_cast<double>(a.uv[1] - b.uv[1]) * image->height;
            s.texels = std::max(s.texels, std::sqrt(u * u + v * v) * scale);
        }
    }
    return s;
}

// uv passed per pixel of the real picture, along rows and columns; 0: no neighbour on the same surface.
std::array<double, 2> uv_step(const Glance& g, int x, int y, double scale) noexcept {
    std::array<double, 2> least{};
    const Glimpse& a = g.at(x, y);
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= g.width || y + dy >= g.height) continue;
        const Glimpse& b = g.at(x + dx, y + dy);
        if (b.w == 0 || b.surface != a.surface) continue;
        double& way = least[dx != 0 ? 0 : 1];
        const double step = std::hypot(static_cast<double>(a.uv[0] - b.uv[0]), static_cast<double>(a.uv[1] - b.uv[1])) * scale;
        way = way > 0 ? std::min(way, step) : step;   // the further one may lie on the next object
    }
    return least;
}

void find_spots(const Glance& g, double scale, std::vector<Spot>& spots) {
    for (int y = kGrid_px / 2; y < g.height; y += kGrid_px)
        for (int x = kGrid_px / 2; x < g.width; x += kGrid_px) {
            const Glimpse& p = g.at(x, y);
            if (p.w == 0) continue;
            const Surface& s = g.surfaces[p.surface];
            if (s.material < 0 || !scene::has_tiles(static_cast<std::uint8_t>(s.material))) continue;
            const auto step = uv_step(g, x, y, scale);
            if (step[0] <= 0 || step[1] <= 0) continue;
            spots.push_back({.tile = {.material = static_cast<std::uint8_t>(s.material), .variant = static_cast<std::uint8_t>(s.variant), .normal = p.normal, .middle = p.uv},
                             .fine_uv = std::min(step[0], step[1]), .coarse_uv = std::max(step[0], step[1]), .share = static_cast<double>(kGrid_px * kGrid_px)});
        }
}

void look_once(const scene::Source& source, const Look& look, double time_s, const std::vector<double>& strokes, Sums& sums, std::vector<Spot>* spots) {
    const scene::SceneView view = scene::stereo_views()[0];
    const Glance g = glance(source, view, time_s, kGlance_px, kGlance_px);
    const double scale = static_cast<double>(kGlance_px) / look.width_px;   // glance pixels per real one
    if (spots != nullptr) find_spots(g, scale, *spots);
    const int thin = std::max(1, static_cast<int>(std::lround(kThin_px * scale)));
    const scene::Mat4 now = clip_from_world(source, view, time_s), before = clip_from_world(source, view, time_s - look.frame_s);
    std::vector<scene::Mat4> world_now, world_before;
    if (source.model) {
        world_now.resize(source.model->nodes.size());
        world_before.resize(source.model->nodes.size());
        scene::place_nodes(*source.model, time_s, world_now);
        scene::place_nodes(*source.model, time_s - look.frame_s, world_before);
    }
    std::vector<bool> seen(g.triangle_px.size());
    for (int y = 0; y < g.height; ++y)
        for (int x = 0; x < g.width; ++x) {
            const Glimpse& p = g.at(x, y);
            const bool through = g.blended[static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(x)];
            if (p.w == 0 && !through) continue;
            ++sums.covered;
            const Surface* s = p.w > 0 ? &g.surfaces[p.surface] : nullptr;
            sums.transparent += through || (s != nullptr && s->cut_out);
            if (s == nullptr) continue;
            seen[p.triangle] = true;
            sums.thin += narrow(g, x, y, 1, 0, thin) || narrow(g, x, y, 0, 1, thin);
            const scene::Image* image = s->image >= 0 ? &source.model->images[static_cast<std::size_t>(s->image)] : nullptr;
            const Slope d = slope(g, x, y, scale, image);
            // GGX: the highlight's half width in the half vector is about the square of the roughness.
            sums.glossy += s->roughness <= kGloss && d.turn_rad > 0 && 2 * static_cast<double>(s->roughness * s->roughness) / d.turn_rad < kHighlight_px;
            const double stroke = s->image >= 0 ? strokes[static_cast<std::size_t>(s->image)] : 0;
            sums.text += stroke > 0 && d.texels > 0 && stroke / d.texels < kStroke_px;
            const std::array<double, 3> at{static_cast<double>(p.world[0]), static_cast<double>(p.world[1]), static_cast<double>(p.world[2])};
            const Point a = project(now, at, look.width_px, look.height_px), b = project(before, at, look.width_px, look.height_px);
            if (a.seen && b.seen) sums.camera_px.push_back(static_cast<float>(std::hypot(a.x - b.x, a.y - b.y)));
            if (!s->moving) continue;
            ++sums.moving;
            const auto node = static_cast<std::size_t>(s->node);
            const Point c = project(now, moved(world_before[node], moved(inverse(world_now[node]), at)), look.width_px, look.height_px);
            if (c.seen) sums.object_px.push_back(static_cast<float>(std::hypot(a.x - c.x, a.y - c.y)));
        }
    for (std::size_t i = 0; i < seen.size(); ++i)
        if (seen[i]) sums.triangle_px.push_back(g.triangle_px[i] / static_cast<float>(scale * scale));
}

}  // namespace

double stroke_texels(const scene::Image& image, bool hard_edges) {
    if (image.rgba.empty()) return 0;
    std::array<std::size_t, 256> histogram{};
    std::vector<std::uint8_t> luma(image.rgba.size() / 4);
    for (std::size_t i = 0; i < luma.size(); ++i) {
        luma[i] = static_cast<std::uint8_t>((2 * image.rgba[i * 4] + 5 * image.rgba[i * 4 + 1] + image.rgba[i * 4 + 2]) / 8);
        ++histogram[luma[i]];
    }
    // The paper is where most tones lie together, grain and all; ink is what is far from it. Between them lie only the letters' edges.
    constexpr int kFar = 90, kNear = 24;
    std::size_t on_paper = 0, ink = 0;
    int paper = 0;
    for (int middle = 0; middle < 256; ++middle) {
        std::size_t together = 0, tones = 0;
        for (int v = std::max(0, middle - kNear); v <= std::min(255, middle + kNear); ++v) {
            together += histogram[static_cast<std::size_t>(v)];
            tones += histogram[static_cast<std::size_t>(v)] * static_cast<std::size_t>(v);
        }
        if (together <= on_paper) continue;
        on_paper = together;
        paper = static_cast<int>(tones / together);
    }
    for (int v = 0; v < 256; ++v) {
        if (std::abs(v - paper) >= kFar) ink += histogram[static_cast<std::size_t>(v)];
    }
    const double all = static_cast<double>(luma.size());
    if (static_cast<double>(on_paper) < 0.5 * all || static_cast<double>(ink) < 0.01 * all || static_cast<double>(ink) > 0.45 * all) return 0;
    std::size_t runs = 0, steps = 0, hard = 0;
    for (int y = 0; y < image.height; ++y) {
        bool before = false;
        for (int x = 0; x < image.width; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
            const bool is_ink = std::abs(luma[i] - paper) >= kFar;
            runs += is_ink && !before;
            if (x > 0 && is_ink != before) {
                ++steps;
                hard += std::abs(luma[i] - luma[i - 1]) >= kFar / 2;
            }
            before = is_ink;
        }
    }
    if (hard_edges && 2 * hard < steps) return 0;
    return static_cast<double>(ink) / static_cast<double>(std::max<std::size_t>(runs, 1));
}

Needs look_at(const scene::Source& source, const Look& look, std::vector<Spot>* spots) {
    if (spots != nullptr) spots->clear();
    std::vector<double> strokes;
    if (source.model)
        for (const scene::Image& i : source.model->images) strokes.push_back(stroke_texels(i));
    Sums s;
    for (const double t : look.times_s) look_once(source, look, t, strokes, s, spots);
    Needs n;
    n.views = look.views;
    n.triangles = static_cast<double>(source.triangles());
    n.triangle_px = median(s.triangle_px);
    const double covered = std::max(s.covered, 1.0);
    if (spots != nullptr)
        for (Spot& spot : *spots) spot.share /= covered;
    n.thin_share = s.thin / covered;
    n.text_share = s.text / covered;
    n.glossy_share = s.glossy / covered;
    n.transparent_share = s.transparent / covered;
    n.moving_share = s.moving / covered;
    n.object_px = median(s.object_px);
    n.camera_px = median(s.camera_px);
    return n;
}

}  // namespace fovea::effects
