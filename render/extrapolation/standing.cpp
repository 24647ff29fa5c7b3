#include "render/extrapolation/standing.hpp"

#include <bit>
#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr float kMoves_px = 0.75f;     // per frame, along an axis: slower, the two edges are not told apart
constexpr int kNear_tiles = 2;         // from the rim to a tile that stands still with all around it
constexpr int kBack_px = 16;           // as far as a field is smoothed
constexpr int kBeyond_px = 4;          // that stand still as well where a standing surface is, and not a spot of one colour
constexpr float kClearly = 1.5f;       // how much more contrast at the edge than one motion further back
constexpr float kLeast = 4.0f;         // levels of 255, over four channels, per pixel asked
constexpr float kFewest = 8;           // pixels: fewer do not decide
constexpr std::uint32_t kEveryOther = 0xaaaaaaaau;   // pixel along an edge is asked where cells are larger than 2 pixels, away from a gaze

std::size_t at(int x, int y, int width) noexcept { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }

bool same(const ConstImage& a, const ConstImage& b, int x, int y) noexcept {
    const int bytes = bytes_per_pixel(a.format);
    const std::byte *p = a.row(y) + static_cast<std::ptrdiff_t>(x) * bytes, *q = b.row(y) + static_cast<std::ptrdiff_t>(x) * bytes;
    if (bytes == 4) {
        std::uint32_t m, n;
        std::memcpy(&m, p, 4);
        std::memcpy(&n, q, 4);
        return m == n;
    }
    return std::memcmp(p, q, static_cast<std::size_t>(bytes)) == 0;
}

// Which pixels of a tile, and of those around it, are equal in both sources; beyond the picture nothing is. Bit i of row j is the
// pixel (x0 - 1 + i, y0 - 1 + j).
struct Mask {
    static constexpr int kEdge = kTilePx + 2;
    static constexpr std::uint32_t kOwn = ((1u << kTilePx) - 1) << 1;   // the tile's own columns
    std::uint32_t same[kEdge];
    bool any = false, all = true;   // of them are

    Mask(const ConstImage& a, const ConstImage& b, int x0, int y0) noexcept {
        const int bytes = bytes_per_pixel(a.format);
        if (bytes == 4 && x0 > 0 && y0 > 0 && x0 + kTilePx < a.width_px && y0 + kTilePx < a.height_px) {
            std::uint32_t most = 0, least = ~0u;
            for (int j = 0; j < kEdge; ++j) {
                same[j] = equal_pixels(a.row(y0 - 1 + j) + static_cast<std::ptrdiff_t>(4) * (x0 - 1), b.row(y0 - 1 + j) + static_cast<std::ptrdiff_t>(4) * (x0 - 1));
                most |= same[j];
                least &= same[j];
            }
            any = most != 0;
            all = least == (1u << kEdge) - 1;
            return;
        }
        for (int j = 0; j < kEdge; ++j) {
            same[j] = 0;
            for (int i = 0; i < kEdge; ++i) {
                const int x = x0 - 1 + i, y = y0 - 1 + j;
                if (x < 0 || y < 0 || x >= a.width_px || y >= a.height_px) continue;
                const bool equal = extrapolation::same(a, b, x, y);
                same[j] |= (equal ? 1u : 0u) << i;
                any = any || equal;
                all = all && equal;
            }
        }
    }

private:
    // Of the kEdge pixels of 4 bytes at p and q.
    static std::uint32_t equal_pixels(const std::byte* p, const std::byte* q) noexcept {
        typedef std::int32_t I4 __attribute__((vector_size(16)));
        constexpr int kLanes = 4;
        I4 bits{};
        for (int i = 0; i + kLanes <= kEdge; i += kLanes) {
            I4 m, n;
            std::memcpy(&m, p + 4 * i, sizeof m);
            std::memcpy(&n, q + 4 * i, sizeof n);
            bits |= (m == n) & (I4{1, 2, 4, 8} << i);
        }
        std::uint32_t equal = static_cast<std::uint32_t>((bits[0] | bits[1]) | (bits[2] | bits[3]));
        for (int i = kEdge / kLanes * kLanes; i < kEdge; ++i) {
            std::uint32_t m, n;
            std::memcpy(&m, p + 4 * i, 4);
            std::memcpy(&n, q + 4 * i, 4);
            equal |= (m == n ? 1u : 0u) << i;
        }
        return equal;
    }
};

