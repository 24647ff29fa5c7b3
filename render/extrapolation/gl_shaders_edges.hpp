// The kernels that judge the pixels at edges of motion one by one, as edges.hpp has it on the processor. See gl_shaders.hpp.
#pragma once

namespace fovea::render::extrapolation::shaders {

// Squares of 8x8 cells: x 1 where any is displaced, y how many cells, z how many beside which something is displaced otherwise. image0: of kFill; size: of it.
inline constexpr const char* kEdges = R"(//K edges
vec4 kernel(ivec2 at) {
    float moves = 0.0, cells = 0.0, edges = 0.0;
    for (int y = 8 * at.y; y < min(8 * at.y + 8, size.y); ++y)
        for (int x = 8 * at.x; x < min(8 * at.x + 8, size.x); ++x) {
            ivec2 p = ivec2(x, y);
            vec2 d = texelFetch(image0, p, 0).xy;
            vec2 across = abs(texelFetch(image0, min(p + ivec2(1, 0), size - 1), 0).xy - d), down = abs(texelFetch(image0, min(p + ivec2(0, 1), size - 1), 0).xy - d), most = max(across, down);
            moves = d == vec2(0.0) ? moves : 1.0;
            cells += 1.0;
            edges += max(most.x, most.y) >= 0.7 ? 1.0 : 0.0;
        }
    return vec4(moves, cells, edges, 1.0);
}
)";

// 1 where there is an edge in this tile or beside it, or what stands still is kept. image0: of kEdges, `cell` to a tile along each
// axis; size: of it; image1: 0 where there are so many that the field is noise, and has no surfaces to tell apart; image2: of kKeep,
// `rounds` to a tile.
inline constexpr const char* kNearEdges = R"(//K near edges
vec4 kernel(ivec2 at) {
    ivec2 first = max((at - 1) * cell, ivec2(0)), last = min((at + 2) * cell, size);
    float edges = 0.0, kept = 0.0;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) edges += texelFetch(image0, ivec2(x, y), 0).z;
    ivec2 end = min(rounds * (at + 1), textureSize(image2, 0));
    for (int y = rounds * at.y; y < end.y; ++y)
        for (int x = rounds * at.x; x < end.x; ++x) kept += texelFetch(image2, ivec2(x, y), 0).r;
    return vec4(edges * texelFetch(image1, ivec2(0), 0).r + kept > 0.5 ? 1.0 : 0.0);
}
)";

// The two displacements that meet at a cell, in front (xy) and behind (zw); the same where none do. image0: of kFill, with -1 in w
// where nothing moves; image1: the background; image2: as image1 of kNearEdges; size: of image0.
inline constexpr const char* kSides = R"(//K sides
float front(ivec2 p) {
    vec3 e = vec3(1.0, vec2(p) / vec2(size));
    vec2 d = vec2(dot(texelFetch(image1, ivec2(0, 0), 0).xyz, e), dot(texelFetch(image1, ivec2(1, 0), 0).xyz, e));
    return min(dot(d, d), 6e4);
}
vec4 kernel(ivec2 at) {
    vec3 ahead = vec3(0.0, 0.0, -1.0), behind = vec3(0.0, 0.0, 1e6);   // displacement, and how little it moves like the background
    for (int k = 0; k < 25; ++k) {
        ivec2 p = clamp(at + ivec2(k % 5, k / 5) - 2, ivec2(0), size - 1);
        vec4 there = texelFetch(image0, p, 0);
        if (there.z > 0.5) continue;   // filled
        float f = there.w < 0.0 ? front(p) : there.w;
        if (f > ahead.z) ahead = vec3(there.xy, f);
        if (f < behind.z) behind = vec3(there.xy, f);
    }
    vec2 apart = abs(ahead.xy - behind.xy);
    return texelFetch(image2, ivec2(0), 0).r < 0.5 || ahead.z < 0.0 || max(apart.x, apart.y) < 0.7 ? vec4(0.0) : vec4(ahead.xy, behind.xy);
}
)";

// image0: near, image1: of kSides, image2: far; the others: of kStays; step_px: the step, in frame times; rounds from 2 on: one channel, taken as grey.
// Where the motion in front says that the pixel came from: does src1 agree with it clearly better than with the one behind? Else the
// same of the one behind; where neither holds, something was uncovered, and what was gathered stays.
inline constexpr const char* kJudged = R"(//K judged
float mismatch(ivec2 p, vec2 d) {
    vec4 is = texelFetch(image0, p, 0), was = far_at(clamp(vec2(p) + d / step_px, vec2(0.0), vec2(size - 1))), apart = abs(was - is);
    if (rounds >= 2) apart.gb = apart.rr;
    return 255.0 * dot(apart / larger(was, is), vec4(1.0));
}
vec4 kernel(ivec2 at) {
    const float kClearly = 6.0;
    vec4 sides = texelFetch(image1, at / cell, 0);
    if (stays(at)) return texelFetch(image0, at, 0);
    if (sides.xy == sides.zw) discard;
    vec2 d = sides.xy;
    bool chosen = false;
    for (int k = 0; k < 2 && !chosen; ++k) {
        d = k == 0 ? sides.xy : sides.zw;
        ivec2 p = clamp(at + ivec2(floor(d + 0.5)), ivec2(0), size - 1);
        chosen = mismatch(p, d) + kClearly < mismatch(p, k == 0 ? sides.zw : sides.xy);
    }
    if (!chosen) discard;
    return gathered(at, d);
}
)";
inline constexpr const char* kJudgedBytes = R"(
vec4 larger(vec4 a, vec4 b) { return vec4(1.0); }
vec4 far_at(vec2 p) { return textureLod(image2, (p + 0.5) / vec2(size), 0.0); }
)";
// Light of any range: in parts of the larger.
inline constexpr const char* kJudgedFloats = R"(
vec4 larger(vec4 a, vec4 b) { return max(max(abs(a), abs(b)), vec4(1e-3)); }
vec4 far_tap(vec2 p) { return texelFetch(image2, min(ivec2(p), size - 1), 0); }
vec4 far_at(vec2 p) {
    vec2 base = floor(p), f = p - base;
    return mix(mix(far_tap(base), far_tap(base + vec2(1, 0)), f.x), mix(far_tap(base + vec2(0, 1)), far_tap(base + vec2(1, 1)), f.x), f.y);
}
)";

}  // namespace fovea::render::extrapolation::shaders
