#include "tests/render/extrapolation_cases.hpp"

#include <algorithm>

namespace fovea::test {

namespace {

constexpr const char* kKinds[] = {"slow thing", "quick thing", "thing beyond reach", "thin bars", "letters", "window", "fade", "flicker", "noisy", "overlay", "particles",
                                  "display over ground", "zoom", "turn", "crossing", "appears", "equal luma", "ground", "ground beyond reach", "soft thing", "hard edges"};

std::uint32_t mixed(std::uint32_t h) {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
}

// The same numbers on every machine.
class Draw {
public:
    explicit Draw(std::uint32_t seed) : state_(mixed(seed + 0x9e3779b9u)) {}
    float one() {
        state_ = mixed(state_ + 0x9e3779b9u);
        return static_cast<float>(state_ >> 8) / 16777216.0f;
    }
    float between(float a, float b) { return a + (b - a) * one(); }
    int below(int n) { return std::min(static_cast<int>(one() * static_cast<float>(n)), n - 1); }
    bool chance(float p) { return one() < p; }

private:
    std::uint32_t state_;
};

float clamp01(float v) { return std::clamp(v, 0.0f, 1.0f); }
float shade(const MovingLayer& l, float x, float y, float per_px) {
    switch (l.texture) {
        case MovingLayer::plain: return 0.5f;
        case MovingLayer::gradient: return clamp01(0.5f + 0.004f * (x + 0.6f * y));
        case MovingLayer::soft: return noise(0.4f * x, 0.4f * y, l.seed);
        case MovingLayer::fine: return noise(1.5f * x, 1.5f * y, l.seed);
        case MovingLayer::checks: {
            // Each of a shade of its own: which of a pattern's repetitions has come along, nobody can tell.
            const auto square = [&](float px, float py) {
                const auto h = mixed(static_cast<std::uint32_t>(static_cast<int>(std::floor(px))) * 0x9e3779b1u ^ static_cast<std::uint32_t>(static_cast<int>(std::floor(py))) * 0x85ebca77u ^ l.seed);
                return static_cast<float>(h >> 8) / 16777216.0f;
            };
            const float w = std::max(per_px / 8, 1e-4f), left = x / 8 - w / 2, top = y / 8 - w / 2;
            const float right = clamp01((left + w - std::floor(left + w)) / w) * (std::floor(left + w) > std::floor(left) ? 1.0f : 0.0f);
            const float below = clamp01((top + w - std::floor(top + w)) / w) * (std::floor(top + w) > std::floor(top) ? 1.0f : 0.0f);
            const float upper = square(left, top) + right * (square(left + w, top) - square(left, top));
            const float lower = square(left, top + w) + right * (square(left + w, top + w) - square(left, top + w));
            return upper + below * (lower - upper);
        }
        case MovingLayer::letters: {   // five strokes in cells of 7x11, some of them empty
            constexpr float kStrokes[5][4] = {{0, 0, 1.5f, 8.5f}, {4, 0, 5.5f, 8.5f}, {0, 0, 5.5f, 1.5f}, {0, 4, 5.5f, 5.5f}, {0, 7, 5.5f, 8.5f}};
            const float x0 = x - per_px / 2, x1 = x + per_px / 2, y0 = y - per_px / 2, y1 = y + per_px / 2;
            float covered = 0;
            for (int j = static_cast<int>(std::floor(y0 / 11)); static_cast<float>(11 * j) < y1; ++j)
                for (int i = static_cast<int>(std::floor(x0 / 7)); static_cast<float>(7 * i) < x1; ++i) {
                    const std::uint32_t h = mixed(static_cast<std::uint32_t>(i) * 0x9e3779b1u ^ static_cast<std::uint32_t>(j) * 0x85ebca77u ^ l.seed);
                    if (h % 6 == 0) continue;
                    const float left = static_cast<float>(7 * i), top = static_cast<float>(11 * j);
                    for (int k = 0; k < 5; ++k) {
                        if ((h >> (8 + k) & 1) == 0) continue;
                        const float across = std::min(x1, left + kStrokes[k][2]) - std::max(x0, left + kStrokes[k][0]);
                        const float down = std::min(y1, top + kStrokes[k][3]) - std::max(y0, top + kStrokes[k][1]);
                        if (across > 0 && down > 0) covered += across * down;
                    }
                }
            return 1 - clamp01(covered / (per_px * per_px));
        }
        case MovingLayer::equal_luma: return noise(0.8f * x, 0.8f * y, l.seed);
    }
    return 0;
}

// How much of the pixel at (x, y) of the shape's own frame it covers.
float covers(const MovingLayer& l, float x, float y, float per_px) {
    const auto part = [&](float inside) { return clamp01(inside / per_px + 0.5f); };
    switch (l.shape) {
        case MovingLayer::everywhere: return 1;
        case MovingLayer::disc: return part(l.half_w - std::sqrt(x * x + y * y));
        case MovingLayer::rectangle:
        case MovingLayer::bar: {
            const auto along = [&](float p, float half) { return std::max(0.0f, std::min(p + per_px / 2, half) - std::max(p - per_px / 2, -half)) / per_px; };
            return along(x, l.half_w) * along(y, l.half_h);
        }
    }
    return 0;
}

MovingLayer::Texture some_texture(Draw& d) {
    constexpr MovingLayer::Texture kAll[] = {MovingLayer::plain, MovingLayer::gradient, MovingLayer::soft, MovingLayer::fine, MovingLayer::letters, MovingLayer::checks};
    return kAll[d.below(6)];
}

void colours(MovingLayer& l, Draw& d) {
    for (std::size_t c = 0; c < 3; ++c) {
        l.low[c] = d.between(0, 0.5f);
        l.high[c] = d.between(0.4f, 1);
    }
    l.seed = static_cast<std::uint32_t>(d.below(1 << 20));
    l.scale = d.chance(0.5f) ? 1.0f : d.between(0.5f, 2);
}

MovingLayer ground(Draw& d) {
    MovingLayer l;
    colours(l, d);
    l.texture = some_texture(d);
    return l;
}

void motion(MovingLayer& l, Draw& d, float least, float most) {
    const float way = d.between(0, 6.2831853f), speed = least * std::pow(most / least, d.one());
    // Some go along an axis, some by whole pixels, as windows and scrolled text do.
    const int exact = d.below(4);
    l.u = speed * std::cos(way);
    l.v = speed * std::sin(way);
    if (exact == 0) {
        l.u = way < 3.14159f ? speed : -speed;
        l.v = 0;
    } else if (exact == 1 && speed >= 1) {
        l.u = std::round(l.u);
        l.v = std::round(l.v);
    }
}

MovingLayer thing(Draw& d, const MovingCase& c, float smallest, float largest) {
    MovingLayer l;
    colours(l, d);
    l.shape = d.chance(0.5f) ? MovingLayer::rectangle : MovingLayer::disc;
    l.texture = some_texture(d);
    l.half_w = 0.5f * smallest * std::pow(largest / smallest, d.one());
    l.half_h = 0.5f * smallest * std::pow(largest / smallest, d.one());
    l.x = d.between(0.25f, 0.75f) * static_cast<float>(c.width);
    l.y = d.between(0.25f, 0.75f) * static_cast<float>(c.height);
    return l;
}

}  // namespace

std::span<const char* const> case_kinds() { return kKinds; }

Picture MovingCase::at(float t) const {
    Picture p(width, height, Format::rgba8);
    struct Now {
        float x, y, cosine, sine, size, opacity, light, scroll_x, scroll_y;
    };
    std::vector<Now> now;
    for (const MovingLayer& l : layers) {
        const float angle = l.angle + l.turn * t, chance = static_cast<float>(mixed(l.seed ^ static_cast<std::uint32_t>(1000 + 8 * t)) >> 8) / 16777216.0f;
        const bool shown = t >= l.from && t < l.until;
        now.push_back({l.x + l.u * t, l.y + l.v * t, std::cos(angle), std::sin(angle), std::pow(l.growth, t), shown ? clamp01(l.opacity + l.opacity_step * t) : 0.0f,
                       l.light + l.light_step * t + l.flicker * (chance - 0.5f), l.scroll_u * t, l.scroll_v * t});
    }
    Draw grain(seed * 31 + static_cast<std::uint32_t>(1000 + 8 * t));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::array<float, 4> colour{0, 0, 0, 1};
            for (std::size_t k = 0; k < layers.size(); ++k) {
                const MovingLayer& l = layers[k];
                const Now& n = now[k];
                if (n.opacity <= 0) continue;
                const float dx = (static_cast<float>(x) + 0.5f - n.x) / n.size, dy = (static_cast<float>(y) + 0.5f - n.y) / n.size, per_px = sampled ? 1e-3f : 1 / n.size;
                const float px = n.cosine * dx + n.sine * dy, py = n.cosine * dy - n.sine * dx;
                const float cover = n.opacity * covers(l, px, py, per_px);
                if (cover <= 0) continue;
                const float s = shade(l, (px - n.scroll_x) * l.scale, (py - n.scroll_y) * l.scale, per_px * l.scale);
                std::array<float, 3> own{};
                for (std::size_t c = 0; c < 3; ++c) own[c] = (l.low[c] + s * (l.high[c] - l.low[c])) * n.light;
                // Red against green, at one brightness as the engine weighs it.
                if (l.texture == MovingLayer::equal_luma) own = {0.2f + 0.6f * s, 0.6f - 0.6f * s * 77 / 150, 0.4f};
                for (std::size_t c = 0; c < 3; ++c) colour[c] += cover * (own[c] - colour[c]);
            }
            if (noise > 0)
                for (std::size_t c = 0; c < 3; ++c) colour[c] += noise / 255 * (grain.one() + grain.one() + grain.one() - 1.5f) * 2;
            p.set(x, y, colour);
        }
    return p;
}

