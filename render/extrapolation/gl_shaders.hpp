// The kernels of gl_passes.cpp that find the motion of patches; those that use it are in gl_shaders_field.hpp.
//
// A kernel defines RESULT kernel(ivec2 at), or its own main. Coordinates: pixels of the kernel's own output; images are
// sampled with clamped edges. A patch of the motion grid has 8x8 pixels and is centred on the corner 4 * at of the luma
// level's pixels, as in kernels_search.hpp. kCell: pixels of the picture along the edge of one of the finest level's, a cell. A
// software rasteriser runs both sides of an `if` and every loop at least once; it leaves a loop when nobody is in it any more. What can
// be spared is spared by lists of tiles, and as turns of a loop.
#pragma once

namespace fovea::render::extrapolation::shaders {

inline constexpr const char* kHead = R"(#version 310 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
layout(binding = 0) uniform sampler2D image0;
layout(binding = 1) uniform sampler2D image1;
layout(binding = 2) uniform sampler2D image2;
layout(binding = 3) uniform sampler2D image3;
layout(binding = 4) uniform usampler2D patches;
uniform ivec2 size;      // of image0, where a kernel needs it
uniform int cell;
uniform int rounds;
uniform float step_px;
uniform float reach;
ivec2 way(int k) { return ivec2(k == 0 ? -1 : k == 1 ? 1 : 0, k == 2 ? -1 : k == 3 ? 1 : 0); }
// Red of the pixels base + (0,1) (1,1) (1,0) (0,0), asked for at the corner that they share.
vec4 quad(sampler2D image, vec2 base, vec2 its_size) { return textureGather(image, (base + 1.0) / its_size); }
// Red between pixel centres; not every driver filters 32-bit floats.
float between(sampler2D image, vec2 p) {
    vec2 q = p - 0.5, base = floor(q), f = q - base;
    vec4 g = quad(image, base, vec2(textureSize(image, 0)));
    vec2 rows = mix(g.wx, g.zy, f.x);
    return mix(rows.x, rows.y, f.y);
}
)";

// Everything, or the rectangles of a list, two triangles each; place: texels per tile (0: everything), 0, the target's size.
inline constexpr const char* kVertex = R"(#version 310 es
layout(binding = 5) uniform highp usampler2D places;
uniform ivec4 place;
void main() {
    vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    if (place.x > 0) {
        uvec2 words = texelFetch(places, ivec2(gl_InstanceID & 255, gl_InstanceID >> 8), 0).xy;
        vec2 corner = vec2(words.x & 0xffffu, words.x >> 16) + vec2(words.y & 0xffffu, words.y >> 16) * vec2((0x1a >> gl_VertexID) & 1, (0x34 >> gl_VertexID) & 1);
        p = 2.0 * corner * float(place.x) / vec2(place.zw) - 1.0;
    }
    gl_Position = vec4(p, 0.0, 1.0);
}
)";
inline constexpr const char* kFragmentMain = R"(
layout(location = 0) out RESULT color;
void main() { color = kernel(ivec2(gl_FragCoord.xy)); }
)";
// %s: the image's format qualifier. Of a list a work group's x is the block, y and z say which part of it.
inline constexpr const char* kComputeMain = R"(
layout(local_size_x = 8, local_size_y = 8) in;
layout(%s, binding = 0) writeonly uniform highp IMAGE target;
layout(binding = 5) uniform highp usampler2D places;
uniform ivec4 place;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (place.x > 0) {
        uint word = texelFetch(places, ivec2(gl_WorkGroupID.x & 255u, gl_WorkGroupID.x >> 8), 0).x;
        at = place.x * ivec2(word & 0xffffu, word >> 16) + 8 * ivec2(gl_WorkGroupID.yz) + ivec2(gl_LocalInvocationID.xy);
    }
    if (all(lessThan(at, imageSize(target)))) imageStore(target, at, kernel(at));
}
)";

inline constexpr const char* kCopy = R"(
vec4 kernel(ivec2 at) { return texelFetch(image0, at, 0); }
)";

