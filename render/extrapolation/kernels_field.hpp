// Luma, its levels, and the smoothing of the motion field. Included inside a namespace per code path.

static void halve(const float* in, std::ptrdiff_t in_stride, float* out, std::ptrdiff_t out_stride, int out_width, int row0, int row1) {
    for (int y = row0; y < row1; ++y) {
        const float *a = in + 2 * y * in_stride, *b = a + in_stride;
        float* o = out + y * out_stride;
        int x = 0;
        for (; x + 8 <= out_width; x += 8) {
            V8 a0, a1, b0, b1;
            load(a0, a + 2 * x);
            load(a1, a + 2 * x + 8);
            load(b0, b + 2 * x);
            load(b1, b + 2 * x + 8);
            a0 += b0;
            a1 += b1;
            const V8 even = __builtin_shuffle(a0, a1, I8{0, 2, 4, 6, 8, 10, 12, 14});
            const V8 odd = __builtin_shuffle(a0, a1, I8{1, 3, 5, 7, 9, 11, 13, 15});
            store(o + x, (even + odd) * 0.25f);
        }
        for (; x < out_width; ++x) o[x] = ((a[2 * x] + b[2 * x]) + (a[2 * x + 1] + b[2 * x + 1])) * 0.25f;
    }
}

// Four rows at a time over all tiles: memory is read in order, and a tile is asked once for them all. `same` keeps what the rows
// above have found.
template <int kRows>
FOVEA_INLINE void same_rows(const std::uint8_t* a, std::ptrdiff_t a_stride, const std::uint8_t* b, std::ptrdiff_t b_stride, int tiles, int tile_bytes, std::uint8_t* same) {
    for (int t = 0; t < tiles; ++t) {
        const std::uint8_t *p = a + static_cast<std::ptrdiff_t>(t) * tile_bytes, *q = b + static_cast<std::ptrdiff_t>(t) * tile_bytes;
        I8 apart{};
        for (int k = 0; k < tile_bytes; k += 32)
            for (int r = 0; r < kRows; ++r) {
                I8 v, w;
                __builtin_memcpy(&v, p + r * a_stride + k, sizeof v);
                __builtin_memcpy(&w, q + r * b_stride + k, sizeof w);
                apart |= v ^ w;
            }
        struct Halves { L2 lo, hi; };
        Halves h;
        __builtin_memcpy(&h, &apart, sizeof h);
        const L2 any = h.lo | h.hi;
        same[t] = static_cast<std::uint8_t>(same[t] & ((any[0] | any[1]) == 0 ? 1 : 0));
    }
}
static void same_tiles(const std::uint8_t* a, std::ptrdiff_t a_stride, const std::uint8_t* b, std::ptrdiff_t b_stride, int rows, int tiles, int tile_bytes, std::uint8_t* same) {
    for (int t = 0; t < tiles; ++t) same[t] = 1;
    int y = 0;
    for (; y + 4 <= rows; y += 4) same_rows<4>(a + y * a_stride, a_stride, b + y * b_stride, b_stride, tiles, tile_bytes, same);
    for (; y < rows; ++y) same_rows<1>(a + y * a_stride, a_stride, b + y * b_stride, b_stride, tiles, tile_bytes, same);
}

