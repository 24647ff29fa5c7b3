#include "render/extrapolation/projection.hpp"

#include <cmath>
#include <cstring>
#include <limits>

namespace fovea::render::extrapolation {

namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr int kWays[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
constexpr int kSearch = 48;   // cells: further away than this nothing is known about what lies behind

// Round half up; exact for the sizes at hand and far cheaper than lround.
int round_int(float v) noexcept {
    const float shifted = v + 0.5f;
    const int i = static_cast<int>(shifted);
    return i - (static_cast<float>(i) > shifted ? 1 : 0);
}

template <int kCount>
bool all_zero(const float* u, const float* v) noexcept {
    std::uint64_t bits = 0;
    for (int k = 0; k < kCount; k += 2) {
        std::uint64_t a, b;
        std::memcpy(&a, u + k, sizeof a);
        std::memcpy(&b, v + k, sizeof b);
        bits |= a | b;
    }
    return (bits & 0x7fffffff7fffffffu) == 0;   // of either sign
}

}  // namespace

void Projection::resize(int width, int height) {
    out_.resize(width, height);
    touched_ = {};
    up_.assign(static_cast<std::size_t>(width), 0);
    down_ = up_;
    front_.assign(out_.u.size(), kNothing);
}

void Projection::resize_known(int width, int height, int width_px, int height_px) {
    resize(width, height);
    border_.resize(width_px, height_px);
    far_.resize(width, height);
    sources_.assign(out_.u.size(), kBoth);
    carry_.assign(carry_scratch(width), 0.0f);
}

Projection::Background Projection::fit_background(const Motion& motion, float reach_px) const noexcept {
    constexpr int kSamples = 32, kRounds = 4;
    constexpr double kScalePx = 1.0;   // deviations of this size count half
    Background best;
    for (int round = 0; round < kRounds; ++round) {
        double m[3][3] = {}, ru[3] = {}, rv[3] = {};
        for (int j = 0; j < kSamples; ++j)
            for (int i = 0; i < kSamples; ++i) {
                const int x = (2 * i + 1) * out_.width / (2 * kSamples), y = (2 * j + 1) * out_.height / (2 * kSamples);
                const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(out_.width) + static_cast<std::size_t>(x);
                const double a = static_cast<double>(motion.u[at * motion.pitch] * motion.scale), b = static_cast<double>(motion.v[at * motion.pitch] * motion.scale);
                if (!(std::fabs(a) <= static_cast<double>(reach_px) && std::fabs(b) <= static_cast<double>(reach_px))) continue;
                const double e[3] = {1, static_cast<double>(x), static_cast<double>(y)};
                double weight = 1;
                if (round > 0) {
                    const double du = a - (static_cast<double>(best.u[0]) + static_cast<double>(best.u[1]) * e[1] + static_cast<double>(best.u[2]) * e[2]);
                    const double dv = b - (static_cast<double>(best.v[0]) + static_cast<double>(best.v[1]) * e[1] + static_cast<double>(best.v[2]) * e[2]);
                    weight = 1 / (1 + (du * du + dv * dv) / (kScalePx * kScalePx));
                }
                for (int r = 0; r < 3; ++r) {
                    for (int c = 0; c < 3; ++c) m[r][c] += weight * e[r] * e[c];
                    ru[r] += weight * e[r] * a;
                    rv[r] += weight * e[r] * b;
                }
            }
        // A ridge keeps a picture of one row or column solvable.
        const double ridge = 1e-6 * (m[0][0] + m[1][1] + m[2][2]) + 1e-12;
        for (int r = 0; r < 3; ++r) m[r][r] += ridge;
        const double c00 = m[1][1] * m[2][2] - m[1][2] * m[2][1], c01 = m[1][2] * m[2][0] - m[1][0] * m[2][2], c02 = m[1][0] * m[2][1] - m[1][1] * m[2][0];
        const double det = m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02;
        if (!(std::fabs(det) > 1e-30)) break;
        const double inv[3][3] = {{c00, m[0][2] * m[2][1] - m[0][1] * m[2][2], m[0][1] * m[1][2] - m[0][2] * m[1][1]},
                                  {c01, m[0][0] * m[2][2] - m[0][2] * m[2][0], m[0][2] * m[1][0] - m[0][0] * m[1][2]},
                                  {c02, m[0][1] * m[2][0] - m[0][0] * m[2][1], m[0][0] * m[1][1] - m[0][1] * m[1][0]}};
        for (int r = 0; r < 3; ++r) {
            best.u[r] = static_cast<float>((inv[r][0] * ru[0] + inv[r][1] * ru[1] + inv[r][2] * ru[2]) / det);
            best.v[r] = static_cast<float>((inv[r][0] * rv[0] + inv[r][1] * rv[1] + inv[r][2] * rv[2]) / det);
        }
    }
    return best;
}

void Projection::run(const Motion& motion, int cell_px, float reach_px, const Box* active) noexcept {
    const int w = out_.width, h = out_.height;
    const float per_cell = 1.0f / static_cast<float>(cell_px);
    const auto within = [&](float v) { return std::fabs(v * motion.scale) <= reach_px ? std::fabs(v * motion.scale) : 0.0f; };
    const Box before = touched_;   // everything outside of it is 0
    touched_ = {0, 0, w, h};
    if (active != nullptr && (active->x1 - active->x0 < w || active->y1 - active->y0 < h)) {
        float most = 0;   // what may move lands no further off than this
        for (int y = active->y0; y < active->y1; ++y)
            for (int x = active->x0; x < active->x1; ++x) {
                const std::size_t from = (static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)) * motion.pitch;
                most = std::max(most, std::max(within(motion.u[from]), within(motion.v[from])));
            }
        touched_ = active->grown(static_cast<int>(most * per_cell) + 2, w, h);
        for (int y = before.y0; y < before.y1; ++y)
            for (std::vector<float>* plane : {&out_.u, &out_.v})
                std::fill_n(plane->data() + static_cast<std::ptrdiff_t>(y) * w + before.x0, before.x1 - before.x0, 0.0f);
    }
    background_ = fit_background(motion, reach_px);
    scatter(motion, cell_px, reach_px, touched_, background_);
}

