#include "render/scene/shaders.hpp"

namespace fovea::scene {
namespace {

constexpr const char* kViewBlock = R"(
precision highp float;
precision highp int;
struct ViewData {
    mat4 clip_from_world;
    vec4 eye;                 // xyz metres, w seconds
    vec4 light_position[6];   // xyz metres, w 1/radius
    vec4 light_color[6];
    vec4 unused[15];          // to 512 bytes: a multiple of what any driver aligns to
};
layout(std140, binding = 0) uniform View { ViewData views[VIEW_DATA]; };
#define view views[VIEW_INDEX]
)";

// Of every vertex shader: what it is given, and what it hands on to the fragments.
constexpr const char* kVertexInterface = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal_in;
layout(location = 2) in vec2 uv_in;
out highp vec3 world;
out highp vec3 normal;
out highp vec2 uv;
flat out highp uvec2 material;
)";
// A model's objects have their material in a block instead.
constexpr const char* kMaterialInput = R"(
layout(location = 3) in uvec4 material_in;
)";

constexpr const char* kVertex = R"(
void main() {
    world = position;
    normal = normal_in.xyz;
    uv = uv_in;
    material = material_in.xy;
    place_in_view(view.clip_from_world * vec4(position, 1.0));
}
)";

// On a sheet of tiles; what a material asks of the place in the world is answered as if it lay on the ground.
constexpr const char* kTileVertex = R"(
void main() {
    world = vec3(uv_in.x, 0.0, uv_in.y);
    normal = normal_in.xyz;
    uv = uv_in;
    material = material_in.xy;
    gl_Position = vec4(position, 1.0);
}
)";

// A box around each ball: a normal's signs say which corner it is, uv.x is the radius.
constexpr const char* kBallVertex = R"(
flat out highp vec4 ball;   // centre, radius
void main() {
    world = position;
    normal = normal_in.xyz;
    uv = uv_in;
    material = material_in.xy;
    ball = vec4(position - sign(normal_in.xyz) * uv_in.x, uv_in.x);
    place_in_view(view.clip_from_world * vec4(position, 1.0));
}
)";

constexpr const char* kObjectBlock = R"(
layout(std140, binding = 1) uniform Object {
    mat4 world_from_object;
    vec4 normal_columns[3];
    vec4 base_color;
    vec4 object_surface;   // metallic, roughness, alpha cutoff
    vec4 emissive;
};
)";

constexpr const char* kModelVertex = R"(
void main() {
    vec4 w = world_from_object * vec4(position, 1.0);
    world = w.xyz;
    normal = mat3(normal_columns[0].xyz, normal_columns[1].xyz, normal_columns[2].xyz) * normal_in.xyz;
    uv = uv_in;
    material = uvec2(0u);
    place_in_view(view.clip_from_world * w);
}
)";

constexpr const char* kNoise = R"(
uint pcg(uint v) {
    uint s = v * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}
float hash(ivec2 p) { return float(pcg(uint(p.x) * 0x8da6b343u + uint(p.y) * 0xd8163841u) >> 8u) * (1.0 / 16777216.0); }
float noise(vec2 p) {
    vec2 i = floor(p), f = p - i;
    ivec2 k = ivec2(i);
    f = f * f * (3.0 - 2.0 * f);
    return mix(mix(hash(k), hash(k + ivec2(1, 0)), f.x), mix(hash(k + ivec2(0, 1)), hash(k + ivec2(1, 1)), f.x), f.y);
}
float fbm(vec2 p, int octaves) {
    float sum = 0.0, weight = 0.5;
    for (int i = 0; i < octaves; ++i) {
        sum += weight * noise(p);
        p = mat2(1.6, 1.2, -1.2, 1.6) * p + 17.3;
        weight *= 0.5;
    }
    return sum;
}
// One character of a 3x5 font; c in 0..15 (digits, A C E F L P).
const uint kFont[16] = uint[16](31599u, 11415u, 29671u, 29647u, 23497u, 31183u, 31215u, 29330u,
                                31727u, 31695u, 11245u, 31015u, 31207u, 31204u, 18727u, 31716u);
