// The gather. Included inside a namespace per code path.
//
// Two 8-bit channels ride in one 32-bit lane as two 16-bit numbers.

FOVEA_INLINE bool any8(const I8& mask) {
    struct Halves { L2 lo, hi; };
    Halves h;
    __builtin_memcpy(&h, &mask, sizeof h);
    const L2 any = h.lo | h.hi;
    return (any[0] | any[1]) != 0;
}

struct Fixed {
    I8 x, y;          // whole pixels
    U8 fx, fy;        // 1/256, in both halves of the lane
    bool together;
};

FOVEA_INLINE void load_fixed(Fixed& f, const std::int32_t* dx, const std::int32_t* dy) {
    I8 x, y;
    __builtin_memcpy(&x, dx, sizeof x);
    __builtin_memcpy(&y, dy, sizeof y);
    f.x = x >> 8;
    f.y = y >> 8;
    const I8 mask_x = x & 255, mask_y = y & 255;
    f.fx = reinterpret_cast<U8>(mask_x);
    f.fy = reinterpret_cast<U8>(mask_y);
    f.fx |= f.fx << 16;
    f.fy |= f.fy << 16;
    const int x0 = f.x[0], y0 = f.y[0];
    const I8 other = (f.x ^ x0) | (f.y ^ y0);
    struct Halves { L2 lo, hi; };
    Halves h;
    __builtin_memcpy(&h, &other, sizeof h);
    const L2 any = h.lo | h.hi;
    f.together = (any[0] | any[1]) == 0;
}

FOVEA_INLINE bool stays8(const std::int32_t* dx, const std::int32_t* dy) {
    struct Halves { L2 lo, hi; };
    Halves x, y;
    __builtin_memcpy(&x, dx, sizeof x);
    __builtin_memcpy(&y, dy, sizeof y);
    const L2 any = (x.lo | x.hi) | (y.lo | y.hi);
    return (any[0] | any[1]) == 0;
}

FOVEA_INLINE void mul16(U8& v, const U8& w) {
    const H16 p = reinterpret_cast<H16>(v) * reinterpret_cast<H16>(w);
    v = reinterpret_cast<U8>(p);
}
FOVEA_INLINE void add16(U8& v, const U8& w) {
    const H16 p = reinterpret_cast<H16>(v) + reinterpret_cast<H16>(w);
    v = reinterpret_cast<U8>(p);
}
FOVEA_INLINE void shift16(U8& v, int bits) {
    const H16 p = reinterpret_cast<H16>(v) >> bits;
    v = reinterpret_cast<U8>(p);
}
FOVEA_INLINE void load_px(U8& rb, U8& ga, const std::uint8_t* p) {
    U8 v;
    __builtin_memcpy(&v, p, sizeof v);
    rb = v & 0xff00ffu;
    ga = (v >> 8) & 0xff00ffu;
}
// a*(256-f) + b*f, rounded back to 8 bits.
FOVEA_INLINE void mix16(U8& a, U8 b, const U8& f) {
    const U8 other = U8{} + 0x01000100u - f;
    U8 half = U8{} + 0x00800080u;
    mul16(a, other);
    mul16(b, f);
    add16(a, b);
    add16(a, half);
    shift16(a, 8);
}

FOVEA_INLINE std::uint32_t mix_scalar(std::uint32_t a, std::uint32_t b, std::uint32_t f) {
    const std::uint32_t rb = ((a & 0xff00ffu) * (256 - f) + (b & 0xff00ffu) * f + 0x800080u) >> 8 & 0xff00ffu;
    const std::uint32_t ga = ((a >> 8 & 0xff00ffu) * (256 - f) + (b >> 8 & 0xff00ffu) * f + 0x800080u) & 0xff00ff00u;
    return rb | ga;
}

FOVEA_INLINE std::uint32_t pixel(const WarpRow& row, int x, int y) {
    std::uint32_t v;
    __builtin_memcpy(&v, row.source + clamp(y, 0, row.height - 1) * row.source_stride + 4 * clamp(x, 0, row.width - 1), 4);
    return v;
}