void Projection::run_part(const Motion& motion, int cell_px, float reach_px, const Box& from, const Box& into, const Projection& whole) noexcept {
    const Box before = touched_;   // everything outside of it is 0
    for (int y = before.y0; y < before.y1; ++y)
        for (std::vector<float>* plane : {&out_.u, &out_.v})
            std::fill_n(plane->data() + static_cast<std::ptrdiff_t>(y) * out_.width + before.x0, before.x1 - before.x0, 0.0f);
    touched_ = into;
    background_ = whole.background_;
    for (float* per_cell : {background_.u, background_.v})   // the centre of a cell lies a quarter of a larger one off
        for (int k = 1; k < 3; ++k) {
            per_cell[k] *= 0.5f;
            per_cell[0] -= 0.5f * per_cell[k];
        }
    scatter(motion, cell_px, reach_px, from, background_);
}

// As below, of cells side by side that do not move.
template <int kLanes>
void Projection::stay(int x0, int y, const Background& b) noexcept {
    typedef float V4 __attribute__((vector_size(16)));
    const std::size_t to = static_cast<std::size_t>(y) * static_cast<std::size_t>(out_.width) + static_cast<std::size_t>(x0);
    const float py = static_cast<float>(y);
    for (std::size_t k = 0; k < kLanes; k += 4) {
        float *there = front_.data() + to + k, *u = out_.u.data() + to + k, *v = out_.v.data() + to + k;
        const V4 px = V4{0, 1, 2, 3} + static_cast<float>(x0 + static_cast<int>(k));
        const V4 du = b.u[0] + b.u[1] * px + b.u[2] * py, dv = b.v[0] + b.v[1] * px + b.v[2] * py, front = du * du + dv * dv;
        V4 was, was_u, was_v;
        std::memcpy(&was, there, sizeof was);
        std::memcpy(&was_u, u, sizeof was);
        std::memcpy(&was_v, v, sizeof was);
        const auto wins = front > was;
        was = wins ? front : was;
        was_u = wins ? V4{} : was_u;
        was_v = wins ? V4{} : was_v;
        std::memcpy(there, &was, sizeof was);
        std::memcpy(u, &was_u, sizeof was);
        std::memcpy(v, &was_v, sizeof was);
    }
}

