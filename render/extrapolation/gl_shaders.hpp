// The kernels of gl_passes.cpp: each defines vec4 kernel(ivec2 at).
//
// Coordinates: pixels of the kernel's own output; images are sampled with clamped edges. A patch of the motion grid is
// centred on the corner 4 * at of the luma level's pixels, as in kernels_search.hpp.
#pragma once

namespace fovea::render::extrapolation::shaders {

inline constexpr const char* kHead = R"(#version 310 es
precision highp float;
precision highp int;
precision highp sampler2D;
layout(binding = 0) uniform sampler2D image0;
layout(binding = 1) uniform sampler2D image1;
layout(binding = 2) uniform sampler2D image2;
layout(binding = 3) uniform sampler2D image3;
uniform ivec2 size;      // of image0, where a kernel needs it
uniform int cell;
uniform int rounds;
uniform float step_px;
uniform float reach;
)";

inline constexpr const char* kVertex = R"(#version 310 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)";
inline constexpr const char* kFragmentMain = R"(
layout(location = 0) out vec4 color;
void main() { color = kernel(ivec2(gl_FragCoord.xy)); }
)";
// %s: the image's format qualifier.
inline constexpr const char* kComputeMain = R"(
layout(local_size_x = 8, local_size_y = 8) in;
layout(%s, binding = 0) writeonly uniform highp image2D target;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (all(lessThan(at, imageSize(target)))) imageStore(target, at, kernel(at));
}
)";

inline constexpr const char* kCopy = R"(
vec4 kernel(ivec2 at) { return texelFetch(image0, at, 0); }
)";

// 1 where a tile of 16x16 pixels is the same in both, bit for bit.
inline constexpr const char* kTiles = R"(
vec4 kernel(ivec2 at) {
    for (int y = 16 * at.y; y < min(16 * at.y + 16, size.y); ++y)
        for (int x = 16 * at.x; x < min(16 * at.x + 16, size.x); ++x)
            if (floatBitsToUint(texelFetch(image0, ivec2(x, y), 0)) != floatBitsToUint(texelFetch(image1, ivec2(x, y), 0)))
                return vec4(0.0);
    return vec4(1.0);
}
)";

// Luma of a cell, 0 to 255. `reach` 1: a float picture, mapped to x / (1 + x). `rounds` 1: one channel, taken as grey.
inline constexpr const char* kLuma = R"(
vec4 kernel(ivec2 at) {
    float sum = 0.0;
    for (int y = 0; y < cell; ++y)
        for (int x = 0; x < cell; ++x) {
            vec4 p = texelFetch(image0, min(cell * at + ivec2(x, y), size - 1), 0);
            if (rounds == 1) p.rgb = p.rrr;
            float l = dot(p.rgb, vec3(0.299, 0.587, 0.114));
            l = l > 0.0 && l < 1e30 ? l : 0.0;
            if (reach > 0.0) l = l / (1.0 + l);
            float a = p.a > 0.0 ? min(p.a, 1.0) : 0.0;
            sum += 0.75 * l + 0.25 * a;
        }
    return vec4(255.0 * sum / float(cell * cell), 0.0, 0.0, 1.0);
}
)";

inline constexpr const char* kHalve = R"(
vec4 kernel(ivec2 at) { return vec4(textureLod(image0, vec2(2 * at + 1) / vec2(size), 0.0).r, 0.0, 0.0, 1.0); }
)";