// Eight pixels whose taps begin at p and at its neighbours.
FOVEA_INLINE void linear8(U8& v, const std::uint8_t* p, std::ptrdiff_t stride, const Fixed& f) {
    U8 rb, ga, rb1, ga1, rb2, ga2;
    load_px(rb, ga, p);
    load_px(rb1, ga1, p + 4);
    mix16(rb, rb1, f.fx);
    mix16(ga, ga1, f.fx);
    p += stride;
    load_px(rb1, ga1, p);
    load_px(rb2, ga2, p + 4);
    mix16(rb1, rb2, f.fx);
    mix16(ga1, ga2, f.fx);
    mix16(rb, rb1, f.fy);
    mix16(ga, ga1, f.fy);
    v = rb | ga << 8;
}
FOVEA_INLINE std::uint32_t linear1(const WarpRow& row, int sx, int sy, int fraction_x, int fraction_y) {
    const auto fx = static_cast<std::uint32_t>(fraction_x), fy = static_cast<std::uint32_t>(fraction_y);
    const std::uint32_t upper = mix_scalar(pixel(row, sx, sy), pixel(row, sx + 1, sy), fx);
    const std::uint32_t lower = mix_scalar(pixel(row, sx, sy + 1), pixel(row, sx + 1, sy + 1), fx);
    return mix_scalar(upper, lower, fy);
}

// Keys' cubic. Its slope at 1 is -0.6: measured over the scenes of `fovea tradeoff extrapolation` with their exact motion it
// keeps 0.1 dB more than Catmull-Rom's -0.5; -0.75 and six taps of Lanczos gain nothing beyond.
// With f from 0 to 1 between the middle taps: outer lobes -0.6 f (1-f)^2 and -0.6 f^2 (1-f), inner one 1 - 2.4 f^2 + 1.4 f^3.
// In 1/128, of f in 1/256, in 32 bits; the sum is 128. For one number or a vector of them: both give the same.
template <class T>
__attribute__((always_inline)) constexpr void cubic_lobes(const T& f, T (&w)[4]) {
    const T g = 256u - f, fg = f * g, half = f - f + (1u << 23);
    constexpr std::uint32_t kOuter = 1229, kSquare = 78643, kCube = 179;   // 0.6 * 128 * 16, 2.4 * 128 * 256, 1.4 * 128
    w[0] = 0u - ((((fg * g) >> 4) * kOuter + half) >> 24);
    w[3] = 0u - ((((fg * f) >> 4) * kOuter + half) >> 24);
    w[1] = 128u - ((f * f * (kSquare - kCube * f) + half) >> 24);
    w[2] = 128u - w[0] - w[1] - w[3];
}
struct CubicTable {
    std::int16_t w[256][4];
};
constexpr CubicTable make_cubic_table() {
    CubicTable t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t w[4] = {};
        cubic_lobes(i, w);
        for (int k = 0; k < 4; ++k) t.w[i][k] = static_cast<std::int16_t>(static_cast<std::int32_t>(w[k]));
    }
    return t;
}
static constexpr CubicTable kCubic = make_cubic_table();

// Sums run modulo 2^16 above this bias, so that undershoot stays positive: 4096 / 128 = 32 levels.
inline constexpr std::uint32_t kBias = (4096u + 64u) * 0x10001u, kBiasLevels = 32u * 0x10001u;

FOVEA_INLINE void clamp_levels(U8& v) {   // v: levels + 32 in 16 bits; back to 0 to 255
    typedef std::int16_t T16 __attribute__((vector_size(32)));
    T16 t = reinterpret_cast<T16>(v) - static_cast<std::int16_t>(32);
    t = t < 0 ? T16{} : t;
    t = t > 255 ? T16{} + static_cast<std::int16_t>(255) : t;
    v = reinterpret_cast<U8>(t);
}

FOVEA_INLINE void cubic_weights(U8 (&w)[4], const U8& f) {   // in both halves of the lane
    cubic_lobes<U8>(f & 255u, w);
    for (int k = 0; k < 4; ++k) w[k] = (w[k] & 0xffffu) | w[k] << 16;
}

static std::uint32_t cubic1(const WarpRow& row, int sx, int sy, int fx, int fy) {
    const std::int16_t *wx = kCubic.w[fx], *wy = kCubic.w[fy];
    int sum[4] = {};
    for (int r = 0; r < 4; ++r) {
        int across[4] = {};
        for (int k = 0; k < 4; ++k) {
            const std::uint32_t p = pixel(row, sx - 1 + k, sy - 1 + r);
            for (int c = 0; c < 4; ++c) across[c] += wx[k] * static_cast<int>(p >> (8 * c) & 255);
        }
        for (int c = 0; c < 4; ++c) sum[c] += wy[r] * ((across[c] + 64) >> 7);
    }
    std::uint32_t v = 0;
    for (int c = 0; c < 4; ++c) v |= static_cast<std::uint32_t>(clamp((sum[c] + 64) >> 7, 0, 255)) << (8 * c);
    return v;
}

