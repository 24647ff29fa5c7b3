// The kernels of gl_passes.cpp that turn the motion of patches into motion per cell, and that into the output. See gl_shaders.hpp.
#pragma once

namespace fovea::render::extrapolation::shaders {

// Whether a motion of the finest level comes back, in z; in patches. image3: the motion back, `rounds` levels coarser, unless reach is 0.
#define FOVEA_TRUST                                                                                                                  \
    "float trust_of(vec2 at, vec2 m, ivec2 patches_wide) {\n"                                                                        \
    "    float per = 1.0 / float(1 << rounds);\n"                                                                                    \
    "    vec2 partner = (clamp(at + m, vec2(0.0), 4.0 * vec2(patches_wide) - 5.0) + 0.5) * per;\n"                                   \
    "    vec2 d = m * per + texelFetch(image3, clamp(ivec2(floor(partner / 4.0 + 0.5)), ivec2(0), textureSize(image3, 0) - 1), 0).xy;\n" \
    "    float limit = 0.75 + 0.05 * per * (abs(m.x) + abs(m.y));\n"                                                                 \
    "    return reach == 0.0 || dot(d, d) < limit * limit ? 1.0 : 0.02;\n"                                                           \
    "}\n"

// 1 for tiles that move whose patches do not agree, or have a motion that does not come back. image0: of kMoving, image2: motion;
// size: of its grid; cell: patches to a tile.
inline constexpr const char* kRough = "//K rough\n" FOVEA_TRUST R"(
vec4 kernel(ivec2 at) {
    const float kApart = 0.4;   // cells
    vec2 low = vec2(1e9), high = vec2(-1e9);
    float trust = 1.0;
    for (int y = 0; y <= cell; ++y)
        for (int x = 0; x <= cell; ++x) {
            ivec2 p = min(cell * at + ivec2(x, y), size - 1);
            vec2 m = texelFetch(image2, p, 0).xy;
            low = min(low, m);
            high = max(high, m);
            trust = min(trust, trust_of(vec2(4 * p), m, size));
        }
    return vec4(texelFetch(image0, at, 0).r > 0.5 && (any(greaterThan(high - low, vec2(kApart))) || trust < 1.0) ? 1.0 : 0.0);
}
)";

// Motion (xy) of each cell, its trust (z) and its luma (w), where patches agree: between the four around it. image0: the luma the
// patches are of, image2: motion.
inline constexpr const char* kGlide = R"(//K glide
layout(location = 0) out vec4 motion;
layout(location = 1) out vec4 smoothed;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), p = at / 4;
    vec2 f = (vec2(at & 3) + 0.5) / 4.0;
    vec2 m = mix(mix(texelFetch(image2, p, 0).xy, texelFetch(image2, p + ivec2(1, 0), 0).xy, f.x),
                 mix(texelFetch(image2, p + ivec2(0, 1), 0).xy, texelFetch(image2, p + 1, 0).xy, f.x), f.y);
    motion = smoothed = vec4(m, 1.0, texelFetch(image0, at, 0).r);
}
)";

// The same where they do not: the mean of the four patches, those that fit it better counting more. A motion whose partner does not
// come back is doubted. image1: the other luma; size: of the patches' grid.
inline constexpr const char* kSpread = "//K spread\n" FOVEA_TRUST R"(
vec4 kernel(ivec2 at) {
    float own = texelFetch(image0, at, 0).r;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        vec2 m = texelFetch(image2, min(at / 4 + ivec2(k & 1, k >> 1), size - 1), 0).xy;
        float e = between(image1, vec2(at) + 0.5 + m) - own;
        sum += vec3(m, 1.0) / max(e * e, 1.0);
    }
    vec2 m = sum.xy / sum.z;
    return vec4(m, trust_of(vec2(at), m, size), own);
}
)";
#undef FOVEA_TRUST

// One edge-aware pass over motion by trust and luma, neighbours `rounds` cells away.
inline constexpr const char* kSmooth = R"(//K smooth
vec4 kernel(ivec2 at) {
    vec4 own = texelFetch(image0, at, 0);
    vec3 sum = vec3(own.xy, 1.0) * own.z;
    for (int k = 0; k < 8; ++k) {
        int j = k < 4 ? k : k + 1;
        vec4 n = texelFetch(image0, clamp(at + rounds * ivec2(j % 3 - 1, j / 3 - 1), ivec2(0), size - 1), 0);
        float g = n.w - own.w;
        sum += vec3(n.xy, 1.0) * (n.z / (1.0 + g * g / 16.0));
    }
    return vec4(sum.xy / sum.z, own.zw);
}
)";

