#include "render/extrapolation/judgement.hpp"

#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr int kEvery = 4;              // rows of pixels: one of so many is asked
constexpr int kEveryCoarse = kTilePx;  // ... where cells are larger than 2 pixels, away from a gaze: both rows of blocks share it
constexpr float kBelieved = 0.5f;      // of what standing still leaves, the motion may leave this part
constexpr float kRegion = 0.4f;        // ... in a region
constexpr int kRegion_blocks = 6;      // from a block to the rim of its region
constexpr float kStrong = 0.2f;        // ... on a side of a strip where nothing can match
constexpr int kStrip_blocks = 4;       // from inside such a strip to a side of it
constexpr float kContrary = 1.5f;      // ... and no strip leaves this part
constexpr float kAsked = 0.25f, kAskedStrong = 0.5f;   // of the pixels that moved, to believe and to be a side
constexpr float kLight = 768.0f;       // levels squared per pixel, over four channels: what changes more is no light, but a thing that comes or goes
constexpr float kNoise = 4.0f;         // levels squared per pixel, over four channels: what changes less makes no side

std::size_t at(int x, int y, int width) noexcept { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }

void add(BlockSums& to, const BlockSums& s) noexcept {
    to.moved += s.moved;
    to.asked += s.asked;
    to.left += s.left;
    to.still += s.still;
    for (int c = 0; c < 4; ++c) {
        to.left_shift[c] += s.left_shift[c];
        to.still_shift[c] += s.still_shift[c];
    }
}

}  // namespace

Judgement::Weight Judgement::weight(const BlockSums& s) noexcept {
    Weight w{s.left, s.still, s.left, s.still, false};
    const float per = 1 / std::max(s.asked, 1.0f);
    for (int c = 0; c < 4; ++c) {
        w.left_light -= s.left_shift[c] * s.left_shift[c] * per;
        w.still_light -= s.still_shift[c] * s.still_shift[c] * per;
    }
    w.is_light = w.left - w.left_light <= kLight * s.asked;
    return w;
}

void Judgement::resize(int width_px, int height_px, Format format, int threads) {
    columns_ = (width_px + kBlockPx - 1) / kBlockPx;
    rows_ = (height_px + kBlockPx - 1) / kBlockPx;
    const std::size_t blocks = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    sums_.assign(blocks, {});
    down_.assign(static_cast<std::size_t>(columns_), {});
    moved_.assign(static_cast<std::size_t>(rows_), {});
    weights_.assign(blocks, {});
    region_.assign(static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1), Sums{});
    believed_.assign(blocks, 0);
    strong_.assign(blocks, 0);
    arrives_.assign(blocks, 0);
    stands_.assign(blocks, 0);
    scratch_.resize(static_cast<std::size_t>(threads));
    for (Scratch& s : scratch_) {
        const auto width = static_cast<std::size_t>(width_px);
        s.dx.assign(width + kExpandPad + 64, 0);
        s.dy = s.far_dx = s.far_dy = s.dx;
        s.row_u.assign(width + 2 * kExpandPad, 0.0f);
        s.row_v = s.row_u;
        const std::size_t whole = static_cast<std::size_t>(columns_) * kBlockPx;
        s.out.assign(whole * (is_float(format) ? 16 : 4), 0);
        s.far = s.out;
        s.mask.assign(whole, 0);
        s.lanes.assign(static_cast<std::size_t>(columns_), {});
    }
}

// Pixels x0 to x1 - 1 of a row, from the first pixel of a block on; the four that are compared there begin at x0.
struct Judgement::Row {
    const std::uint8_t *out, *far, *near, *then;
    int band, x0, x1;   // of blocks
};

void Judgement::weigh_bytes(const Row& row, const Kernels& kernels, Scratch& s) const noexcept {
    const int first = row.x0 / kBlockPx, whole = (row.x1 - row.x0) / kBlockPx, rest = (row.x1 - row.x0) % kBlockPx;
    kernels.weigh_rgba8({row.out, row.far, row.near, row.then, s.mask.data() + row.x0, whole, s.lanes.data() + first});
    if (rest == 0) return;
    std::uint8_t last[4][4 * kBlockPx] = {};
    const std::uint8_t* from[4] = {row.out, row.far, row.near, row.then};
    for (int r = 0; r < 4; ++r) std::memcpy(last[r], from[r] + static_cast<std::ptrdiff_t>(4 * kBlockPx) * whole, static_cast<std::size_t>(4 * rest));
    const int x = row.x0 + whole * kBlockPx;
    std::fill(s.mask.begin() + x + rest, s.mask.begin() + x + kBlockPx, 0u);
    kernels.weigh_rgba8({last[0], last[1], last[2], last[3], s.mask.data() + x, 1, s.lanes.data() + first + whole});
}

