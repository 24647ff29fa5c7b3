// The search, and the spreading of what it found over pixels. Included inside a namespace per code path.
//
// A patch of `from` is moved over `to` by Gauss-Newton steps whose matrix depends on `from` alone and is built once
// (inverse compositional). The mean difference is taken out, so that a change of brightness is no motion.

struct Template {
    V8 pixels[kPatchPx], gx[kPatchPx], gy[kPatchPx];
    float sum_gx, sum_gy;
    float xx, xy, yy;
    float a, b, d;      // inverse of the 2x2 matrix {a b; b d}; all 0 where the patch says nothing about motion
};

struct Fit {
    float cost, shift, bx, by;
};

FOVEA_INLINE void build_template(Template& t, const float* p, std::ptrdiff_t stride) {
    V8 above, below, left, right;
    V8 sx{}, sy{}, sxx{}, syy{}, sxy{};
    for (int r = 0; r < kPatchPx; ++r) {
        const float* row = p + r * stride;
        load(t.pixels[r], row);
        load(left, row - 1);
        load(right, row + 1);
        load(above, row - stride);
        load(below, row + stride);
        const V8 gx = (right - left) * 0.5f, gy = (below - above) * 0.5f;
        t.gx[r] = gx;
        t.gy[r] = gy;
        sx += gx;
        sy += gy;
        sxx += gx * gx;
        syy += gy * gy;
        sxy += gx * gy;
    }
    V4 s, s2;
    sum4(s, sx, sy, sxx, syy);
    sum4(s2, sxy, sxy, sxy, sxy);
    constexpr float n = kPatchPx * kPatchPx;
    t.sum_gx = s[0];
    t.sum_gy = s[1];
    // A little on the diagonal keeps a flat patch where it started, and a part of the other axis' share an edge from sliding along
    // itself: the matrix grows in the direction that it knows less of, and not in the other.
    constexpr float kDamping = 8.0f, kAcross = 0.006f;
    t.xx = s[2] - s[0] * s[0] / n;
    t.yy = s[3] - s[1] * s[1] / n;
    t.xy = s2[0] - s[0] * s[1] / n;
    const float xx = t.xx + kAcross * t.yy + kDamping, yy = t.yy + kAcross * t.xx + kDamping, xy = (1 - kAcross) * t.xy;
    const float det = xx * yy - xy * xy;
    const bool says_something = xx + yy > 4 * kDamping && det > 0;
    const float inverse = says_something ? 1.0f / det : 0.0f;
    t.a = yy * inverse;
    t.b = -xy * inverse;
    t.d = xx * inverse;
}

// What is left with the patch at column x, row y of `to` (both kept inside the padding).
FOVEA_INLINE void evaluate(Fit& fit, const Template& t, const SearchJob& job, float x, float y) {
    x = clamp(x, job.low_x, job.high_x);
    y = clamp(y, job.low_y, job.high_y);
    const int ix = floor_int(x), iy = floor_int(y);
    V8 fx, fy;
    splat(fx, x - static_cast<float>(ix));
    splat(fy, y - static_cast<float>(iy));
    const float* p = job.to + iy * job.stride + ix;
    V8 a, b, sd{}, sdd{}, sx{}, sy{};
    load(a, p);
    load(b, p + 1);
    V8 upper = a + fx * (b - a);
    for (int r = 0; r < kPatchPx; ++r) {
        p += job.stride;
        load(a, p);
        load(b, p + 1);
        const V8 lower = a + fx * (b - a);
        const V8 d = upper + fy * (lower - upper) - t.pixels[r];
        upper = lower;
        sd += d;
        sdd += d * d;
        sx += d * t.gx[r];
        sy += d * t.gy[r];
    }
    V4 s;
    sum4(s, sd, sdd, sx, sy);
    constexpr float kPerPixel = 1.0f / (kPatchPx * kPatchPx);
    fit.shift = s[0] * kPerPixel;
    fit.cost = s[1] - s[0] * fit.shift;
    fit.bx = s[2] - t.sum_gx * fit.shift;
    fit.by = s[3] - t.sum_gy * fit.shift;
}