// Blocks of 8x8: x 1 where the motion explains them, and standing still does not four times better, y 1 where there is texture, z 1 where nothing
// explains it. image0: motion of the finest level, image1 and image2: near and far luma of this one, `rounds` levels coarser;
// size: of that.
inline constexpr const char* kJudge = R"(//K judge
vec4 kernel(ivec2 at) {
    ivec2 finest = textureSize(image0, 0), here = size;
    float per = 1.0 / float(1 << rounds), n = 0.0, cells = 0.0;
    vec3 sums = vec3(0.0), squares = vec3(0.0);
    ivec2 tile = (8 * at << rounds) * kCell / 16, tiles = textureSize(image3, 0) - 1;
    // All four tiles of a block of 32 pixels; of 16, the same one four times.
    float known = 1.0;
    for (int k = 0; k < 4; ++k) known = min(known, texelFetch(image3, min(((8 * at + 7 * ivec2(k & 1, k >> 1)) << rounds) * kCell / 16, tiles), 0).x);
    ivec2 end = known > 0.5 ? ivec2(0) : min(8 * at + 8, here);
    for (int y = 8 * at.y; y < end.y; ++y)
        for (int x = 8 * at.x; x < end.x; ++x) {
            cells += 1.0;
            vec2 m = texelFetch(image0, min(ivec2(x, y) << rounds, finest - 1), 0).xy * per;
            vec2 t = vec2(x, y) + m;
            // What came into the picture since cannot be judged by what was there before.
            if (any(lessThan(t, vec2(-0.5))) || any(greaterThan(t, vec2(here) - 0.5))) continue;
            float value = texelFetch(image1, ivec2(x, y), 0).r;
            vec3 v = vec3(value, texelFetch(image2, ivec2(x, y), 0).r - value, between(image2, t + 0.5) - value);
            n += 1.0;
            sums += v;
            squares += v * v;
        }
    if (known > 0.5) return vec4(1.0, 1.0, 0.0, 1.0);   // explained, by standing still
    if (2.0 * n < cells) return vec4(1.0, 0.0, 0.0, 1.0);
    vec3 variance = squares / n - (sums / n) * (sums / n);   // of the luma, of standing still, of the motion
    bool textured = variance.x > 4.0;
    bool still = texelFetch(image3, tile, 0).r > 0.5;
    bool worse = variance.z > 4.0 * variance.y + 0.5 || (textured && variance.z > 0.9 * variance.x && variance.z > 0.25 * variance.y);
    return vec4(worse ? 0.0 : 1.0, textured ? 1.0 : 0.0, textured && variance.z > 0.5 * variance.x && !still ? 1.0 : 0.0, 1.0);
}
)";

// What is refused there is asked again at the finest cells, `rounds` levels finer: stripes of a few pixels are mixed where cells are
// larger. image0: motion of them, image1 and image2: their lumas, image3: of kJudge; size: of the finest.
inline constexpr const char* kJudgeFinest = R"(//K judge finest
vec4 kernel(ivec2 at) {
    vec4 before = texelFetch(image3, at, 0);
    float n = 0.0;
    vec3 sums = vec3(0.0), squares = vec3(0.0);
    for (int k = 0; before.x < 0.5 && k < 64; ++k) {
        ivec2 p = (8 * at + ivec2(k & 7, k >> 3)) << rounds;
        vec2 t = vec2(p) + texelFetch(image0, min(p, size - 1), 0).xy;
        if (any(greaterThanEqual(p, size)) || any(lessThan(t, vec2(-0.5))) || any(greaterThan(t, vec2(size) - 0.5))) continue;
        float value = texelFetch(image1, p, 0).r;
        vec3 v = vec3(value, texelFetch(image2, p, 0).r - value, between(image2, t + 0.5) - value);
        n += 1.0;
        sums += v;
        squares += v * v;
    }
    if (n < 0.5) return before;
    vec3 variance = squares / n - (sums / n) * (sums / n);
    bool worse = variance.z > 4.0 * variance.y + 0.5 || (variance.x > 4.0 && variance.z > 0.9 * variance.x && variance.z > 0.25 * variance.y);
    return vec4(worse ? 0.0 : 1.0, before.yzw);
}
)";

