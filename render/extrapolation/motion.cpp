#include "render/extrapolation/motion.hpp"

#include <cmath>

namespace fovea::render::extrapolation {

namespace {

constexpr int kCoarsestPx = 32;      // the longer edge of the coarsest level is at most this
constexpr int kShortestPx = 8;       // ... unless the shorter one would fall below a patch
constexpr int kChunkRows = 16;       // rows of patches that share what they find; fixed, so that threads change nothing
constexpr float kDoubt = 0.02f;      // trust in a motion that the way back contradicts; not 0: it may be all there is

std::size_t at(int x, int y, int width) noexcept { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }

// From `least` to `most` a plane and its border are filled.
struct Reach {
    float least_x, least_y, most_x, most_y;
    // `part` of the plane is, and the border beside it.
    Reach(const Box& part, const Plane& p) noexcept : least_x(least(part.x0)), least_y(least(part.y0)), most_x(most(part.x1, p.width())), most_y(most(part.y1, p.height())) {}

private:
    static float least(int at) noexcept { return static_cast<float>(at == 0 ? 1 - kPadPx : at); }
    static float most(int at, int end) noexcept { return static_cast<float>(at == end ? end + kPadPx - 2 : at - 2); }
};
float sample(const Plane& p, const Reach& r, float x, float y) noexcept {
    x = std::clamp(x, r.least_x, r.most_x);
    y = std::clamp(y, r.least_y, r.most_y);
    const auto ix = static_cast<int>(x + kPadPx) - kPadPx, iy = static_cast<int>(y + kPadPx) - kPadPx;   // the floor: nothing lies further out
    const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
    const float *a = p.row(iy) + ix, *b = p.row(iy + 1) + ix;
    const float upper = a[0] + fx * (a[1] - a[0]), lower = b[0] + fx * (b[1] - b[0]);
    return upper + fy * (lower - upper);
}

}  // namespace

void MotionSearch::resize(int width_px, int height_px, int cell_px, int threads) {
    width_px_ = width_px;
    height_px_ = height_px;
    cell_px_ = cell_px;
    near_.clear();
    int w = (width_px + cell_px - 1) / cell_px, h = (height_px + cell_px - 1) / cell_px;
    for (;;) {
        near_.emplace_back().resize(w, h);
        if (std::max(w, h) <= kCoarsestPx || (std::min(w, h) + 1) / 2 < kShortestPx) break;
        w = (w + 1) / 2;
        h = (h + 1) / 2;
    }
    far_ = near_;
    for (std::vector<Box>& of_levels : written_) of_levels.assign(near_.size(), Box{});
    forward_.resize(near_.size());
    backward_.resize(near_.size());
    for (std::size_t l = 0; l < near_.size(); ++l) {
        forward_[l].resize(near_[l].width(), near_[l].height());
        backward_[l].resize(near_[l].width(), near_[l].height());
    }
    const Plane& finest = near_[0];
    const int columns = (finest.width() + kStridePx - 1) / kStridePx + 1, rows = (finest.height() + kStridePx - 1) / kStridePx + 1;
    patches_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    tasks_.resize(patches_.size());
    threads_ = threads;
    spread_scratch_.assign(static_cast<std::size_t>(spread_scratch(columns)) * static_cast<std::size_t>(threads), 0.0f);
    trust_.assign(forward_[0].u.size(), 1.0f);
    smoothed_.resize(finest.width(), finest.height());
}

// From level `first` on, each from the one above. Up to cells of kPartPx only the part that is looked at; there the rest becomes as
// the part's rim is: the patches of the coarser levels reach further than the part.
void MotionSearch::levels_below(std::vector<Plane>& planes, std::size_t first, const Kernels& kernels, ThreadPool& pool) noexcept {
    for (std::size_t l = first; l < planes.size(); ++l) {
        Plane &in = planes[l - 1], &out = planes[l];
        const Box part = part_at(static_cast<int>(l));
        pool.run(part.y1 - part.y0, 64, [&](int row0, int row1) {
            kernels.halve(in.row(0) + 2 * part.x0, in.stride(), out.row(0) + part.x0, out.stride(), part.x1 - part.x0, part.y0 + row0, part.y0 + row1);
            for (int y = part.y0 + row0; y < part.y0 + row1; ++y) out.pad_row(y);
        });
        if (cell_px_ << l == kPartPx) extend(out, part);
        out.pad_above();
        out.pad_below();
    }
}

void MotionSearch::extend(Plane& p, const Box& part) noexcept {
    if (part.x0 > 0 || part.x1 < p.width())
        for (int y = part.y0; y < part.y1; ++y) {
            float* r = p.row(y);
            std::fill(r, r + part.x0, r[part.x0]);
            std::fill(r + part.x1, r + p.width(), r[part.x1 - 1]);
            p.pad_row(y);
        }
    for (int y = 0; y < p.height(); ++y) {
        if (y == part.y0) y = part.y1;
        if (y >= p.height()) break;
        std::copy_n(p.row(y < part.y0 ? part.y0 : part.y1 - 1) - kPadPx, p.stride(), p.row(y) - kPadPx);
    }
}

// What may move: all but the tiles that stand still. The even inside of a moving thing is still, bit for bit, and yet moves: it
// does not hold its surroundings back.
void MotionSearch::find_active(const TileMap& tiles) noexcept {
    int x0 = tiles.columns, y0 = tiles.rows, x1 = 0, y1 = 0;
    for (int row = 0; row < tiles.rows; ++row)
        for (int column = 0; column < tiles.columns; ++column) {
            if (tiles.is_anchor(column, row)) continue;
            x0 = std::min(x0, column);
            x1 = std::max(x1, column + 1);
            y0 = std::min(y0, row);
            y1 = std::max(y1, row + 1);
        }
    const int cells = kTilePx / cell_px_;
    const Field& finest = forward_[0];
    active_ = Box{x0 * cells, y0 * cells, std::min(x1 * cells, finest.width), std::min(y1 * cells, finest.height)};
}

// What may move, and what of the picture is looked at for it.
Box MotionSearch::begin(const TileMap& tiles, bool foveated) noexcept {
    const Field& finest = forward_[0];
    active_ = {0, 0, finest.width, finest.height};
    part_ = {0, 0, tiles.columns, tiles.rows};
    if (tiles.still_count == 0) return part_;
    find_active(tiles);
    const auto whole = [](int v, int block, int most) { return std::min((v + block - 1) / block * block, most); };
    if (foveated)   // as the blocks are judged
        active_ = {active_.x0 / kFoveaBlock * kFoveaBlock, active_.y0 / kFoveaBlock * kFoveaBlock, whole(active_.x1, kFoveaBlock, finest.width), whole(active_.y1, kFoveaBlock, finest.height)};
    const int per_tile = kTilePx / cell_px_;
    part_ = Box{active_.x0 / per_tile, active_.y0 / per_tile, (active_.x1 + per_tile - 1) / per_tile, (active_.y1 + per_tile - 1) / per_tile}.grown(kAroundTiles, tiles.columns, tiles.rows);
    return part_;
}

// Of a level, what its luma is made of; all of it where the cells are larger than kPartPx.
Box MotionSearch::part_at(int level) const noexcept {
    const Plane& p = near_[static_cast<std::size_t>(level)];
    const int cell = cell_px_ << level;
    if (cell > kPartPx) return {0, 0, p.width(), p.height()};
    const int per_tile = kTilePx / cell;
    return {part_.x0 * per_tile, part_.y0 * per_tile, std::min(part_.x1 * per_tile, p.width()), std::min(part_.y1 * per_tile, p.height())};
}

// What may move of a level, in its cells, and whole strides.
Box MotionSearch::active_at(int level) const noexcept {
    const Field& f = forward_[static_cast<std::size_t>(level)];
    const auto down = [](int v) { return v / kStridePx * kStridePx; };
    return {down(active_.x0 >> level), down(active_.y0 >> level), std::min(down((active_.x1 >> level) + kStridePx), f.width), std::min(down((active_.y1 >> level) + kStridePx), f.height)};
}

// The patches that touch a box of a level, and one more around them.
Box MotionSearch::patches_of(const Box& box, int level) const noexcept {
    const Field& f = forward_[static_cast<std::size_t>(level)];
    const int columns = (f.width + kStridePx - 1) / kStridePx + 1, rows = (f.height + kStridePx - 1) / kStridePx + 1;
    return {std::max(box.x0 / kStridePx - 1, 0), std::max(box.y0 / kStridePx - 1, 0), std::min((box.x1 + kStridePx - 1) / kStridePx + 2, columns), std::min((box.y1 + kStridePx - 1) / kStridePx + 2, rows)};
}

// Still patches are known.
void MotionSearch::choose_tasks(const Box& searched, const TileMap& tiles, int level) noexcept {
    const Plane& p = near_[static_cast<std::size_t>(level)];
    const int columns = (p.width() + kStridePx - 1) / kStridePx + 1;
    const int scale = cell_px_ << level;   // pixels of the picture per pixel of the level
    const Box patches = patches_of(searched, level);
    for (int j = patches.y0; j < patches.y1; ++j)
        for (int i = patches.x0; i < patches.x1; ++i) {
            std::uint8_t task = kPatchSearch;
            const int x0 = (kStridePx * i - kStridePx) * scale, y0 = (kStridePx * j - kStridePx) * scale;
            if (tiles.still_count > 0) {
                const int c0 = std::clamp(x0 / kTilePx, 0, tiles.columns - 1), c1 = std::clamp((x0 + kPatchPx * scale - 1) / kTilePx, 0, tiles.columns - 1);
                const int r0 = std::clamp(y0 / kTilePx, 0, tiles.rows - 1), r1 = std::clamp((y0 + kPatchPx * scale - 1) / kTilePx, 0, tiles.rows - 1);
                bool still = true, anchored = false;
                for (int r = r0; r <= r1 && still; ++r)
                    for (int c = c0; c <= c1 && still; ++c) {
                        still = tiles.is_still(c, r);
                        anchored |= tiles.is_anchor(c, r);
                    }
                if (still) task = anchored ? kPatchStill : kPatchKeep;
            }
            tasks_[at(i, j, columns)] = task;
        }
}

// Of `may` a level goes on as the coarser one found, around what is searched.
void MotionSearch::spread_coarse(std::vector<Field>& fields, const Box& may, const Box& searched, int level) noexcept {
    const auto l = static_cast<std::size_t>(level);
    Field& f = fields[l];
    const Field& c = fields[l + 1];
    float* const mixed = spread_scratch_.data() + 1;   // of a row of coarse cells, with one more at each end
    const auto columns = [&](int y, int x0, int x1) {
        const int j0 = std::clamp((y - 1) >> 1, 0, c.height - 1), j1 = std::min(((y - 1) >> 1) + 1, c.height - 1);
        const float t = y % 2 == 0 ? 0.75f : 0.25f;
        // Cells come in pairs on both sides of the line between two coarse cells.
        const int i0 = (x0 - 1) >> 1, i1 = (x1 - 2) >> 1;
        for (int plane = 0; plane < 2; ++plane) {
            const float* from = plane == 0 ? c.u.data() : c.v.data();
            const float *above = from + at(0, j0, c.width), *below = from + at(0, j1, c.width);
            float* to = (plane == 0 ? f.u.data() : f.v.data()) + at(0, y, f.width);
            const int end = std::min(i1 + 1, c.width - 1);
            for (int i = std::max(i0, 0); i <= end; ++i) mixed[i] = 2 * (above[i] + t * (below[i] - above[i]));
            mixed[-1] = mixed[0];
            mixed[c.width] = mixed[c.width - 1];
            const auto step = [&](int i) { return 0.25f * (mixed[i + 1] - mixed[i]); };
            const int whole0 = 2 * i0 + 1 >= x0 ? i0 : i0 + 1, whole1 = 2 * i1 + 2 < x1 ? i1 + 1 : i1;
            if (whole0 > i0) to[2 * i0 + 2] = mixed[i0 + 1] - step(i0);
            for (int i = whole0; i < whole1; ++i) {
                to[2 * i + 1] = mixed[i] + step(i);
                to[2 * i + 2] = mixed[i + 1] - step(i);
            }
            if (whole1 <= i1 && whole1 >= whole0) to[2 * i1 + 1] = mixed[i1] + step(i1);
        }
    };
    for (int y = may.y0; y < may.y1; ++y) {
        const bool beside = y >= searched.y0 && y < searched.y1 && searched.x1 > searched.x0;
        if (!beside) {
            columns(y, may.x0, may.x1);
            continue;
        }
        if (may.x0 < searched.x0) columns(y, may.x0, searched.x0);
        if (searched.x1 < may.x1) columns(y, searched.x1, may.x1);
    }
}

void MotionSearch::search_level(const Box& box, const Box& around, int level, bool backward, const Tuning& tuning, const Kernels& kernels, ThreadPool& pool) noexcept {
    const auto l = static_cast<std::size_t>(level);
    const Plane &from = backward ? far_[l] : near_[l], &to = backward ? near_[l] : far_[l];
    std::vector<Field>& fields = backward ? backward_ : forward_;
    const int columns = (from.width() + kStridePx - 1) / kStridePx + 1, rows = (from.height() + kStridePx - 1) / kStridePx + 1;
    const bool coarsest = l + 1 == near_.size();
    const Box patches = patches_of(box, level);
    for (int j = patches.y0; j < patches.y1; ++j)
        for (int i = patches.x0; i < patches.x1; ++i) {
            PatchMotion m;
            if (!coarsest && tasks_[at(i, j, columns)] != kPatchStill) {
                const Field& c = fields[l + 1];
                const int x1 = std::min(2 * i, c.width - 1), y1 = std::min(2 * j, c.height - 1), x0 = std::max(x1 - 1, 0), y0 = std::max(y1 - 1, 0);
                m.u = 0.5f * ((c.u[at(x0, y0, c.width)] + c.u[at(x1, y0, c.width)]) + (c.u[at(x0, y1, c.width)] + c.u[at(x1, y1, c.width)]));
                m.v = 0.5f * ((c.v[at(x0, y0, c.width)] + c.v[at(x1, y0, c.width)]) + (c.v[at(x0, y1, c.width)] + c.v[at(x1, y1, c.width)]));
            }
            patches_[at(i, j, columns)] = m;
        }
    const float reach = std::max(1.0f, kSearchReach * static_cast<float>(std::max(width_px_, height_px_)) / static_cast<float>(cell_px_ << level));
    // The way back only has to tell right from wrong.
    const int iterations = backward ? (tuning.iterations + 1) / 2 : tuning.iterations;
    const int rounds = backward ? (tuning.balance_rounds + 1) / 2 : tuning.balance_rounds;
    // Where a patch's first pixel may come to lie: beyond the picture's edge there is a border.
    const Box filled = level == 0 ? filled_ : cell_px_ << level < kPartPx ? part_at(level) : Box{0, 0, to.width(), to.height()};
    const auto low = [](int at) { return static_cast<float>(at == 0 ? kSearchLow : at); };
    const auto high = [](int at, int end) { return static_cast<float>(at == end ? end + kSearchHigh : at - kPatchPx - 2); };
    const SearchJob job{from.row(0), to.row(0), from.stride(), from.width(), from.height(), columns, rows, patches_.data(), tasks_.data(),
                        iterations, level == 0 ? 1 : tuning.passes, reach, low(filled.x0), low(filled.y0), high(filled.x1, to.width()), high(filled.y1, to.height()), patches.x0, patches.x1, patches.y0, patches.y1};
    pool.run(patches.y1 - patches.y0, kChunkRows, [&](int row0, int row1) { kernels.search(job, patches.y0 + row0, patches.y0 + row1); });
    kernels.balance({&job, rounds, tuning.stiffness});
    go_on(around, box, level, backward);
    const int first_band = box.y0 / kStridePx, bands = (box.y1 + kStridePx - 1) / kStridePx - first_band, bands_per_thread = (bands + threads_ - 1) / threads_;
    const SpreadJob spread{&job, fields[l].u.data(), fields[l].v.data(), spread_scratch_.data(), bands_per_thread, first_band, box.x0 / kStridePx, (box.x1 + kStridePx - 1) / kStridePx};
    pool.run(bands, bands_per_thread, [&](int band0, int band1) { kernels.spread(spread, first_band + band0, first_band + band1); });
}

// Around what is searched a level is as the coarser one found; beyond, nothing moves.
void MotionSearch::go_on(const Box& around, const Box& searched, int level, bool backward) noexcept {
    const auto l = static_cast<std::size_t>(level);
    std::vector<Field>& fields = backward ? backward_ : forward_;
    Box& written = written_[backward ? 1 : 0][l];
    if (!around.holds(written)) clear(fields[l], written);   // what a call before has left where nothing may move now
    written = around;
    if (l + 1 < near_.size()) spread_coarse(fields, around, searched, level);
}

// A cell whose partner does not come back was hidden in the other source: its motion is a guess. `read`: where the smoothing, of
// the finest level, looks; what stands still is sure of it.
void MotionSearch::check_backward(const Box& box, const Box& read, int level) noexcept {
    const auto l = static_cast<std::size_t>(level);
    const Field &f = forward_[l], &b = backward_[l], &finest = forward_[0];
    const float away = 0.75f, away_per_motion = 0.05f;   // pixels of the level
    for (int y = read.y0; y < read.y1; ++y) std::fill_n(trust_.data() + at(read.x0, y, finest.width), read.x1 - read.x0, 1.0f);
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1; ++x) {
            const float u = f.u[at(x, y, f.width)], v = f.v[at(x, y, f.width)];
            // Clamped first: then plain truncation rounds.
            const auto px = static_cast<int>(std::clamp(static_cast<float>(x) + u + 0.5f, 0.5f, static_cast<float>(f.width) - 0.5f));
            const auto py = static_cast<int>(std::clamp(static_cast<float>(y) + v + 0.5f, 0.5f, static_cast<float>(f.height) - 0.5f));
            const float du = u + b.u[at(px, py, f.width)], dv = v + b.v[at(px, py, f.width)];
            const float limit = away + away_per_motion * (std::fabs(u) + std::fabs(v));
            const float trust = du * du + dv * dv < limit * limit ? 1.0f : kDoubt;
            const int x1 = std::min((x + 1) << level, finest.width), y1 = std::min((y + 1) << level, finest.height);
            for (int yy = y << level; yy < y1; ++yy)
                for (int xx = x << level; xx < x1; ++xx) trust_[at(xx, yy, finest.width)] = trust;
        }
}