// Inverse compositional search of one patch: sixteen samples, each the mean of 2x2 pixels. Result: motion, cost per sample,
// and how much the patch knows (the smaller of its gradients' sums).
inline constexpr const char* kSearch = R"(
float t[16];
vec2 g[16];
vec2 origin, mean_g;
float near_at(vec2 p) { return textureLod(image0, p / vec2(size), 0.0).r; }
vec4 fit(vec2 m) {   // bx, by, cost
    vec3 sum = vec3(0.0);
    float squares = 0.0;
    for (int i = 0; i < 16; ++i) {
        float d = textureLod(image1, (origin + 2.0 * vec2(i & 3, i >> 2) + m) / vec2(size), 0.0).r - t[i];
        sum += vec3(g[i] * d, d);
        squares += d * d;
    }
    return vec4(sum.xy - mean_g * sum.z, squares - sum.z * sum.z / 16.0, 0.0);
}
vec4 kernel(ivec2 at) {
    origin = vec2(4 * at) - 3.0;
    vec2 sum = vec2(0.0);
    vec3 h = vec3(0.0);
    for (int i = 0; i < 16; ++i) {
        vec2 p = origin + 2.0 * vec2(i & 3, i >> 2);
        t[i] = near_at(p);
        g[i] = 0.5 * vec2(near_at(p + vec2(1, 0)) - near_at(p - vec2(1, 0)), near_at(p + vec2(0, 1)) - near_at(p - vec2(0, 1)));
        sum += g[i];
        h += vec3(g[i] * g[i], g[i].x * g[i].y);
    }
    mean_g = sum / 16.0;
    h -= vec3(sum * sum, sum.x * sum.y) / 16.0;
    vec2 m = vec2(0.0);
    ivec2 coarse = textureSize(image2, 0) - 1;
    bool has_coarse = reach < 0.0;
    if (has_coarse) m = texelFetch(image2, min(at / 2, coarse), 0).xy + texelFetch(image2, min((at + 1) / 2, coarse), 0).xy;
    // A still tile with anything in it stands still.
    ivec2 tiles = textureSize(image3, 0) - 1;
    ivec2 first = clamp((4 * at - 4) * cell / 16, ivec2(0), tiles), last = clamp(((4 * at + 4) * cell - 1) / 16, ivec2(0), tiles);
    bool still = all(lessThanEqual(last - first, ivec2(3)));
    for (int y = first.y; still && y <= last.y; ++y)
        for (int x = first.x; still && x <= last.x; ++x) still = texelFetch(image3, ivec2(x, y), 0).r > 0.5;
    float known = min(h.x, h.y);
    if (still && h.x + h.y > 0.1) return vec4(0.0, 0.0, 0.0, 1e4);
    if (h.x + h.y < 8.0) return vec4(m, 0.0, 0.0);
    vec4 best = fit(m);
    if (has_coarse)
        for (int k = 0; k < 5; ++k) {
            ivec2 q = clamp(at / 2 + ivec2(k == 0 ? -1 : k == 1 ? 1 : 0, k == 2 ? -1 : k == 3 ? 1 : 0), ivec2(0), coarse);
            vec2 other = k == 4 ? vec2(0.0) : 2.0 * texelFetch(image2, q, 0).xy;
            vec4 f = fit(other);
            if (f.z < 0.9 * best.z) { best = f; m = other; }
        }
    float a = h.x + 2.0, d = h.y + 2.0, det = a * d - h.z * h.z;
    vec2 start = m, trial = m;
    vec4 now = best;
    for (int i = 0; i < rounds; ++i) {
        trial -= vec2(d * now.x - h.z * now.y, a * now.y - h.z * now.x) / det;
        if (!(dot(trial - start, trial - start) < 64.0)) break;
        now = fit(trial);
        if (!(now.z < best.z)) break;
        best = now;
        m = trial;
    }
    return vec4(m, best.z / 16.0, max(known, 0.0));
}
)";

// Neighbours exchange what they know; those that differ widely do not belong together.
inline constexpr const char* kRelax = R"(
vec4 kernel(ivec2 at) {
    vec4 own = texelFetch(image0, at, 0);
    float w = own.w / (1.0 + own.z * 0.25);
    vec2 sum = w * own.xy;
    for (int k = 0; k < 8; ++k) {
        int j = k < 4 ? k : k + 1;
        vec4 n = texelFetch(image0, clamp(at + ivec2(j % 3 - 1, j / 3 - 1), ivec2(0), size - 1), 0);
        vec2 d = n.xy - own.xy;
        float v = 20.0 * (0.1 + min(n.w / (1.0 + n.z * 0.25), 100.0) * 0.01) / (1.0 + dot(d, d));
        sum += v * n.xy;
        w += v;
    }
    return vec4(sum / w, own.zw);
}
)";