// p in characters from the lower left of a text of `size` characters; 1 inside ink.
float text(vec2 p, vec2 size, uint seed) {
    if (p.x < 0.0 || p.y < 0.0 || p.x >= size.x || p.y >= size.y) return 0.0;
    ivec2 cell = ivec2(floor(p));
    vec2 f = (p - vec2(cell)) * vec2(4.0, 7.0);
    ivec2 g = ivec2(floor(f));
    if (g.x > 2 || g.y > 4) return 0.0;
    uint c = pcg(seed + uint(cell.x * 7 + cell.y * 131)) & 15u;
    return float((kFont[c] >> uint((g.y) * 3 + 2 - g.x)) & 1u);
}
)";

constexpr const char* kMaterials = R"(
struct Surface { vec3 albedo; float metal; float rough; vec3 glow; vec2 bump; };

// Bundles of traces on square tiles: straight, or a 45 degree turn; the lanes of neighbouring tiles meet.
float lanes(vec2 p, float scale, float count, out float edge) {
    vec2 q = p * scale;
    ivec2 tile = ivec2(floor(q));
    vec2 f = q - floor(q) - 0.5;
    float kind = hash(tile + ivec2(911, 77));
    float s = kind < 0.3 ? f.y : kind < 0.6 ? f.x : kind < 0.8 ? f.y - f.x : f.y + f.x;
    if (kind >= 0.6) s += s > 0.0 ? -0.5 : 0.5;
    float l = s * count, w = fwidth(q.x) * count + fwidth(q.y) * count;
    float d = abs(fract(l) - 0.5);
    edge = clamp(1.0 - abs(d - 0.24) / (0.05 + w), 0.0, 1.0);
    return 1.0 - smoothstep(0.24 - 0.5 * w, 0.24 + 0.5 * w, d);
}

Surface board(vec2 p) {
    Surface s;
    float wear = fbm(p * 5.0, 3), patch_ = noise(p * 0.9 + 3.0), edge, edge2;
    float copper = lanes(p, 1.6, 5.0, edge) * step(0.42, patch_);
    copper = max(copper, lanes(p + 0.31, 3.1, 4.0, edge2) * step(patch_, 0.38));
    s.albedo = mix(vec3(0.008, 0.060, 0.050), vec3(0.020, 0.150, 0.105), copper) * (0.75 + 0.5 * wear);
    s.metal = 0.0;
    s.rough = 0.22 + 0.25 * wear;
    s.glow = vec3(0.0);
    // Vias: gold rings around holes.
    vec2 v = p * 4.0, cell = floor(v), f = v - cell - 0.5;
    if (hash(ivec2(cell)) > 0.55) {
        float r = length(f), w = fwidth(v.x) + fwidth(v.y);
        float ring = smoothstep(0.20 + 0.5 * w, 0.20 - 0.5 * w, r) * smoothstep(0.09 - 0.5 * w, 0.09 + 0.5 * w, r);
        s.albedo = mix(s.albedo, vec3(0.95, 0.68, 0.28), ring) * mix(1.0, 0.15, smoothstep(0.09, 0.07, r));
        s.metal = ring;
        s.rough = mix(s.rough, 0.3, ring);
    }
    // Silk screen: part names.
    vec2 t = p * 1.25;
    ivec2 field = ivec2(floor(t));
    float ink = text((t - vec2(field) - vec2(0.1, 0.12)) * vec2(18.0, 10.0), vec2(4.0, 1.0), uint(field.x * 57 + field.y * 1013));
    s.albedo = mix(s.albedo, vec3(0.78, 0.80, 0.76), ink * 0.9);
    s.rough = mix(s.rough, 0.7, ink);
    s.metal *= 1.0 - ink;
    s.bump = vec2(edge, edge2) * 0.12 + (wear - 0.5) * 0.10;
    return s;
}