// Row by row of tiles; columns of anchors to the left and right of what may move stay 0.
void MotionSearch::smooth(const Box& box, const TileMap& tiles, int passes, const Kernels& kernels, ThreadPool& pool) noexcept {
    Field& f = forward_[0];
    const int rows_per_tile = kTilePx / cell_px_;
    const bool everywhere = box.x0 == 0 && box.y0 == 0 && box.x1 == f.width && box.y1 == f.height;
    for (int pass = 0; pass < passes; ++pass) {
        pool.run(tiles.rows, 4, [&](int tile0, int tile1) {
            for (int row = tile0; row < tile1; ++row) {
                int first = tiles.columns, last = -1;
                for (int column = 0; column < tiles.columns; ++column) {
                    if (tiles.is_anchor(column, row)) continue;
                    first = std::min(first, column);
                    last = column;
                }
                const int y0 = std::max(row * rows_per_tile, box.y0), y1 = std::min((row + 1) * rows_per_tile, box.y1);
                const int x0 = std::clamp(first * rows_per_tile, box.x0, box.x1), x1 = std::clamp((last + 1) * rows_per_tile, x0, box.x1);
                for (int y = y0; y < y1; ++y) {
                    const std::size_t begin = at(0, y, f.width);
                    for (std::vector<float>* plane : {&smoothed_.u, &smoothed_.v}) {
                        std::fill(plane->data() + begin + box.x0, plane->data() + begin + x0, 0.0f);
                        std::fill(plane->data() + begin + x1, plane->data() + begin + box.x1, 0.0f);
                    }
                }
                if (x0 == x1 || y0 >= y1) continue;
                const SmoothJob job{f.u.data(), f.v.data(), trust_.data(), near_[0].row(0), near_[0].stride(), f.width, f.height, 1 << (passes - 1 - pass), x0, x1, smoothed_.u.data(), smoothed_.v.data()};
                kernels.smooth(job, y0, y1);
            }
        });
        if (everywhere) {
            std::swap(f.u, smoothed_.u);
            std::swap(f.v, smoothed_.v);
            continue;
        }
        for (int y = box.y0; y < box.y1; ++y) {
            const std::size_t begin = at(box.x0, y, f.width);
            std::copy_n(smoothed_.u.data() + begin, box.x1 - box.x0, f.u.data() + begin);
            std::copy_n(smoothed_.v.data() + begin, box.x1 - box.x0, f.v.data() + begin);
        }
    }
}