void Judgement::weigh_floats(const Row& row, Scratch& s) noexcept {
    for (int x = row.x0; x < row.x1; ++x) {
        const std::uint32_t mask = s.mask[static_cast<std::size_t>(x)];
        if (mask == 0) continue;
        BlockSums& sum = sums_[at(x / kBlockPx, row.band, columns_)];
        sum.moved += 1;
        if (mask >> 31 == 0) continue;
        sum.asked += 1;
        const std::uint8_t* from[4] = {row.out, row.far, row.near, row.then};
        float v[4][4];
        for (int r = 0; r < 4; ++r) std::memcpy(v[r], from[r] + static_cast<std::ptrdiff_t>(x - row.x0) * 16, sizeof v[r]);
        for (int c = 0; c < 4; ++c) {
            // Light of any range: in parts of the largest.
            float size = 1e-3f;
            for (const auto& of : v) size = std::max(size, std::fabs(of[c]));
            const float per = 255.0f / size, l = (v[0][c] - v[1][c]) * per, t = (v[2][c] - v[3][c]) * per;
            if (!(std::fabs(l) <= 510.0f && std::fabs(t) <= 510.0f)) continue;   // not finite
            sum.left += l * l;
            sum.still += t * t;
            sum.left_shift[c] += l;
            sum.still_shift[c] += t;
        }
    }
}

void Judgement::weigh_tiles(const Job& job, int row0, int row1, const Kernels& kernels, Scratch& s) noexcept {
    const ConstImage& near = *job.near;
    const int w = near.width_px, h = near.height_px;
    const bool floats = is_float(near.format), own = near.format == Format::rgba8 || near.format == Format::rgba32f;
    const std::ptrdiff_t pixel = floats ? 16 : 4;
    const auto warp = floats ? kernels.warp_float_linear : kernels.warp_rgba8_linear;
    std::int32_t *dx = s.dx.data() + kExpandPad, *dy = s.dy.data() + kExpandPad, *far_dx = s.far_dx.data() + kExpandPad, *far_dy = s.far_dy.data() + kExpandPad;
    for (int row = row0; row < row1; ++row) {
        const auto layer_of = [&](int c) { return &job.layer_of(c, row); };
        const int first = row * kTilePx / kBlockPx, last = std::min((row + 1) * kTilePx / kBlockPx, rows_);
        const std::uint8_t* own_stays = job.stays + static_cast<std::ptrdiff_t>(row) * job.tiles->columns;
        Range moved{columns_, 0};
        for (int column = 0; column < job.tiles->columns; ++column) {
            if (own_stays[column] != 0) continue;
            const int block0 = column * kTilePx / kBlockPx;
            moved = {std::min(moved.begin, block0), std::min(block0 + kTilePx / kBlockPx, columns_)};
        }
        for (int b = first; b < last; ++b) {
            moved_[static_cast<std::size_t>(b)] = moved;
            if (moved.end > 0) std::fill(sums_.begin() + static_cast<std::ptrdiff_t>(at(moved.begin, b, columns_)), sums_.begin() + static_cast<std::ptrdiff_t>(at(moved.end, b, columns_)), BlockSums{});
        }
        if (moved.end == 0) continue;
        for (int column = 0; column < job.tiles->columns;) {
            const Gather::Layer* layer = layer_of(column);
            const bool stays = own_stays[column] != 0;
            int end = column + 1;
            while (end < job.tiles->columns && layer_of(end) == layer && (own_stays[end] != 0) == stays) ++end;
            const int x0 = column * kTilePx, x1 = std::min(end * kTilePx, w);
            column = end;
            if (stays) continue;
            const int block0 = x0 / kBlockPx, block1 = (x1 + kBlockPx - 1) / kBlockPx;
            const int every = layer->cell_px > 2 ? kEveryCoarse : kEvery;
            const int asked_px = std::max(every, kBlockPx), bands = asked_px / kBlockPx;   // rows that share what is asked
            for (int band = first; band < last; band += bands) {
                std::fill(s.lanes.begin() + block0, s.lanes.begin() + block1, BlockLanes{});
                const int begin = band * kBlockPx, end_y = std::min(begin + asked_px, h);
                // Where a tile has one row, those of two tiles lie at different places in them: lines may be as far apart as tiles.
                const int offset = bands == 1 ? every / 2 : row % 2 == 0 ? every / 4 : every * 11 / 16;
                for (int y = std::min(begin + offset, end_y - 1); y < end_y; y += every) {
                    Gather::displacement_row(*layer->displacement, layer->cell_px, y, x0, x1, kernels, dx, dy, s.row_u.data() + kExpandPad, s.row_v.data() + kExpandPad);
                    kernels.ask({dx, dy, 1 + 1 / job.step, w, h, y, x0, x1, far_dx, far_dy, s.mask.data()});
                    warp({job.far_source->pixels, job.far_source->row_bytes, w, h, y, x0, x1, far_dx, far_dy, s.far.data(), job.far_source->finite});
                    const auto* out = reinterpret_cast<const std::uint8_t*>(job.output->row(y)) + x0 * pixel;
                    if (!own) {
                        unpack_row(job.output->row(y), near.format, x0, x1 - x0, s.out.data());
                        out = s.out.data();
                    }
                    const Row line{out, s.far.data(), job.near_source->pixels + y * job.near_source->row_bytes + x0 * pixel, job.far_source->pixels + y * job.far_source->row_bytes + x0 * pixel, band, x0, x1};
                    if (floats) weigh_floats(line, s);
                    else weigh_bytes(line, kernels, s);
                }
                if (!floats) kernels.sum_blocks(s.lanes.data() + block0, block1 - block0, sums_.data() + at(block0, band, columns_));
                for (int shared = band + 1; shared < std::min(band + bands, last); ++shared)
                    std::copy_n(sums_.begin() + static_cast<std::ptrdiff_t>(at(block0, band, columns_)), block1 - block0, sums_.begin() + static_cast<std::ptrdiff_t>(at(block0, shared, columns_)));
            }
        }
    }
}

