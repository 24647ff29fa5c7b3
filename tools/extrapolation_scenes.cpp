#include "tools/extrapolation_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>

namespace fovea::tools {

namespace {

struct V3 {
    double x = 0, y = 0, z = 0;
    friend V3 operator+(V3 a, V3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend V3 operator-(V3 a, V3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend V3 operator*(double s, V3 a) { return {s * a.x, s * a.y, s * a.z}; }
};
double dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
V3 unit(V3 a) { return (1 / std::sqrt(dot(a, a))) * a; }

struct Turn {
    double yaw = 0, pitch = 0, roll = 0;   // rad
    [[nodiscard]] std::array<V3, 3> rows() const {
        const double cy = std::cos(yaw), sy = std::sin(yaw), cp = std::cos(pitch), sp = std::sin(pitch), cr = std::cos(roll), sr = std::sin(roll);
        return {V3{cy * cr + sy * sp * sr, -cy * sr + sy * sp * cr, sy * cp}, V3{cp * sr, cp * cr, -sp}, V3{-sy * cr + cy * sp * sr, sy * sr + cy * sp * cr, cy * cp}};
    }
};
V3 apply(const std::array<V3, 3>& m, V3 v) { return {dot(m[0], v), dot(m[1], v), dot(m[2], v)}; }
V3 apply_inverse(const std::array<V3, 3>& m, V3 v) { return v.x * m[0] + v.y * m[1] + v.z * m[2]; }

struct Colour {
    float r = 0, g = 0, b = 0;
};

// A square texture with its mip levels, repeating.
class Texture {
public:
    Texture(int size, std::uint32_t seed, Colour (*f)(double u, double v, std::uint32_t seed)) {
        std::vector<Colour> level(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) level[static_cast<std::size_t>(y * size + x)] = f((x + 0.5) / size, (y + 0.5) / size, seed);
        levels_.push_back(level);
        for (int s = size / 2; s >= 1; s /= 2) {
            std::vector<Colour> next(static_cast<std::size_t>(s) * static_cast<std::size_t>(s));
            const auto& up = levels_.back();
            for (int y = 0; y < s; ++y)
                for (int x = 0; x < s; ++x) {
                    Colour c;
                    for (const int k : {0, 1, 2, 3}) {
                        const Colour& u = up[static_cast<std::size_t>((2 * y + k / 2) * 2 * s + 2 * x + k % 2)];
                        c = {c.r + u.r / 4, c.g + u.g / 4, c.b + u.b / 4};
                    }
                    next[static_cast<std::size_t>(y * s + x)] = c;
                }
            levels_.push_back(std::move(next));
        }
        size_ = size;
    }
    // u, v: one turn of the texture per unit. footprint: the pixel's size in the same unit.
    [[nodiscard]] Colour at(double u, double v, double footprint) const {
        const double want = std::clamp(std::log2(std::max(footprint * size_, 1e-6)), 0.0, static_cast<double>(levels_.size()) - 1.001);
        const auto l = static_cast<std::size_t>(want);
        const auto f = static_cast<float>(want - static_cast<double>(l));
        const Colour a = bilinear(l, u, v), b = bilinear(l + 1, u, v);
        return {a.r + f * (b.r - a.r), a.g + f * (b.g - a.g), a.b + f * (b.b - a.b)};
    }

private:
    [[nodiscard]] Colour bilinear(std::size_t l, double u, double v) const {
        const int s = size_ >> l;
        const double x = u * s - 0.5, y = v * s - 0.5, fx0 = std::floor(x), fy0 = std::floor(y);
        const int x0 = static_cast<int>(fx0) & (s - 1), y0 = static_cast<int>(fy0) & (s - 1), x1 = (x0 + 1) & (s - 1), y1 = (y0 + 1) & (s - 1);
        const auto fx = static_cast<float>(x - fx0), fy = static_cast<float>(y - fy0);
        const auto& t = levels_[l];
        const Colour &a = t[static_cast<std::size_t>(y0 * s + x0)], &b = t[static_cast<std::size_t>(y0 * s + x1)], &c = t[static_cast<std::size_t>(y1 * s + x0)], &d = t[static_cast<std::size_t>(y1 * s + x1)];
        const auto mix = [&](float p, float q, float r, float w) { return (p + fx * (q - p)) * (1 - fy) + (r + fx * (w - r)) * fy; };
        return {mix(a.r, b.r, c.r, d.r), mix(a.g, b.g, c.g, d.g), mix(a.b, b.b, c.b, d.b)};
    }
    int size_ = 0;
    std::vector<std::vector<Colour>> levels_;
};

std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
    std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u ^ seed * 0xc2b2ae3du;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return h ^ h >> 15;
}
double lattice(int x, int y, int period, std::uint32_t seed) {
    return hash(static_cast<std::uint32_t>(((x % period) + period) % period), static_cast<std::uint32_t>(((y % period) + period) % period), seed) / 4294967295.0;
}
double value_noise(double u, double v, int period, std::uint32_t seed) {
    const double x = u * period, y = v * period;
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    double fx = x - ix, fy = y - iy;
    fx = fx * fx * (3 - 2 * fx);
    fy = fy * fy * (3 - 2 * fy);
    const double a = lattice(ix, iy, period, seed), b = lattice(ix + 1, iy, period, seed), c = lattice(ix, iy + 1, period, seed), d = lattice(ix + 1, iy + 1, period, seed);
    return (a + fx * (b - a)) * (1 - fy) + (c + fx * (d - c)) * fy;
}
double fbm(double u, double v, int period, std::uint32_t seed) {
    double sum = 0, weight = 0.5;
    for (std::uint32_t o = 0; o < 5; ++o, period *= 2, weight /= 2) sum += weight * value_noise(u, v, period, seed + o);
    return sum;
}

Colour stone(double u, double v, std::uint32_t seed) {
    const double n = fbm(u, v, 4, seed + 1), m = fbm(u, v, 8, seed + 11);
    return {static_cast<float>(0.15 + 0.8 * n), static_cast<float>(0.2 + 0.6 * m), static_cast<float>(0.55 * n + 0.3 * m)};
}
// Tracks and pads: hard edges at all scales.
Colour circuit(double u, double v, std::uint32_t seed) {
    double l = 0.12 + 0.1 * fbm(u, v, 8, seed + 5);
    for (const int cells : {8, 16, 32}) {
        const int x = static_cast<int>(u * cells), y = static_cast<int>(v * cells);
        const double fx = u * cells - x, fy = v * cells - y, r = lattice(x, y, cells, seed + static_cast<std::uint32_t>(cells));
        if (r < 0.3 && std::abs(fx - 0.5) < 0.12) l = 0.75;
        if (r > 0.7 && std::abs(fy - 0.5) < 0.12) l = 0.6;
        if (r > 0.45 && r < 0.55 && std::hypot(fx - 0.5, fy - 0.5) < 0.3) l = 0.9;
    }
    return {static_cast<float>(0.9 * l), static_cast<float>(0.3 + 0.6 * l), static_cast<float>(0.5 * l)};
}
Colour bricks(double u, double v, std::uint32_t) {
    const double y = v * 8, x = u * 4 + (static_cast<int>(y) % 2 == 0 ? 0 : 0.5), fx = x - std::floor(x), fy = y - std::floor(y);
    const bool mortar = fx < 0.06 || fy < 0.1;
    return mortar ? Colour{0.8f, 0.78f, 0.75f} : Colour{0.6f, 0.25f, 0.18f};
}
Colour wood(double u, double v, std::uint32_t seed) {
    const double n = fbm(u, v, 2, seed + 21), rings = 0.5 + 0.5 * std::sin(2 * std::numbers::pi * (8 * u + 3 * n));
    return {static_cast<float>(0.35 + 0.4 * rings), static_cast<float>(0.2 + 0.25 * rings), static_cast<float>(0.1 + 0.12 * n)};
}

enum Skin { kStone, kCircuit, kBricks, kWood, kSkins };
using Textures = std::array<Texture, kSkins>;
// One variant's, shared by all scenes that live at the same time.
std::shared_ptr<const Textures> textures_of(int variant) {
    static std::mutex mutex;
    static std::map<int, std::weak_ptr<const Textures>> kept;
    const std::lock_guard lock(mutex);
    if (auto there = kept[variant].lock()) return there;
    const std::uint32_t seed = 1000u * static_cast<std::uint32_t>(variant);
    auto made = std::make_shared<const Textures>(Textures{Texture(512, seed, stone), Texture(1024, seed, circuit), Texture(256, seed, bricks), Texture(512, seed, wood)});
    kept[variant] = made;
    return made;
}

// A rectangle (radius 0) or a sphere; `move` is per frame, in the world.
struct Thing {
    V3 centre;
    V3 across{1, 0, 0}, up{0, 1, 0};   // half the rectangle's extent
    double radius = 0;
    V3 move;
    Skin skin = kStone;
    double repeat = 1;                 // texture turns per unit of length
    double shine = 0;
    bool fixed = false;                // a wall, a floor, a ceiling: no variant moves it
};

}  // namespace

struct ExtrapolationScene::Content {
    std::vector<Thing> things;
    V3 camera, camera_move;
    Turn turn, turn_rate;
    double flicker = 0;
    bool cut = false;
    std::shared_ptr<const Textures> textures;