namespace {

// What a block of one luma leaves beside that of the other source, if it moves and if it stands still; means taken out.
struct Fit {
    float count = 0, variance = 0, still = 0, left = 0;

    // x0 to x1 - 1, y0 to y1 - 1 of `near`, every `every`-th along both axes; `f` has 1 << shift cells per pixel of the luma.
    Fit(const Plane& near, const Plane& far, const Reach& reach, const Field& f, int shift, const Box& b, int every) noexcept {
        float n = 0, s = 0, ss = 0, z = 0, zz = 0, m = 0, mm = 0;
        const float per = 1.0f / static_cast<float>(1 << shift);
        for (int y = b.y0; y < b.y1; y += every)
            for (int x = b.x0; x < b.x1; x += every) {
                const std::size_t cell = at(std::min(x << shift, f.width - 1), std::min(y << shift, f.height - 1), f.width);
                const float value = near.row(y)[x], zero = far.row(y)[x] - value;
                const float tx = static_cast<float>(x) + f.u[cell] * per, ty = static_cast<float>(y) + f.v[cell] * per;
                // What came into the picture since cannot be judged by what was there before.
                if (tx < -0.5f || ty < -0.5f || tx > static_cast<float>(near.width()) - 0.5f || ty > static_cast<float>(near.height()) - 0.5f) continue;
                const float moved = sample(far, reach, tx, ty) - value;
                n += 1;
                s += value;
                ss += value * value;
                z += zero;
                zz += zero * zero;
                m += moved;
                mm += moved * moved;
            }
        count = n;
        if (n == 0) return;
        variance = ss / n - (s / n) * (s / n);
        still = zz / n - (z / n) * (z / n);
        left = mm / n - (m / n) * (m / n);
    }
    [[nodiscard]] bool textured() const noexcept { return variance > kTextured; }
    // A match that leaves most of the texture, and much of what standing still leaves, is none: there is worse than showing what
    // was there.
    [[nodiscard]] bool refused() const noexcept {
        return left > kMuchWorse * still + kNoise || (textured() && left > kNoMatch * variance && left > kHardlyBetter * still);
    }

