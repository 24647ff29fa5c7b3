// Carries every cell of the nearer source to where it will be at the output, for known motion with depth. Included inside a
// namespace per code path.
//
// At an edge between motions a pixel of the thing behind may hold a little of the thing in front (that is what antialiasing
// is), and cells that land whole miss the front's edge by part of a pixel: so the front is carried with a rim of one cell, of those
// pixels that it covers a part of. Eight neighbours that move by the same whole cells (the usual case)
// are compared with what already lies there, and written, at once.

// One row of what moves, with the edge repeated on both sides.
struct CarryRow {
    float *a, *c, *far_u, *far_v, *front;   // cell x at index x; -1 and `width` exist
};

FOVEA_INLINE CarryRow carry_row(const CarryJob& job, int y) {
    float* base = job.scratch + static_cast<std::ptrdiff_t>(y % 3) * 5 * carry_pitch(job.width) + 8;
    const std::ptrdiff_t pitch = carry_pitch(job.width);
    return {base, base + pitch, base + 2 * pitch, base + 3 * pitch, base + 4 * pitch};
}

static void load_carry_row(const CarryJob& job, int y) {
    const CarryRow r = carry_row(job, y);
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) * job.width;
    const float* given = (job.ahead != nullptr ? job.ahead : job.motion) + 2 * row;
    const float scale = job.ahead != nullptr ? 1.0f : job.step;
    const float* z = job.depth + row;
    const float* m = job.motion != nullptr ? job.motion + 2 * row : given;
    V8 lowest, nowhere, reach, factor;
    splat(lowest, -3.4028235e38f);
    splat(nowhere, kNowhere_px);
    splat(reach, job.reach_px);
    splat(factor, scale);
    // Where nothing bends, all of this is 0.
    V8 bend[2][2], slope[2][2], place;
    const float cells = 0.5f * scale * (1 + scale) / static_cast<float>(job.cell_px), row_at = static_cast<float>(y);
    for (int i = 0; i < 4; ++i) {
        const float* g = job.bend == nullptr ? nullptr : i < 2 ? job.bend->u[i] : job.bend->v[i - 2];
        splat(bend[i / 2][i % 2], g == nullptr ? 0.0f : cells * (g[0] + g[2] * row_at));
        splat(slope[i / 2][i % 2], g == nullptr ? 0.0f : cells * g[1]);
    }
    for (int k = 0; k < 8; ++k) place[k] = static_cast<float>(k);
    for (int x = 0; x < job.width; x += 8) {
        // The last few are read from a copy, and what lies beyond the row is written over below.
        float pairs[2][16], last[8];
        const float *p = given + 2 * x, *q = m + 2 * x, *d = z + x;
        if (x + 8 > job.width) {
            const auto left = static_cast<std::size_t>(job.width - x);
            __builtin_memset(pairs, 0, sizeof pairs);
            __builtin_memset(last, 0, sizeof last);
            __builtin_memcpy(pairs[0], p, 2 * left * sizeof(float));
            __builtin_memcpy(pairs[1], q, 2 * left * sizeof(float));
            __builtin_memcpy(last, d, left * sizeof(float));
            p = pairs[0];
            q = pairs[1];
            d = last;
        }
        V8 low, high, u, v, size_u, size_v, front;
        load(low, p);
        load(high, p + 8);
        V8 a = __builtin_shuffle(low, high, I8{0, 2, 4, 6, 8, 10, 12, 14}), c = __builtin_shuffle(low, high, I8{1, 3, 5, 7, 9, 11, 13, 15});
        const V8 first = a, other = c;
        a *= factor;
        c *= factor;
        absolute(size_u, a);
        absolute(size_v, c);
        const I8 ok = (size_u <= reach) & (size_v <= reach);
        if (job.bend != nullptr) {
            // A path that bends by more of its length is none of a turn's.
            const V8 most = (size_u + size_v) * 0.25f;
            V8 more_a = (bend[0][0] + slope[0][0] * place) * first + (bend[0][1] + slope[0][1] * place) * other;
            V8 more_c = (bend[1][0] + slope[1][0] * place) * first + (bend[1][1] + slope[1][1] * place) * other;
            more_a = more_a > most ? most : more_a;
            more_c = more_c > most ? most : more_c;
            a += more_a < -most ? -most : more_a;
            c += more_c < -most ? -most : more_c;
            place += 8.0f;
        }
        a = ok ? a : V8{};
        c = ok ? c : V8{};
        store(r.a + x, a);
        store(r.c + x, c);
        load(front, d);
        front = -front;
        front = front > lowest ? front : lowest;
        store(r.front + x, front);
        load(low, q);
        load(high, q + 8);
        u = __builtin_shuffle(low, high, I8{0, 2, 4, 6, 8, 10, 12, 14});
        v = __builtin_shuffle(low, high, I8{1, 3, 5, 7, 9, 11, 13, 15});
        absolute(size_u, u);
        absolute(size_v, v);
        I8 known = (size_u < nowhere) & (size_v < nowhere);
        if (job.motion == nullptr) known = I8{};
        u = known ? -(a + u) : nowhere;
        v = known ? -(c + v) : nowhere;
        store(r.far_u + x, u);
        store(r.far_v + x, v);
    }
    float* const planes[] = {r.a, r.c, r.far_u, r.far_v, r.front};
    for (float* p : planes) {
        p[-1] = p[0];
        for (int x = 0; x < 8; ++x) p[job.width + x] = p[job.width - 1];
    }
}

