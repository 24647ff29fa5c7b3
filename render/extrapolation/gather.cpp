#include "render/extrapolation/gather.hpp"

#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

void Gather::resize(int width_px, int height_px, Format format, int threads) {
    stays_.assign(static_cast<std::size_t>((width_px + kTilePx - 1) / kTilePx) * static_cast<std::size_t>((height_px + kTilePx - 1) / kTilePx), 0);
    scratch_.resize(static_cast<std::size_t>(threads));
    for (auto& s : scratch_) {
        const auto width = static_cast<std::size_t>(width_px);
        s.dx.assign(width + kExpandPad + 64, 0);
        s.dy = s.dx;
        s.row_u.assign(width + 2 * kExpandPad, 0.0f);
        s.row_v = s.row_u;
        const bool own = format == Format::rgba8 || format == Format::rgba32f;
        s.packed.assign(own ? 0 : width * (is_float(format) ? 16 : 4), 0);
        s.second.assign(width * (is_float(format) ? 16 : 4), 0);
        s.how.assign(width, kFirstOnly);
    }
}

// How the two sources meet in a row whose displacement in the farther one is in the scratch. False: only the nearer counts.
bool Gather::how_row(const Job& job, int y, int x0, int x1, Scratch& s) noexcept {
    const int q = job.all.cell_px, w = job.near->width_px, h = job.near->height_px;
    const std::uint8_t* cells = job.sources->data() + static_cast<std::ptrdiff_t>(y / q) * job.far_displacement->width;
    const std::int32_t *dx = s.dx.data() + kExpandPad, *dy = s.dy.data() + kExpandPad;
    std::int32_t* how = s.how.data();
    const auto judge = [&](const auto& source_of) {
        const auto right = static_cast<std::uint32_t>((w - 1) * 256), bottom = static_cast<std::uint32_t>((h - 1) * 256);
        std::int32_t any = 0;
        for (int x = x0; x < x1; ++x) {   // without a branch: several at once
            const auto fx = static_cast<std::uint32_t>(dx[x] + x * 256), fy = static_cast<std::uint32_t>(dy[x] + y * 256);
            const std::int32_t inside = -static_cast<std::int32_t>((fx <= right) & (fy <= bottom));
            how[x] = static_cast<std::int32_t>(source_of(x)) & inside;
            any |= how[x];
        }
        return any != 0;
    };
    static_assert(kFirstOnly == 0);
    return q == 1 ? judge([&](int x) { return cells[x]; }) : judge([&](int x) { return cells[x / q]; });
}

void Gather::displacement_row(const Field& f, int q, int y, int x0, int x1, const Kernels& kernels, std::int32_t* dx, std::int32_t* dy, float* row_u, float* row_v) noexcept {
    if (q == 1) {
        const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) * f.width + x0;
        kernels.fix(f.u.data() + row, dx + x0, x1 - x0);
        kernels.fix(f.v.data() + row, dy + x0, x1 - x0);
        return;
    }
    // Twice the position in cells, from the centre of cell 0: (2y + 1 - q) / q halves.
    const int twice = 2 * y + 1 - q, j0 = std::clamp(twice < 0 ? -1 : twice / (2 * q), 0, f.height - 1), j1 = std::min(j0 + (twice < 0 ? 0 : 1), f.height - 1);
    const float fy = twice < 0 ? 0.0f : static_cast<float>(twice - 2 * q * j0) / static_cast<float>(2 * q);
    const int c0 = std::max(x0 / q - 1, 0), c1 = std::min((x1 - 1) / q + 2, f.width);
    const std::ptrdiff_t a = static_cast<std::ptrdiff_t>(j0) * f.width, b = static_cast<std::ptrdiff_t>(j1) * f.width;
    kernels.expand({f.u.data() + a, f.v.data() + a, f.u.data() + b, f.v.data() + b, fy, q, c0, c1, x0, x1, row_u, row_v, dx, dy});
}

bool Gather::nothing_moves_into(const Layer& layer, int column, int row, int height_px) noexcept {
    const Field& f = *layer.displacement;
    const int q = layer.cell_px, y0 = row * kTilePx, y1 = std::min(y0 + kTilePx, height_px);
    const int i0 = column * kTilePx / q, i1 = std::min(((column + 1) * kTilePx + q - 1) / q, f.width), j0 = y0 / q, j1 = std::min((y1 + q - 1) / q, f.height);
    if (i0 >= layer.touched.x1 || i1 <= layer.touched.x0 || j0 >= layer.touched.y1 || j1 <= layer.touched.y0) return true;
    for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) {
            const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(f.width) + static_cast<std::size_t>(i);
            if (f.u[at] != 0 || f.v[at] != 0) return false;
        }
    return true;
}

