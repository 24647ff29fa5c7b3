// The kernels that judge the pixels at edges of motion one by one, as edges.hpp has it on the processor. See gl_shaders.hpp.
#pragma once

#include "render/extrapolation/gl_shaders_field.hpp"

namespace fovea::render::extrapolation::shaders {

// Squares of 8x8 cells: x 1 where any is displaced, y how many cells, z how many beside which something is displaced otherwise, w the
// sides that such a one is near: 1, 2, 4 and 8. image0: of kFill; size: of it.
inline constexpr const char* kEdges = R"(//K edges
vec4 kernel(ivec2 at) {
    float moves = 0.0, cells = 0.0, edges = 0.0;
    int sides = 0;
    for (int y = 8 * at.y; y < min(8 * at.y + 8, size.y); ++y)
        for (int x = 8 * at.x; x < min(8 * at.x + 8, size.x); ++x) {
            ivec2 p = ivec2(x, y), i = p - 8 * at;
            vec2 d = texelFetch(image0, p, 0).xy;
            vec2 across = abs(texelFetch(image0, min(p + ivec2(1, 0), size - 1), 0).xy - d), down = abs(texelFetch(image0, min(p + ivec2(0, 1), size - 1), 0).xy - d), most = max(across, down);
            moves = d == vec2(0.0) ? moves : 1.0;
            cells += 1.0;
            if (max(most.x, most.y) < 0.7) continue;
            edges += 1.0;
            sides |= (i.x < 2 ? 1 : 0) | (i.x > 4 ? 2 : 0) | (i.y < 2 ? 4 : 0) | (i.y > 4 ? 8 : 0);
        }
    return vec4(moves, cells, edges, float(sides));
}
)";

// 1 where a tile is within two cells of an edge. image0: of kEdges, `cell` to a tile along each axis; size: of it; image1: 0 where there
// are so many that the field is noise, and has no surfaces to tell apart.
inline constexpr const char* kNearEdges = R"(//K near edges
vec4 kernel(ivec2 at) {
    ivec2 first = at * cell, last = first + cell;
    bool found = false;
    for (int y = max(first.y - 1, 0); y < min(last.y + 1, size.y); ++y)
        for (int x = max(first.x - 1, 0); x < min(last.x + 1, size.x); ++x) {
            vec4 square = texelFetch(image0, ivec2(x, y), 0);
            int wanted = (x < first.x ? 2 : x >= last.x ? 1 : 0) | (y < first.y ? 8 : y >= last.y ? 4 : 0);
            found = found || (square.z > 0.5 && (int(square.w) & wanted) == wanted);
        }
    return vec4(found && texelFetch(image1, ivec2(0), 0).r > 0.5 ? 1.0 : 0.0);
}
)";

// The two displacements that meet at a cell, in front (xy) and behind (zw); the same where none do. image0: of kFill; size: of it.
inline constexpr const char* kSides = "//K sides\n" FOVEA_FRONT R"(
vec4 kernel(ivec2 at) {
    know_background();
    vec3 ahead = vec3(0.0, 0.0, -1.0), behind = vec3(0.0, 0.0, 1e6);   // displacement, and how little it moves like the background
    for (int k = 0; k < 25; ++k) {
        ivec2 p = clamp(at + ivec2(k % 5, k / 5) - 2, ivec2(0), size - 1);
        vec4 there = texelFetch(image0, p, 0);
        if (there.z > 0.5) continue;   // filled
        float f = there.w < 0.0 ? front(p, there.xy) : there.w;
        if (f > ahead.z) ahead = vec3(there.xy, f);
        if (f < behind.z) behind = vec3(there.xy, f);
    }
    vec2 apart = abs(ahead.xy - behind.xy);
    return ahead.z < 0.0 || max(apart.x, apart.y) < 0.7 ? vec4(0.0) : vec4(ahead.xy, behind.xy);
}
)";

// image0: near, image1: of kSides, image2: far; step_px: the step, in frame times; rounds 1: one channel, taken as grey.
// Where the motion in front says that the pixel came from: does src1 agree with it clearly better than with the one behind? Else the
// same of the one behind; where neither holds, something was uncovered, and what was gathered stays.
inline constexpr const char* kJudged = R"(//K judged
float mismatch(ivec2 p, vec2 d) {
    vec4 is = texelFetch(image0, p, 0), was = far_at(clamp(vec2(p) + d / step_px, vec2(0.0), vec2(size - 1))), apart = abs(was - is);
    if (rounds == 1) apart.gb = apart.rr;
    return 255.0 * dot(apart / larger(was, is), vec4(1.0));
}
vec4 kernel(ivec2 at) {
    const float kClearly = 6.0;
    vec4 sides = texelFetch(image1, at / kCell, 0);
    if (sides.xy == sides.zw) discard;
    vec2 d = sides.xy;
    bool chosen = false;
    for (int k = 0; k < 2 && !chosen; ++k) {
        d = k == 0 ? sides.xy : sides.zw;
        ivec2 p = clamp(at + ivec2(floor(d + 0.5)), ivec2(0), size - 1);
        chosen = mismatch(p, d) + kClearly < mismatch(p, k == 0 ? sides.zw : sides.xy);
    }
    if (!chosen) discard;
    return stands(d) ? texelFetch(image0, at, 0) : gathered(at, d);
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

#undef FOVEA_FRONT
#undef FOVEA_CARRIED

}  // namespace fovea::render::extrapolation::shaders
