// The kernels of gl_regions.cpp: what differs between the sources, and the lists of tiles made of that. See gl_shaders.hpp.
//
// A list's entry: two words, x and y and then width and height of a rectangle of tiles, 16 bits each.
#pragma once

namespace fovea::render::extrapolation::shaders {

// Of 4x4 pixels, which of image0 and image1 are the same, bit for bit: bit 4y + x; size: of both.
inline constexpr const char* kCompare = R"(//K compare
RESULT kernel(ivec2 at) {
    uint same = 0u;
    ivec2 first = 4 * at;
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            ivec2 p = min(first + ivec2(x, y), size - 1);
            uvec4 differs = floatBitsToUint(texelFetch(image0, p, 0)) ^ floatBitsToUint(texelFetch(image1, p, 0));
            same |= (differs.x | differs.y | differs.z | differs.w) == 0u ? 1u << (4 * y + x) : 0u;
        }
    return uvec4(same);
}
)";

// 1 where a tile stands still. patches: of kCompare; size: of it.
inline constexpr const char* kStill = R"(//K still
vec4 kernel(ivec2 at) {
    float still = 1.0;
    for (int y = 4 * at.y; y < min(4 * at.y + 4, size.y); ++y)
        for (int x = 4 * at.x; x < min(4 * at.x + 4, size.x); ++x) still = min(still, texelFetch(patches, ivec2(x, y), 0).r == 0xffffu ? 1.0 : 0.0);
    return vec4(still);
}
)";

// 1 where anything differs in this tile or beside it. image0: 1 where nothing does, `cell` to a tile along each axis; size: of it.
inline constexpr const char* kMoving = R"(//K moving
vec4 kernel(ivec2 at) {
    ivec2 first = clamp((at - 1) * cell, ivec2(0), size), last = clamp((at + 2) * cell, ivec2(0), size);
    float still = 1.0;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) still = min(still, texelFetch(image0, ivec2(x, y), 0).r);
    return vec4(1.0 - still);
}
)";

// 1 where anything may land, and it moves as what is beside it does (`rounds` 0), or not (1). image0: of kWiden, `cell` to a tile along each axis;
// size: of it.
inline constexpr const char* kReached = R"(//K reached
vec4 kernel(ivec2 at) {
    const float kStep = 0.35;   // pixels: half an edge of motion
    ivec2 last = min((at + 1) * cell, size);
    vec2 most = vec2(0.0);
    for (int y = at.y * cell; y < last.y; ++y)
        for (int x = at.x * cell; x < last.x; ++x) most = max(most, texelFetch(image0, ivec2(x, y), 0).xy);
    return vec4(most.x > 0.0 && (most.y >= kStep) == (rounds == 1) ? 1.0 : 0.0);
}
)";

// 1 for tiles of the one map, image0, beside one of the other, image1; size: of both.
inline constexpr const char* kHem = R"(//K hem
vec4 kernel(ivec2 at) {
    float most = 0.0;
    for (int k = 0; k < 9; ++k) most = max(most, texelFetch(image1, clamp(at + ivec2(k % 3, k / 3) - 1, ivec2(0), size - 1), 0).r);
    return vec4(most * texelFetch(image0, at, 0).r);
}
)";

// 1 where any of `cell` x `cell` texels of image0 is; size: of it.
inline constexpr const char* kAny = R"(//K any
vec4 kernel(ivec2 at) {
    float any_of_it = 0.0;
    for (int y = at.y * cell; y < min((at.y + 1) * cell, size.y); ++y)
        for (int x = at.x * cell; x < min((at.x + 1) * cell, size.x); ++x) any_of_it = max(any_of_it, texelFetch(image0, ivec2(x, y), 0).r);
    return vec4(any_of_it);
}
)";

// Blocks of 4x4 tiles, as kRectangles has them. image0: of kMoving; size: of it.
inline constexpr const char* kBlocks = R"(//K blocks
vec4 kernel(ivec2 at) {
    float most = 0.0;
    for (int k = 0; k < 16; ++k) most = max(most, texelFetch(image0, min(4 * at + ivec2(k & 3, k >> 2), size - 1), 0).r);
    return vec4(most, 1.0, 0.0, 0.0);
}
)";