struct Carried {
    V8 a, c, far_u, far_v, front;
};

FOVEA_INLINE void carried_pixel(V4& v, const CarryJob& job, int x, int y) {
    const auto* row = static_cast<const std::uint8_t*>(job.pixels) + clamp(y, 0, job.height - 1) * job.stride;
    const int column = clamp(x, 0, job.width - 1);
    if (job.floats) {
        __builtin_memcpy(&v, row + static_cast<std::ptrdiff_t>(16) * column, sizeof v);
        return;
    }
    const std::uint8_t* p = row + static_cast<std::ptrdiff_t>(4) * column;
    v = V4{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), static_cast<float>(p[3])};
}
// How much of the pixel (x, y) belongs to what lies (dx, dy) beside it, and not to what lies on its other side: 0 to 1.
FOVEA_INLINE float share_of(const CarryJob& job, int x, int y, int dx, int dy) {
    V4 own, front, behind;
    carried_pixel(own, job, x, y);
    carried_pixel(front, job, x + dx, y + dy);
    carried_pixel(behind, job, x - dx, y - dy);
    const V4 to_front = front - behind, to_own = own - behind;
    const V4 a = to_front * to_front, b = to_front * to_own;
    const float whole = (a[0] + a[1]) + (a[2] + a[3]), part = (b[0] + b[1]) + (b[2] + b[3]);
    return whole > 0 && part > 0 ? smaller(part / whole, 1.0f) : 0.0f;
}
// What of a landing falls towards the rim on the side (-dx, -dy): the part of a pixel by which whole cells miss the front's edge.
FOVEA_INLINE float beyond(float moved, int side) {
    const float missed = moved - static_cast<float>(floor_int(moved + 0.5f));
    return side == 0 ? 1.0f : side > 0 ? -missed : missed;
}

// The front, whose cell (at, row) lies beside (x, y), has left this since: all that it went past shows nothing in the farther source.
FOVEA_INLINE void hide(const CarryJob& job, int x, int y, int at, int row, const CarryRow& own, const CarryRow& front) {
    constexpr float kFarthest_px = 64, kLeast_px = 1;
    const float a = own.a[x], c = own.c[x];
    const float u = (own.far_u[x] + a) - (front.far_u[at] + front.a[at]), v = (own.far_v[x] + c) - (front.far_v[at] + front.c[at]);
    const float length = larger(larger(u, -u), larger(v, -v));
    if (!(length >= kLeast_px && length <= kFarthest_px) || u * static_cast<float>(at - x) + v * static_cast<float>(row - y) <= 0) return;
    const float between = 0.5f * (own.front[x] + front.front[at]);
    const int steps = floor_int(length) + 1;
    for (int k = 0; k <= steps; ++k) {
        const float t = static_cast<float>(k) / static_cast<float>(steps), px = static_cast<float>(x) - t * u, py = static_cast<float>(y) - t * v;
        // Where the front is now that hid this then, if it is that large.
        const int fx = clamp(floor_int(px + u + 0.5f), 0, job.width - 1), fy = clamp(floor_int(py + v + 0.5f), 0, job.height - 1);
        // What was a pixel beside it held some of it.
        const int rim_x = clamp(fx + at - x, 0, job.width - 1), rim_y = clamp(fy + row - y, 0, job.height - 1);
        if (k > 0 && !(-job.depth[static_cast<std::ptrdiff_t>(fy) * job.width + fx] > between) &&
            !(-job.depth[static_cast<std::ptrdiff_t>(rim_y) * job.width + rim_x] > between))
            continue;
        const int to_x = floor_int(px + a + 0.5f), to_y = floor_int(py + c + 0.5f);
        if (to_x >= 0 && to_x < job.width && to_y >= 0 && to_y < job.height) job.sources[static_cast<std::ptrdiff_t>(to_y) * job.width + to_x] = static_cast<std::uint8_t>(kFirstOnly);
    }
}

