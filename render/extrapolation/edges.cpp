#include "render/extrapolation/edges.hpp"

#include <atomic>
#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr float kEdge_px = 0.7f;     // neighbouring cells displaced this far apart belong to different surfaces
constexpr int kAround = 2;           // cells on either side of an edge that it may be off by
constexpr int kMostEdges = 16;       // a field with more than this part of edges is noise, and has no surfaces to tell apart
constexpr float kClearly = 6.0f;     // levels of 255, over four channels: closer than this, the sources do not decide

std::size_t at(int x, int y, int width) noexcept { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }

int round_int(float v) noexcept {
    const float shifted = v + 0.5f;
    const int i = static_cast<int>(shifted);
    return i - (static_cast<float>(i) > shifted ? 1 : 0);
}

typedef float V4 __attribute__((vector_size(16)));
typedef std::int32_t I4 __attribute__((vector_size(16)));

V4 four_channels(const std::uint8_t* p) noexcept {
    typedef std::uint8_t B4 __attribute__((vector_size(4)));
    B4 bytes;
    std::memcpy(&bytes, p, sizeof bytes);
    return __builtin_convertvector(bytes, V4);
}
V4 four_channels(const float* p) noexcept {
    V4 v;
    std::memcpy(&v, p, sizeof v);
    return v;
}
V4 absolute(V4 v) noexcept { return reinterpret_cast<V4>(reinterpret_cast<I4>(v) & 0x7fffffff); }

template <class Channel>
struct Pair {
    const Gatherable *near, *far;
    int width, height;
    float per_step;

    [[nodiscard]] V4 pixel(const Gatherable& g, int x, int y) const noexcept {
        return four_channels(reinterpret_cast<const Channel*>(g.pixels + y * g.row_bytes) + static_cast<std::ptrdiff_t>(4) * x);
    }
    // How differently the nearer source's pixel (x, y) and the place it came from look, if (u, v) is its displacement.
    [[nodiscard]] float mismatch(int x, int y, float u, float v) const noexcept {
        const float fx = std::clamp(static_cast<float>(x) + u * per_step, 0.0f, static_cast<float>(width - 1));
        const float fy = std::clamp(static_cast<float>(y) + v * per_step, 0.0f, static_cast<float>(height - 1));
        const int ix = static_cast<int>(fx), iy = static_cast<int>(fy), jx = std::min(ix + 1, width - 1), jy = std::min(iy + 1, height - 1);
        const float px = fx - static_cast<float>(ix), py = fy - static_cast<float>(iy);
        const V4 a = pixel(*far, ix, iy), b = pixel(*far, jx, iy), c = pixel(*far, ix, jy), d = pixel(*far, jx, jy);
        const V4 upper = a + px * (b - a), lower = c + px * (d - c), was = upper + py * (lower - upper), is = pixel(*near, x, y);
        V4 apart = absolute(was - is);
        if constexpr (sizeof(Channel) > 1) {   // light of any range: in parts of the larger
            const V4 size_was = absolute(was), size_is = absolute(is), least = V4{} + 1e-3f;
            V4 size = size_was > size_is ? size_was : size_is;
            size = size > least ? size : least;
            apart *= 255.0f / size;
        }
        return (apart[0] + apart[1]) + (apart[2] + apart[3]);
    }
};

}  // namespace

void MotionEdges::resize(int width_cells, int height_cells, int width_px, Format format, int threads) {
    width_ = width_cells;
    height_ = height_cells;
    edge_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
    around_ = edge_;
    row_has_edge_.assign(static_cast<std::size_t>(height_), 0);
    scratch_.resize(static_cast<std::size_t>(threads));
    for (Scratch& s : scratch_) {
        s.sides.resize(static_cast<std::size_t>(width_));
        s.dx.assign(static_cast<std::size_t>(width_px) + 16, 0);
        s.dy = s.dx;
        s.packed.assign(static_cast<std::size_t>(width_px) * (is_float(format) ? 16 : 4), 0);
    }
}