void Gather::run(const Job& job, const Kernels& kernels, ThreadPool& pool) noexcept {
    const ConstImage& near = *job.near;
    const bool floats = is_float(near.format), own = near.format == Format::rgba8 || near.format == Format::rgba32f;
    const int pixel = bytes_per_pixel(near.format);
    std::atomic<std::size_t> next{0};
    const auto workers = static_cast<int>(scratch_.size());
    const int chunk = (job.tiles->rows + workers - 1) / workers;
    pool.run(job.tiles->rows, chunk, [&](int row0, int row1) {
        Scratch& s = scratch_[next.fetch_add(1, std::memory_order_relaxed) % scratch_.size()];
        std::int32_t *dx = s.dx.data() + kExpandPad, *dy = s.dy.data() + kExpandPad;
        float *row_u = s.row_u.data() + kExpandPad, *row_v = s.row_v.data() + kExpandPad;
        for (int row = row0; row < row1; ++row) {
            const int y0 = row * kTilePx, y1 = std::min(y0 + kTilePx, near.height_px);
            const Box& fovea = job.fovea_tiles;
            const auto layer_of = [&](int c) { return row >= fovea.y0 && row < fovea.y1 && c >= fovea.x0 && c < fovea.x1 ? &job.fovea : &job.all; };
            const auto cubic_there = [&](int c) {
                if (!job.cubic || job.gaze == nullptr) return job.cubic;
                const float gaze_x = static_cast<float>(c * kTilePx + kTilePx / 2) - job.gaze->x_px, gaze_y = static_cast<float>(y0 + kTilePx / 2) - job.gaze->y_px;
                return !(gaze_x * gaze_x + gaze_y * gaze_y > job.gaze->full_radius_px * job.gaze->full_radius_px);
            };
            std::uint8_t* stays = stays_.data() + static_cast<std::ptrdiff_t>(row) * job.tiles->columns;
            for (int column = 0; column < job.tiles->columns; ++column) stays[column] = job.tiles->is_still(column, row) && nothing_moves_into(*layer_of(column), column, row, near.height_px);
            for (int column = 0; column < job.tiles->columns;) {
                const Layer* layer = layer_of(column);
                const bool still = stays[column] != 0, cubic = cubic_there(column);
                int end = column + 1;
                while (end < job.tiles->columns && layer_of(end) == layer && (stays[end] != 0) == still && (still || cubic_there(end) == cubic)) ++end;
                const int x0 = column * kTilePx, x1 = std::min(end * kTilePx, near.width_px);
                column = end;
                if (still) continue;
                const auto from = static_cast<std::ptrdiff_t>(x0) * pixel;
                for (int y = y0; y < y1; ++y) {
                    std::byte* out = job.output->row(y) + from;
                    displacement_row(*layer->displacement, layer->cell_px, y, x0, x1, kernels, dx, dy, row_u, row_v);
                    void* to = own ? static_cast<void*>(out) : s.packed.data();
                    const auto warp = floats ? (cubic ? kernels.warp_float_cubic : kernels.warp_float_linear) : (cubic ? kernels.warp_rgba8_cubic : kernels.warp_rgba8_linear);
                    warp({job.source->pixels, job.source->row_bytes, near.width_px, near.height_px, y, x0, x1, dx, dy, to, job.source->finite});
                    if (job.far_source != nullptr) {
                        displacement_row(*job.far_displacement, layer->cell_px, y, x0, x1, kernels, dx, dy, row_u, row_v);
                        if (how_row(job, y, x0, x1, s)) {
                            const Gatherable& far = *job.far_source;
                            warp({far.pixels, far.row_bytes, near.width_px, near.height_px, y, x0, x1, dx, dy, s.second.data(), far.finite});
                            (floats ? kernels.blend_float : kernels.blend_rgba8)({to, s.second.data(), s.how.data() + x0, x1 - x0, job.light != nullptr ? job.light->differences(x0, y) : nullptr});
                        }
                    }
                    if (!own) pack_row(s.packed.data(), near.format, x1 - x0, out);
                }
            }
        }
    });
}

}  // namespace fovea::render::extrapolation