// The nearest of the nine cells around lends its motion.
FOVEA_INLINE void lend(Carried& k, int lane, int x, int y, const CarryRow (&rows)[3], const CarryJob& job) {
    float best = rows[1].front[x];
    int from = 1, at = x;
    for (int j = 0; j < 3; ++j)
        for (int i = x - 1; i <= x + 1; ++i)
            if (rows[j].front[i] > best) {
                best = rows[j].front[i];
                from = j;
                at = i;
            }
    if (from == 1 && at == x) return;
    if (job.sources != nullptr) hide(job, x, y, at, y + from - 1, rows[1], rows[from]);
    // Across the corner only where there is nothing of it straight beside.
    if (from != 1 && at != x) {
        const float between = 0.5f * (rows[1].front[x] + best);
        if (rows[from].front[x] > between)
            at = x;
        else if (rows[1].front[at] > between)
            from = 1;
        best = rows[from].front[at];
    }
    if (job.pixels != nullptr) {
        // Lent to what moves about as the front does, where it costs nothing; to what the front covers a part of, there or by where
        // its own cell lands; and to what would itself be read too near to where the front was.
        constexpr float kApart_px = 1.0f, kLeast = 0.15f;   // of a pixel; of four samples, one is 0.25
        const int dx = at - x, dy = from - 1;
        const float du = rows[from].a[at] - rows[1].a[x], dv = rows[from].c[at] - rows[1].c[x];
        const bool apart = larger(du, -du) >= kApart_px || larger(dv, -dv) >= kApart_px;
        if (apart && !(share_of(job, x, y, dx, dy) + smaller(beyond(rows[from].a[at], dx), beyond(rows[from].c[at], dy)) > kLeast)) {
            // What stays is read at its own centre, and not beside it where the front is.
            const float a = rows[1].a[x], c = rows[1].c[x], own_a = static_cast<float>(floor_int(a + 0.5f)), own_c = static_cast<float>(floor_int(c + 0.5f));
            if (static_cast<float>(dx) * (own_a - a) > 0) k.a[lane] = own_a;
            if (static_cast<float>(dy) * (own_c - c) > 0) k.c[lane] = own_c;
            return;
        }
    }
    k.a[lane] = rows[from].a[at];
    k.c[lane] = rows[from].c[at];
    k.far_u[lane] = rows[from].far_u[at];
    k.far_v[lane] = rows[from].far_v[at];
    k.front[lane] = best;
}

FOVEA_INLINE void floor8(I8& out, const V8& v) {
    out = __builtin_convertvector(v, I8);
    const V8 back = __builtin_convertvector(out, V8);
    out += back > v;   // -1 where true
}
static bool carry(const CarryJob& job) {
    constexpr float kEdge_px = 0.25f;   // neighbours whose motion differs by more do not belong together
    const float per_cell = 1.0f / static_cast<float>(job.cell_px);
    bool moves = false;
    load_carry_row(job, 0);
    for (int y = 0; y < job.height; ++y) {
        if (y + 1 < job.height) load_carry_row(job, y + 1);
        const CarryRow rows[3] = {carry_row(job, y > 0 ? y - 1 : y), carry_row(job, y), carry_row(job, y + 1 < job.height ? y + 1 : y)};
        for (int x = 0; x < job.width; x += 8) {
            Carried k;
            load(k.a, rows[1].a + x);
            load(k.c, rows[1].c + x);
            load(k.far_u, rows[1].far_u + x);
            load(k.far_v, rows[1].far_v + x);
            load(k.front, rows[1].front + x);
            moves |= any8((k.a != 0.0f) | (k.c != 0.0f));
            V8 edge{}, e, other;
            const float* around[8] = {rows[1].a + x - 1, rows[1].a + x + 1, rows[0].a + x, rows[2].a + x, rows[1].c + x - 1, rows[1].c + x + 1, rows[0].c + x, rows[2].c + x};
            for (int i = 0; i < 8; ++i) {
                load(other, around[i]);
                absolute(e, other - (i < 4 ? k.a : k.c));
                at_least(edge, e);
            }
            const I8 lent = edge > kEdge_px;
            const int count = job.width - x < 8 ? job.width - x : 8;
            if (any8(lent))
                for (int lane = 0; lane < count; ++lane)
                    if (lent[lane] != 0) lend(k, lane, x + lane, y, rows, job);
            I8 tx, ty;
            floor8(tx, k.a * per_cell + 0.5f);
            floor8(ty, k.c * per_cell + 0.5f);
            const int to_x = x + tx[0], to_y = y + ty[0];
            if (count == 8 && !any8((tx ^ tx[0]) | (ty ^ ty[0]))) {
                if (to_y < 0 || to_y >= job.height) continue;
                if (to_x >= 0 && to_x + 8 <= job.width) {
                    const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(to_y) * job.width + to_x;
                    V8 old;
                    load(old, job.front + to);
                    const I8 wins = k.front > old;
                    const auto put = [&](float* plane, const V8& v) __attribute__((always_inline)) {
                        V8 was;
                        load(was, plane + to);
                        store(plane + to, wins ? v : was);
                    };
                    put(job.front, k.front);
                    put(job.u, -k.a);
                    put(job.v, -k.c);
                    put(job.far_u, k.far_u);
                    put(job.far_v, k.far_v);
                    continue;
                }
            }
            for (int lane = 0; lane < count; ++lane) {
                const int px = x + lane + tx[lane], py = y + ty[lane];
                if (px < 0 || px >= job.width || py < 0 || py >= job.height) continue;
                const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(py) * job.width + px;
                if (!(k.front[lane] > job.front[to])) continue;
                job.front[to] = k.front[lane];
                job.u[to] = -k.a[lane];
                job.v[to] = -k.c[lane];
                job.far_u[to] = k.far_u[lane];
                job.far_v[to] = k.far_v[lane];
            }
        }
    }
    return moves;
}
