// The kernels that keep the rim of a window whose content scrolls, as standing.hpp has it on the processor. See gl_shaders.hpp.
#pragma once

namespace fovea::render::extrapolation::shaders {

// What of the picture is the same in both sources, bit for bit: patches, of kCompare, has a bit per pixel.
#define FOVEA_SAME                                                                                                                   \
    "bool outside(ivec2 p) { return any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, size)); }\n"                               \
    "bool same(ivec2 p) { return (texelFetch(patches, p / 4, 0).r >> uint(4 * (p.y & 3) + (p.x & 3)) & 1u) != 0u; }\n"

// Tiles of 16x16 pixels that may hold a rim: 1 where anything is displaced no further than two tiles from one that stands still with
// all around it. image0: of kEdges, image1: 1 where a tile stands still; size: of that.
inline constexpr const char* kRims = R"(//K rims
bool still(ivec2 p) { return texelFetch(image1, p, 0).r > 0.5; }
vec4 kernel(ivec2 at) {
    ivec2 square = 2 * at / kCell;
    bool moves = texelFetch(image0, square, 0).x > 0.5, found = false;
    ivec2 first = max(at - 2, ivec2(0)), last = min(at + 2, size - 1);
    for (int y = first.y; moves && !found && y <= last.y; ++y)
        for (int x = first.x; !found && x <= last.x; ++x) {
            found = still(ivec2(x, y));
            ivec2 low = max(ivec2(x, y) - 1, ivec2(0)), high = min(ivec2(x, y) + 1, size - 1);
            for (int j = low.y; found && j <= high.y; ++j)
                for (int i = low.x; found && i <= high.x; ++i) found = still(ivec2(i, j));
        }
    return vec4(found ? 1.0 : 0.0);
}
)";

// Of 4x4 pixels, those that stand still beside one that does not, where something moves across: x the contrast there, y that one
// motion further back (both over 255), z how many pixels. image0: near, image1: displacement, image2: far, image3: of kRims, patches:
// of kCompare; size: of the picture; step_px: the step, in frame times; reach 1: floats; rounds 1: one
// channel, taken as grey.
inline constexpr const char* kVote = "//K vote\n" FOVEA_SAME R"(
// The bits of 4x4 pixels; beyond the picture, where nothing may be asked, all are set.
uint bits(ivec2 part) {
    ivec2 n = clamp(size - 4 * part, ivec2(0), ivec2(4));
    uint within = ((1u << n.x) - 1u) * 0x1111u & (1u << 4 * n.y) - 1u;
    return any(lessThan(part, ivec2(0))) || within == 0u ? 0xffffu : texelFetch(patches, part, 0).r | ~within & 0xffffu;
}
// Those beside which, against the way k, something does not stand still.
uint edges(ivec2 at, int k) {
    uint own = bits(at), next = bits(at - way(k));
    uint before = k == 0 ? own >> 1 & 0x7777u | next << 3 & 0x8888u : k == 1 ? own << 1 & 0xeeeeu | next >> 3 & 0x1111u
                : k == 2 ? own >> 4 | next << 12 & 0xf000u : own << 4 & 0xfff0u | next >> 12;
    return own & ~before;
}
vec4 shown(ivec2 p, bool far) { return far ? texelFetch(image2, p, 0) : texelFetch(image0, p, 0); }
float contrast(ivec2 a, ivec2 b, bool far) {
    vec4 p = shown(a, far), q = shown(b, far), apart = abs(p - q);
    if (reach > 0.0) apart /= max(max(abs(p), abs(q)), vec4(1e-3));   // light of any range
    if (rounds == 1) apart.gb = apart.rr;
    return dot(mix(vec4(1.0), apart, lessThan(apart, vec4(1.0))), vec4(1.0));
}
vec3 ask(ivec2 p, ivec2 w) {
    // Motion is smoothed at its edges: the most that goes this way or comes from here.
    const float kMoves = 0.75;
    vec2 motion = vec2(0.0);
    float most = kMoves;
    bool leads = true;
    for (int k = 0; k <= 16 && !outside(p - k * w); k += kCell) {
        vec2 m = texelFetch(image1, (p - k * w) / kCell, 0).xy / -step_px;
        float along = dot(m, vec2(w));
        if (!(abs(along) > most)) continue;
        most = abs(along);
        leads = along > 0.0;
        motion = m;
    }
    if (!(most > kMoves)) return vec3(0.0);
    // Where content comes in, all is the other way round. Of three pixels each: where the motion is a fraction off, it lies beside.
    ivec2 back = ivec2(floor((leads ? motion : -motion) + 0.5));
    int beside = most > 3.0 ? 1 : 0;
    vec2 contrasts = vec2(0.0);
    for (int k = -beside; k <= beside; ++k) {
        ivec2 h = p + k * w, o = h - back;
        if (outside(h) || outside(h - w) || outside(o) || outside(o - w)) return vec3(0.0);
        contrasts = max(contrasts, vec2(contrast(h, h - w, leads), contrast(o, o - w, leads)));
    }
    return vec3(contrasts, 1.0);
}
vec4 kernel(ivec2 at) {
    vec3 votes = vec3(0.0);
    bool asked = texelFetch(image3, at / 4, 0).r > 0.5;
    for (int k = 0; asked && k < 4; ++k)
        for (uint left = edges(at, k); left != 0u; left &= left - 1u) {
            int bit = findLSB(left);
            votes += ask(4 * at + ivec2(bit & 3, bit >> 2), way(k));
        }
    return vec4(votes, 1.0);
}
)";

// Tiles of 16x16 pixels: 1 where the edge is a window's. image0: of kVote, image1: of kRims; size: of that.
inline constexpr const char* kKeep = R"(//K keep
vec4 kernel(ivec2 at) {
    vec3 sum = vec3(0.0);
    bool asked = texelFetch(image1, at, 0).r > 0.5;
    ivec2 first = max(at - 1, ivec2(0)), last = min(at + 1, size - 1), end = textureSize(image0, 0);
    for (int y = first.y; asked && y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) {
            bool votes = texelFetch(image1, ivec2(x, y), 0).r > 0.5;
            for (int k = 0; votes && k < 16; ++k) {
                ivec2 part = 4 * ivec2(x, y) + ivec2(k & 3, k >> 2);
                if (all(lessThan(part, end))) sum += texelFetch(image0, part, 0).xyz;
            }
        }
    const float kFewest = 8.0, kClearly = 1.5, kLeast = 4.0 / 255.0;
    return vec4(sum.z >= kFewest && sum.x > kClearly * sum.y + kLeast * sum.z ? 1.0 : 0.0);
}
)";

// In such a tile a pixel stays as it is that stands still, and one that comes along from one and lies on it for four pixels more, and so
// is not only an even spot of the content. image0: near, image1: displacement, image2: of kKeep, patches: of kCompare; size: of image0.
inline constexpr const char* kStand = "//K stand\n" FOVEA_SAME R"(
vec4 kernel(ivec2 at) {
    vec2 d = texelFetch(image1, at / kCell, 0).xy;
    float longest = max(abs(d.x), abs(d.y));
    bool own = same(at), stands = own || longest > 0.0;
    for (int k = 0; stands && !own && k < 4; ++k) {
        ivec2 p = ivec2(floor(vec2(at) + d * (1.0 + float(k) / longest) + 0.5));
        stands = !outside(p) && same(p);
    }
    if (!stands || texelFetch(image2, at / 16, 0).r < 0.5) discard;
    return texelFetch(image0, at, 0);
}
)";
#undef FOVEA_SAME

}  // namespace fovea::render::extrapolation::shaders