FOVEA_INLINE void refine(PatchMotion& m, Fit fit, const Template& t, const SearchJob& job, float x0, float y0) {
    m.cost = fit.cost;
    m.shift = fit.shift;
    const float u0 = m.u, v0 = m.v;
    float u = m.u, v = m.v;
    for (int i = 0; i < job.iterations; ++i) {
        const float du = t.a * fit.bx + t.b * fit.by, dv = t.b * fit.bx + t.d * fit.by;
        u = clamp(u - du, -job.reach, job.reach);
        v = clamp(v - dv, -job.reach, job.reach);
        // A patch that runs further than its own size has lost its way; so has a step that is no number.
        if (!((u - u0) * (u - u0) + (v - v0) * (v - v0) < static_cast<float>(kPatchPx * kPatchPx))) break;
        evaluate(fit, t, job, x0 + u, y0 + v);
        if (!(fit.cost < m.cost)) break;
        m.u = u;
        m.v = v;
        m.cost = fit.cost;
        m.shift = fit.shift;
        constexpr float kStopStep = 0.02f;   // pixels of the level
        if (du * du + dv * dv < kStopStep * kStopStep) break;
    }
}

// Another motion is taken where it leaves clearly less. Of two places along an edge, or a period apart, reading between pixels alone
// leaves some of the gradients' energy more at the one; and part of what the patch has left it will get rid of by itself, by a step.
FOVEA_INLINE void consider(PatchMotion& m, Fit& best, const Template& t, const SearchJob& job, float x0, float y0, float u, float v) {
    constexpr float kSameMotion = 0.25f, kMustGain = 0.9f, kReading = 0.03f, kStepGain = 0.3f;
    if ((u - m.u) * (u - m.u) + (v - m.v) * (v - m.v) < kSameMotion * kSameMotion) return;
    Fit fit;
    evaluate(fit, t, job, x0 + u, y0 + v);
    const auto after_step = [&](const Fit& f) __attribute__((always_inline)) { return f.cost - kStepGain * ((t.a * f.bx + 2 * t.b * f.by) * f.bx + t.d * f.by * f.by); };
    if (after_step(fit) < kMustGain * after_step(best) - kReading * (t.xx + t.yy)) {
        m.u = u;
        m.v = v;
        best = fit;
    }
}

// The patch lies further outside `to` than it does outside `from`: what it shows came into the picture since.
FOVEA_INLINE bool leaves(const SearchJob& job, float x0, float y0, const PatchMotion& m) {
    constexpr float kSlack = 1.0f;
    const auto right = static_cast<float>(job.width - kPatchPx), below = static_cast<float>(job.height - kPatchPx);
    const float x = x0 + m.u, y = y0 + m.v;
    return x < smaller(x0, 0) - kSlack || y < smaller(y0, 0) - kSlack || x > larger(x0, right) + kSlack || y > larger(y0, below) + kSlack;
}

static void search(const SearchJob& job, int row0, int row1) {
    Template t;
    for (int pass = 0; pass < job.passes; ++pass) {
        const bool back = pass % 2 == 1;
        const int step = back ? 1 : -1;   // to the neighbours that this pass has done
        for (int k = 0; k < row1 - row0; ++k) {
            const int j = back ? row1 - 1 - k : row0 + k;
            for (int l = 0; l < job.column1 - job.column0; ++l) {
                const int i = back ? job.column1 - 1 - l : job.column0 + l;
                PatchMotion& m = job.patches[j * job.columns + i];
                if (job.tasks[j * job.columns + i] != kPatchSearch) {
                    if (pass == 0) m.cost = m.shift = m.xx = m.xy = m.yy = 0;
                    continue;
                }
                const int x = kStridePx * i - kStridePx, y = kStridePx * j - kStridePx;
                const auto x0 = static_cast<float>(x), y0 = static_cast<float>(y);
                const bool has_column = i + step >= job.column0 && i + step < job.column1, has_row = j + step >= row0 && j + step < row1;
                const PatchMotion before = m;
                const PatchMotion& side = job.patches[j * job.columns + i + (has_column ? step : 0)];
                const PatchMotion& over = job.patches[(j + (has_row ? step : 0)) * job.columns + i];
                constexpr float kSame = 0.25f * 0.25f;
                if (pass > 0 && (side.u - m.u) * (side.u - m.u) + (side.v - m.v) * (side.v - m.v) < kSame &&
                    (over.u - m.u) * (over.u - m.u) + (over.v - m.v) * (over.v - m.v) < kSame)
                    continue;
                build_template(t, job.from + y * job.stride + x, job.stride);
                if (pass == 0) m.cost = m.shift = m.xx = m.xy = m.yy = 0;
                if (t.a == 0 || leaves(job, x0, y0, m)) continue;   // flat, or never seen there: as its surroundings
                m.xx = t.xx;
                m.xy = t.xy;
                m.yy = t.yy;
                Fit fit;
                evaluate(fit, t, job, x0 + m.u, y0 + m.v);
                consider(m, fit, t, job, x0, y0, side.u, side.v);
                consider(m, fit, t, job, x0, y0, over.u, over.v);
                if (pass == 0) consider(m, fit, t, job, x0, y0, 0, 0);
                if (pass > 0 && m.u == before.u && m.v == before.v) continue;
                refine(m, fit, t, job, x0, y0);
            }
        }
    }
}