FOVEA_INLINE void cubic8(U8& v, const std::uint8_t* p, std::ptrdiff_t stride, const Fixed& f) {
    U8 wx[4], wy[4];
    cubic_weights(wx, f.fx);
    cubic_weights(wy, f.fy);
    const U8 bias = U8{} + kBias, levels = U8{} + kBiasLevels;
    U8 rb_sum = bias, ga_sum = bias;
    p -= stride + 4;
    for (int r = 0; r < 4; ++r, p += stride) {
        U8 rb_row = bias, ga_row = bias;
        for (int k = 0; k < 4; ++k) {
            U8 rb, ga;
            load_px(rb, ga, p + 4 * k);
            mul16(rb, wx[k]);
            mul16(ga, wx[k]);
            add16(rb_row, rb);
            add16(ga_row, ga);
        }
        shift16(rb_row, 7);
        shift16(ga_row, 7);
        const H16 rb_level = reinterpret_cast<H16>(rb_row) - reinterpret_cast<H16>(levels);
        const H16 ga_level = reinterpret_cast<H16>(ga_row) - reinterpret_cast<H16>(levels);
        rb_row = reinterpret_cast<U8>(rb_level);
        ga_row = reinterpret_cast<U8>(ga_level);
        mul16(rb_row, wy[r]);
        mul16(ga_row, wy[r]);
        add16(rb_sum, rb_row);
        add16(ga_sum, ga_row);
    }
    shift16(rb_sum, 7);
    shift16(ga_sum, 7);
    clamp_levels(rb_sum);
    clamp_levels(ga_sum);
    v = rb_sum | ga_sum << 8;
}

// Eight neighbours mostly come from eight neighbours; where a whole pixel is passed within them they come from two or three
// such runs, each of which is read as if it were all eight.
template <bool kIsCubic>
FOVEA_INLINE void warp_rgba8(const WarpRow& row) {
    constexpr int kBefore = kIsCubic ? 1 : 0, kAfter = kIsCubic ? 3 : 2;   // taps before, and from it on
    auto* out = static_cast<std::uint8_t*>(row.out);
    for (int x = row.x0; x < row.x1;) {
        const int end = x + 8 <= row.x1 ? x + 8 : row.x1;
        if (x + 8 <= row.x1) {
            if (stays8(row.dx + x, row.dy + x)) {   // all weights are those of the pixel itself
                __builtin_memcpy(out + 4 * (x - row.x0), row.source + row.y * row.source_stride + static_cast<std::ptrdiff_t>(4) * x, sizeof(U8));
                x += 8;
                continue;
            }
            Fixed f;
            load_fixed(f, row.dx + x, row.dy + x);
            U8 result{};
            I8 done{};
            int lane = 0;
            for (int run = 0; run < 3 && lane < 8; ++run) {
                const int dx = f.x[lane], dy = f.y[lane], sx = x + dx, sy = row.y + dy;
                if (sx < kBefore || sx + 7 + kAfter > row.width || sy < kBefore || sy + kAfter > row.height) break;
                U8 v;
                const std::uint8_t* p = row.source + sy * row.source_stride + 4 * sx;
                if constexpr (kIsCubic)
                    cubic8(v, p, row.source_stride, f);
                else
                    linear8(v, p, row.source_stride, f);
                if (f.together) {
                    result = v;
                    lane = 8;
                    break;
                }
                const I8 same = (f.x == dx) & (f.y == dy);
                result = same != 0 ? v : result;
                done |= same;
                while (lane < 8 && done[lane] != 0) ++lane;
            }
            if (lane == 8) {
                __builtin_memcpy(out + 4 * (x - row.x0), &result, sizeof result);
                x += 8;
                continue;
            }
        }
        for (; x < end; ++x) {
            const int dx = row.dx[x], dy = row.dy[x], sx = x + (dx >> 8), sy = row.y + (dy >> 8);
            const std::uint32_t v = kIsCubic ? cubic1(row, sx, sy, dx & 255, dy & 255) : linear1(row, sx, sy, dx & 255, dy & 255);
            __builtin_memcpy(out + 4 * (x - row.x0), &v, 4);
        }
    }
}
static void warp_rgba8_linear(const WarpRow& row) { warp_rgba8<false>(row); }
static void warp_rgba8_cubic(const WarpRow& row) { warp_rgba8<true>(row); }