// Two channels ride in one 32-bit lane: 16 pixels of 255 stay below 2^16.
static void luma_rgba8(const std::uint8_t* rows, std::ptrdiff_t row_bytes, int cell_px, int cells, float* out) {
    if (cell_px == 2) {   // sixteen pixels of both rows at a time
        constexpr float kScale = 1.0f / 16;
        constexpr float kR = 0.299f * 3 * kScale, kG = 0.587f * 3 * kScale, kB = 0.114f * 3 * kScale, kA = kScale;
        while (cells >= 8) {
            U8 a, b, c, d;
            __builtin_memcpy(&a, rows, sizeof a);
            __builtin_memcpy(&b, rows + 32, sizeof b);
            __builtin_memcpy(&c, rows + row_bytes, sizeof c);
            __builtin_memcpy(&d, rows + row_bytes + 32, sizeof d);
            const U8 rb_low = (a & 0xff00ffu) + (c & 0xff00ffu), rb_high = (b & 0xff00ffu) + (d & 0xff00ffu);
            const U8 ga_low = (a >> 8 & 0xff00ffu) + (c >> 8 & 0xff00ffu), ga_high = (b >> 8 & 0xff00ffu) + (d >> 8 & 0xff00ffu);
            const I8 even{0, 2, 4, 6, 8, 10, 12, 14}, odd{1, 3, 5, 7, 9, 11, 13, 15};
            const U8 rb = __builtin_shuffle(rb_low, rb_high, even) + __builtin_shuffle(rb_low, rb_high, odd);
            const U8 ga = __builtin_shuffle(ga_low, ga_high, even) + __builtin_shuffle(ga_low, ga_high, odd);
            const U8 red = rb & 0xffffu, blue = rb >> 16, green = ga & 0xffffu, alpha = ga >> 16;
            store(out, (kR * __builtin_convertvector(reinterpret_cast<I8>(red), V8) + kB * __builtin_convertvector(reinterpret_cast<I8>(blue), V8)) +
                           (kG * __builtin_convertvector(reinterpret_cast<I8>(green), V8) + kA * __builtin_convertvector(reinterpret_cast<I8>(alpha), V8)));
            rows += 64;
            out += 8;
            cells -= 8;
        }
    }
    if (cell_px == 4) {   // thirty-two pixels of four rows at a time
        constexpr float kScale = 1.0f / 64;
        constexpr float kR = 0.299f * 3 * kScale, kG = 0.587f * 3 * kScale, kB = 0.114f * 3 * kScale, kA = kScale;
        const I8 even{0, 2, 4, 6, 8, 10, 12, 14}, odd{1, 3, 5, 7, 9, 11, 13, 15};
        while (cells >= 8) {
            U8 rb[4] = {}, ga[4] = {};
            for (int r = 0; r < 4; ++r)
                for (int k = 0; k < 4; ++k) {
                    U8 p;
                    __builtin_memcpy(&p, rows + r * row_bytes + 32 * k, sizeof p);
                    rb[k] += p & 0xff00ffu;
                    ga[k] += p >> 8 & 0xff00ffu;
                }
            const U8 rb_low = __builtin_shuffle(rb[0], rb[1], even) + __builtin_shuffle(rb[0], rb[1], odd), rb_high = __builtin_shuffle(rb[2], rb[3], even) + __builtin_shuffle(rb[2], rb[3], odd);
            const U8 ga_low = __builtin_shuffle(ga[0], ga[1], even) + __builtin_shuffle(ga[0], ga[1], odd), ga_high = __builtin_shuffle(ga[2], ga[3], even) + __builtin_shuffle(ga[2], ga[3], odd);
            const U8 rb_sum = __builtin_shuffle(rb_low, rb_high, even) + __builtin_shuffle(rb_low, rb_high, odd);
            const U8 ga_sum = __builtin_shuffle(ga_low, ga_high, even) + __builtin_shuffle(ga_low, ga_high, odd);
            const U8 red = rb_sum & 0xffffu, blue = rb_sum >> 16, green = ga_sum & 0xffffu, alpha = ga_sum >> 16;
            store(out, (kR * __builtin_convertvector(reinterpret_cast<I8>(red), V8) + kB * __builtin_convertvector(reinterpret_cast<I8>(blue), V8)) +
                           (kG * __builtin_convertvector(reinterpret_cast<I8>(green), V8) + kA * __builtin_convertvector(reinterpret_cast<I8>(alpha), V8)));
            rows += 128;
            out += 8;
            cells -= 8;
        }
    }
    constexpr int kChunk = 256;   // pixels
    std::uint32_t rb[kChunk], ga[kChunk];
    const int per_chunk = kChunk / cell_px;
    const float scale = 1.0f / static_cast<float>(4 * cell_px * cell_px);
    const float wr = 0.299f * 3 * scale, wg = 0.587f * 3 * scale, wb = 0.114f * 3 * scale, wa = scale;
    for (int c0 = 0; c0 < cells; c0 += per_chunk) {
        const int count = (cells - c0 < per_chunk ? cells - c0 : per_chunk) * cell_px;
        for (int r = 0; r < cell_px; ++r) {
            const std::uint8_t* p = rows + r * row_bytes + static_cast<std::ptrdiff_t>(c0) * cell_px * 4;
            if (r == 0)
                for (int x = 0; x < count; ++x) {
                    std::uint32_t v;
                    __builtin_memcpy(&v, p + 4 * x, 4);
                    rb[x] = v & 0xff00ffu;
                    ga[x] = (v >> 8) & 0xff00ffu;
                }
            else
                for (int x = 0; x < count; ++x) {
                    std::uint32_t v;
                    __builtin_memcpy(&v, p + 4 * x, 4);
                    rb[x] += v & 0xff00ffu;
                    ga[x] += (v >> 8) & 0xff00ffu;
                }
        }
        for (int x = 0; x < count; x += cell_px) {
            std::uint32_t s = rb[x] + rb[x + 1], t = ga[x] + ga[x + 1];
            if (cell_px == 4) {
                s += rb[x + 2] + rb[x + 3];
                t += ga[x + 2] + ga[x + 3];
            }
            out[c0 + x / cell_px] = (wr * static_cast<float>(s & 0xffffu) + wb * static_cast<float>(s >> 16)) +
                                    (wg * static_cast<float>(t & 0xffffu) + wa * static_cast<float>(t >> 16));
        }
    }
}