MovingCase moving_case(int kind, std::uint32_t seed) {
    Draw d(seed * 64 + static_cast<std::uint32_t>(kind));
    MovingCase c;
    c.name = std::string(kKinds[kind]) + " " + std::to_string(seed);
    c.seed = seed * 64 + static_cast<std::uint32_t>(kind);
    c.width = 96 + 16 * d.below(7);
    c.height = 96 + 16 * d.below(7);
    const float reach = 0.125f * static_cast<float>(std::max(c.width, c.height));
    c.layers.push_back(ground(d));
    const auto add = [&](MovingLayer l) { c.layers.push_back(l); };
    const std::string name = kKinds[kind];
    c.sampled = name == "hard edges";
    if (name == "hard edges" || name == "slow thing" || name == "quick thing" || name == "thing beyond reach" || name == "soft thing") {
        const int count = 1 + d.below(3);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 8, 64);
            if (name == "soft thing") l.texture = MovingLayer::soft;
            if (name == "quick thing") motion(l, d, 3, reach);
            else if (name == "thing beyond reach") motion(l, d, reach, 3 * reach);
            else if (c.sampled) motion(l, d, 1.5f, reach);   // slower, edges jump: what two frames show is not what moved
            else motion(l, d, 0.1f, 3);
            add(l);
        }
    } else if (name == "thin bars") {
        const int count = 1 + d.below(5);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 30, 90);
            l.shape = MovingLayer::bar;
            l.texture = MovingLayer::plain;
            l.half_w = d.between(0.4f, 2);
            l.angle = d.chance(0.5f) ? 0 : d.between(0, 3.14159f);
            motion(l, d, 0.3f, reach);
            add(l);
        }
    } else if (name == "letters") {
        MovingLayer l = thing(d, c, 40, 200);
        l.shape = d.chance(0.5f) ? MovingLayer::everywhere : MovingLayer::rectangle;
        l.texture = MovingLayer::letters;
        l.scale = d.between(0.6f, 1.4f);
        motion(l, d, 0.2f, reach);
        add(l);
    } else if (name == "window") {
        MovingLayer l = thing(d, c, 32, 120);
        l.shape = MovingLayer::rectangle;
        MovingLayer way;
        motion(way, d, 0.3f, reach);
        l.scroll_u = d.chance(0.5f) ? 0 : way.u;
        l.scroll_v = way.v;
        if (l.texture == MovingLayer::plain) l.texture = MovingLayer::letters;
        add(l);
    } else if (name == "fade") {
        if (d.chance(0.5f)) {
            c.layers[0].light_step = d.between(-0.08f, 0.08f);
            if (d.chance(0.5f)) motion(c.layers[0], d, 0.2f, 6);
        }
        MovingLayer l = thing(d, c, 16, 80);
        l.opacity = d.between(0.3f, 1);
        l.opacity_step = d.between(-0.3f, 0.3f);
        if (d.chance(0.5f)) motion(l, d, 0.2f, 6);
        add(l);
    } else if (name == "flicker") {
        c.layers[0].flicker = d.between(0, 0.3f);
        if (d.chance(0.5f)) motion(c.layers[0], d, 0.2f, 8);
        MovingLayer l = thing(d, c, 16, 80);
        l.flicker = d.between(0, 0.5f);
        if (d.chance(0.7f)) motion(l, d, 0.2f, 8);
        add(l);
    } else if (name == "noisy") {
        c.noise = d.between(1, 12);
        if (d.chance(0.4f)) motion(c.layers[0], d, 0.2f, reach);
        MovingLayer l = thing(d, c, 12, 64);
        if (d.chance(0.7f)) motion(l, d, 0.2f, reach);
        add(l);
    } else if (name == "overlay") {
        if (d.chance(0.6f)) motion(c.layers[0], d, 0.2f, reach);
        MovingLayer l = thing(d, c, 24, 100);
        l.opacity = d.between(0.2f, 0.8f);
        if (d.chance(0.6f)) motion(l, d, 0.2f, reach);
        add(l);
    } else if (name == "particles") {
        if (d.chance(0.3f)) motion(c.layers[0], d, 0.2f, reach);
        const int count = 10 + d.below(50);
        const float most = d.between(1, 2 * reach);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 1.5f, 6);
            l.shape = MovingLayer::disc;
            l.texture = MovingLayer::plain;
            l.x = d.between(0, static_cast<float>(c.width));
            l.y = d.between(0, static_cast<float>(c.height));
            motion(l, d, 0.3f, most);
            add(l);
        }
    } else if (name == "display over ground") {
        motion(c.layers[0], d, 0.3f, reach);
        const int count = 1 + d.below(3);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 12, 70);
            l.shape = MovingLayer::rectangle;
            l.texture = d.chance(0.5f) ? MovingLayer::letters : MovingLayer::plain;
            l.opacity = d.chance(0.5f) ? 1 : d.between(0.4f, 0.9f);
            add(l);
        }
    } else if (name == "zoom") {
        MovingLayer& l = c.layers[0];
        l.x = 0.5f * static_cast<float>(c.width);
        l.y = 0.5f * static_cast<float>(c.height);
        l.growth = d.between(0.9f, 1.12f);
    } else if (name == "turn") {
        MovingLayer l = d.chance(0.5f) ? c.layers[0] : thing(d, c, 30, 100);
        l.x = 0.5f * static_cast<float>(c.width);
        l.y = 0.5f * static_cast<float>(c.height);
        l.turn = d.between(-0.12f, 0.12f);
        if (l.shape == MovingLayer::everywhere) c.layers[0] = l;
        else add(l);
    } else if (name == "crossing") {
        const int count = 3 + d.below(4);
        if (d.chance(0.4f)) motion(c.layers[0], d, 0.2f, 6);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 12, 50);
            motion(l, d, 0.5f, reach);
            add(l);
        }
    } else if (name == "appears") {
        if (d.chance(0.4f)) motion(c.layers[0], d, 0.2f, 6);
        const int count = 1 + d.below(3);
        for (int i = 0; i < count; ++i) {
            MovingLayer l = thing(d, c, 8, 70);
            (d.chance(0.5f) ? l.from : l.until) = 0.5f;
            if (d.chance(0.5f)) motion(l, d, 0.5f, 6);
            add(l);
        }
    } else if (name == "equal luma") {
        MovingLayer& g = c.layers[0];
        g.texture = d.chance(0.5f) ? MovingLayer::plain : MovingLayer::equal_luma;
        MovingLayer l = thing(d, c, 20, 80);
        l.texture = MovingLayer::equal_luma;
        motion(l, d, 0.3f, reach);
        add(l);
    } else if (name == "ground") {
        motion(c.layers[0], d, 0.1f, reach);
    } else if (name == "ground beyond reach") {
        motion(c.layers[0], d, reach, 4 * reach);
    }
    return c;
}

}  // namespace fovea::test