// Floats: linear over the finite pixels of the four; an infinity or a NaN stays where it is and reaches no neighbour.
FOVEA_INLINE void float_pixel(V4& v, const WarpRow& row, int x, int y) {
    __builtin_memcpy(&v, row.source + clamp(y, 0, row.height - 1) * row.source_stride + static_cast<std::ptrdiff_t>(16) * clamp(x, 0, row.width - 1), sizeof v);
}
FOVEA_INLINE bool is_finite(const WarpRow& row, int x, int y) {
    return row.finite == nullptr || row.finite[static_cast<std::ptrdiff_t>(clamp(y, 0, row.height - 1)) * row.width + clamp(x, 0, row.width - 1)] != 0;
}

FOVEA_INLINE void warp_float(const WarpRow& row, bool cubic) {
    auto* out = static_cast<std::uint8_t*>(row.out);
    for (int x = row.x0; x < row.x1; ++x, out += sizeof(V4)) {
        const int dx = row.dx[x], dy = row.dy[x], sx = x + (dx >> 8), sy = row.y + (dy >> 8);
        V4 own;
        float_pixel(own, row, x, row.y);
        if ((dx == 0 && dy == 0) || !is_finite(row, x, row.y)) {
            __builtin_memcpy(out, &own, sizeof own);
            continue;
        }
        const float fx = static_cast<float>(dx & 255) / 256.0f, fy = static_cast<float>(dy & 255) / 256.0f;
        V4 low{}, high{}, sum{};
        float total = 0;
        for (int k = 0; k < 4; ++k) {
            const int px = sx + (k & 1), py = sy + (k >> 1);
            if (!is_finite(row, px, py)) continue;
            V4 v;
            float_pixel(v, row, px, py);
            const float w = ((k & 1) != 0 ? fx : 1 - fx) * (k > 1 ? fy : 1 - fy);
            low = total == 0 ? v : (low < v ? low : v);
            high = total == 0 ? v : (high > v ? high : v);
            // Weighted first: the sum of two numbers near the largest one must not overflow.
            sum += v * w;
            total += w;
        }
        if (total <= 0) {
            __builtin_memcpy(out, &own, sizeof own);
            continue;
        }
        if (total < 0.999f) {
            sum /= total;
        } else if (cubic && row.finite == nullptr && sx >= 1 && sx + 3 <= row.width && sy >= 1 && sy + 3 <= row.height) {
            // Sharper, but never beyond the four pixels around: no dark rim about a light of 10,000.
            const std::int16_t *wx = kCubic.w[dx & 255], *wy = kCubic.w[dy & 255];
            V4 all{};
            for (int r = 0; r < 4; ++r) {
                V4 across{};
                for (int k = 0; k < 4; ++k) {
                    V4 v;
                    float_pixel(v, row, sx - 1 + k, sy - 1 + r);
                    across += v * (static_cast<float>(wx[k]) / 128.0f);
                }
                all += across * (static_cast<float>(wy[r]) / 128.0f);
            }
            sum = all;
        }
        // The linear mean too: its rounding would make an alpha of 1 more than 1, and the largest number an infinity.
        sum = sum > low ? sum : low;
        sum = sum < high ? sum : high;
        __builtin_memcpy(out, &sum, sizeof sum);
    }
}
static void warp_float_linear(const WarpRow& row) { warp_float(row, false); }
static void warp_float_cubic(const WarpRow& row) { warp_float(row, true); }