// Sums of the rows of image0, of kJudge, over the number of columns.
inline constexpr const char* kCount = R"(//K count
vec4 kernel(ivec2 at) {
    vec2 sum = vec2(0.0);
    for (int x = 0; x < size.x; ++x) sum += texelFetch(image0, ivec2(x, at.y), 0).yz;
    return vec4(0.0, sum / float(size.x), 1.0);
}
)";

// One pixel: 0 where most of the textured blocks stay unexplained, so that nothing moves. image0: of kCount.
inline constexpr const char* kVerdict = R"(//K verdict
vec4 kernel(ivec2 at) {
    vec2 sum = vec2(0.0);
    for (int y = 0; y < size.y; ++y) sum += texelFetch(image0, ivec2(0, y), 0).yz;
    return vec4(sum.x > 0.0 && sum.y > reach * sum.x ? 0.0 : 1.0);
}
)";

// How far the motion of a cell takes it in the output, in pixels. image0: motion, image1: blocks, image2: verdict, image3: tiles.
inline constexpr const char* kCarry = R"(//K carry
vec4 kernel(ivec2 at) {
    float moves = texelFetch(image1, (at >> rounds) / 8, 0).x * texelFetch(image2, ivec2(0), 0).x * (1.0 - texelFetch(image3, at * kCell / 16, 0).y);
    vec2 a = -texelFetch(image0, at, 0).xy * step_px * moves;
    return vec4(max(abs(a.x), abs(a.y)) <= reach ? a : vec2(0.0), 0.0, 1.0);
}
)";

// Two pixels: the motion of the background, u and v as c0 + c1 x + c2 y with x and y from 0 to 1; a robust fit to image0, of
// kCarry.
inline constexpr const char* kBackground = R"(//K background
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

// Squares of 8x8 cells: x the furthest that anything moves along an axis, y the most that neighbours differ, and much where one stands still
// beside one that moves. image0: of kCarry.
inline constexpr const char* kSpan = R"(//K span
vec2 step_between(vec2 a, vec2 b) { return (a == vec2(0.0)) == (b == vec2(0.0)) ? abs(a - b) : vec2(1e3); }
vec4 kernel(ivec2 at) {
    vec2 far = vec2(0.0), apart = vec2(0.0);
    for (int y = 8 * at.y; y < min(8 * at.y + 8, size.y); ++y) {
        vec2 left = texelFetch(image0, ivec2(8 * at.x, y), 0).xy;
        for (int x = 8 * at.x; x < min(8 * at.x + 8, size.x); ++x) {
            vec2 a = texelFetch(image0, ivec2(x, y), 0).xy, below = texelFetch(image0, ivec2(x, min(y + 1, size.y - 1)), 0).xy;
            far = max(far, abs(a));
            apart = max(apart, max(step_between(a, left), step_between(a, below)));
            left = a;
        }
        apart = max(apart, step_between(texelFetch(image0, ivec2(min(8 * at.x + 8, size.x - 1), y), 0).xy, left));
    }
    return vec4(max(far.x, far.y), max(apart.x, apart.y), 0.0, 1.0);
}
)";

// The same over all squares whose motion may reach this one. image0: of kSpan.
inline constexpr const char* kWiden = R"(//K widen
vec4 kernel(ivec2 at) {
    vec2 most = texelFetch(image0, at, 0).xy;
    for (int y = -4; y <= 4; ++y)
        for (int x = -4; x <= 4; ++x) {
            vec2 n = texelFetch(image0, clamp(at + ivec2(x, y), ivec2(0), size - 1), 0).xy;
            if (n.x >= float(8 * kCell * (max(abs(x), abs(y)) - 1))) most = max(most, n);
        }
    return vec4(most, 0.0, 1.0);
}
)";

#define FOVEA_CARRIED                                                                                            \
    "bool outside(ivec2 p) { return any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, size)); }\n"           \
    "vec2 carried(ivec2 p) { return texelFetch(image0, p, 0).xy; }\n"