// The key of a float picture, that is the geometric mean of its positive luma, as luma_key() of sources.hpp takes it: of a
// column of 64 samples, x the mean of the logarithms to base 2 and y of how many; then of all of them. image0: the picture, then
// those; size: of the picture.
inline constexpr const char* kKeyColumns = R"(//K key columns
vec4 kernel(ivec2 at) {
    vec2 sum = vec2(0.0);
    for (int k = 0; k < 64; ++k) {
        float l = dot(texelFetch(image0, ivec2(2 * at.x + 1, 2 * k + 1) * size / 128, 0).rgb, vec3(0.299, 0.587, 0.114));
        if (l > 1e-30 && l < 1e38) sum += vec2(log2(l), 1.0);
    }
    return vec4(sum.x / max(sum.y, 1.0), sum.y, 0.0, 1.0);
}
)";
inline constexpr const char* kKey = R"(//K key
vec4 kernel(ivec2 at) {
    vec2 sum = vec2(0.0);
    for (int x = 0; x < 64; ++x) {
        vec2 column = texelFetch(image0, ivec2(x, 0), 0).xy;
        sum += vec2(column.x * column.y, column.y);
    }
    return vec4(sum.x / max(sum.y, 1.0));
}
)";

// Luma of a cell of both sources, 0 to 255; where they are the same it is asked for once. image0: nearer, image1: farther, image2:
// where a tile stands still; size: of the sources.
#define FOVEA_LUMA                                                                                                           \
    "layout(location = 0) out vec4 near_luma;\n"                                                                             \
    "layout(location = 1) out vec4 far_luma;\n"                                                                              \
    "void main() {\n"                                                                                                        \
    "    ivec2 at = ivec2(gl_FragCoord.xy);\n"                                                                               \
    "    prepare();\n"                                                                                                       \
    "    near_luma = vec4(cell_luma(image0, at), 0.0, 0.0, 1.0);\n"                                                          \
    "    far_luma = vec4(cell_luma(image1, at), 0.0, 0.0, 1.0);\n"                                                           \
    "}\n"
// Eight bits: the driver filters 2x2 pixels. `rounds` 1: one channel, taken as grey.
inline constexpr const char* kLumaBytes = R"(//K luma
vec4 weights;
vec2 per_pixel;
void prepare() {
    const float kPart = 4.0 * 255.0 / float(kCell * kCell);
    weights = kPart * (rounds == 1 ? vec4(0.75, 0.0, 0.0, 0.25) : vec4(0.75 * vec3(0.299, 0.587, 0.114), 0.25));
    per_pixel = 1.0 / vec2(size);
}
float cell_luma(sampler2D image, ivec2 at) {
    vec4 sum = vec4(0.0);
    for (int y = 1; y < kCell; y += 2)
        for (int x = 1; x < kCell; x += 2) sum += textureLod(image, vec2(kCell * at + ivec2(x, y)) * per_pixel, 0.0);
    return dot(sum, weights);
}
)" FOVEA_LUMA;
// Floats: mapped to x / (key + x), image3: of kKey.
inline constexpr const char* kLumaFloats = R"(//K luma
float key;
void prepare() { key = exp2(texelFetch(image3, ivec2(0), 0).r); }
float cell_luma(sampler2D image, ivec2 at) {
    float sum = 0.0;
    for (int k = 0; k < kCell * kCell; ++k) {
        vec4 p = texelFetch(image, min(kCell * at + ivec2(k % kCell, k / kCell), size - 1), 0);
        float l = dot(p.rgb, vec3(0.299, 0.587, 0.114));
        l = l > 0.0 && l < 1e38 ? l : 0.0;
        sum += 0.75 * l / (key + l) + 0.25 * (p.a > 0.0 ? min(p.a, 1.0) : 0.0);
    }
    return sum * (255.0 / float(kCell * kCell));
}
)" FOVEA_LUMA;
#undef FOVEA_LUMA

// x: 1 where a tile of 16x16 pixels is the same in both sources. y: 1 where such a tile has anything in it that shows that it
// stands still. image0: those that are the same, image1: near luma; size: of that.
inline constexpr const char* kTiles = R"(//K tiles
vec4 kernel(ivec2 at) {
    int n = texelFetch(image0, at, 0).r > 0.5 ? 16 / kCell : 0;
    float low = 1e9, high = -1e9;
    for (int y = n * at.y; y < min(n * at.y + n, size.y); ++y)
        for (int x = n * at.x; x < min(n * at.x + n, size.x); ++x) {
            float l = texelFetch(image1, ivec2(x, y), 0).r;
            low = min(low, l);
            high = max(high, l);
        }
    return vec4(n > 0 ? 1.0 : 0.0, high - low > 0.02 ? 1.0 : 0.0, 0.0, 1.0);
}
)";