// a0 b0 a1 b1 ...
FOVEA_INLINE void interleave(V8& low, V8& high, const V8& a, const V8& b) {
    low = __builtin_shuffle(a, b, I8{0, 8, 1, 9, 2, 10, 3, 11});
    high = __builtin_shuffle(a, b, I8{4, 12, 5, 13, 6, 14, 7, 15});
}
FOVEA_INLINE void store_fixed(std::int32_t* out, const V8& v) {
    V8 half, other;
    splat(half, 0.5f);
    splat(other, -0.5f);
    const I8 i = __builtin_convertvector(v + (v < 0.0f ? other : half), I8);
    __builtin_memcpy(out, &i, sizeof i);
}
// Of eight cells, the values of kCell pixels each, kept by their place in the cell, become 8 * kCell pixels in a row.
template <int kCell>
FOVEA_INLINE void store_cells(std::int32_t* out, const V8 (&v)[kCell]) {
    if constexpr (kCell == 1) {
        store_fixed(out, v[0]);
    } else {
        V8 low[kCell / 2], high[kCell / 2];
        for (int k = 0; k < kCell / 2; ++k) interleave(low[k], high[k], v[k], v[k + kCell / 2]);
        store_cells<kCell / 2>(out, low);
        store_cells<kCell / 2>(out + 4 * kCell, high);
    }
}
template <int kCell>
FOVEA_INLINE void expand_cells(const ExpandRow& row) {
    V8 step;
    splat(step, kSurfaceStep_px * 256.0f);
    // From the centre of cell c to that of c + 1: kCell pixels, starting half a cell into c.
    int c = row.x0 / kCell - 1;
    for (int x = c * kCell + kCell / 2; x < row.x1; x += 8 * kCell, c += 8) {
        V8 u, v, du, dv, size_u, size_v, one[kCell];
        load(u, row.mixed_u + c);
        load(v, row.mixed_v + c);
        load(du, row.mixed_u + c + 1);
        load(dv, row.mixed_v + c + 1);
        du -= u;
        dv -= v;
        absolute(size_u, du);
        absolute(size_v, dv);
        const I8 apart = (size_u > step) | (size_v > step);
        for (int plane = 0; plane < 2; ++plane) {
            const V8 &from = plane == 0 ? u : v, &to = plane == 0 ? du : dv;
            for (int k = 0; k < kCell; ++k) {
                V8 t, side;
                splat(t, static_cast<float>(2 * k + 1) / static_cast<float>(2 * kCell));
                splat(side, 2 * k + 1 < kCell ? 0.0f : 1.0f);
                one[k] = from + (apart ? side : t) * to;
            }
            store_cells<kCell>((plane == 0 ? row.dx : row.dy) + x, one);
        }
    }
}
static void expand(const ExpandRow& row) {
    V8 step, t, side, one;
    splat(step, kSurfaceStep_px);
    splat(t, row.below);
    splat(side, row.below < 0.5f ? 0.0f : 1.0f);
    splat(one, 256.0f);
    for (int c = row.cell0; c < row.cell1;) {
        const int count = row.cell1 - c;
        if (count >= 8) {
            V8 u, v, du, dv, size_u, size_v;
            load(u, row.upper_u + c);
            load(v, row.upper_v + c);
            load(du, row.lower_u + c);
            load(dv, row.lower_v + c);
            du -= u;
            dv -= v;
            absolute(size_u, du);
            absolute(size_v, dv);
            const V8 w = ((size_u > step) | (size_v > step)) ? side : t;
            store(row.mixed_u + c, (u + w * du) * one);
            store(row.mixed_v + c, (v + w * dv) * one);
            c += 8;
        } else {
            const float u = row.upper_u[c], v = row.upper_v[c], du = row.lower_u[c] - u, dv = row.lower_v[c] - v;
            const bool apart = larger(du, -du) > kSurfaceStep_px || larger(dv, -dv) > kSurfaceStep_px;
            const float w = apart ? (row.below < 0.5f ? 0.0f : 1.0f) : row.below;
            row.mixed_u[c] = (u + w * du) * 256.0f;
            row.mixed_v[c] = (v + w * dv) * 256.0f;
            ++c;
        }
    }
    for (int k = 1; k <= kExpandPad; ++k) {
        row.mixed_u[row.cell0 - k] = row.mixed_u[row.cell0];
        row.mixed_v[row.cell0 - k] = row.mixed_v[row.cell0];
        row.mixed_u[row.cell1 - 1 + k] = row.mixed_u[row.cell1 - 1];
        row.mixed_v[row.cell1 - 1 + k] = row.mixed_v[row.cell1 - 1];
    }
    if (row.cell_px == 2)
        expand_cells<2>(row);
    else if (row.cell_px == 4)
        expand_cells<4>(row);
    else
        expand_cells<8>(row);
}

static void fix(const float* px, std::int32_t* fixed, int count) {
    for (int i = 0; i < count; ++i) {
        const float v = px[i] * 256.0f;
        fixed[i] = static_cast<std::int32_t>(v + (v < 0 ? -0.5f : 0.5f));
    }
}