bool MotionEdges::find(const Field& f, const Box& touched, const Gaze* gaze, int cell_px) noexcept {
    box_ = gaze == nullptr ? touched : touched.around(gaze->x_px, gaze->y_px, gaze->full_radius_px + 1, cell_px);
    int found = 0;
    for (int y = box_.y0; y < box_.y1; ++y) {
        const float *u = f.u.data() + at(0, y, width_), *v = f.v.data() + at(0, y, width_);
        const std::ptrdiff_t below = y + 1 < box_.y1 ? width_ : 0;
        std::uint8_t* edge = edge_.data() + at(0, y, width_);
        unsigned any = 0;
        for (int x = box_.x0; x + 1 < box_.x1; ++x) {
            const float across = std::max(std::fabs(u[x + 1] - u[x]), std::fabs(v[x + 1] - v[x]));
            const float down = std::max(std::fabs(u[x + below] - u[x]), std::fabs(v[x + below] - v[x]));
            const unsigned is = std::max(across, down) >= kEdge_px ? 1u : 0u;
            edge[x] = static_cast<std::uint8_t>(is);
            any += is;
        }
        if (box_.x1 > box_.x0) edge[box_.x1 - 1] = 0;
        row_has_edge_[static_cast<std::size_t>(y)] = any != 0;
        found += static_cast<int>(any);
    }
    return found > 0 && found <= width_ * height_ / kMostEdges;
}

void MotionEdges::row_of_cells(const Job& job, int row, std::uint8_t* decide, const Kernels& kernels, Scratch& s) const noexcept {
    const Field& f = *job.displacement;
    const int q = job.cell_px, w = job.near->width_px, h = job.near->height_px;
    const bool floats = is_float(job.near->format), own = job.near->format == Format::rgba8 || job.near->format == Format::rgba32f;
    const int pixel = bytes_per_pixel(job.near->format);
    const int j0 = std::max(row - kAround, box_.y0), j1 = std::min(row + kAround + 1, box_.y1);
    // Which two motions meet at each cell.
    for (int i = box_.x0; i < box_.x1; ++i) {
        if (decide[i] == 0) continue;
        decide[i] = 0;
        if (job.gaze != nullptr) {
            const float dx = static_cast<float>(i * q) - job.gaze->x_px, dy = static_cast<float>(row * q) - job.gaze->y_px;
            if (dx * dx + dy * dy > job.gaze->full_radius_px * job.gaze->full_radius_px) continue;
        }
        const int i0 = std::max(i - kAround, box_.x0), i1 = std::min(i + kAround + 1, box_.x1);
        float most = -1, least = 0;
        std::size_t in_front = 0, behind = 0;
        for (int y = j0; y < j1; ++y)
            for (int x = i0; x < i1; ++x) {
                const std::size_t cell = at(x, y, width_);
                const float front = job.front[cell];
                if (!(front >= 0)) continue;
                if (most < 0 || front < least) {
                    least = front;
                    behind = cell;
                }
                if (front > most) {
                    most = front;
                    in_front = cell;
                }
            }
        if (most < 0) continue;
        const Sides sides{f.u[in_front], f.v[in_front], f.u[behind], f.v[behind]};
        if (std::fabs(sides.front_u - sides.back_u) < kEdge_px && std::fabs(sides.front_v - sides.back_v) < kEdge_px) continue;
        s.sides[static_cast<std::size_t>(i)] = sides;
        decide[i] = 1;
    }
    const auto warp = floats ? (job.cubic ? kernels.warp_float_cubic : kernels.warp_float_linear) : (job.cubic ? kernels.warp_rgba8_cubic : kernels.warp_rgba8_linear);
    const auto rewrite = [&](int y, int x0, int x1) {
        std::byte* out = job.output->row(y) + static_cast<std::ptrdiff_t>(x0) * pixel;
        void* to = own ? static_cast<void*>(out) : s.packed.data();
        warp({job.source->pixels, job.source->row_bytes, w, h, y, x0, x1, s.dx.data(), s.dy.data(), to, job.source->finite});
        if (!own) pack_row(s.packed.data(), job.near->format, x1 - x0, out);
    };
    const auto decide_pixels = [&](const auto& pair) {
        for (int y = row * q; y < std::min((row + 1) * q, h); ++y) {
            int begin = -1;   // of the run of pixels that a side was chosen for
            int i = box_.x0;
            for (; i < box_.x1; ++i) {
                if (decide[i] == 0) {
                    if (begin >= 0) rewrite(y, begin, i * q);
                    begin = -1;
                    continue;
                }
                const Sides& sides = s.sides[static_cast<std::size_t>(i)];
                const int fx = round_int(sides.front_u), fy = round_int(sides.front_v), bx = round_int(sides.back_u), by = round_int(sides.back_v);
                for (int x = i * q; x < std::min((i + 1) * q, w); ++x) {
                    const int ax = std::clamp(x + fx, 0, w - 1), ay = std::clamp(y + fy, 0, h - 1);
                    float u = sides.front_u, v = sides.front_v;
                    bool chosen = pair.mismatch(ax, ay, sides.front_u, sides.front_v) + kClearly < pair.mismatch(ax, ay, sides.back_u, sides.back_v);
                    if (!chosen) {
                        const int cx = std::clamp(x + bx, 0, w - 1), cy = std::clamp(y + by, 0, h - 1);
                        chosen = pair.mismatch(cx, cy, sides.back_u, sides.back_v) + kClearly < pair.mismatch(cx, cy, sides.front_u, sides.front_v);
                        u = sides.back_u;
                        v = sides.back_v;
                    }
                    if (!chosen) {
                        if (begin >= 0) rewrite(y, begin, x);
                        begin = -1;
                        continue;
                    }
                    if (begin < 0) begin = x;
                    s.dx[static_cast<std::size_t>(x)] = round_int(u * 256.0f);
                    s.dy[static_cast<std::size_t>(x)] = round_int(v * 256.0f);
                }
            }
            if (begin >= 0) rewrite(y, begin, std::min(i * q, w));
        }
    };
    if (floats)
        decide_pixels(Pair<float>{job.source, job.far_source, w, h, 1.0f / job.step});
    else
        decide_pixels(Pair<std::uint8_t>{job.source, job.far_source, w, h, 1.0f / job.step});
}