float alpha = 1.0;
#if FAMILY == 4
#ifdef COLOR_IMAGE
layout(binding = 3) uniform highp sampler2D color_image;
#endif
#ifdef SURFACE_IMAGE
layout(binding = 4) uniform highp sampler2D surface_image;
#endif
Surface surface(uvec2 m, vec3 n, vec3 where, vec2 p) {
    vec4 c = base_color;
    vec2 s = object_surface.xy;
#ifdef COLOR_IMAGE
    c *= texture(color_image, p);
#endif
#ifdef SURFACE_IMAGE
    s *= texture(surface_image, p).bg;
#endif
#ifdef CUT_OUT
    if (c.a < object_surface.z) discard;
#endif
    alpha = c.a;
    return Surface(c.rgb, s.x, max(s.y, 0.05), emissive.rgb, vec2(0.0));
}
#elif FAMILY == 0
Surface surface(uvec2 m, vec3 n, vec3 where, vec2 p) { return board(p); }
#else
Surface surface(uvec2 m, vec3 n, vec3 where, vec2 p) {
    Surface s = Surface(vec3(0.5), 0.0, 0.5, vec3(0.0), vec2(0.0));
    float seed = float(m.y);
#if FAMILY == 1
    if (m.x == 1u) {          // moulded epoxy with a laser-marked name
        float grain = fbm(where.xz * 60.0 + where.y * 31.0, 3);
        s.albedo = vec3(0.022, 0.023, 0.026) * (0.6 + grain);
        s.rough = 0.38 + 0.3 * grain;
        s.bump = vec2(grain - 0.5) * 0.25;
        if (n.y > 0.9) {
            float ink = text((p - vec2(0.12, 0.10)) * vec2(13.0, 8.5), vec2(8.0, 5.0), m.y * 977u);
            float dot_ = smoothstep(0.055, 0.045, length(p - vec2(0.07)));
            s.albedo = mix(s.albedo, vec3(0.55, 0.57, 0.60), max(ink, dot_) * 0.85);
        }
    } else if (m.x == 2u) {   // tinned legs
        float scratch = noise(vec2(p.x * 240.0, p.y * 30.0) + seed);
        s = Surface(vec3(0.86, 0.84, 0.80), 1.0, 0.18 + 0.25 * scratch, vec3(0.0), vec2(scratch - 0.5) * 0.08);
    } else if (m.x == 3u) {   // electrolytic capacitors: printed sleeve, scored aluminium top
        if (n.y > 0.9) {
            float scratch = noise(vec2(atan(p.y, p.x) * 6.0, length(p) * 90.0));
            float score = min(abs(p.x), abs(p.y));
            s = Surface(vec3(0.80, 0.82, 0.84) * (0.4 + 0.6 * smoothstep(0.01, 0.05, score)), 1.0, 0.25 + 0.2 * scratch,
                        vec3(0.0), vec2(scratch - 0.5) * 0.1);
        } else {
            vec3 sleeve = seed < 85.0 ? vec3(0.02, 0.05, 0.16) : seed < 170.0 ? vec3(0.03, 0.03, 0.035) : vec3(0.17, 0.03, 0.02);
            float band = step(0.80, p.x), ink = text((p - vec2(0.08, 0.08)) * vec2(24.0, 11.0), vec2(9.0, 4.0), m.y);
            float minus = band * step(0.45, fract(p.y * 6.0)) * step(0.86, p.x) * step(p.x, 0.94);
            s.albedo = mix(sleeve, vec3(0.72, 0.74, 0.72), max(max(band - minus, 0.0) * 0.8, ink));
            s.rough = 0.28 + 0.1 * noise(p * 40.0);
        }
    } else if (m.x == 4u) {   // chip resistors and ceramic capacitors
        float grain = noise(where.xz * 90.0);
        s.albedo = (seed < 128.0 ? vec3(0.035) : vec3(0.42, 0.30, 0.19)) * (0.8 + 0.4 * grain);
        s.rough = 0.45;
        if (n.y > 0.9 && seed < 128.0)
            s.albedo = mix(s.albedo, vec3(0.8), text((p - vec2(0.035, 0.03)) * vec2(22.0, 12.0), vec2(3.0, 1.0), m.y * 31u));
    } else if (m.x == 5u) {   // lamps
        vec3 c = view.light_color[int(m.y) % 6].rgb;
        s.albedo = c * 0.3;
        s.rough = 0.1;
        s.glow = c * (1.6 + 0.5 * sin(view.eye.w * 2.0 + seed));
    } else if (m.x == 6u) {   // anodised heat sinks
        float brush = noise(vec2(p.x * 6.0, p.y * 180.0));
        vec3 c = seed < 128.0 ? vec3(0.03, 0.06, 0.16) : vec3(0.16, 0.16, 0.17);
        s = Surface(c * (0.8 + 0.4 * brush), 0.75, 0.32 + 0.2 * brush, vec3(0.0), vec2(brush - 0.5) * 0.12);
    }
#elif FAMILY == 5
    float grain = noise(n.xz * 9.0 + n.y * 5.0 + seed);
    vec3 tint = fract(vec3(0.13, 0.37, 0.71) * (seed * 0.31 + 1.0));
    s.albedo = (0.15 + 0.6 * tint) * (0.85 + 0.3 * grain);
    s.rough = 0.35 + 0.2 * grain;
#else
    if (m.x == 8u) {          // veined marble
        float w = fbm(p * 2.2, 5), vein = abs(fbm(p * 1.3 + 1.8 * w, 5) - 0.47);
        s.albedo = mix(vec3(0.18, 0.16, 0.15), vec3(0.74, 0.70, 0.64), smoothstep(0.0, 0.09, vein)) * (0.8 + 0.3 * w);
        vec2 tile = abs(fract(p) - 0.5);
        s.albedo *= 1.0 - 0.6 * smoothstep(0.485, 0.495, max(tile.x, tile.y));
        s.rough = 0.16 + 0.3 * w;
    } else if (m.x == 9u) {   // planks
        float plank = floor(p.x * 3.0), along = p.y + hash(ivec2(int(plank), 7)) * 9.0;
        float ring = fbm(vec2(p.x * 14.0 + plank * 5.0, along * 1.4), 5), fine = noise(vec2(p.x * 160.0, along * 9.0));
        s.albedo = mix(vec3(0.16, 0.075, 0.03), vec3(0.45, 0.25, 0.12), ring) * (0.75 + 0.4 * fine) *
                   (1.0 - 0.7 * smoothstep(0.47, 0.49, abs(fract(p.x * 3.0) - 0.5)));
        s.rough = 0.35 + 0.3 * fine;
        s.bump = vec2(ring - 0.5, fine - 0.5) * 0.2;
    }
#endif
    return s;
}
#endif