// Where a run of tiles in a row begins, its length, else 0. image0: of kMoving or kReached; size: of it.
inline constexpr const char* kRuns = R"(//K runs
vec4 kernel(ivec2 at) {
    bool goes_on = texelFetch(image0, at, 0).r > 0.5 && (at.x == 0 || texelFetch(image0, at - ivec2(1, 0), 0).r < 0.5);
    float length = 0.0;
    for (int x = at.x; goes_on && x < size.x; ++x) {
        goes_on = texelFetch(image0, ivec2(x, at.y), 0).r > 0.5;
        length += goes_on ? 1.0 : 0.0;
    }
    return vec4(length);
}
)";

// Runs that are the same in rows that follow each other are one rectangle, that of the first: its width and height, else 0.
// image0: of kRuns; size: of it.
inline constexpr const char* kRectangles = R"(//K rectangles
vec4 kernel(ivec2 at) {
    float run = texelFetch(image0, at, 0).r, rows = 0.0;
    bool goes_on = run > 0.5 && (at.y == 0 || texelFetch(image0, at - ivec2(0, 1), 0).r != run);
    for (int y = at.y; goes_on && y < size.y; ++y) {
        goes_on = texelFetch(image0, ivec2(at.x, y), 0).r == run;
        rows += goes_on ? 1.0 : 0.0;
    }
    return rows > 0.5 ? vec4(run, rows, 0.0, 0.0) : vec4(0.0);
}
)";

// x: how many rectangles begin in each row, y: of how many tiles. image0: of kRectangles or kBlocks; size: of it.
inline constexpr const char* kRowCount = R"(//K rowcount
RESULT kernel(ivec2 at) {
    uvec4 sum = uvec4(0u);
    for (int x = 0; x < size.x; ++x) {
        vec2 r = texelFetch(image0, ivec2(x, at.y), 0).xy;
        if (r.x > 0.5) sum += uvec4(1u, uint(r.x * r.y), 0u, 0u);
    }
    return sum;
}
)";

// The same of all rows before this one. patches: of kRowCount.
inline constexpr const char* kPrefix = R"(//K prefix
RESULT kernel(ivec2 at) {
    uvec4 sum = uvec4(0u);
    for (int y = 0; y < at.y; ++y) sum += texelFetch(patches, ivec2(0, y), 0);
    return sum;
}
)";

// The rectangles one after the other, 256 to a row. image0: of kRectangles or kBlocks, patches: of kPrefix; size: of image0.
inline constexpr const char* kList = R"(//K list
RESULT kernel(ivec2 at) {
    uint i = uint(256 * at.y + at.x), before = 0u, total = texelFetch(patches, ivec2(0, size.y), 0).x;
    int y = 0;
    for (; i < total && y < size.y; ++y) {
        uint next = texelFetch(patches, ivec2(0, y + 1), 0).x;
        if (next > i) break;
        before = next;
    }
    uvec4 words = uvec4(0u);
    for (int x = 0; i < total && x < size.x; ++x) {
        vec2 r = texelFetch(image0, ivec2(x, y), 0).xy;
        if (r.x < 0.5) continue;
        if (before == i) {
            words = uvec4(uint(x) | uint(y) << 16, uint(r.x) | uint(r.y) << 16, 0u, 0u);
            break;
        }
        ++before;
    }
    return words;
}
)";

// What draws and dispatches are to do: see Args of gl_runner.hpp. patches: kPrefix of the rectangles, places: of the blocks; size: of
// the finest level; cell: work groups along the patches of a block.
inline constexpr const char* kArgs = R"(//K args
layout(binding = 5) uniform highp usampler2D places;
RESULT kernel(ivec2 at) {
    uvec4 all = texelFetch(patches, ivec2(0, textureSize(patches, 0).y - 1), 0);
    uint any = min(all.x, 1u);
    if (at.x == 0) return uvec4(6u, all.x, 0u, 0u);
    if (at.x == 1) return uvec4(all.y, 0u, 0u, 0u);
    if (at.x == 2) return uvec4(3u, any, 0u, 0u);
    if (at.x == 3) return uvec4(texelFetch(places, ivec2(0, textureSize(places, 0).y - 1), 0).x, uvec2(cell), 0u);
    ivec2 level = size;
    for (int l = 4; l < at.x; ++l) level = (level + 1) / 2;
    return uvec4(uvec2((level + 3) / 4 + 8) / 8u, any, 0u);
}
)";

}  // namespace fovea::render::extrapolation::shaders