static void balance(const BalanceJob& job) {
    const SearchJob& s = *job.search;
    constexpr float kApart = 1.0f, kNoise = 2.0f;   // pixels of the level; levels of 255
    for (int j = s.row0; j < s.row1; ++j)
        for (int i = s.column0; i < s.column1; ++i) {
            PatchMotion& m = s.patches[j * s.columns + i];
            // A patch that fits badly knows less than its gradients promise.
            const float trust = 1.0f / (1.0f + m.cost * (1.0f / (kPatchPx * kPatchPx * kNoise * kNoise)));
            m.xx *= trust;
            m.xy *= trust;
            m.yy *= trust;
            m.claim_u = m.xx * m.u + m.xy * m.v;
            m.claim_v = m.xy * m.u + m.yy * m.v;
        }
    const auto settle = [&](int at, int left, int right, int above, int below) __attribute__((always_inline)) {
        PatchMotion& m = s.patches[at];
        const PatchMotion &l = s.patches[left], &r = s.patches[right], &a = s.patches[above], &b = s.patches[below];
        const V4 nu{l.u, r.u, a.u, b.u}, nv{l.v, r.v, a.v, b.v};
        const V4 du = nu - m.u, dv = nv - m.v;
        V4 w = job.stiffness / (1.0f + (du * du + dv * dv) * (1.0f / (kApart * kApart)));
        const I4 others{left != at, right != at, above != at, below != at};   // at an edge of the grid: no neighbour
        w = others != 0 ? w : V4{};
        const V4 wu = w * nu, wv = w * nv;
        const float su = (wu[0] + wu[1]) + (wu[2] + wu[3]), sv = (wv[0] + wv[1]) + (wv[2] + wv[3]), sw = (w[0] + w[1]) + (w[2] + w[3]);
        const float p = m.xx + sw, q = m.yy + sw, det = p * q - m.xy * m.xy;
        if (!(det > 0)) return;
        const float per = 1.0f / det, bu = m.claim_u + su, bv = m.claim_v + sv;
        m.u = (q * bu - m.xy * bv) * per;
        m.v = (p * bv - m.xy * bu) * per;
    };
    // Four rows at once, each a step behind the one before: every patch still sees the same neighbours settled as in one
    // row after the other, but no settling waits for the one just begun.
    constexpr int kAtOnce = 4;
    for (int round = 0; round < job.rounds; ++round) {
        const bool back = round % 2 != 0;   // from the other corner: what one round spreads far, the next spreads back
        const int rows = s.row1 - s.row0, columns = s.column1 - s.column0;
        for (int first = 0; first < rows; first += kAtOnce)
            for (int step = 0; step < columns + kAtOnce - 1; ++step)
                for (int k = 0; k < kAtOnce; ++k) {
                    const int row = first + k, column = step - k;
                    if (row >= rows || column < 0 || column >= columns) continue;
                    const int j = back ? s.row1 - 1 - row : s.row0 + row, i = back ? s.column1 - 1 - column : s.column0 + column, at = j * s.columns + i;
                    if (s.tasks[at] == kPatchStill || s.tasks[at] == kPatchCoarse) continue;
                    settle(at, at - (i > s.column0 ? 1 : 0), at + (i + 1 < s.column1 ? 1 : 0), at - (j > s.row0 ? s.columns : 0), at + (j + 1 < s.row1 ? s.columns : 0));
                }
    }
}