// Blocks of a row that may have moved, or lie beside some that have.
Judgement::Range Judgement::active(int row) const noexcept {
    Range all{columns_, 0};
    for (int j = std::max(row - 1, 0); j <= std::min(row + 1, rows_ - 1); ++j) {
        const Range& r = moved_[static_cast<std::size_t>(j)];
        if (r.end == 0) continue;
        all = {std::min(all.begin, std::max(r.begin - 1, 0)), std::max(all.end, std::min(r.end + 1, columns_))};
    }
    return all;
}

bool Judgement::decide() noexcept {
    std::fill(believed_.begin(), believed_.end(), std::uint8_t{1});
    std::fill(strong_.begin(), strong_.end(), std::uint8_t{0});
    std::fill(stands_.begin(), stands_.end(), std::uint8_t{1});
    int doubted = 0;
    for (int row = 0; row < rows_; ++row) {
        const Range range = active(row);
        if (range.end == 0) continue;
        const Range& own = moved_[static_cast<std::size_t>(row)];   // beyond, sums_ is of another frame
        BlockSums* down = down_.data();   // with the blocks above and below
        std::fill_n(down, columns_, BlockSums{});
        for (int j = std::max(row - 1, 0); j <= std::min(row + 1, rows_ - 1); ++j) {
            const Range& r = moved_[static_cast<std::size_t>(j)];
            for (int column = r.begin; column < r.end; ++column) add(down[column], sums_[at(column, j, columns_)]);
        }
        for (int column = range.begin; column < range.end; ++column) {
            BlockSums all = down[column];
            if (column > 0) add(all, down[column - 1]);
            if (column + 1 < columns_) add(all, down[column + 1]);
            const std::size_t block = at(column, row, columns_);
            if (all.moved == 0) {
                weights_[block] = {};
                continue;
            }
            const Weight& w = weights_[block] = weight(all);
            stands_[block] = column < own.begin || column >= own.end || sums_[block].moved == 0;
            believed_[block] = all.asked >= kAsked * all.moved && w.explains(kBelieved);
            arrives_[block] = all.asked < all.moved;
            doubted += 1 - believed_[block];
            strong_[block] = all.asked >= kAskedStrong * all.moved && w.still > kNoise * all.asked && w.explains(kStrong);
        }
    }
    if (doubted == 0) return false;
    // Sums from the first block on; nothing lies outside of what is active.
    Box box{columns_, rows_, 0, 0};
    for (int row = 0; row < rows_; ++row) {
        const Range range = active(row);
        if (range.end == 0) continue;
        box = {std::min(box.x0, range.begin), std::min(box.y0, row), std::max(box.x1, range.end), row + 1};
    }
    const int pitch = columns_ + 1;
    std::fill_n(region_.begin() + static_cast<std::ptrdiff_t>(at(box.x0, box.y0, pitch)), box.x1 - box.x0 + 1, Sums{});
    for (int row = box.y0; row < box.y1; ++row) {
        const Range range = active(row);
        Sums line{};
        region_[at(box.x0, row + 1, pitch)] = line;
        for (int column = box.x0; column < box.x1; ++column) {
            if (column >= range.begin && column < range.end) {
                const Weight& w = weights_[at(column, row, columns_)];
                line += Sums{static_cast<double>(w.left), static_cast<double>(w.still), static_cast<double>(w.left_light), static_cast<double>(w.still_light)};
            }
            region_[at(column + 1, row + 1, pitch)] = region_[at(column + 1, row, pitch)] + line;
        }
    }
    for (int row = 0; row < rows_; ++row) {
        const Range range = active(row);
        for (int column = range.begin; column < range.end; ++column) {
            const std::size_t block = at(column, row, columns_);
            if (believed_[block] != 0) continue;
            const int i0 = std::max(column - kRegion_blocks, box.x0), i1 = std::min(column + kRegion_blocks + 1, box.x1);
            const int j0 = std::max(row - kRegion_blocks, box.y0), j1 = std::min(row + kRegion_blocks + 1, box.y1);
            const Sums around = region_[at(i1, j1, pitch)] - region_[at(i0, j1, pitch)] - region_[at(i1, j0, pitch)] + region_[at(i0, j0, pitch)];
            float v[4];
            for (int k = 0; k < 4; ++k) v[k] = static_cast<float>(around[k]);
            // 2: one that is explained well; 1: what stands still, or, for what comes into the picture and cannot be asked, its rim.
            const auto side = [&](int dx, int dy) {
                int found = 0;
                for (int k = 1; k <= kStrip_blocks; ++k) {
                    const int x = column + k * dx, y = row + k * dy;
                    if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return std::max(found, arrives_[block] != 0 ? 1 : 0);
                    const std::size_t there = at(x, y, columns_);
                    if (strong_[there] != 0) return 2;
                    if (stands_[there] != 0) found = 1;
                }
                return found;
            };
            const auto between = [&](int a, int b) { return std::min(a, b) > 0 && std::max(a, b) > 1; };
            const bool contrary = arrives_[block] == 0 && weights_[block].left > kContrary * weights_[block].still;
            const bool explained = v[1] > 0 && Weight{v[0], v[1], v[2], v[3], true}.explains(kRegion);
            believed_[block] = explained || (!contrary && (between(side(-1, 0), side(1, 0)) || between(side(0, -1), side(0, 1))));
            doubted -= believed_[block];
        }
    }
    return doubted > 0;
}