    [[nodiscard]] Turn turn_at(double t) const { return {turn.yaw + turn_rate.yaw * t, turn.pitch + turn_rate.pitch * t, turn.roll + turn_rate.roll * t}; }
    [[nodiscard]] V3 camera_at(double t) const { return camera + t * camera_move; }

    void vary(std::uint32_t seed);
    void room(Skin walls, Skin floor) {
        things.push_back({{0, 0, -9}, {14, 0, 0}, {0, 5, 0}, 0, {}, walls, 0.25, 0, true});
        things.push_back({{-9, 0, 0}, {0, 0, -14}, {0, 5, 0}, 0, {}, walls, 0.25, 0, true});
        things.push_back({{9, 0, 0}, {0, 0, 14}, {0, 5, 0}, 0, {}, walls, 0.25, 0, true});
        things.push_back({{0, -2.5, 0}, {14, 0, 0}, {0, 0, -14}, 0, {}, floor, 0.3, 0, true});
        things.push_back({{0, 4.5, 0}, {14, 0, 0}, {0, 0, -14}, 0, {}, floor, 0.2, 0, true});
    }
};

// The same kind of scene as another seed has it: other walls, other places, sizes and directions, speeds from 0.7 to 1.3 times as
// high; what makes the kind (what moves, and how thin, shining or regular it is) stays. Each thing draws from a stream of its own.
void ExtrapolationScene::Content::vary(std::uint32_t seed) {
    std::uint32_t stream = 0, drawn = 0;
    const auto draw = [&](double low, double high) { return low + (high - low) * (hash(stream, drawn++, seed) / 4294967295.0); };
    const auto rotated = [&](double& a, double& b, double angle) {
        const double x = a;
        a = std::cos(angle) * x - std::sin(angle) * b;
        b = std::sin(angle) * x + std::cos(angle) * b;
    };
    const double full = 2 * std::numbers::pi;
    turn.yaw += draw(-0.35, 0.35);
    turn.pitch += draw(-0.12, 0.12);
    turn.roll += draw(-0.1, 0.1);
    const double quick = draw(0.7, 1.3);
    rotated(turn_rate.yaw, turn_rate.pitch, draw(0, full));
    turn_rate = {quick * turn_rate.yaw, quick * turn_rate.pitch, (draw(0, 1) < 0.5 ? -quick : quick) * turn_rate.roll};
    // Mostly level, as heads move.
    rotated(camera_move.x, camera_move.z, draw(0, full));
    camera_move = quick * camera_move;
    // The walls of a room share a skin, as do its floor and ceiling.
    Skin other[kSkins];
    for (int k = 0; k < kSkins; ++k) other[k] = static_cast<Skin>((k + static_cast<int>(draw(0, 3.999))) % kSkins);
    for (Thing& t : things) {
        ++stream;
        drawn = 0;
        const bool even_pattern = things.size() == 1;   // the wall of bricks is the kind
        if (!even_pattern) t.skin = other[t.skin];
        t.repeat *= draw(0.8, 1.25);
        if (t.fixed) continue;
        const double size = draw(0.8, 1.25), pace = draw(0.7, 1.3);
        if (t.radius > 0 || dot(t.move, t.move) > 0) {   // what stands by itself
            t.centre = t.centre + V3{draw(-0.5, 0.5), draw(-0.3, 0.3), draw(-0.5, 0.5)};
            t.radius *= size;
            t.across = size * t.across;
            t.up = size * t.up;
        } else {
            t.centre.x += draw(-0.2, 0.2);
        }
        rotated(t.move.x, t.move.y, draw(0, full));
        t.move = pace * t.move;
    }
}

namespace {

constexpr SceneRow kScenes[] = {
    {"rotation", "the head turns and tilts in a room"},
    {"translation", "the head moves sideways and forward among pillars"},
    {"object", "spheres and boards move before a still room"},
    {"occlusion", "a board crosses close by while the head moves the other way"},
    {"thin", "bars two to three pixels wide before a wall"},
    {"specular", "highlights that slide over a floor and spheres"},
    {"repetitive", "a brick wall, the head turns"},
    {"flicker", "the light changes by 6% from frame to frame while the head turns"},
    {"cut", "the two sources show different places"},
};

struct Hit {
    double t = 1e30, u = 0, v = 0;
    int thing = -1;
    V3 local, normal;
};

}  // namespace

std::span<const SceneRow> extrapolation_scenes() { return kScenes; }

ExtrapolationScene::ExtrapolationScene(const std::string& name, double speed, int variant) : content_(std::make_unique<Content>()) {
    Content& c = *content_;
    c.textures = textures_of(variant);
    const double rad = speed * 0.8 * std::numbers::pi / 180, metre = speed * 0.05;
    const auto pillars = [&](Skin skin) {
        for (int i = 0; i < 6; ++i) c.things.push_back({{-5.0 + 2 * i, -0.5, -3.5 - 0.8 * (i * 7 % 5)}, {0.28, 0, 0}, {0, 2.5, 0}, 0, {}, skin, 0.6, 0});
    };
    if (name == "rotation") {
        c.room(kCircuit, kWood);
        pillars(kStone);
        c.turn_rate = {rad, 0.35 * rad, 0.4 * rad};
    } else if (name == "translation") {
        c.room(kCircuit, kStone);
        pillars(kWood);
        c.camera_move = {1.2 * metre, 0.1 * metre, -0.8 * metre};
    } else if (name == "object") {
        c.room(kStone, kWood);
        c.things.push_back({{-1.5, 0.3, -4}, {}, {}, 0.8, {1.2 * metre, 0, 0}, kCircuit, 0.8, 0});
        c.things.push_back({{1.6, -0.6, -3.5}, {0.7, 0.1, 0}, {-0.05, 0.6, 0}, 0, {-0.6 * metre, 0.7 * metre, 0}, kBricks, 0.5, 0});
        c.things.push_back({{0.2, 1.6, -5}, {1.2, 0, 0}, {0, 0.5, 0}, 0, {0, -1.4 * metre, 0.5 * metre}, kWood, 0.7, 0});
    } else if (name == "occlusion") {
        c.room(kCircuit, kWood);
        c.things.push_back({{-0.4, 0, -2.2}, {0.7, 0, 0.1}, {0, 0.9, 0}, 0, {0.8 * metre, 0.1 * metre, 0}, kStone, 0.9, 0});
        c.camera_move = {-0.5 * metre, 0, 0};
    } else if (name == "thin") {
        c.room(kStone, kWood);
        for (int i = -8; i <= 8; ++i) c.things.push_back({{0.55 * i, 0, -4}, {0.01, 0, 0}, {0, 2.5, 0}, 0, {}, kCircuit, 0.5, 0});
        for (int i = -3; i <= 3; ++i) c.things.push_back({{0, 0.7 * i, -4}, {6, 0, 0}, {0, 0.008, 0}, 0, {}, kCircuit, 0.5, 0});
        c.turn_rate = {0.7 * rad, 0.2 * rad, 0};
        c.camera_move = {0.4 * metre, 0, 0};
    } else if (name == "specular") {
        c.room(kStone, kWood);
        for (auto& t : c.things) t.shine = 0.5;
        c.things.push_back({{-1.4, -0.4, -3.6}, {}, {}, 0.9, {}, kWood, 0.6, 0.8});
        c.things.push_back({{1.4, 0.2, -4.2}, {}, {}, 0.9, {0, 0.3 * metre, 0}, kStone, 0.6, 0.8});
        c.camera_move = {metre, 0.2 * metre, 0};
    } else if (name == "repetitive") {
        c.things.push_back({{0, 0, -4}, {30, 0, 0}, {0, 30, 0}, 0, {}, kBricks, 0.25, 0, true});
        c.turn_rate = {rad, 0.3 * rad, 0};
    } else if (name == "flicker") {
        c.room(kCircuit, kWood);
        c.turn_rate = {0.7 * rad, 0.2 * rad, 0};
        c.flicker = 0.06;
    } else {   // cut
        c.room(kCircuit, kWood);
        pillars(kStone);
        c.turn_rate = {rad, 0.2 * rad, 0};
        c.cut = true;
    }
    if (variant != 0) c.vary(static_cast<std::uint32_t>(variant));
}

ExtrapolationScene::~ExtrapolationScene() = default;

CameraTurn ExtrapolationScene::turn(double from, double to) const {
    const auto a = content_->turn_at(from).rows(), b = content_->turn_at(to).rows();
    CameraTurn result{};
    for (int k = 0; k < 3; ++k) {
        const V3 axis{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
        const V3 seen = apply_inverse(b, apply(a, axis));
        result.m[0][k] = seen.x;
        result.m[1][k] = seen.y;
        result.m[2][k] = seen.z;
    }
    return result;
}

SceneFrame ExtrapolationScene::render(double time, int size_px, bool with_motion, double ahead) const {
    const Content& c = *content_;
    SceneFrame frame;
    frame.size_px = size_px;
    const auto pixels = static_cast<std::size_t>(size_px) * static_cast<std::size_t>(size_px);
    frame.rgba.resize(4 * pixels);
    if (with_motion) {
        frame.motion_px.resize(2 * pixels);
        frame.ahead_px.resize(2 * pixels);
        frame.depth.resize(pixels);
    }
    const bool other_place = c.cut && time < 0.5;
    const double focal = size_px / 2.0;   // 90 degrees
    Turn turn = c.turn_at(time);
    if (other_place) turn.yaw += 2.5;
    const auto rows = turn.rows(), before = c.turn_at(time - 1).rows(), later = c.turn_at(time + ahead).rows();
    const V3 eye = c.camera_at(time), eye_before = c.camera_at(time - 1), eye_later = c.camera_at(time + ahead);
    const V3 light = unit({0.3, 0.8, 0.5});
    const double brightness = 1 + c.flicker * std::cos(std::numbers::pi * time);

    const auto cast = [&](double px, double py) {
        const V3 d = apply(rows, {(px - size_px / 2.0) / focal, -(py - size_px / 2.0) / focal, -1});
        Hit best;
        for (std::size_t i = 0; i < c.things.size(); ++i) {
            const Thing& thing = c.things[i];
            const V3 to = thing.centre + time * thing.move - eye;
            if (thing.radius > 0) {
                const double a = dot(d, d), b = dot(d, to), q = b * b - a * (dot(to, to) - thing.radius * thing.radius);
                if (q <= 0) continue;
                const double t = (b - std::sqrt(q)) / a;
                if (t <= 1e-3 || t >= best.t) continue;
                const V3 n = (1 / thing.radius) * (t * d - to);
                best = {t, std::atan2(n.x, n.z), std::asin(std::clamp(n.y, -1.0, 1.0)), static_cast<int>(i), thing.radius * n, n};
            } else {
                const double ll_a = dot(thing.across, thing.across), ll_u = dot(thing.up, thing.up);
                const V3 n = unit({thing.across.y * thing.up.z - thing.across.z * thing.up.y, thing.across.z * thing.up.x - thing.across.x * thing.up.z, thing.across.x * thing.up.y - thing.across.y * thing.up.x});
                const double along = dot(d, n);
                if (std::abs(along) < 1e-9) continue;
                const double t = dot(to, n) / along;
                if (t <= 1e-3 || t >= best.t) continue;
                const V3 local = t * d - to;
                const double u = dot(local, thing.across), v = dot(local, thing.up);
                if (std::abs(u) > ll_a || std::abs(v) > ll_u) continue;
                best = {t, u / std::sqrt(ll_a), v / std::sqrt(ll_u), static_cast<int>(i), local, along < 0 ? n : -1 * n};
            }
        }
        return std::pair{best, d};
    };

    for (int y = 0; y < size_px; ++y)
        for (int x = 0; x < size_px; ++x) {
            const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(size_px) + static_cast<std::size_t>(x);
            float sum[3] = {};
            for (const int k : {0, 1, 2, 3}) {
                const auto [hit, d] = cast(x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2));
                Colour colour{0.35f, 0.45f, 0.6f};
                if (hit.thing >= 0) {
                    const Thing& thing = c.things[static_cast<std::size_t>(hit.thing)];
                    const double slant = std::max(0.15, std::abs(dot(unit(d), hit.normal)));
                    colour = (*c.textures)[thing.skin].at(hit.u * thing.repeat, hit.v * thing.repeat, hit.t / focal * thing.repeat / std::sqrt(slant));
                    const double lambert = 0.55 + 0.45 * std::max(0.0, dot(hit.normal, light));
                    double gloss = 0;
                    if (thing.shine > 0) {
                        const V3 half = unit(light - unit(d));
                        gloss = thing.shine * std::pow(std::max(0.0, dot(half, hit.normal)), 60);
                    }
                    colour = {static_cast<float>(colour.r * lambert + gloss), static_cast<float>(colour.g * lambert + gloss), static_cast<float>(colour.b * lambert + gloss)};
                }
                sum[0] += colour.r / 4;
                sum[1] += colour.g / 4;
                sum[2] += colour.b / 4;
            }
            for (std::size_t k = 0; k < 3; ++k)
                frame.rgba[4 * at + k] = static_cast<std::uint8_t>(std::clamp(static_cast<double>(sum[k]) * brightness * 255 + 0.5, 0.0, 255.0));
            frame.rgba[4 * at + 3] = 255;
            if (!with_motion) continue;
            const auto [hit, d] = cast(x + 0.5, y + 0.5);
            frame.depth[at] = static_cast<float>(hit.t);
            // Where the same point of the same thing is seen at another time; the sky is far away.
            const auto moved_to = [&](double at_time, const V3& from, const auto& turned, double& px, double& py) {
                V3 point = 1e6 * d;
                if (hit.thing >= 0) {
                    const Thing& thing = c.things[static_cast<std::size_t>(hit.thing)];
                    point = thing.centre + at_time * thing.move + hit.local - from;
                }
                const V3 seen = apply_inverse(turned, point);
                if (!(seen.z < -1e-6)) return false;
                px = size_px / 2.0 - seen.x / seen.z * focal;
                py = size_px / 2.0 + seen.y / seen.z * focal;
                return true;
            };
            double px = 0, py = 0;
            if (moved_to(time - 1, eye_before, before, px, py)) {
                frame.motion_px[2 * at] = static_cast<float>(x + 0.5 - px);
                frame.motion_px[2 * at + 1] = static_cast<float>(y + 0.5 - py);
            }
            if (moved_to(time + ahead, eye_later, later, px, py)) {
                frame.ahead_px[2 * at] = static_cast<float>(px - x - 0.5);
                frame.ahead_px[2 * at + 1] = static_cast<float>(py - y - 0.5);
            }
        }
    return frame;
}

}  // namespace fovea::tools