static void spread(const SpreadJob& job, int band0, int band1) {
    const SearchJob& s = *job.search;
    const int pitch = spread_pitch(s.columns);
    float* const scratch = job.scratch + static_cast<std::ptrdiff_t>((band0 - job.first_band) / job.bands_per_scratch) * spread_scratch(s.columns);
    // [u, v, weight][row of the band][column, shifted by one stride]
    const auto sums = [&](int plane, int row) __attribute__((always_inline)) { return scratch + (plane * kStridePx + row) * pitch; };
    V8 one;
    splat(one, 1.0f);
    for (int band = band0; band < band1; ++band) {
        for (int row = 0; row < 3 * kStridePx; ++row) {
            const int columns = (job.column1 < s.columns ? job.column1 : s.columns) + 2 - job.column0, left = pitch - job.column0 * kStridePx;
            __builtin_memset(scratch + row * pitch + job.column0 * kStridePx, 0, sizeof(float) * static_cast<std::size_t>(columns * kStridePx < left ? columns * kStridePx : left));
        }
        for (int half = 0; half < 2; ++half) {
            const int j = band + half, first = half == 0 ? kStridePx : 0;   // rows of the patch that lie in the band
            if (j >= s.rows) continue;
            const int i1 = s.columns < job.column1 + 1 ? s.columns : job.column1 + 1;
            for (int i = job.column0; i < i1; ++i) {
                const PatchMotion& m = s.patches[j * s.columns + i];
                const bool searched = s.tasks[j * s.columns + i] == kPatchSearch;
                const int x = kStridePx * i - kStridePx, y = kStridePx * j - kStridePx;
                const float px = clamp(static_cast<float>(x) + m.u, s.low_x, s.high_x);
                const float py = clamp(static_cast<float>(y) + m.v, s.low_y, s.high_y);
                const int ix = floor_int(px), iy = floor_int(py);
                V8 fx, fy, u, v, shift;
                splat(fx, px - static_cast<float>(ix));
                splat(fy, py - static_cast<float>(iy));
                splat(u, m.u);
                splat(v, m.v);
                splat(shift, m.shift);
                for (int r = 0; r < kStridePx; ++r) {
                    V8 w = one;
                    if (searched) {
                        const float* p = s.to + (iy + first + r) * s.stride + ix;
                        V8 a, b, c, d, t;
                        load(a, p);
                        load(b, p + 1);
                        load(c, p + s.stride);
                        load(d, p + s.stride + 1);
                        load(t, s.from + (y + first + r) * s.stride + x);
                        const V8 upper = a + fx * (b - a), lower = c + fx * (d - c);
                        V8 e = upper + fy * (lower - upper) - t - shift;
                        e = e * e;
                        at_least(e, one);
                        w = one / e;
                    }
                    float *su = sums(0, r) + x + kStridePx, *sv = sums(1, r) + x + kStridePx, *sw = sums(2, r) + x + kStridePx;
                    V8 cu, cv, cw;
                    load(cu, su);
                    load(cv, sv);
                    load(cw, sw);
                    store(su, cu + w * u);
                    store(sv, cv + w * v);
                    store(sw, cw + w);
                }
            }
        }
        for (int r = 0; r < kStridePx && band * kStridePx + r < s.height; ++r) {
            const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(band * kStridePx + r) * s.width;
            const float *su = sums(0, r) + kStridePx, *sv = sums(1, r) + kStridePx, *sw = sums(2, r) + kStridePx;
            const int x1 = s.width < job.column1 * kStridePx ? s.width : job.column1 * kStridePx;
            for (int x = job.column0 * kStridePx; x < x1; ++x) {
                job.u[row + x] = su[x] / sw[x];
                job.v[row + x] = sv[x] / sw[x];
            }
        }
    }
}