// The next level of both lumas. size: of this one.
inline constexpr const char* kHalve = R"(//K halve
layout(location = 0) out vec4 near_luma;
layout(location = 1) out vec4 far_luma;
void main() {
    vec2 base = min(2.0 * floor(gl_FragCoord.xy), vec2(size - 1)), all_of_it = vec2(textureSize(image0, 0));
    near_luma = vec4(dot(quad(image0, base, all_of_it), vec4(0.25)), 0.0, 0.0, 1.0);
    far_luma = vec4(dot(quad(image1, base, all_of_it), vec4(0.25)), 0.0, 0.0, 1.0);
}
)";

// What is known of a patch, in one texel: u and v as they are; xx, yy, xy (of 64 pixels, over 64) as halves.
inline constexpr const char* kPatch = R"(
struct Patch { vec2 motion; vec3 matrix; };   // matrix: xx, yy, xy, less where the patch fits badly
uvec4 words_of(Patch p) { return uvec4(floatBitsToUint(p.motion), packHalf2x16(p.matrix.xy / 64.0), packHalf2x16(vec2(p.matrix.z / 64.0, 0.0))); }
vec2 motion_of(uvec4 t) { return uintBitsToFloat(t.xy); }
Patch patch_of(uvec4 t) {
    return Patch(uintBitsToFloat(t.xy), 64.0 * vec3(unpackHalf2x16(t.z), unpackHalf2x16(t.w).x));
}
)";

// Inverse compositional search of one patch. image0: the luma it is of, image1: the other, image2: motion of the coarser
// level, unless reach is 0; image3: tiles. Rows of the window: columns -1 to 2, 3 to 6, and 7 and 8 of the patch.
inline constexpr const char* kSearch = R"(//K search
vec4 wa[10], wb[10];
vec2 wc[10], corner, mean_g, all_of_it;   // all_of_it: of the textures, which may be larger than the level
#define WINDOW(j) { vec2 b = corner + vec2(-1, 2 * j - 1); \
    vec4 p = quad(image0, b, all_of_it), q = quad(image0, b + vec2(2, 0), all_of_it), r = quad(image0, b + vec2(4, 0), all_of_it), s = quad(image0, b + vec2(6, 0), all_of_it), t = quad(image0, b + vec2(8, 0), all_of_it); \
    wa[2 * j] = vec4(p.wz, q.wz); wb[2 * j] = vec4(r.wz, s.wz); wc[2 * j] = t.wz; \
    wa[2 * j + 1] = vec4(p.xy, q.xy); wb[2 * j + 1] = vec4(r.xy, s.xy); wc[2 * j + 1] = t.xy; }
#define LEFT(r) vec4(wa[r].yzw, wb[r].x)
#define RIGHT(r) vec4(wb[r].yzw, wc[r].x)
#define GRADIENTS(r) vec4 gxa = 0.5 * (vec4(wa[r].zw, wb[r].xy) - wa[r]), gxb = 0.5 * (vec4(wb[r].zw, wc[r]) - wb[r]); \
    vec4 gya = 0.5 * (LEFT(r + 1) - LEFT(r - 1)), gyb = 0.5 * (RIGHT(r + 1) - RIGHT(r - 1));
// One row of the patch against the row between `upper` and `lower` of the other picture.
#define COMPARE(r, upper_a, upper_b, lower_a, lower_b) { GRADIENTS(r) \
    vec4 a = mix(upper_a, lower_a, f.y) - LEFT(r), b = mix(upper_b, lower_b, f.y) - RIGHT(r); \
    sd += a + b; sdd += a * a + b * b; sx += a * gxa + b * gxb; sy += a * gya + b * gyb; }
// Two rows of the other picture, between columns.
#define TWO_ROWS(j) { vec2 b = base + vec2(0, 2 * j); \
    vec4 p = quad(image1, b, all_of_it), q = quad(image1, b + vec2(2, 0), all_of_it), r = quad(image1, b + vec2(4, 0), all_of_it), s = quad(image1, b + vec2(6, 0), all_of_it); \
    vec2 t = quad(image1, b + vec2(8, 0), all_of_it).wx; \
    ea = mix(vec4(p.wz, q.wz), vec4(p.z, q.wz, r.w), f.x); eb = mix(vec4(r.wz, s.wz), vec4(r.z, s.wz, t.x), f.x); \
    oa = mix(vec4(p.xy, q.xy), vec4(p.y, q.xy, r.x), f.x); ob = mix(vec4(r.xy, s.xy), vec4(r.y, s.xy, t.y), f.x); }