static void smooth(const SmoothJob& job, int row0, int row1) {
    constexpr float kLikeness = 1.0f / (4.0f * 4.0f);   // a difference of 4 of 255 halves a neighbour's weight
    V8 one, likeness;
    splat(one, 1.0f);
    splat(likeness, kLikeness);
    for (int y = row0; y < row1; ++y) {
        for (int x = job.x0; x < job.x1;) {
            const bool inside = x >= job.step && x + 8 + job.step <= job.width && x + 8 <= job.x1;
            const int lanes = inside ? 8 : 1;
            float u_sum[8], v_sum[8];
            if (inside) {
                V8 su{}, sv{}, sw{}, centre;
                load(centre, job.guide + y * job.guide_stride + x);
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) {
                        const int yy = clamp(y + dy * job.step, 0, job.height - 1), xx = x + dx * job.step;
                        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(yy) * job.width + xx;
                        V8 g, w, u, v;
                        load(g, job.guide + yy * job.guide_stride + xx);
                        load(w, job.trust + at);
                        load(u, job.u + at);
                        load(v, job.v + at);
                        g -= centre;
                        w = w / (one + g * g * likeness);
                        su += w * u;
                        sv += w * v;
                        sw += w;
                    }
                store(u_sum, su / sw);
                store(v_sum, sv / sw);
            } else {
                float su = 0, sv = 0, sw = 0;
                const float centre = job.guide[y * job.guide_stride + x];
                for (int dy = -1; dy <= 1; ++dy)
                    for (int dx = -1; dx <= 1; ++dx) {
                        const int yy = clamp(y + dy * job.step, 0, job.height - 1), xx = clamp(x + dx * job.step, 0, job.width - 1);
                        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(yy) * job.width + xx;
                        const float g = job.guide[yy * job.guide_stride + xx] - centre;
                        const float w = job.trust[at] / (1.0f + g * g * kLikeness);
                        su += w * job.u[at];
                        sv += w * job.v[at];
                        sw += w;
                    }
                u_sum[0] = su / sw;
                v_sum[0] = sv / sw;
            }
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * job.width + x;
            for (int l = 0; l < lanes; ++l) {
                job.u_out[at + l] = u_sum[l];
                job.v_out[at + l] = v_sum[l];
            }
            x += lanes;
        }
    }
}