// Motion of each pixel of a level: the mean of its four patches, those that fit it better counting more. image0: the luma
// the patches are of, image1: the other, image2: motion; size: of its grid.
inline constexpr const char* kSpread = R"(
vec4 kernel(ivec2 at) {
    float own = texelFetch(image0, at, 0).r;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        vec2 m = texelFetch(image2, min(at / 4 + ivec2(k & 1, k >> 1), size - 1), 0).xy;
        float e = textureLod(image1, (vec2(at) + 0.5 + m) / vec2(textureSize(image1, 0)), 0.0).r - own;
        sum += vec3(m, 1.0) / max(e * e, 1.0);
    }
    return vec4(sum.xy / sum.z, 1.0, 1.0);
}
)";

// A motion whose partner does not come back is doubted. image0: forward, image1: backward, per pixel of the level.
inline constexpr const char* kCheck = R"(
vec4 kernel(ivec2 at) {
    vec2 m = texelFetch(image0, at, 0).xy;
    ivec2 partner = clamp(ivec2(floor(vec2(at) + m + 0.5)), ivec2(0), size - 1);
    vec2 d = m + texelFetch(image1, partner, 0).xy;
    float limit = 0.75 + 0.05 * (abs(m.x) + abs(m.y));
    return vec4(m, dot(d, d) < limit * limit ? 1.0 : 0.02, 1.0);
}
)";

// One edge-aware pass over motion (xy) by trust (z), neighbours `rounds` pixels away. image1: luma.
inline constexpr const char* kSmooth = R"(
vec4 kernel(ivec2 at) {
    float centre = texelFetch(image1, at, 0).r;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 9; ++k) {
        ivec2 p = clamp(at + rounds * ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), size - 1);
        vec3 m = texelFetch(image0, p, 0).xyz;
        float g = texelFetch(image1, p, 0).r - centre;
        sum += vec3(m.xy, 1.0) * (m.z / (1.0 + g * g / 16.0));
    }
    return vec4(sum.xy / sum.z, texelFetch(image0, at, 0).z, 1.0);
}
)";

// Blocks of 8x8: x 1 where the motion explains more than standing still does, y 1 where there is texture, z 1 where nothing
// explains it. image0: motion of the finest level, image1 and image2: near and far luma of this one, `rounds` levels coarser.
inline constexpr const char* kJudge = R"(
vec4 kernel(ivec2 at) {
    ivec2 finest = textureSize(image0, 0), here = textureSize(image1, 0);
    float per = 1.0 / float(1 << rounds), n = 0.0, cells = 0.0;
    vec3 sums = vec3(0.0), squares = vec3(0.0);
    for (int y = 8 * at.y; y < min(8 * at.y + 8, here.y); ++y)
        for (int x = 8 * at.x; x < min(8 * at.x + 8, here.x); ++x) {
            cells += 1.0;
            vec2 m = texelFetch(image0, min(ivec2(x, y) << rounds, finest - 1), 0).xy * per;
            vec2 t = vec2(x, y) + m;
            // What came into the picture since cannot be judged by what was there before.
            if (any(lessThan(t, vec2(-0.5))) || any(greaterThan(t, vec2(here) - 0.5))) continue;
            float value = texelFetch(image1, ivec2(x, y), 0).r;
            vec3 v = vec3(value, texelFetch(image2, ivec2(x, y), 0).r - value, textureLod(image2, (t + 0.5) / vec2(here), 0.0).r - value);
            n += 1.0;
            sums += v;
            squares += v * v;
        }
    if (2.0 * n < cells) return vec4(1.0, 0.0, 0.0, 1.0);
    vec3 variance = squares / n - (sums / n) * (sums / n);   // of the luma, of standing still, of the motion
    bool textured = variance.x > 4.0;
    bool still = texelFetch(image3, min((8 * at << rounds) * cell / 16, textureSize(image3, 0) - 1), 0).r > 0.5;
    bool worse = variance.z > 0.97 * variance.y + 0.5 || (textured && variance.z > 1.2 * variance.x);
    return vec4(worse ? 0.0 : 1.0, textured ? 1.0 : 0.0, textured && variance.z > 0.5 * variance.x && !still ? 1.0 : 0.0, 1.0);
}
)";