void MotionEdges::run(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept {
    std::atomic<std::size_t> next{0};
    const int rows = box_.y1 - box_.y0, chunk = (rows + static_cast<int>(scratch_.size()) - 1) / static_cast<int>(scratch_.size());
    pool.run(rows, chunk, [&](int row0, int row1) {
        Scratch& s = scratch_[next.fetch_add(1, std::memory_order_relaxed) % scratch_.size()];
        for (int row = box_.y0 + row0; row < box_.y0 + row1; ++row) {
            bool any = false;
            const int j0 = std::max(row - kAround, box_.y0), j1 = std::min(row + kAround + 1, box_.y1);
            for (int j = j0; j < j1; ++j) any = any || row_has_edge_[static_cast<std::size_t>(j)] != 0;
            if (!any) continue;
            std::uint8_t* around = around_.data() + at(0, row, width_);
            std::fill(around + box_.x0, around + box_.x1, std::uint8_t{0});
            for (int j = j0; j < j1; ++j) {
                if (row_has_edge_[static_cast<std::size_t>(j)] == 0) continue;
                const std::uint8_t* edge = edge_.data() + at(0, j, width_);
                for (int x = box_.x0; x < box_.x1; ++x) {
                    if (edge[x] == 0) continue;
                    for (int k = std::max(x - kAround, box_.x0); k <= std::min(x + kAround + 1, box_.x1 - 1); ++k) around[k] = 1;
                }
            }
            row_of_cells(job, row, around, kernels, s);
        }
    });
}

}  // namespace fovea::render::extrapolation