// How little a cell that is displaced by d moves like the background, image1: u and v as c0 + c1 x + c2 y.
#define FOVEA_FRONT                                                                                              \
    "vec3 behind_u, behind_v;\n"                                                                                 \
    "void know_background() {\n"                                                                                 \
    "    behind_u = texelFetch(image1, ivec2(0, 0), 0).xyz;\n"                                                   \
    "    behind_v = texelFetch(image1, ivec2(1, 0), 0).xyz;\n"                                                   \
    "}\n"                                                                                                        \
    "float front(ivec2 p, vec2 d) {\n"                                                                           \
    "    vec3 e = vec3(1.0, vec2(p) / vec2(size));\n"                                                            \
    "    d += vec2(dot(behind_u, e), dot(behind_v, e));\n"                                                       \
    "    return min(dot(d, d), 6e4);\n"                                                                          \
    "}\n"

// Where the output cell comes from, where all that may land moves alike.
#define FOVEA_ALIKE                                                                                              \
    FOVEA_CARRIED                                                                                                \
    "vec2 landing(ivec2 at) {\n"                                                                                 \
    "    vec2 a = carried(at);\n"                                                                                \
    "    for (int k = 0; k < 2; ++k) {\n"                                                                        \
    "        ivec2 p = at - ivec2(floor(a / float(kCell) + 0.5));\n"                                             \
    "        if (!outside(p)) a = carried(p);\n"                                                                 \
    "    }\n"                                                                                                    \
    "    return -a;\n"                                                                                           \
    "}\n"
// Squares of 4x4 cells: the displacement in the middle, and its change per pixel to the right and down, in 65536ths. image0: of kCarry;
// size: of it.
inline constexpr const char* kSlope = "//K slope\n" FOVEA_ALIKE R"(
vec2 corner(ivec2 p) { return landing(min(p, size - 1)); }
uint word(vec2 slope) {
    ivec2 i = ivec2(floor(clamp(slope, vec2(-0.49), vec2(0.49)) * 65536.0 + 0.5));
    return uint(i.x) & 0xffffu | uint(i.y) << 16;
}
RESULT kernel(ivec2 at) {
    vec2 a = corner(4 * at), b = corner(4 * at + ivec2(3, 0)), c = corner(4 * at + ivec2(0, 3)), d = corner(4 * at + 3);
    const float kPer = 1.0 / float(6 * kCell);
    return uvec4(floatBitsToUint(0.25 * (a + b + c + d)), word(kPer * (b + d - a - c)), word(kPer * (c + d - a - b)));
}
)";

// The same for each cell, beside where it does not. -1 in w, here and where nothing moves: how little it moves like the background is
// for whoever asks.
inline constexpr const char* kAlike = "//K alike\n" FOVEA_ALIKE R"(
layout(location = 0) out vec4 landed;
layout(location = 1) out vec4 filled;
void main() { landed = filled = vec4(landing(ivec2(gl_FragCoord.xy)), 0.0, -1.0); }
)";
#undef FOVEA_ALIKE

// The same where not: of the cells that land on it the one in front, that is the one that moves least like the
// background (image1), and how little (w); z 1: a hole, none does. Nothing can be scattered here, so each motion found in the
// neighbourhood is followed back to a cell, and asked whether it lands. image2: of kWiden.
inline constexpr const char* kDisplacement = "//K displacement\n" FOVEA_CARRIED FOVEA_FRONT R"(
// The cell that lands here if it moves about as `a`; outside: none does.
ivec2 source(ivec2 at, inout vec2 a) {
    const float per = 1.0 / float(kCell);
    ivec2 p = at;
    for (int i = 0; i < 3; ++i) {
        ivec2 next = ivec2(floor(vec2(at) - a * per + 0.5));
        if (i > 0 && next == p) break;
        p = next;
        if (outside(p)) return p;
        a = carried(p);
    }
    return p + ivec2(floor(a * per + 0.5)) == at ? p : ivec2(-1);
}
vec4 kernel(ivec2 at) {
    know_background();
    vec2 shown = vec2(0.0);
    float best = -1.0;
    int count = 1 + 4 * min(5, int(ceil(log2(1.0 + texelFetch(image2, at / 8, 0).x / float(kCell)))));
    for (int k = 0; k < count; ++k) {
        ivec2 from = at + (k == 0 ? ivec2(0) : (1 << ((k - 1) / 4)) * way((k - 1) % 4));
        if (outside(from)) continue;
        vec2 a = carried(from);
        ivec2 p = source(at, a);
        if (outside(p)) continue;
        float f = front(p, -a);
        if (f > best) { best = f; shown = a; }
    }
    return vec4(-shown, best < 0.0 ? 1.0 : 0.0, max(best, 0.0));
}
)";

