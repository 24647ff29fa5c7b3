// Vectors of eight floats for kernels_*.hpp, included inside a namespace of its own per code path. No standard library here:
// an inline function of it, compiled for AVX2, could be the copy that the linker keeps for all.

typedef float V8 __attribute__((vector_size(32)));
typedef float V4 __attribute__((vector_size(16)));
typedef std::int32_t I8 __attribute__((vector_size(32)));
typedef std::uint32_t U8 __attribute__((vector_size(32)));
typedef std::uint16_t H16 __attribute__((vector_size(32)));
typedef std::int32_t I4 __attribute__((vector_size(16)));
typedef std::uint64_t L2 __attribute__((vector_size(16)));

#define FOVEA_INLINE static inline __attribute__((always_inline))

FOVEA_INLINE void load(V8& v, const float* p) { __builtin_memcpy(&v, p, sizeof v); }
FOVEA_INLINE void store(float* p, const V8& v) { __builtin_memcpy(p, &v, sizeof v); }
FOVEA_INLINE void splat(V8& v, float f) { v = V8{f, f, f, f, f, f, f, f}; }
FOVEA_INLINE void absolute(V8& out, const V8& v) {
    const I8 bits = reinterpret_cast<I8>(v) & 0x7fffffff;
    out = reinterpret_cast<V8>(bits);
}
FOVEA_INLINE void at_least(V8& v, const V8& low) { v = v > low ? v : low; }

// r = {sum of a, sum of b, sum of c, sum of d}, always in the same order.
FOVEA_INLINE void sum4(V4& r, const V8& a8, const V8& b8, const V8& c8, const V8& d8) {
    struct Halves { V4 lo, hi; };
    Halves ha, hb, hc, hd;
    __builtin_memcpy(&ha, &a8, sizeof ha);
    __builtin_memcpy(&hb, &b8, sizeof hb);
    __builtin_memcpy(&hc, &c8, sizeof hc);
    __builtin_memcpy(&hd, &d8, sizeof hd);
    const V4 a = ha.lo + ha.hi, b = hb.lo + hb.hi, c = hc.lo + hc.hi, d = hd.lo + hd.hi;
    const V4 ab = __builtin_shuffle(a, b, I4{0, 4, 1, 5}) + __builtin_shuffle(a, b, I4{2, 6, 3, 7});
    const V4 cd = __builtin_shuffle(c, d, I4{0, 4, 1, 5}) + __builtin_shuffle(c, d, I4{2, 6, 3, 7});
    r = __builtin_shuffle(ab, cd, I4{0, 1, 4, 5}) + __builtin_shuffle(ab, cd, I4{2, 3, 6, 7});
}

FOVEA_INLINE float smaller(float a, float b) { return a < b ? a : b; }
FOVEA_INLINE float larger(float a, float b) { return a > b ? a : b; }
FOVEA_INLINE float clamp(float v, float lo, float hi) { return v < lo ? lo : v > hi ? hi : v; }
FOVEA_INLINE int clamp(int v, int lo, int hi) { return v < lo ? lo : v > hi ? hi : v; }
FOVEA_INLINE int floor_int(float v) {
    const int i = static_cast<int>(v);
    return i - (static_cast<float>(i) > v ? 1 : 0);
}
