// Sums over blocks, for the judgement of what was moved. Included inside a namespace per code path. Whole numbers: any order of
// adding gives the same.

// Where each pixel of a row lies in the farther source, and whether it may be asked.
static void ask(const AskRow& row) {
    const float back = row.back;
    const int right = (row.width - 1) * 256, below = (row.height - 1) * 256, py0 = row.y * 256;
    const std::int32_t* __restrict from_x = row.dx;
    const std::int32_t* __restrict from_y = row.dy;
    std::int32_t* __restrict to_x = row.far_dx;
    std::int32_t* __restrict to_y = row.far_dy;
    std::uint32_t* __restrict mask = row.mask;
    for (int x = row.x0; x < row.x1; ++x) {
        const std::int32_t dx = static_cast<std::int32_t>(static_cast<float>(from_x[x]) * back), dy = static_cast<std::int32_t>(static_cast<float>(from_y[x]) * back);
        to_x[x] = dx;
        to_y[x] = dy;
        const int px = x * 256 + dx, py = py0 + dy;
        const std::uint32_t moved = (from_x[x] | from_y[x]) != 0 ? ~0u : 0u;
        const std::uint32_t inside = ((px >= 0) & (py >= 0) & (px <= right) & (py <= below)) != 0 ? ~0u : 1u;
        mask[x] = moved & inside;
    }
}

typedef std::int16_t S16 __attribute__((vector_size(32)));

// Of two channels that share a word, the lower and the upper one.
FOVEA_INLINE void split(I8& low, I8& high, const S16& pairs) {
    const I8 words = reinterpret_cast<I8>(pairs);
    low = (words << 16) >> 16;
    high = words >> 16;
}

static void weigh_rgba8(const WeighRow& row) {
    const std::uint8_t* const from[4] = {row.out, row.far, row.near, row.then};
    for (int b = 0; b < row.blocks; ++b) {
        U8 mask, v[4];
        __builtin_memcpy(&mask, row.mask + kWeighPx * b, sizeof mask);
        const U8 asked = U8{} - (mask >> 31);
        for (int r = 0; r < 4; ++r) {
            __builtin_memcpy(&v[r], from[r] + static_cast<std::ptrdiff_t>(4 * kWeighPx) * b, sizeof v[r]);
            v[r] &= asked;
        }
        BlockLanes& sum = row.lanes[b];
        I8 squares[2], counts[2];
        __builtin_memcpy(squares, sum.squares, sizeof squares);
        __builtin_memcpy(counts, sum.counts, sizeof counts);
        S16 shifts[4];
        __builtin_memcpy(shifts, sum.shifts, sizeof shifts);
        for (int k = 0; k < 2; ++k) {   // what is left, and what standing still leaves
            const U8 &p = v[2 * k], &q = v[2 * k + 1];
            const U8 p_even = p & 0x00ff00ffu, q_even = q & 0x00ff00ffu, p_odd = (p >> 8) & 0x00ff00ffu, q_odd = (q >> 8) & 0x00ff00ffu;
            const S16 even = reinterpret_cast<S16>(p_even) - reinterpret_cast<S16>(q_even), odd = reinterpret_cast<S16>(p_odd) - reinterpret_cast<S16>(q_odd);
            shifts[2 * k] += even;
            shifts[2 * k + 1] += odd;
            I8 low, high;
            split(low, high, even);
            squares[k] += low * low + high * high;
            split(low, high, odd);
            squares[k] += low * low + high * high;
        }
        counts[0] += reinterpret_cast<I8>(mask & 1u);
        counts[1] += reinterpret_cast<I8>(mask >> 31);
        __builtin_memcpy(sum.squares, squares, sizeof squares);
        __builtin_memcpy(sum.counts, counts, sizeof counts);
        __builtin_memcpy(sum.shifts, shifts, sizeof shifts);
    }
}

// r = {sum of a, sum of b, sum of c, sum of d}.
FOVEA_INLINE void sum4(I4& r, const I8& a8, const I8& b8, const I8& c8, const I8& d8) {
    struct Halves { I4 lo, hi; };
    Halves ha, hb, hc, hd;
    __builtin_memcpy(&ha, &a8, sizeof ha);
    __builtin_memcpy(&hb, &b8, sizeof hb);
    __builtin_memcpy(&hc, &c8, sizeof hc);
    __builtin_memcpy(&hd, &d8, sizeof hd);
    const I4 a = ha.lo + ha.hi, b = hb.lo + hb.hi, c = hc.lo + hc.hi, d = hd.lo + hd.hi;
    const I4 ab = __builtin_shuffle(a, b, I4{0, 4, 1, 5}) + __builtin_shuffle(a, b, I4{2, 6, 3, 7});
    const I4 cd = __builtin_shuffle(c, d, I4{0, 4, 1, 5}) + __builtin_shuffle(c, d, I4{2, 6, 3, 7});
    r = __builtin_shuffle(ab, cd, I4{0, 1, 4, 5}) + __builtin_shuffle(ab, cd, I4{2, 3, 6, 7});
}

static void sum_blocks(const BlockLanes* lanes, int blocks, BlockSums* sums) {
    for (int b = 0; b < blocks; ++b) {
        I8 squares[2], counts[2];
        __builtin_memcpy(squares, lanes[b].squares, sizeof squares);
        __builtin_memcpy(counts, lanes[b].counts, sizeof counts);
        S16 shifts[4];
        __builtin_memcpy(shifts, lanes[b].shifts, sizeof shifts);
        I4 all[3];
        sum4(all[0], counts[0], counts[1], squares[0], squares[1]);
        for (int k = 0; k < 2; ++k) {
            I8 c0, c1, c2, c3;
            split(c0, c2, shifts[2 * k]);
            split(c1, c3, shifts[2 * k + 1]);
            sum4(all[1 + k], c0, c1, c2, c3);
        }
        for (int k = 0; k < 3; ++k) {
            const V4 v = __builtin_convertvector(all[k], V4);
            __builtin_memcpy(reinterpret_cast<char*>(&sums[b]) + 16 * k, &v, sizeof v);
        }
    }
}
