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

// One pixel: the share of textured patches that nothing explains. image0: motion of a coarse level; image1: its luma.
inline constexpr const char* kVerdict = R"(
vec4 kernel(ivec2 at) {
    float textured = 0.0, bad = 0.0;
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) {
            float s = 0.0, ss = 0.0;
            for (int i = 0; i < 16; ++i) {
                vec2 p = vec2(4 * ivec2(x, y)) - 3.0 + 2.0 * vec2(i & 3, i >> 2);
                float v = textureLod(image1, p / vec2(textureSize(image1, 0)), 0.0).r;
                s += v;
                ss += v * v;
            }
            float variance = (ss - s * s / 16.0) / 16.0;
            if (variance < 4.0) continue;
            textured += 1.0;
            if (texelFetch(image0, ivec2(x, y), 0).z > 0.5 * variance) bad += 1.0;
        }
    return vec4(textured > 0.0 && bad > 0.6 * textured ? 1.0 : 0.0);
}
)";

// Where the cell at the output comes from: the motion is followed back to the cell that lands here.
inline constexpr const char* kDisplacement = R"(
vec2 motion(vec2 p) { return textureLod(image0, (p + 0.5) / vec2(size), 0.0).xy * step_px; }
vec4 kernel(ivec2 at) {
    vec2 d = motion(vec2(at));
    for (int i = 0; i < 3; ++i) d = motion(vec2(at) + d / float(4 * cell));
    if (!(max(abs(d.x), abs(d.y)) <= reach)) d = vec2(0.0);
    return vec4(d, 0.0, 0.0);
}
)";

// image0: near, image1: displacement, image2: verdict, image3: tiles. `rounds` 1: a float picture.
inline constexpr const char* kGather = R"(
// By its bits: a compiler may take v - v for 0, whatever v is.
bool finite(vec4 v) { return all(notEqual(floatBitsToUint(v) & 0x7f800000u, uvec4(0x7f800000u))); }
vec4 kernel(ivec2 at) {
    vec4 own = texelFetch(image0, at, 0);
    vec2 d = textureLod(image1, ((vec2(at) + 0.5) / float(4 * cell) + 0.5) / vec2(textureSize(image1, 0)), 0.0).xy;
    float length2 = dot(d, d);
    bool still = texelFetch(image3, at / 16, 0).r > 0.5 && length2 < 0.25;
    if (texelFetch(image2, ivec2(0), 0).r > 0.5 || still || length2 < 1.0 / 65536.0 || (rounds == 1 && !finite(own))) return own;
    vec2 p = vec2(at) + d, base = floor(p), f = p - base;
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 o = ivec2(k & 1, k >> 1);
        vec4 v = texelFetch(image0, clamp(ivec2(base) + o, ivec2(0), size - 1), 0);
        if (rounds == 1 && !finite(v)) continue;
        float w = (o.x == 1 ? f.x : 1.0 - f.x) * (o.y == 1 ? f.y : 1.0 - f.y);
        sum += w * v;
        total += w;
    }
    return total > 0.0 ? sum / total : own;
}
)";

}  // namespace fovea::render::extrapolation::shaders