// Holes take the motion of what lies behind: of the nearest cells to four sides that something landed on, the one that moves
// most like the background. A surface that grows tears open by a cell or two: what stands on both sides goes on there,
// whatever lies further off. image0: of kDisplacement and kAlike; size: of it.
inline constexpr const char* kFill = "//K fill\n" FOVEA_FRONT R"(
vec4 kernel(ivec2 at) {
    know_background();
    vec4 own = texelFetch(image0, at, 0);
    int ways = own.z > 0.5 ? 4 : 0, reachable = 48, nearest = 0;
    vec4 pair = vec4(0.0, 0.0, 0.0, 1e6), chosen = pair;   // front in w; of one axis; of all
    int distance_chosen = 0, distance_pair = 0, distance_before = 0;
    bool torn = false;
    for (int k = 0; k < ways; ++k) {
        if (k == 2 && nearest != 0) reachable = min(48, 2 * nearest + 6);
        int found = 0;
        vec4 there = vec4(0.0);
        for (int d = 1; d <= reachable; ++d) {
            ivec2 p = at + d * way(k);
            if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, size))) break;
            there = texelFetch(image0, p, 0);
            if (there.z < 0.5) {
                found = d;
                break;
            }
        }
        if ((k & 1) == 0) {
            pair.w = 1e6;
            distance_before = found;
        }
        if (found == 0) continue;
        if (there.w < 0.0) there.w = front(at + found * way(k), there.xy);
        if (nearest == 0 || found < nearest) nearest = found;
        if (there.w < pair.w || (there.w == pair.w && found < distance_pair)) { pair = there; distance_pair = found; }
        if (!torn && (there.w < chosen.w || (there.w == chosen.w && found < distance_chosen))) { chosen = there; distance_chosen = found; }
        if ((k & 1) == 1 && !torn && distance_before != 0 && distance_before + found <= 3) {
            chosen = pair;
            torn = true;
        }
    }
    return ways == 0 ? own : vec4(chosen.xy, 1.0, 0.0);
}
)";

// image0: near, image1: displacement per cell. A gather is kDisplaced, kCalm or kJudged, and kGatherBytes
// or kGatherFloats.
inline constexpr const char* kDisplaced = R"(//K gather
// Between cell centres; where neighbours differ they belong to different surfaces, and the nearer one counts. A pixel whose own
// cell stands still does.
vec2 displacement(ivec2 at) {
    vec2 p = (vec2(at) + 0.5) / float(kCell) - 0.5, base = floor(p), f = p - base, corner = (base + 1.0) / vec2(textureSize(image1, 0));
    vec4 u = textureGather(image1, corner, 0).wzxy, v = textureGather(image1, corner, 1).wzxy;
    vec2 low = vec2(min(min(u.x, u.y), min(u.z, u.w)), min(min(v.x, v.y), min(v.z, v.w)));
    vec2 high = vec2(max(max(u.x, u.y), max(u.z, u.w)), max(max(v.x, v.y), max(v.z, v.w)));
    vec2 near = step(0.5, f), apart = high - low;
    vec4 x = mix(u.xzxz, u.ywyw, near.x), y = mix(v.xzxz, v.ywyw, near.x);
    vec2 own = mix(vec2(x.x, y.x), vec2(x.y, y.y), near.y);
    if (max(apart.x, apart.y) > 3.0 || own == vec2(0.0)) return own;
    return vec2(mix(mix(u.x, u.y, f.x), mix(u.z, u.w, f.x), f.y), mix(mix(v.x, v.y, f.x), mix(v.z, v.w, f.x), f.y));
}
vec4 kernel(ivec2 at) {
    vec2 d = displacement(at);
    if (stands(d)) discard;
    return gathered(at, d);
}
)";
// The same where neighbours are alike. patches: of kSlope.
inline constexpr const char* kCalm = R"(//K gather calm
vec2 slope(uint word) { return vec2(ivec2(int(word << 16), int(word)) >> 16) / 65536.0; }
vec4 kernel(ivec2 at) {
    const int kEdge = 4 * kCell;
    uvec4 t = texelFetch(patches, at / kEdge, 0);
    vec2 from = vec2(at % kEdge) + 0.5 - 0.5 * float(kEdge);
    vec2 d = uintBitsToFloat(t.xy) + from.x * slope(t.z) + from.y * slope(t.w);
    if (stands(d)) discard;
    return gathered(at, d);
}
)";
inline constexpr const char* kGatherHead = R"(
// Not moved at all: the output is a copy of the nearer source to begin with.
bool stands(vec2 d) { return dot(d, d) < 1.0 / 65536.0; }
// Keys' cubic, slope -0.6 at 1.
vec4 lobes(float f) {
    float g = 1.0 - f;
    vec4 w = vec4(-0.6 * f * g * g, 1.0 + f * f * (1.4 * f - 2.4), 0.0, -0.6 * f * f * g);
    w.z = 1.0 - w.x - w.y - w.w;
    return w;
}
)";