// Eight pixels at a time, each channel in a lane of its own.
FOVEA_INLINE void blend8(std::uint8_t* out, const std::uint8_t* second, const std::int32_t* how, std::int16_t* differences) {
    U8 a, b;
    I8 limit;
    __builtin_memcpy(&a, out, sizeof a);
    __builtin_memcpy(&b, second, sizeof b);
    __builtin_memcpy(&limit, how, sizeof limit);
    I8 first[4], apart[4], most{};
    for (int c = 0; c < 4; ++c) {
        const U8 p = a >> (8 * c) & 255u, q = b >> (8 * c) & 255u;
        first[c] = reinterpret_cast<I8>(p);
        apart[c] = reinterpret_cast<I8>(q) - first[c];
        const I8 size = apart[c] < 0 ? -apart[c] : apart[c];
        most = size > most ? size : most;
    }
    if (differences != nullptr && !any8(limit != kBoth)) {
        I8 size{};
        for (int c = 0; c < 3; ++c) size += apart[c] < 0 ? -apart[c] : apart[c];
        const I8 pairs[2] = {(apart[0] & 0xffff) | apart[2] << 16, (apart[1] & 0xffff) | size << 16};
        for (int k = 0; k < 2; ++k) {
            U8 sum;
            __builtin_memcpy(&sum, differences + 16 * k, sizeof sum);
            add16(sum, reinterpret_cast<U8>(pairs[k]));
            __builtin_memcpy(differences + 16 * k, &sum, sizeof sum);
        }
    }
    I8 weight = kSecondOnly - most;   // of 48: a half up to a difference of 24 levels, none from 48 on
    weight = weight < 0 ? I8{} : weight;
    weight = weight < limit ? weight : limit;
    weight = limit == kSecondOnly ? limit : weight;
    I8 v{};
    for (int c = 0; c < 4; ++c) {
        constexpr int kShare = 1366;   // 65536 / 48, rounded up: a weight of 48 is the whole
        const I8 mixed = first[c] + ((apart[c] * weight * kShare + 32768) >> 16);
        v |= mixed << (8 * c);
    }
    __builtin_memcpy(out, &v, sizeof v);
}
static void blend_rgba8(const BlendRow& row) {
    auto* out = static_cast<std::uint8_t*>(row.out);
    const auto* second = static_cast<const std::uint8_t*>(row.second);
    int x = 0;
    const auto at = [&](int k) { return row.differences == nullptr ? nullptr : row.differences + k / 8 * kDifferenceLanes; };
    for (; x + 8 <= row.count; x += 8) blend8(out + 4 * x, second + 4 * x, row.how + x, at(x));
    if (x == row.count) return;
    std::uint8_t a[32] = {}, b[32] = {};
    std::int32_t how[8] = {};
    const auto left = static_cast<std::size_t>(row.count - x);
    __builtin_memcpy(a, out + 4 * x, 4 * left);
    __builtin_memcpy(b, second + 4 * x, 4 * left);
    __builtin_memcpy(how, row.how + x, 4 * left);
    blend8(a, b, how, at(x));
    __builtin_memcpy(out + 4 * x, a, 4 * left);
}

// The same for light of any range: what counts is the difference in parts of the larger.
static void blend_float(const BlendRow& row) {
    auto* out = static_cast<float*>(row.out);
    const auto* second = static_cast<const float*>(row.second);
    for (int x = 0; x < row.count; ++x, out += 4, second += 4) {
        if (row.how[x] == kFirstOnly) continue;
        float most = 0;
        bool numbers = true;
        for (int c = 0; c < 4; ++c) {
            const float p = out[c], q = second[c], apart = p > q ? p - q : q - p;
            const float size = larger(larger(p, -p), larger(q, -q));
            numbers = numbers && size <= 3.4028235e38f && p - p == 0 && q - q == 0;
            most = larger(most, apart / larger(size, 1e-3f));
        }
        if (!numbers) continue;   // a number that is none stays where it is, and reaches nobody
        constexpr float kSame = 0.1f;
        const float weight = row.how[x] == kSecondOnly ? 1.0f : 0.5f * clamp(2.0f - most / kSame, 0.0f, 1.0f);
        for (int c = 0; c < 4; ++c) out[c] = (1.0f - weight) * out[c] + weight * second[c];
    }
}