vec3 fit(vec2 m) {   // bx, by, cost
    vec2 base = floor(corner + m), f = corner + m - base;
    vec4 sd = vec4(0.0), sdd = vec4(0.0), sx = vec4(0.0), sy = vec4(0.0), ea, eb, oa, ob, la, lb;
    TWO_ROWS(0) COMPARE(1, ea, eb, oa, ob) la = oa; lb = ob;
    TWO_ROWS(1) COMPARE(2, la, lb, ea, eb) COMPARE(3, ea, eb, oa, ob) la = oa; lb = ob;
    TWO_ROWS(2) COMPARE(4, la, lb, ea, eb) COMPARE(5, ea, eb, oa, ob) la = oa; lb = ob;
    TWO_ROWS(3) COMPARE(6, la, lb, ea, eb) COMPARE(7, ea, eb, oa, ob) la = oa; lb = ob;
    TWO_ROWS(4) COMPARE(8, la, lb, ea, eb)
    const vec4 one = vec4(1.0);
    float shift = dot(sd, one) / 64.0;
    return vec3(vec2(dot(sx, one), dot(sy, one)) - mean_g * (64.0 * shift), dot(sdd, one) - 64.0 * shift * shift);
}
// The patch lies further outside the other picture than outside its own: what it shows came into the picture since.
bool leaves(vec2 m) {
    vec2 last = vec2(size - 8), p = corner + m;
    return any(lessThan(p, min(corner, vec2(0.0)) - 1.0)) || any(greaterThan(p, max(corner, last) + 1.0));
}
RESULT kernel(ivec2 at) {
    corner = vec2(4 * at) - 4.0;
    all_of_it = vec2(textureSize(image0, 0));
    vec2 m = vec2(0.0);
    ivec2 coarse = ((size + 1) / 2 + 3) / 4;   // the last of the coarser level's patches
    bool has_coarse = reach < 0.0;
    if (has_coarse) m = texelFetch(image2, min(at / 2, coarse), 0).xy + texelFetch(image2, min((at + 1) / 2, coarse), 0).xy;
    WINDOW(0) WINDOW(1) WINDOW(2) WINDOW(3) WINDOW(4)
    vec4 tx = vec4(0.0), ty = vec4(0.0), txx = vec4(0.0), tyy = vec4(0.0), txy = vec4(0.0);
#define SUM(r) { GRADIENTS(r) tx += gxa + gxb; ty += gya + gyb; txx += gxa * gxa + gxb * gxb; tyy += gya * gya + gyb * gyb; txy += gxa * gya + gxb * gyb; }
    SUM(1) SUM(2) SUM(3) SUM(4) SUM(5) SUM(6) SUM(7) SUM(8)
    const vec4 one = vec4(1.0);
    mean_g = vec2(dot(tx, one), dot(ty, one)) / 64.0;
    vec3 h = vec3(dot(txx, one), dot(tyy, one), dot(txy, one)) - 64.0 * vec3(mean_g * mean_g, mean_g.x * mean_g.y);
    ivec2 tiles = (size * cell + 15) / 16 - 1;
    ivec2 first = clamp((4 * at - 4) * cell / 16, ivec2(0), tiles), last = clamp(((4 * at + 4) * cell - 1) / 16, ivec2(0), tiles);
    bool still = all(lessThanEqual(last - first, ivec2(3))), anchored = false;
    for (int y = first.y; still && y <= last.y; ++y)
        for (int x = first.x; still && x <= last.x; ++x) {
            vec2 tile = texelFetch(image3, ivec2(x, y), 0).xy;
            still = tile.x > 0.5;
            anchored = anchored || tile.y > 0.5;
        }
    if (still && anchored) return words_of(Patch(vec2(0.0), vec3(1e4, 1e4, 0.0)));
    if (still) return words_of(Patch(m, vec3(0.0)));
    if (h.x + h.y < 16.0 || leaves(m)) return words_of(Patch(m, vec3(0.0)));
    // What the neighbours on the coarser level found, and, but for the finest level, standing still; where that is something else.
    vec2 others[5];
    int count = 0;
    for (int k = 0; has_coarse && k < (cell == kCell ? 4 : 5); ++k) {
        vec2 other = k == 4 ? vec2(0.0) : 2.0 * texelFetch(image2, clamp(at / 2 + way(k), ivec2(0), coarse), 0).xy, d = other - m;
        others[count] = other;
        if (dot(d, d) >= 0.0625) ++count;
    }
    // A little on the diagonal keeps a flat patch where it is, a part of the other axis' share an edge from sliding along itself.
    float a = h.x + 0.006 * h.y + 8.0, d = h.y + 0.006 * h.x + 8.0, c = 0.994 * h.z, det = a * d - c * c, still_left = 0.0;
    vec2 start = m, trial = m;
    vec3 best = vec3(0.0, 0.0, 3e38);
    for (int i = 0; i <= count + rounds; ++i) {
        bool refines = i > count;
        vec2 step = vec2(d * best.x - c * best.y, a * best.y - c * best.x) / det;
        if (refines) trial = m - step;
        else if (i > 0) trial = others[i - 1];
        if (refines && !(dot(trial - start, trial - start) < 64.0)) break;
        if (refines && dot(step, step) < 0.0036) {   // so little needs no proof
            m = trial;
            break;
        }
        vec3 now = fit(trial);
        // Of two places along an edge reading between pixels alone leaves more at the one; and part of it a step will take away.
        float left = now.z - 0.3 * dot(now.xy, vec2(d * now.x - c * now.y, a * now.y - c * now.x)) / det;
        if (i == 0 || (refines ? now.z < best.z : left < 0.9 * still_left - 0.03 * (h.x + h.y))) {
            best = now;
            still_left = left;
            m = trial;
            if (i == 0 && now.z < 64.0) count = 0;   // a level of noise per pixel: none fits better
        } else if (refines) break;
        if (!refines) start = m;
    }
    return words_of(Patch(m, h / (1.0 + best.z / 256.0)));
}
)";