// Eight bits, filtered by the driver: the two inner weights of each axis are one linear sample between them. The corners, 1/128
// at most, are left out.
inline constexpr const char* kGatherBytes = R"(
vec2 per_pixel;
vec4 tap(float x, float y) { return textureLod(image0, vec2(x, y) * per_pixel, 0.0); }
vec4 gathered(ivec2 at, vec2 d) {
    per_pixel = 1.0 / vec2(size);
    vec2 p = vec2(at) + d, base = floor(p), f = p - base;
    if (!kCubic) return tap(p.x + 0.5, p.y + 0.5);
    vec4 wx = lobes(f.x), wy = lobes(f.y);
    float mx = wx.y + wx.z, my = wy.y + wy.z, x = base.x + 0.5 + wx.z / mx, y = base.y + 0.5 + wy.z / my;
    vec4 sum = mx * my * tap(x, y) + wx.x * my * tap(base.x - 0.5, y) + wx.w * my * tap(base.x + 2.5, y) + mx * wy.x * tap(x, base.y - 0.5) + mx * wy.w * tap(x, base.y + 2.5);
    return clamp(sum * (1.0 / (mx * my + (wx.x + wx.w) * my + mx * (wy.x + wy.w))), vec4(0.0), vec4(1.0));
}
)";

// Floats: what is no finite number is read by nobody but itself.
inline constexpr const char* kGatherFloats = R"(
// By its bits: a compiler may take v - v for 0, whatever v is.
bool finite(vec4 v) { return all(notEqual(floatBitsToUint(v) & 0x7f800000u, uvec4(0x7f800000u))); }
vec4 tap(ivec2 p) { return texelFetch(image0, clamp(p, ivec2(0), size - 1), 0); }
vec4 gathered(ivec2 at, vec2 d) {
    vec4 own = texelFetch(image0, at, 0);
    if (!finite(own)) return own;
    vec2 p = vec2(at) + d, base = floor(p), f = p - base;
    vec4 sum = vec4(0.0), low = vec4(3.4028235e38), high = vec4(-3.4028235e38);
    float total = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 o = ivec2(k & 1, k >> 1);
        vec4 v = tap(ivec2(base) + o);
        if (!finite(v)) continue;
        low = min(low, v);
        high = max(high, v);
        float w = (o.x == 1 ? f.x : 1.0 - f.x) * (o.y == 1 ? f.y : 1.0 - f.y);
        sum += w * v;
        total += w;
    }
    if (total <= 0.0) return own;
    // Rounded, a mean may be more than its numbers: an alpha of 1, or the largest number.
    vec4 mean = clamp(sum / total, low, high);
    if (!kCubic || total < 0.999) return mean;
    vec4 wx = lobes(f.x), wy = lobes(f.y), all4 = vec4(0.0);
    for (int k = 0; k < 16; ++k) {
        vec4 v = tap(ivec2(base) + ivec2(k & 3, k >> 2) - 1);
        if (!finite(v)) return mean;
        all4 += wx[k & 3] * wy[k >> 2] * v;
    }
    return finite(all4) ? clamp(all4, low, high) : mean;   // no dark rim about a light of 10,000
}
)";

}  // namespace fovea::render::extrapolation::shaders
