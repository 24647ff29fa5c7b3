// The gather. Included inside a namespace per code path.
//
// Eight neighbours whose sources are neighbours too (the usual case) are read as rows; the others one by one. Two 8-bit
// channels ride in one 32-bit lane as two 16-bit numbers.

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

static void warp_rgba8_linear(const WarpRow& row) {
    auto* out = static_cast<std::uint8_t*>(row.out);
    for (int x = row.x0; x < row.x1;) {
        if (x + 8 <= row.x1) {
            Fixed f;
            load_fixed(f, row.dx + x, row.dy + x);
            const int sx = x + f.x[0], sy = row.y + f.y[0];
            if (f.together && sx >= 0 && sx + 9 <= row.width && sy >= 0 && sy + 2 <= row.height) {
                const std::uint8_t* p = row.source + sy * row.source_stride + 4 * sx;
                U8 rb, ga, rb1, ga1, rb2, ga2;
                load_px(rb, ga, p);
                load_px(rb1, ga1, p + 4);
                mix16(rb, rb1, f.fx);
                mix16(ga, ga1, f.fx);
                p += row.source_stride;
                load_px(rb1, ga1, p);
                load_px(rb2, ga2, p + 4);
                mix16(rb1, rb2, f.fx);
                mix16(ga1, ga2, f.fx);
                mix16(rb, rb1, f.fy);
                mix16(ga, ga1, f.fy);
                const U8 v = rb | ga << 8;
                __builtin_memcpy(out + 4 * (x - row.x0), &v, sizeof v);
                x += 8;
                continue;
            }
        }
        const int end = x + 8 <= row.x1 ? x + 8 : row.x1;
        for (; x < end; ++x) {
            const int dx = row.dx[x], dy = row.dy[x], sx = x + (dx >> 8), sy = row.y + (dy >> 8);
            const auto fx = static_cast<std::uint32_t>(dx & 255), fy = static_cast<std::uint32_t>(dy & 255);
            const std::uint32_t upper = mix_scalar(pixel(row, sx, sy), pixel(row, sx + 1, sy), fx);
            const std::uint32_t lower = mix_scalar(pixel(row, sx, sy + 1), pixel(row, sx + 1, sy + 1), fx);
            const std::uint32_t v = mix_scalar(upper, lower, fy);
            __builtin_memcpy(out + 4 * (x - row.x0), &v, 4);
        }
    }
}

// Keys' cubic. Its slope at 1 is -0.6: measured over the scenes of `fovea tradeoff extrapolation` with their exact motion it
// keeps 0.1 dB more than Catmull-Rom's -0.5; -0.75 and six taps of Lanczos gain nothing beyond.
inline constexpr double kSlope = -0.6;
constexpr double inner_lobe(double x) { return ((kSlope + 2) * x - (kSlope + 3)) * x * x + 1; }
constexpr double outer_lobe(double x) { return ((x - 5) * x + 8) * x * kSlope - 4 * kSlope; }
// Its weights in 1/128, for each 1/256 of a pixel; their sum is 128. Four 16-bit numbers.
struct CubicTable {
    std::int16_t w[256][4];
};
constexpr CubicTable make_cubic_table() {
    CubicTable t{};
    for (int i = 0; i < 256; ++i) {
        const double f = i / 256.0;
        const double g = 1 - f;
        const double w[4] = {outer_lobe(1 + f), inner_lobe(f), inner_lobe(g), outer_lobe(1 + g)};
        int sum = 0;
        for (int k = 0; k < 4; ++k) {
            t.w[i][k] = static_cast<std::int16_t>(w[k] * 128 + (w[k] < 0 ? -0.5 : 0.5));
            sum += t.w[i][k];
        }
        const int k = f < 0.5 ? 1 : 2;   // the largest takes what rounding left
        t.w[i][k] = static_cast<std::int16_t>(t.w[i][k] + 128 - sum);
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

FOVEA_INLINE void cubic_weights(U8 (&w)[4], const U8& f) {
    for (int lane = 0; lane < 8; ++lane) {
        const std::int16_t* t = kCubic.w[f[lane] & 255];
        for (int k = 0; k < 4; ++k) w[k][lane] = static_cast<std::uint16_t>(t[k]) * 0x10001u;
    }
}

static std::uint32_t cubic_scalar(const WarpRow& row, int sx, int sy, int fx, int fy) {
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

static void warp_rgba8_cubic(const WarpRow& row) {
    auto* out = static_cast<std::uint8_t*>(row.out);
    for (int x = row.x0; x < row.x1;) {
        if (x + 8 <= row.x1) {
            Fixed f;
            load_fixed(f, row.dx + x, row.dy + x);
            const int sx = x + f.x[0], sy = row.y + f.y[0];
            if (f.together && sx >= 1 && sx + 10 <= row.width && sy >= 1 && sy + 3 <= row.height) {
                U8 wx[4], wy[4];
                cubic_weights(wx, f.fx);
                cubic_weights(wy, f.fy);
                const U8 bias = U8{} + kBias, levels = U8{} + kBiasLevels;
                U8 rb_sum = bias, ga_sum = bias;
                const std::uint8_t* p = row.source + (sy - 1) * row.source_stride + 4 * (sx - 1);
                for (int r = 0; r < 4; ++r, p += row.source_stride) {
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
                const U8 v = rb_sum | ga_sum << 8;
                __builtin_memcpy(out + 4 * (x - row.x0), &v, sizeof v);
                x += 8;
                continue;
            }
        }
        const int end = x + 8 <= row.x1 ? x + 8 : row.x1;
        for (; x < end; ++x) {
            const int dx = row.dx[x], dy = row.dy[x];
            const std::uint32_t v = cubic_scalar(row, x + (dx >> 8), row.y + (dy >> 8), dx & 255, dy & 255);
            __builtin_memcpy(out + 4 * (x - row.x0), &v, 4);
        }
    }
}

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
            low = k == 0 ? v : (low < v ? low : v);
            high = k == 0 ? v : (high > v ? high : v);
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
            all = all > low ? all : low;
            sum = all < high ? all : high;
        }
        __builtin_memcpy(out, &sum, sizeof sum);
    }
}
static void warp_float_linear(const WarpRow& row) { warp_float(row, false); }
static void warp_float_cubic(const WarpRow& row) { warp_float(row, true); }