// Neighbours exchange what they know: a patch that sees only an edge moves along it as they do, an even one as all of them
// do; those that differ widely do not belong together. image0: motion as of the round before (the first: as found, in patches); reach:
// the stiffness; cell: how far away the neighbours are, which then count less and have to agree more.
#define FOVEA_BALANCE                                                                                                                    \
    "vec3 heard(ivec2 p, vec2 m) {\n"                                                                                                    \
    "    vec2 n = now(clamp(p, ivec2(0), size - 1)), d = n - m;\n"                                                                       \
    "    float w = p == clamp(p, ivec2(0), size - 1) ? reach / (float(cell) * (1.0 + float(cell) * dot(d, d))) : 0.0;\n"                 \
    "    return w * vec3(n, 1.0);\n"                                                                                                     \
    "}\n"                                                                                                                                \
    "vec4 kernel(ivec2 at) {\n"                                                                                                          \
    "    Patch own = patch_of(texelFetch(patches, at, 0));\n"                                                                            \
    "    vec2 m = now(at);\n"                                                                                                            \
    "    vec3 sum = heard(at + ivec2(-cell, 0), m) + heard(at + ivec2(cell, 0), m) + heard(at + ivec2(0, -cell), m) + heard(at + ivec2(0, cell), m);\n" \
    "    sum.xy += vec2(own.matrix.x * own.motion.x + own.matrix.z * own.motion.y, own.matrix.z * own.motion.x + own.matrix.y * own.motion.y);\n" \
    "    float a = own.matrix.x + sum.z, d = own.matrix.y + sum.z, det = a * d - own.matrix.z * own.matrix.z;\n"                         \
    "    if (det > 0.0) m = vec2(d * sum.x - own.matrix.z * sum.y, a * sum.y - own.matrix.z * sum.x) / det;\n"                           \
    "    return vec4(m, 0.0, 1.0);\n"                                                                                                    \
    "}\n"
inline constexpr const char* kBalance = "//K balance\nvec2 now(ivec2 p) { return texelFetch(image0, p, 0).xy; }\n" FOVEA_BALANCE;
inline constexpr const char* kBalanceFirst = "//K balance first\nvec2 now(ivec2 p) { return motion_of(texelFetch(patches, p, 0)); }\n" FOVEA_BALANCE;
#undef FOVEA_BALANCE

}  // namespace fovea::render::extrapolation::shaders