// The most that two pixels in a row differ by, over four channels, of those from `beside` + 1 before (x, y) to `beside` beyond, on
// the way (dx, dy).
template <class Channel>
float contrast(const Gatherable& g, int x, int y, int dx, int dy, int beside) noexcept {
    const std::uint8_t* at_pixel = g.pixels + y * g.row_bytes + static_cast<std::ptrdiff_t>(4 * sizeof(Channel)) * x;
    const std::ptrdiff_t step = dy * g.row_bytes + static_cast<std::ptrdiff_t>(4 * sizeof(Channel)) * dx;
    if constexpr (sizeof(Channel) == 1) {
        typedef std::uint8_t B16 __attribute__((vector_size(16)));
        typedef std::uint32_t U4 __attribute__((vector_size(16)));
        std::uint32_t p[4];   // one and the same where fewer are asked for
        for (int k = 0; k < 4; ++k) std::memcpy(&p[k], at_pixel + std::clamp(k - 2, -beside - 1, beside) * step, 4);
        const U4 before{p[0], p[1], p[2], 0}, after{p[1], p[2], p[3], 0};
        const B16 a = reinterpret_cast<B16>(before), b = reinterpret_cast<B16>(after);
        const B16 apart = (a > b ? a : b) - (a > b ? b : a);
        const U4 pairs = (reinterpret_cast<U4>(apart) & 0xff00ffu) + (reinterpret_cast<U4>(apart) >> 8 & 0xff00ffu), sum = (pairs & 0xffffu) + (pairs >> 16);
        return static_cast<float>(std::max(std::max(sum[0], sum[1]), sum[2]));
    } else {
        float most = 0;
        for (int k = -beside; k <= beside; ++k) {
            Channel a[4], b[4];
            std::memcpy(a, at_pixel + k * step, sizeof a);
            std::memcpy(b, at_pixel + (k - 1) * step, sizeof b);
            float sum = 0;
            for (int c = 0; c < 4; ++c) {   // light of any range
                const float apart = std::fabs(a[c] - b[c]) * (255.0f / std::max(std::max(std::fabs(a[c]), std::fabs(b[c])), 1e-3f));
                sum += apart < 255.0f ? apart : 255.0f;
            }
            most = std::max(most, sum);
        }
        return most;
    }
}

}  // namespace

void StandingRims::resize(int columns, int rows) {
    columns_ = columns;
    rows_ = rows;
    candidate_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
    sure_ = candidate_;
    votes_.assign(candidate_.size(), {});
}

bool StandingRims::find(const Job& job) noexcept {
    if (job.tiles->still_count == 0) return false;
    // Tiles of one colour stand still for sure only where many do: the bricks of a wall that moves are of one colour too.
    const auto around = [&](int column, int row, int by, const auto& holds) {
        for (int j = std::max(row - by, 0); j <= std::min(row + by, rows_ - 1); ++j)
            for (int i = std::max(column - by, 0); i <= std::min(column + by, columns_ - 1); ++i)
                if (holds(i, j)) return true;
        return false;
    };
    // Only what is moved into can be a candidate.
    const auto tiles_of = [](const Gather::Layer& l) {
        const int per_tile = kTilePx / std::max(l.cell_px, 1);
        const Box& b = l.touched;
        return Box{b.x0 / per_tile, b.y0 / per_tile, (b.x1 + per_tile - 1) / per_tile, (b.y1 + per_tile - 1) / per_tile};
    };
    const Box all = tiles_of(job.all), fine = tiles_of(job.fovea);
    const Box moved = fine.x1 <= fine.x0 ? all : Box{std::min(all.x0, fine.x0), std::min(all.y0, fine.y0), std::max(all.x1, fine.x1), std::max(all.y1, fine.y1)};
    std::fill(candidate_.begin(), candidate_.end(), std::uint8_t{0});
    bool stands = false;
    const Box near = moved.grown(kNear_tiles, columns_, rows_);
    for (int row = near.y0; row < near.y1; ++row) {
        const std::uint8_t* still = job.tiles->still.data();
        const std::uint8_t *above = still + at(0, std::max(row - 1, 0), columns_), *own = still + at(0, row, columns_), *below = still + at(0, std::min(row + 1, rows_ - 1), columns_);
        const auto three = [&](int column) { return above[column] != 0 && own[column] != 0 && below[column] != 0; };
        bool left = three(std::max(near.x0 - 1, 0)), here = three(near.x0);
        for (int column = near.x0; column < near.x1; ++column) {
            const bool right = three(std::min(column + 1, columns_ - 1)), sure = left && here && right;
            sure_[at(column, row, columns_)] = sure;
            stands = stands || sure;
            left = here;
            here = right;
        }
    }
    if (!stands) return false;
    bool any = false;
    for (int row = moved.y0; row < std::min(moved.y1, rows_); ++row)
        for (int column = moved.x0; column < std::min(moved.x1, columns_); ++column) {
            const std::size_t tile = at(column, row, columns_);
            if (job.stays[tile] != 0) continue;
            votes_[tile] = {};
            const Gather::Layer& layer = job.layer_of(column, row);
            const int per_tile = kTilePx / layer.cell_px;
            const Field& f = *layer.displacement;
            const Box& touched = layer.touched;   // beyond, all is 0
            const int i0 = std::max(column * per_tile, touched.x0), i1 = std::min((column + 1) * per_tile, touched.x1);
            for (int y = std::max(row * per_tile, touched.y0); y < std::min((row + 1) * per_tile, touched.y1) && candidate_[tile] == 0; ++y) {
                const float *u = f.u.data() + at(0, y, f.width), *v = f.v.data() + at(0, y, f.width);
                for (int x = i0; x < i1; ++x) candidate_[tile] |= static_cast<std::uint8_t>((u[x] != 0) | (v[x] != 0));
            }
            if (candidate_[tile] == 0) continue;
            candidate_[tile] = around(column, row, kNear_tiles, [&](int i, int j) { return sure_[at(i, j, columns_)] != 0; });
            any = any || candidate_[tile] != 0;
        }
    return any;
}