// Every cell of `from` to where it lands inside of what is touched.
void Projection::scatter(const Motion& motion, int cell_px, float reach_px, const Box& from_box, const Background& b) noexcept {
    const int w = out_.width;
    const float per_cell = 1.0f / static_cast<float>(cell_px);
    const Box& box = touched_;
    for (int y = box.y0; y < box.y1; ++y)
        std::fill_n(front_.begin() + static_cast<std::ptrdiff_t>(y) * w + box.x0, box.x1 - box.x0, kNothing);
    bool moves = false;
    constexpr int kLanes = 8;   // cells at once; where all eight land side by side, they are compared and written at once
    for (int y = from_box.y0; y < from_box.y1; ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(w);
        for (int x0 = from_box.x0; x0 < from_box.x1; x0 += kLanes) {
            const int count = std::min(kLanes, from_box.x1 - x0);
            if (motion.pitch == 1 && count == kLanes && x0 >= box.x0 && x0 + kLanes <= box.x1 && y >= box.y0 && y < box.y1 && all_zero<kLanes>(motion.u + row + x0, motion.v + row + x0)) {
                stay<kLanes>(x0, y, b);   // most of what is partly static
                continue;
            }
            float a[kLanes] = {}, c[kLanes] = {}, front[kLanes];
            int right[kLanes], down[kLanes];
            for (int k = 0; k < count; ++k) {
                const std::size_t from = (row + static_cast<std::size_t>(x0 + k)) * motion.pitch;
                a[k] = motion.u[from] * motion.scale;
                c[k] = motion.v[from] * motion.scale;
            }
            int any = 0, apart = 0;
            for (int k = 0; k < kLanes; ++k) {
                const bool within_reach = std::fabs(a[k]) <= reach_px && std::fabs(c[k]) <= reach_px;
                a[k] = within_reach ? a[k] : 0.0f;
                c[k] = within_reach ? c[k] : 0.0f;
                any |= (a[k] != 0) | (c[k] != 0);
                right[k] = round_int(a[k] * per_cell);
                down[k] = round_int(c[k] * per_cell);
                const float px = static_cast<float>(x0 + k), py = static_cast<float>(y);
                const float du = a[k] - (b.u[0] + b.u[1] * px + b.u[2] * py), dv = c[k] - (b.v[0] + b.v[1] * px + b.v[2] * py);
                front[k] = du * du + dv * dv;
            }
            for (int k = 0; k < kLanes; ++k) apart |= (right[k] ^ right[0]) | (down[k] ^ down[0]);
            moves |= any != 0;
            const int to_x = x0 + right[0], to_y = y + down[0];
            if (apart == 0 && count == kLanes && to_x >= box.x0 && to_x + kLanes <= box.x1) {
                if (to_y < box.y0 || to_y >= box.y1) continue;
                const std::size_t to = static_cast<std::size_t>(to_y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(to_x);
                float *there = front_.data() + to, *u = out_.u.data() + to, *v = out_.v.data() + to;
                float merged[3][kLanes];
                for (int k = 0; k < kLanes; ++k) {
                    const bool wins = front[k] > there[k];
                    merged[0][k] = wins ? front[k] : there[k];
                    merged[1][k] = wins ? -a[k] : u[k];
                    merged[2][k] = wins ? -c[k] : v[k];
                }
                std::copy_n(merged[0], kLanes, there);
                std::copy_n(merged[1], kLanes, u);
                std::copy_n(merged[2], kLanes, v);
                continue;
            }
            for (int k = 0; k < count; ++k) {
                const int tx = x0 + k + right[k], ty = y + down[k];
                if (tx < box.x0 || tx >= box.x1 || ty < box.y0 || ty >= box.y1) continue;
                const std::size_t target = static_cast<std::size_t>(ty) * static_cast<std::size_t>(w) + static_cast<std::size_t>(tx);
                if (front[k] > front_[target]) {
                    front_[target] = front[k];
                    out_.u[target] = -a[k];
                    out_.v[target] = -c[k];
                }
            }
        }
    }
    has_far_ = false;
    moves_ = moves;
    filled_ = 0;
    if (moves) fill_holes(cell_px, nullptr);
}

void Projection::run_known(const KnownMotion& known, float step, int cell_px, float reach_px, const Gatherable& source, bool floats, const Kernels& kernels) noexcept {
    std::fill(front_.begin(), front_.end(), kNothing);
    touched_ = {0, 0, out_.width, out_.height};
    has_far_ = known.motion_px != nullptr;
    if (has_far_) std::fill(sources_.begin(), sources_.end(), static_cast<std::uint8_t>(kBoth));
    // Who does not say where each point will be says by its motion how paths bend.
    PathBend bend;
    constexpr float kFarthest = 2;   // frame times: a path is no parabola for longer
    const bool bends = known.ahead_px == nullptr && std::fabs(step) <= kFarthest;
    if (bends) bend = fit_path_bend(known.motion_px, out_.width, out_.height, reach_px);
    moves_ = kernels.carry({known.motion_px, known.ahead_px, known.depth, step, bends ? &bend : nullptr, out_.width, out_.height, cell_px, reach_px,
                            cell_px == 1 ? source.pixels : nullptr, source.row_bytes, floats, carry_.data(), front_.data(),
                            has_far_ && cell_px == 1 ? sources_.data() : nullptr, out_.u.data(), out_.v.data(),
                            far_.u.data(), far_.v.data()});
    filled_ = 0;
    if (moves_) {
        const Carry carry{&known, step, cell_px, bends ? &bend : nullptr};
        border_.find(source, floats);
        fill_holes(cell_px, &carry);
    }
}

// What surrounds a hole: in each of four ways the first cell that something landed on.
struct Projection::Hole {
    int x, y;
    int distance[4];           // cells; 0: nothing within reach
    std::size_t found[4];
    int behind;                // the way to what lies behind
    bool apart;                // they do not all move alike: something in front has left
};

// The farther source shows what lies behind if the place is inside of it, and if what is in front now was elsewhere then.
// Whether the nearer source shows, where `found` would take the hole's content from, what `found` belongs to, and not something in
// front that moves otherwise: that has left, and hides there what the hole has to show.
bool Projection::continues(const Carry& carry, int x, int y, std::size_t found) const noexcept {
    const int w = out_.width, h = out_.height;
    const float per_cell = 1.0f / static_cast<float>(carry.cell_px), alike = 0.25f * static_cast<float>(carry.cell_px);
    const int px = x + round_int(out_.u[found] * per_cell), py = y + round_int(out_.v[found] * per_cell);
    if (px < 0 || px >= w || py < 0 || py >= h) return true;
    const float* given = carry.known->ahead_px != nullptr ? carry.known->ahead_px : carry.known->motion_px;
    const float scale = carry.known->ahead_px != nullptr ? 1.0f : carry.step;
    // What lies beside it may be mixed of both.
    for (int j = std::max(py - 1, 0); j <= std::min(py + 1, h - 1); ++j)
        for (int i = std::max(px - 1, 0); i <= std::min(px + 1, w - 1); ++i) {
            const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(w) + static_cast<std::size_t>(i);
            if (!(-carry.known->depth[at] > front_[found])) continue;
            const float u = given[2 * at], v = given[2 * at + 1];
            float du = u * scale + out_.u[found], dv = v * scale + out_.v[found];
            if (carry.bend != nullptr) {
                const float half = 0.5f * scale * (1 + scale) * per_cell, fx = static_cast<float>(i), fy = static_cast<float>(j);
                const auto along = [&](const float (&g)[2][3]) { return half * ((g[0][0] + g[0][1] * fx + g[0][2] * fy) * u + (g[1][0] + g[1][1] * fx + g[1][2] * fy) * v); };
                du += along(carry.bend->u);
                dv += along(carry.bend->v);
            }
            if (!(std::fabs(du) <= alike && std::fabs(dv) <= alike)) return false;
        }
    return true;
}

void Projection::fill_from_far(const Hole& hole, const float* depth, int cell_px) noexcept {
    const int w = out_.width, h = out_.height;
    const std::size_t at = static_cast<std::size_t>(hole.y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(hole.x), behind = hole.found[hole.behind];
    far_.u[at] = far_.u[behind];
    far_.v[at] = far_.v[behind];
    const float per_cell = 1.0f / static_cast<float>(cell_px);
    const float far_x = static_cast<float>(hole.x) + far_.u[at] * per_cell, far_y = static_cast<float>(hole.y) + far_.v[at] * per_cell;
    const auto inside = [&](float x, float y) { return x >= 0 && y >= 0 && x <= static_cast<float>(w - 1) && y <= static_cast<float>(h - 1); };
    if (!inside(far_x, far_y)) return;
    const bool near_inside = inside(static_cast<float>(hole.x) + out_.u[behind] * per_cell, static_cast<float>(hole.y) + out_.v[behind] * per_cell);
    if (near_inside && !hole.apart) {
        sources_[at] = kBoth;
        return;
    }
    for (int way = 0; way < 4; ++way) {
        if (hole.distance[way] == 0 || !(front_[hole.found[way]] > front_[behind])) continue;
        const std::size_t f = hole.found[way];
        // The mover's own motion brings the place in the farther source to the nearer one; half-way in depth tells them apart.
        const int x = round_int(far_x + (out_.u[f] - far_.u[f]) * per_cell), y = round_int(far_y + (out_.v[f] - far_.v[f]) * per_cell);
        if (far_.u[f] >= kNowhere_px) return;
        const float between = 0.5f * (front_[f] + front_[behind]);
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, h - 1); ++j)
            for (int i = std::max(x - 1, 0); i <= std::min(x + 1, w - 1); ++i)
                if (-depth[static_cast<std::size_t>(j) * static_cast<std::size_t>(w) + static_cast<std::size_t>(i)] > between) return;
    }
    sources_[at] = kSecondOnly;
}