// One pixel: whether most of the textured blocks (image0) stay unexplained.
inline constexpr const char* kVerdict = R"(
vec4 kernel(ivec2 at) {
    vec2 sum = vec2(0.0);
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) sum += texelFetch(image0, ivec2(x, y), 0).yz;
    return vec4(sum.x > 0.0 && sum.y > reach * sum.x ? 1.0 : 0.0);
}
)";

// How far the motion of a cell takes it in the output, in pixels. image0: motion, image1: blocks.
inline constexpr const char* kCarry = R"(
vec4 kernel(ivec2 at) {
    vec2 a = -texelFetch(image0, at, 0).xy * step_px * texelFetch(image1, (at >> rounds) / 8, 0).x;
    return vec4(max(abs(a.x), abs(a.y)) <= reach ? a : vec2(0.0), 0.0, 1.0);
}
)";

// Two pixels: the motion of the background, u and v as c0 + c1 x + c2 y with x and y from 0 to 1; a robust fit to image0, of
// kCarry.
inline constexpr const char* kBackground = R"(
vec4 kernel(ivec2 at) {
    vec3 u = vec3(0.0), v = vec3(0.0);
    for (int round = 0; round < 3; ++round) {
        mat3 m = mat3(1e-6);
        vec3 ru = vec3(0.0), rv = vec3(0.0);
        for (int k = 0; k < 256; ++k) {
            ivec2 p = (2 * ivec2(k & 15, k >> 4) + 1) * size / 32;
            vec2 a = texelFetch(image0, p, 0).xy;
            vec3 e = vec3(1.0, vec2(p) / vec2(size));
            vec2 d = a - vec2(dot(u, e), dot(v, e));
            float w = round == 0 ? 1.0 : 1.0 / (1.0 + dot(d, d));
            m += w * outerProduct(e, e);
            ru += w * a.x * e;
            rv += w * a.y * e;
        }
        for (int i = 0; i < 3; ++i) m[i][i] += 1e-3;
        mat3 inverted = inverse(m);
        u = inverted * ru;
        v = inverted * rv;
    }
    return vec4(at.x == 0 ? u : v, 1.0);
}
)";

// Where the output cell comes from: of the cells that land on it the one in front, that is the one that moves least like the
// background (image1); where none does, the motion of what lies behind. Nothing can be scattered here, so each motion found
// in the neighbourhood is followed back to a cell, and asked whether it lands.
inline constexpr const char* kDisplacement = R"(
bool outside(ivec2 p) { return any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, size)); }
vec2 carried(ivec2 p) { return texelFetch(image0, p, 0).xy; }
ivec2 way(int k) { return ivec2(k == 0 ? -1 : k == 1 ? 1 : 0, k == 2 ? -1 : k == 3 ? 1 : 0); }
// The cell that lands here if it moves about as `a`; outside: none does.
ivec2 source(ivec2 at, inout vec2 a) {
    float per = 1.0 / float(cell);
    ivec2 p = at;
    for (int i = 0; i < 3; ++i) {
        p = ivec2(floor(vec2(at) - a * per + 0.5));
        if (outside(p)) return p;
        a = carried(p);
    }
    return p + ivec2(floor(a * per + 0.5)) == at ? p : ivec2(-1);
}
float front(ivec2 p, vec2 a, vec3 u, vec3 v) {
    vec3 e = vec3(1.0, vec2(p) / vec2(size));
    vec2 d = a - vec2(dot(u, e), dot(v, e));
    return dot(d, d);
}
vec4 kernel(ivec2 at) {
    vec2 own = carried(at), a = own, low = own, high = own;
    for (int k = 0; k < 8; ++k) {
        vec2 n = carried(clamp(at + (k < 4 ? 2 : 12) * way(k & 3), ivec2(0), size - 1));
        low = min(low, n);
        high = max(high, n);
    }
    // All around move alike: there is one candidate.
    ivec2 p = source(at, a);
    if (all(lessThan(high - low, vec2(1.0)))) return vec4(outside(p) ? -own : -a, 0.0, 1.0);
    vec3 u = texelFetch(image1, ivec2(0, 0), 0).xyz, v = texelFetch(image1, ivec2(1, 0), 0).xyz;
    float best = -1.0, behind = 3e38;
    vec2 shown = vec2(0.0), hidden = vec2(0.0);
    for (int k = 0; k < 25; ++k) {
        ivec2 from = at + (k == 0 ? ivec2(0) : (1 << ((k - 1) / 4)) * way((k - 1) % 4));
        if (outside(from)) continue;
        a = carried(from);
        float f = front(from, a, u, v);
        if (f < behind) { behind = f; hidden = a; }
        p = source(at, a);
        if (outside(p)) continue;
        f = front(p, a, u, v);
        if (f > best) { best = f; shown = a; }
    }
    return vec4(best < 0.0 ? -hidden : -shown, best < 0.0 ? 1.0 : 0.0, 1.0);
}
)";