    static constexpr float kNoise = 0.5f, kTextured = 4.0f;   // variances, levels of 255 squared
    // Reading between cells blurs, and standing still does not: what is thinner than a cell, moved rightly, leaves more than at rest.
    static constexpr float kMuchWorse = 4.0f, kNoMatch = 0.9f;
    // Of two textures that have nothing to do with each other standing still leaves twice the variance.
    static constexpr float kHardlyBetter = 0.25f;
};

}  // namespace

// Blocks where the motion explains far less than standing still does stand still; counts what nothing explains. Judged at the
// cells of level 1; with a gaze it is that level's motion which goes on outside of `fovea`, in cells of the finest.
void MotionSearch::validate(const TileMap& tiles, const Box* fovea) noexcept {
    const std::size_t l = cell_px_ < 4 && near_.size() > 1 ? 1 : 0;
    const int scale = cell_px_ << l;
    const Plane &near = near_[l], &far = far_[l];
    constexpr int kBlock = 8;
    constexpr float kUnexplained = 0.5f;
    const Reach reach(cell_px_ << l < kPartPx ? part_at(static_cast<int>(l)) : Box{0, 0, far.width(), far.height()}, far), finest_reach(filled_, far_[0]);
    int textured = 0, unexplained = 0;
    for (int by = 0; by < near.height(); by += kBlock)
        for (int bx = 0; bx < near.width(); bx += kBlock) {
            const int tile_x = std::min(bx * scale / kTilePx, tiles.columns - 1), tile_y = std::min(by * scale / kTilePx, tiles.rows - 1);
            const bool coarse = fovea != nullptr && !(2 * bx >= fovea->x0 && 2 * bx < fovea->x1 && 2 * by >= fovea->y0 && 2 * by < fovea->y1);
            Field& f = forward_[coarse ? 1 : 0];
            const int shift = coarse ? 0 : static_cast<int>(l);
            if (tiles.is_anchor(tile_x, tile_y)) {
                ++textured;   // explained, by standing still
                continue;
            }
            const Box block{bx, by, std::min(bx + kBlock, near.width()), std::min(by + kBlock, near.height())};
            const Fit fit(near, far, reach, f, shift, block, 1);
            if (2 * static_cast<int>(fit.count) < (block.y1 - by) * (block.x1 - bx)) continue;
            if (fit.textured()) {
                ++textured;
                unexplained += fit.left > kUnexplained * fit.variance && !tiles.is_still(tile_x, tile_y);
            }
            if (!fit.refused()) continue;
            const Box cells{bx << shift, by << shift, std::min(block.x1 << shift, f.width), std::min(block.y1 << shift, f.height)};
            // Stripes of a few pixels are mixed at the cells of level 1, however rightly they move: the finest have the last word.
            if (shift > 0 && filled_.holds(cells) && !Fit(near_[0], far_[0], finest_reach, f, 0, cells, 1 << shift).refused()) continue;
            for (int y = cells.y0; y < cells.y1; ++y)
                for (int x = cells.x0; x < cells.x1; ++x) f.u[at(x, y, f.width)] = f.v[at(x, y, f.width)] = 0;
        }
    unexplained_ = textured > 0 ? static_cast<float>(unexplained) / static_cast<float>(textured) : 0.0f;
}