bool Judgement::weigh(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept {
    std::atomic<std::size_t> next{0};
    const auto workers = static_cast<int>(scratch_.size());
    const int chunk = (job.tiles->rows + workers - 1) / workers;
    pool.run(job.tiles->rows, chunk, [&](int row0, int row1) {
        Scratch& s = scratch_[next.fetch_add(1, std::memory_order_relaxed) % scratch_.size()];
        weigh_tiles(job, row0, row1, kernels, s);
    });
    return decide();
}

void Judgement::keep(const Job& job, ThreadPool& pool) noexcept {
    const ConstImage& near = *job.near;
    const int bytes = bytes_per_pixel(near.format);
    pool.run(rows_, 8, [&](int row0, int row1) {
        for (int row = row0; row < row1; ++row)
            for (int column = 0; column < columns_; ++column) {
                if (believed_[at(column, row, columns_)] != 0) continue;
                const int x0 = column * kBlockPx, x1 = std::min(x0 + kBlockPx, near.width_px);
                for (int y = row * kBlockPx; y < std::min((row + 1) * kBlockPx, near.height_px); ++y)
                    std::memcpy(job.output->row(y) + static_cast<std::ptrdiff_t>(x0) * bytes, near.row(y) + static_cast<std::ptrdiff_t>(x0) * bytes, static_cast<std::size_t>((x1 - x0) * bytes));
            }
    });
}

}  // namespace fovea::render::extrapolation