// image0: near, image1: displacement per cell, image2: verdict, image3: tiles. rounds: 1 a float picture, 2 cubic, 3 both.
inline constexpr const char* kGather = R"(
// By its bits: a compiler may take v - v for 0, whatever v is.
bool finite(vec4 v) { return all(notEqual(floatBitsToUint(v) & 0x7f800000u, uvec4(0x7f800000u))); }
// Between cell centres; where neighbours differ they belong to different surfaces, and the nearer one counts.
vec2 displacement(ivec2 at) {
    vec2 p = (vec2(at) + 0.5) / float(cell) - 0.5, base = floor(p), f = p - base;
    ivec2 last = textureSize(image1, 0) - 1;
    vec2 v[4];
    for (int k = 0; k < 4; ++k) v[k] = texelFetch(image1, clamp(ivec2(base) + ivec2(k & 1, k >> 1), ivec2(0), last), 0).xy;
    vec2 apart = max(max(v[0], v[1]), max(v[2], v[3])) - min(min(v[0], v[1]), min(v[2], v[3]));
    if (max(apart.x, apart.y) > 3.0) f = step(0.5, f);
    return mix(mix(v[0], v[1], f.x), mix(v[2], v[3], f.x), f.y);
}
vec4 tap(ivec2 p) { return texelFetch(image0, clamp(p, ivec2(0), size - 1), 0); }
// Keys' cubic, slope -0.6 at 1.
vec4 lobes(float f) {
    float g = 1.0 - f;
    vec4 w = vec4(-0.6 * f * g * g, 1.0 + f * f * (1.4 * f - 2.4), 0.0, -0.6 * f * f * g);
    w.z = 1.0 - w.x - w.y - w.w;
    return w;
}
vec4 kernel(ivec2 at) {
    vec4 own = texelFetch(image0, at, 0);
    vec2 d = displacement(at);
    float length2 = dot(d, d);
    bool still = texelFetch(image3, at / 16, 0).r > 0.5 && length2 < 0.25, floats = (rounds & 1) != 0;
    if (texelFetch(image2, ivec2(0), 0).r > 0.5 || still || length2 < 1.0 / 65536.0 || (floats && !finite(own))) return own;
    vec2 p = vec2(at) + d, base = floor(p), f = p - base;
    vec4 sum = vec4(0.0), low = vec4(3.4e38), high = vec4(-3.4e38);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 o = ivec2(k & 1, k >> 1);
        vec4 v = tap(ivec2(base) + o);
        if (floats && !finite(v)) continue;
        low = min(low, v);
        high = max(high, v);
        float w = (o.x == 1 ? f.x : 1.0 - f.x) * (o.y == 1 ? f.y : 1.0 - f.y);
        sum += w * v;
        total += w;
    }
    if (total <= 0.0) return own;
    if ((rounds & 2) == 0 || total < 0.999) return sum / total;
    vec4 wx = lobes(f.x), wy = lobes(f.y), all4 = vec4(0.0);
    for (int k = 0; k < 16; ++k) {
        vec4 v = tap(ivec2(base) + ivec2(k & 3, k >> 2) - 1);
        if (floats && !finite(v)) return sum / total;
        all4 += wx[k & 3] * wy[k >> 2] * v;
    }
    // No dark rim about a light of 10,000; eight bits are clamped by their format.
    return floats ? clamp(all4, low, high) : clamp(all4, vec4(0.0), vec4(1.0));
}
)";

}  // namespace fovea::render::extrapolation::shaders