// The first cell in each way that something landed on; how many ways have one. The hole `beside` it on the left and the one above
// (`below` that: this) have looked already, and all but one step of it is known from there; `left` and `right` are what that on the left found.
int Projection::look_around(Hole& hole, bool beside, bool below, int& left, int& right) noexcept {
    const int w = out_.width;
    const Box& box = touched_;
    const auto landed = [&](int way, int d) {
        const int x = hole.x + kWays[way][0] * d, y = hole.y + kWays[way][1] * d;
        return x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1 && front_[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] != kNothing;
    };
    const auto search = [&](int way) {
        for (int d = 1; d <= kSearch; ++d)
            if (landed(way, d)) return d;
        return 0;
    };
    const auto further = [](int d) { return d != 0 && d < kSearch ? d + 1 : 0; };
    const auto nearer = [&](int d, int way) { return d != 0 ? d - 1 : landed(way, kSearch) ? kSearch : 0; };
    std::uint8_t &up = up_[static_cast<std::size_t>(hole.x)], &down = down_[static_cast<std::size_t>(hole.x)];
    left = beside ? further(left) : landed(0, 1) ? 1 : 0;
    right = beside ? nearer(right, 1) : search(1);
    up = static_cast<std::uint8_t>(below ? further(up) : landed(2, 1) ? 1 : 0);
    down = static_cast<std::uint8_t>(below ? nearer(down, 3) : search(3));
    const int found[4] = {left, right, up, down};
    int nearest = 0, ways = 0, reach = kSearch;
    for (int way = 0; way < 4; ++way) {
        // What lies much further off above or below than beside does not decide.
        if (way == 2 && nearest != 0) reach = std::min(kSearch, 2 * nearest + 6);
        const int d = found[way];
        if (d == 0 || d > reach) continue;
        hole.distance[way] = d;
        hole.found[way] = static_cast<std::size_t>(hole.y + kWays[way][1] * d) * static_cast<std::size_t>(w) + static_cast<std::size_t>(hole.x + kWays[way][0] * d);
        ++ways;
        if (nearest == 0 || d < nearest) nearest = d;
    }
    return ways;
}