// The hall around the scene: dusk, with rows of soft lamps overhead.
vec3 surroundings(vec3 d, float blur) {
    float up = clamp(d.y, -1.0, 1.0);
    vec3 c = mix(vec3(0.035, 0.045, 0.070), vec3(0.11, 0.16, 0.24), smoothstep(-0.25, 0.55, up));
    c += vec3(0.42, 0.22, 0.10) * exp(-12.0 * abs(up + 0.02));
    if (up > 0.05) {
        vec2 q = d.xz / up * 0.7;
        vec2 f = abs(fract(q) - 0.5);
        float soft = 0.03 + 0.35 * blur;
        float lamp = smoothstep(0.26 + soft, 0.26 - soft, f.x) * smoothstep(0.10 + soft, 0.10 - soft, f.y);
        c += vec3(1.7, 1.65, 1.5) * lamp * smoothstep(0.05, 0.5, up);
    }
    return c;
}
)";

constexpr const char* kInputs = R"(
in highp vec3 world;
in highp vec3 normal;
in highp vec2 uv;
flat in highp uvec2 material;
layout(location = 0) out vec4 color;
)";

constexpr const char* kUnlit = R"(
void main() { color = vec4(sqrt(clamp(surface(material, normalize(normal), world, uv).albedo, 0.0, 1.0)), 1.0); }
)";

constexpr const char* kLighting = R"(
#if FAMILY == 5
flat in highp vec4 ball;
#endif

vec3 shade_light(Surface s, vec3 n, vec3 v, vec3 l, vec3 radiance, vec3 f0, float a2, float nv) {
    float nl = dot(n, l);
    if (nl <= 0.0) return vec3(0.0);
    vec3 h = normalize(l + v);
    float nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float k = (s.rough + 1.0) * (s.rough + 1.0) * 0.125;
    float g = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    float f5 = 1.0 - vh;
    f5 = f5 * f5 * f5 * f5 * f5;
    vec3 f = f0 + (1.0 - f0) * f5;
    return (s.albedo * (1.0 - s.metal) * 0.318 + f * (a2 / (3.1416 * d * d) * g)) * radiance * nl;
}

vec3 film(vec3 x) { return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0); }