template <class Channel>
void StandingRims::vote(const Job& job, int column, int row) noexcept {
    const ConstImage &near = *job.near, &far = *job.far;
    const Gather::Layer& layer = job.layer_of(column, row);
    const Field& f = *layer.displacement;
    const int w = near.width_px, h = near.height_px, q = layer.cell_px, shift = q == 2 ? 1 : q == 4 ? 2 : 3;
    Votes& votes = votes_[at(column, row, columns_)];
    if (sure_[at(column, row, columns_)] != 0) return;   // no edge is there
    const Mask mask(near, far, column * kTilePx, row * kTilePx);
    if (!mask.any || mask.all) return;
    const auto inside = [&](int x, int y) { return x >= 0 && y >= 0 && x < w && y < h; };
    const float per_step = -1.0f / job.step;
    // Motion is smoothed at its edges: the most, as many pixels back, that goes this way or comes from here.
    struct Mover {
        bool asked = false, moves = false, leads = false;
        int x = 0, y = 0, beside = 0;   // whole pixels per frame
    };
    const auto mover = [&](int x, int y, int dx, int dy) {
        Mover m{.asked = true};
        float mx = 0, my = 0, most = kMoves_px;
        for (int k = 0; k <= kBack_px && inside(x - k * dx, y - k * dy); k += q) {
            const std::size_t cell = at((x - k * dx) >> shift, (y - k * dy) >> shift, f.width);
            const float u = f.u[cell] * per_step, v = f.v[cell] * per_step, along = u * static_cast<float>(dx) + v * static_cast<float>(dy);
            if (!(std::fabs(along) > most)) continue;
            most = std::fabs(along);
            m.leads = along > 0;
            mx = u;
            my = v;
        }
        m.moves = most > kMoves_px;
        m.x = static_cast<int>(std::lround(m.leads ? mx : -mx));
        m.y = static_cast<int>(std::lround(m.leads ? my : -my));
        m.beside = most > 3 ? 1 : 0;
        return m;
    };
    // All pixels of a cell have the same, but for those so near to the picture's edge that the way back ends there.
    const bool same_in_cell = column > 0 && row > 0 && (column + 2) * kTilePx <= w && (row + 2) * kTilePx <= h;
    Mover known[4][kTilePx];   // of a row of cells
    // Pixel (x, y) stands still, and the one before it, on the way (dx, dy), does not.
    const auto ask = [&](int x, int y, int way, int dx, int dy) {
        Mover& m = known[way][(x - column * kTilePx) >> shift];
        if (!m.asked || !same_in_cell) m = mover(x, y, dx, dy);
        if (!m.moves) return;
        // Where content comes in, all is the other way round: a thing that moves has its contrast one motion ahead in the nearer source.
        const Gatherable& shown = m.leads ? *job.far_source : *job.near_source;
        const int bx = m.x, by = m.y, beside = m.beside;
        // Of three pixels each: where the motion is a fraction off, and an edge mixed, it lies beside.
        const int px = x - bx, py = y - by, to = beside, from = beside + 1;
        if (!inside(x + to * dx, y + to * dy) || !inside(x - from * dx, y - from * dy) || !inside(px + to * dx, py + to * dy) || !inside(px - from * dx, py - from * dy)) return;
        votes.here += contrast<Channel>(shown, x, y, dx, dy, beside);
        votes.back += contrast<Channel>(shown, px, py, dx, dy, beside);
        votes.pixels += 1;
    };
    const bool coarse = q > 2;
    const std::uint32_t columns_asked = coarse ? Mask::kOwn & kEveryOther : Mask::kOwn;
    for (int j = 1; j <= kTilePx; ++j) {
        if ((j - 1) % q == 0)
            for (auto& way : known)
                for (int i = 0; i < kTilePx >> shift; ++i) way[i].asked = false;
        const std::uint32_t here = mask.same[j] & Mask::kOwn, across = coarse && j % 2 == 0 ? 0 : here, along = here & columns_asked;
        const struct {
            int dx, dy;
            std::uint32_t edge;   // of its pixels: the one before does not stand still
        } ways[4] = {{1, 0, across & ~(mask.same[j] << 1)}, {-1, 0, across & ~(mask.same[j] >> 1)}, {0, 1, along & ~mask.same[j - 1]}, {0, -1, along & ~mask.same[j + 1]}};
        for (std::uint32_t left = (ways[0].edge | ways[1].edge) | (ways[2].edge | ways[3].edge); left != 0; left &= left - 1) {
            const int i = std::countr_zero(left), x = column * kTilePx + i - 1, y = row * kTilePx + j - 1;
            for (int k = 0; k < 4; ++k)
                if ((ways[k].edge >> i & 1u) != 0 && inside(x - ways[k].dx, y - ways[k].dy)) ask(x, y, k, ways[k].dx, ways[k].dy);
        }
    }
}