void MotionSearch::clear(Field& f, const Box& box) noexcept {
    for (int y = box.y0; y < box.y1; ++y)
        for (std::vector<float>* plane : {&f.u, &f.v}) std::fill_n(plane->data() + at(box.x0, y, f.width), box.x1 - box.x0, 0.0f);
}

void MotionSearch::stand_still(Field& f, const Box& box, int cell_px, const TileMap& tiles) noexcept {
    if (tiles.still_count == 0) return;
    const int per_tile = kTilePx / cell_px;
    for (int y = box.y0; y < box.y1; ++y)
        for (int x = box.x0; x < box.x1;) {
            const int end = std::min((x / per_tile + 1) * per_tile, box.x1);
            if (tiles.is_anchor(x / per_tile, y / per_tile))
                for (std::vector<float>* plane : {&f.u, &f.v}) std::fill_n(plane->data() + at(x, y, f.width), end - x, 0.0f);
            x = end;
        }
}

void MotionSearch::run(const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept {
    levels_below(near_, 1, kernels, pool);
    levels_below(far_, 1, kernels, pool);
    Field& finest = forward_[0];
    filled_ = part_at(0);
    const int backward_level = tuning.backward_level < 0 ? levels() : std::min(tuning.backward_level, levels() - 1);
    for (int l = levels() - 1; l >= 0; --l) {
        const Box box = active_at(l);
        choose_tasks(box, tiles, l);
        search_level(box, box, l, false, tuning, kernels, pool);
        if (l >= backward_level) search_level(box, box, l, true, tuning, kernels, pool);
    }
    if (backward_level < levels()) check_backward(backward_level > 0 ? active_at(backward_level) : active_, active_.grown(8, finest.width, finest.height), backward_level);
    smooth(active_, tiles, tuning.smoothing_passes, kernels, pool);
    validate(tiles, nullptr);
    stand_still(finest, active_at(0), cell_px_, tiles);   // whole strides were searched
}

}  // namespace fovea::render::extrapolation