void main() {
#ifdef COUNT_FRAGMENTS
    atomicCounterIncrement(fragments);
#endif
    vec3 at_ = world, facing = normal;
#if FAMILY == 5
    vec3 ray = normalize(world - view.eye.xyz), from = view.eye.xyz - ball.xyz;
    float along = dot(from, ray), under = along * along - dot(from, from) + ball.w * ball.w;
    if (under < 0.0) discard;
    at_ = view.eye.xyz - (along + sqrt(under)) * ray;
    facing = at_ - ball.xyz;
    vec4 clip = view.clip_from_world * vec4(at_, 1.0);
    gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
#endif
    vec3 to_eye = view.eye.xyz - at_;
    float range = length(to_eye);
    vec3 v = to_eye / range;
#if FAMILY == 2
    color = vec4(sqrt(film(surroundings(-v, 0.0))), 1.0);
#else
    vec3 n = normalize(facing);
#if FAMILY == 4
    if (dot(n, v) < 0.0 && !gl_FrontFacing) n = -n;
#endif
    Surface s = surface(material, n, at_, uv);
    vec3 tangent = abs(n.y) > 0.7 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    n = normalize(n + s.bump.x * tangent + s.bump.y * cross(n, tangent));
    vec3 f0 = mix(vec3(0.04), s.albedo, s.metal);
    float a = s.rough * s.rough, a2 = a * a, nv = max(dot(n, v), 0.05);
    vec3 sum = s.glow;
    sum += shade_light(s, n, v, vec3(-0.48, 0.80, 0.36), vec3(2.1, 1.95, 1.75), f0, a2, nv);
    for (int i = 0; i < 6 + EXTRA_LIGHTS; ++i) {
        vec4 at = view.light_position[i % 6];
        vec3 l = at.xyz + vec3(float(i / 6) * 0.37, 0.0, float(i / 6) * -0.21) - at_;
        float d2 = dot(l, l), reach = max(1.0 - d2 * at.w * at.w, 0.0);
        if (reach > 0.0) sum += shade_light(s, n, v, l * inversesqrt(d2), view.light_color[i % 6].rgb * (reach * reach / (d2 + 0.05)) * LIGHT_SCALE, f0, a2, nv);
    }
    vec3 mirror = surroundings(reflect(-v, n), s.rough);
    float fresnel = (1.0 - nv) * (1.0 - nv);
    fresnel *= fresnel * (1.0 - nv);
    sum += s.albedo * (1.0 - s.metal) * mix(vec3(0.10, 0.09, 0.09), vec3(0.24, 0.28, 0.34), n.y * 0.5 + 0.5);
    sum += mirror * (f0 + (max(vec3(1.0 - s.rough), f0) - f0) * fresnel) * (1.0 - 0.6 * s.rough);
    sum = mix(surroundings(vec3(-v.x, 0.02, -v.z), 1.0), sum, exp(-range * range * 0.0016));
#if FAMILY == 4
    color = vec4(sqrt(film(sum)), alpha);
#else
    color = vec4(sqrt(film(sum)), 1.0);
#endif
#endif
}
)";

}  // namespace

std::string vertex_shader(Family family, const gl::ViewsAtOnce& at_once) {
    std::string source = std::string(kViewBlock) + kVertexInterface;
    if (family == Family::model) source += std::string(kObjectBlock) + kModelVertex;
    else source += std::string(kMaterialInput) + (family == Family::balls ? kBallVertex : kVertex);
    return gl::vertex_for_views(source, at_once);
}

std::string tile_vertex_shader() { return std::string("#version 310 es\n") + kVertexInterface + kMaterialInput + kTileVertex; }

std::string fragment_shader(const ShaderOptions& o) {
    std::string source;
    if (o.count_fragments)
        source += std::string("#define COUNT_FRAGMENTS\n") + (o.cut_out || o.family == Family::balls ? "" : "layout(early_fragment_tests) in;\n") +
                  "layout(binding = 0, offset = 0) uniform highp atomic_uint fragments;\n";
    source += "#define FAMILY " + std::to_string(static_cast<int>(o.family)) + "\n";
    source += "#define EXTRA_LIGHTS " + std::to_string(o.extra_lights) + "\n#define LIGHT_SCALE " +
              std::to_string(6.0 / (6.0 + o.extra_lights)) + "\n";
    if (o.color_image) source += "#define COLOR_IMAGE\n";
    if (o.surface_image) source += "#define SURFACE_IMAGE\n";
    if (o.cut_out) source += "#define CUT_OUT\n";
    source += std::string(kViewBlock) + (o.family == Family::model ? kObjectBlock : "") + kNoise + kMaterials + kInputs + (o.unlit ? kUnlit : kLighting);
    return gl::fragment_for_views(source, o.at_once);
}

}  // namespace fovea::scene