void StandingRims::run(const Job& job) noexcept {
    const bool floats = is_float(job.near->format);
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column) {
            if (candidate_[at(column, row, columns_)] == 0) continue;
            if (floats) vote<float>(job, column, row);
            else vote<std::uint8_t>(job, column, row);
        }
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column) {
            if (candidate_[at(column, row, columns_)] == 0) continue;
            Votes sum{};
            for (int j = std::max(row - 1, 0); j <= std::min(row + 1, rows_ - 1); ++j)
                for (int i = std::max(column - 1, 0); i <= std::min(column + 1, columns_ - 1); ++i) {
                    if (candidate_[at(i, j, columns_)] == 0) continue;
                    const Votes& v = votes_[at(i, j, columns_)];
                    sum.here += v.here;
                    sum.back += v.back;
                    sum.pixels += v.pixels;
                }
            if (!(sum.pixels >= kFewest && sum.here > kClearly * sum.back + kLeast * sum.pixels)) continue;
            keep(job, column, row);
        }
}

// Of a tile at a window's rim: what stands still stays, and comes along with nothing.
void StandingRims::keep(const Job& job, int column, int row) noexcept {
    const ConstImage &near = *job.near, &far = *job.far;
    const Gather::Layer& layer = job.layer_of(column, row);
    const Field& f = *layer.displacement;
    const int w = near.width_px, h = near.height_px, q = layer.cell_px, bytes = bytes_per_pixel(near.format);
    for (int y = row * kTilePx; y < std::min((row + 1) * kTilePx, h); ++y)
        for (int x = column * kTilePx; x < std::min((column + 1) * kTilePx, w); ++x) {
            bool stays = same(near, far, x, y);
            const std::size_t cell = at(x / q, y / q, f.width);
            const float u = f.u[cell], v = f.v[cell], longest = std::max(std::fabs(u), std::fabs(v));
            if (!stays && longest > 0) {   // not only an even spot of the content: all the way on
                stays = true;
                for (int k = 0; k < kBeyond_px && stays; ++k) {
                    const float part = 1.0f + static_cast<float>(k) / longest;
                    const int sx = static_cast<int>(std::lround(static_cast<float>(x) + u * part)), sy = static_cast<int>(std::lround(static_cast<float>(y) + v * part));
                    stays = sx >= 0 && sy >= 0 && sx < w && sy < h && same(near, far, sx, sy);
                }
            }
            if (!stays) continue;
            const std::ptrdiff_t at_pixel = static_cast<std::ptrdiff_t>(x) * bytes;
            std::memcpy(job.output->row(y) + at_pixel, near.row(y) + at_pixel, static_cast<std::size_t>(bytes));
        }
}

}  // namespace fovea::render::extrapolation