void Projection::fill_holes(int cell_px, const Carry* carry) noexcept {
    constexpr float kBehind = 0.25f;   // of the way from the farthest front to the nearest
    const int w = out_.width, h = out_.height;
    const auto at = [w](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x); };
    long holes = 0;
    const Box& box = touched_;
    constexpr int kAtOnce = 32;   // cells: most runs of them have no hole
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0, known_to = x, left = 0, right = 0; x < box.x1; ++x) {
            if (x >= known_to) {
                known_to = std::min(x + kAtOnce, box.x1);
                const float* row = front_.data() + at(x, y);
                int any = 0;
                for (int k = 0; k < known_to - x; ++k) any |= row[k] == kNothing ? 1 : 0;
                if (any == 0) {
                    x = known_to - 1;
                    continue;
                }
            }
            if (front_[at(x, y)] != kNothing) continue;
            ++holes;
            float& u = out_.u[at(x, y)];
            float& v = out_.v[at(x, y)];
            u = v = 0;
            if (has_far_) {
                sources_[at(x, y)] = kFirstOnly;
                far_.u[at(x, y)] = far_.v[at(x, y)] = 0;   // the cells beside it mix it in
            }
            Hole hole{x, y, {}, {}, -1, false};
            auto& found = hole.found;
            auto& distance = hole.distance;
            const bool beside = x > box.x0 && front_[at(x - 1, y)] == kNothing, below = y > box.y0 && front_[at(x, y - 1)] == kNothing;
            const int ways = look_around(hole, beside, below, left, right);
            if (ways == 0) continue;
            // A surface that grows tears open by a cell or two: what stands on both sides goes on there, whatever lies further off.
            bool torn = false, uncovered = false;
            for (int way = 0; way < 4 && !torn; way += 2)
                if (distance[way] != 0 && distance[way + 1] != 0 && distance[way] + distance[way + 1] <= 3) {
                    const int behind = front_[found[way]] < front_[found[way + 1]] ? way : way + 1;
                    uncovered = carry != nullptr && !continues(*carry, x, y, found[behind]);   // something in front has left
                    torn = true;
                    distance[2 - way] = distance[3 - way] = 0;
                }
            // What lies behind: of the ways whose front is not much above the smallest, the shortest.
            int chosen = -1;
            float nearest_front = kNothing, farthest_front = -kNothing;
            float low_u = 0, high_u = 0, low_v = 0, high_v = 0;
            for (int way = 0; way < 4; ++way) {
                if (distance[way] == 0) continue;
                const float a = out_.u[found[way]], c = out_.v[found[way]];
                if (chosen < 0) {
                    low_u = high_u = a;
                    low_v = high_v = c;
                }
                low_u = std::min(low_u, a);
                high_u = std::max(high_u, a);
                low_v = std::min(low_v, c);
                high_v = std::max(high_v, c);
                nearest_front = std::max(nearest_front, front_[found[way]]);
                farthest_front = std::min(farthest_front, front_[found[way]]);
                chosen = way;
            }
            // Of a floor that slopes away, all of it lies behind: the nearest of what does. (Fronts may be infinite: no number is behind.)
            const float behind = farthest_front + kBehind * (nearest_front - farthest_front);
            chosen = -1;
            for (int way = 0; way < 4; ++way)
                if (distance[way] != 0 && !(front_[found[way]] > behind) && (chosen < 0 || distance[way] < distance[chosen])) chosen = way;
            u = out_.u[found[chosen]];
            v = out_.v[found[chosen]];
            // Around a crack all agree: it continues. Around a real hole they do not, and what the mover uncovers is the
            // picture behind, of which only the part beyond the rim is known: its rim is what is likest to it, for the few pixels
            // that a hole is wide (mirrored there, texture is wrong twice). Only with depth is the rim sure enough for that;
            // without, the gain is less than the loss where the motion's edge is a cell or two off.
            const float disagreement = std::max(high_u - low_u, high_v - low_v);
            hole.behind = chosen;
            hole.apart = torn ? uncovered : (ways > 1 && disagreement > 0.5f * static_cast<float>(cell_px)) || (carry != nullptr && !continues(*carry, x, y, found[chosen]));
            if (has_far_) fill_from_far(hole, carry->known->depth, cell_px);
            if (carry == nullptr) continue;
            if (hole.apart) {
                // The rim's own centre: beside it is what covered the hole.
                const float scale = static_cast<float>(cell_px);
                float& across = chosen < 2 ? u : v;
                across = static_cast<float>(kWays[chosen][chosen < 2 ? 0 : 1] * distance[chosen] + round_int(across / scale)) * scale;
            }
            const auto centre = [cell_px](int cell) { return (static_cast<float>(cell) + 0.5f) * static_cast<float>(cell_px) - 0.5f; };
            border_.follow(centre(x), centre(y), u, v);
        }
    filled_ = static_cast<float>(holes) / (static_cast<float>(w) * static_cast<float>(h));
}

}  // namespace fovea::render::extrapolation
