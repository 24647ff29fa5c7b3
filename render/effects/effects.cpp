#include "render/effects/effects.hpp"

#include <algorithm>
#include <cstdio>

namespace fovea::effects {
namespace {

// Shares of the picture from which on an effect is worth its cost. Small on purpose: an eye that looks for text or a
// wire finds it in one part in fifty of the picture.
constexpr double kThinShare = 0.02, kTextShare = 0.02, kGlossyShare = 0.02;
// From which on smoothing over time is worth a pass over the picture: it hides crawling that only shows in the periphery.
constexpr double kFlickerShare = 0.05;
// MSAA smooths edges of geometry: it is called for where thin geometry is common.
constexpr int kSamples = 4;
// Of the contrast lost by enlarging: the white paper's pictures lie between 0.5 and 1; more rings (docs/scenes.md).
constexpr double kContrast = 0.7;
constexpr double kBlend_px = 50;
// Share of the pixels that a gain of 4 leaves, and the three submissions it takes (docs/render.md).
constexpr double kPixelShare = 0.19, kSubmissions = 3;
// Millions of pixels whose mask and resolve take a millisecond on a processor rasteriser (docs/render.md).
constexpr double kResolve_px_per_ms = 260e3;
// Unmeasured: a triangle costs about what a fragment does (llvmpipe: 53 ns against 50 to 110), so that three submissions
// cannot pay above 0.4 triangles a pixel. Fivefold certainty is asked for before the frames themselves are not.
constexpr double kTrianglesPerPixel = 2;

constexpr std::array<NeedEntry, 14> kNeeds{{
    {"views", "", "views drawn", &Needs::views, 4},
    {"triangles", "", "triangles in the scene", &Needs::triangles, 1e12},
    {"triangle_px", "px", "median area of a visible triangle", &Needs::triangle_px, 1e9},
    {"thin_share", "", "of the picture: wires, railings, grids", &Needs::thin_share, 1},
    {"text_share", "", "of the picture: print", &Needs::text_share, 1},
    {"glossy_share", "", "of the picture: surfaces with small highlights", &Needs::glossy_share, 1},
    {"transparent_share", "", "of the picture: blended or cut out", &Needs::transparent_share, 1},
    {"moving_share", "", "of the picture: objects that move on their own", &Needs::moving_share, 1},
    {"object_px", "px", "how far those move per frame, median", &Needs::object_px, 1e5},
    {"camera_px", "px", "how far the camera moves the picture per frame, median", &Needs::camera_px, 1e5},
    {"lens_radius", "NDC", "nothing is seen beyond; 0: everything is", &Needs::lens_radius, 4},
    {"vertex_ms", "ms", "one submission of the geometry, nothing shaded", &Needs::vertex_ms, 1e6},
    {"full_ms", "ms", "a frame in full", &Needs::full_ms, 1e6},
    {"foveated_ms", "ms", "the same frame foveated", &Needs::foveated_ms, 1e6},
}};
static_assert(std::tuple_size_v<decltype(Declared::needs)> == kNeeds.size());

constexpr const char* kBins = "scaled_bins scaled_bins_late shading_rate";

constexpr std::array<EffectEntry, kEffects> kEffectEntries{{
    {Effect::foveation, "foveation", "fewer pixels where the eye does not look", "fragments that cost more than the geometry does",
     "scaled_bins scaled_bins_late shading_rate inset_outset dynamic_viewports"},
    {Effect::level_mask, "level_mask", "stencil or depth rejects what a level does not need", "a method that draws the scene at several densities",
     "scaled_bins scaled_bins_late shading_rate inset_outset"},
    {Effect::hidden_area, "hidden_area", "what the lens hides is not shaded, or coarsely", "a lens that hides a part of the picture", "inset_outset shading_rate"},
    {Effect::blend, "blend", "the sharp picture fades into the wide one", "detail that makes the edge between them visible", "inset_outset"},
    {Effect::contrast, "contrast", "puts back contrast that enlarging takes", "print or thin geometry in the periphery", "inset_outset"},
    {Effect::msaa, "msaa", "4 samples a pixel in all views", "thin geometry", "inset_outset"},
    {Effect::finer_periphery, "finer_periphery", "density read as area: more pixels outside the fovea",
     "highlights, print or wires, which crawl at coarse levels when the picture moves", kBins},
    {Effect::lens_distortion, "lens_distortion", "warps the picture for the lens in front of the panel, each colour by itself", "a lens that is declared ([lens])", "*"},
    {Effect::temporal_smoothing, "temporal_smoothing", "mixes the periphery with the pictures before it", "highlights, print or wires in a picture that moves, slowly enough to be followed",
     "scaled_bins scaled_bins_late shading_rate inset_outset dynamic_viewports"},
    {Effect::extrapolation, "extrapolation", "a frame between frames from the last two", "motion, and a frame budget that is missed", "*"},
    {Effect::fragment_counter, "fragment_counter", "counts shaded fragments with an atomic counter", "a measurement that asks for it", "*"},
}};

// printf into a string; the formats are all in this file.
template <class... Args>
std::string text(const char* format, Args... args) {
    char buffer[256];
    std::snprintf(buffer, sizeof buffer, format, args...);
    return buffer;
}

bool has(const char* methods, std::string_view method) {
    const std::string_view all = methods;
    if (all == "*") return true;
    for (std::size_t at = all.find(method); at != all.npos; at = all.find(method, at + 1)) {
        const std::size_t end = at + method.size();
        if ((at == 0 || all[at - 1] == ' ') && (end == all.size() || all[end] == ' ')) return true;
    }
    return false;
}

// Does foveation pay? By the frames that were measured, else by what they are made of, else by counting triangles.
Decision pays(const Needs& n, const Situation& s) {
    const double pixels = n.views * s.width_px * s.height_px;
    if (n.full_ms > 0 && n.foveated_ms > 0) {
        const double ratio = n.foveated_ms / n.full_ms;
        const bool on = ratio < kPays;
        const char* bound = kSubmissions * n.vertex_ms > n.full_ms ? "bound by its vertices: foveation does not pay" : "foveation does not pay";
        return {on, text("%.1f ms foveated, %.1f ms in full (ratio %.2f; it pays below %.2f)%s%s", n.foveated_ms, n.full_ms, ratio, kPays,
                         on ? "" : "; ", on ? "" : bound)};
    }
    if (n.full_ms > 0 && n.vertex_ms > 0) {
        const double fragments = std::max(0.0, n.full_ms - n.vertex_ms);
        const double expected = kSubmissions * n.vertex_ms + kPixelShare * fragments + pixels / kResolve_px_per_ms;
        const bool on = expected < kPays * n.full_ms;
        return {on, text("geometry %.1f ms of %.1f ms a frame; foveated expected %.1f ms%s", n.vertex_ms, n.full_ms, expected,
                         on ? "" : ": bound by its vertices, foveation does not pay")};
    }
    const double density = pixels > 0 ? n.triangles * n.views / pixels : 0;
    const bool on = density < kTrianglesPerPixel;
    return {on, text("%.3f triangles a pixel, limit %.1f (no frame was measured)%s", density, kTrianglesPerPixel, on ? "" : ": bound by its vertices, foveation does not pay")};
}

Decision above(double value, double limit, const char* what) {
    const bool on = value >= limit;
    return {on, text("%s %.1f %% of the picture, %s %.0f %%", what, 100 * value, on ? "at least" : "less than", 100 * limit)};
}

// The first of several reasons that calls for it; else the one that came nearest.
Decision any_of(std::initializer_list<std::pair<double, std::pair<double, const char*>>> causes) {
    Decision nearest;
    double best = -1;
    for (const auto& [value, rule] : causes) {
        if (value / rule.first <= best) continue;
        best = value / rule.first;
        nearest = above(value, rule.first, rule.second);
    }
    return nearest;
}

}  // namespace

std::span<const NeedEntry> need_entries() noexcept { return kNeeds; }
std::span<const EffectEntry, kEffects> effect_entries() noexcept { return kEffectEntries; }

bool extrapolation_called_for(const Needs& n, double frame_ms, double budget_ms, std::optional<bool> declared) noexcept {
    if (declared) return *declared;
    const bool moves = (n.moving_share > 0 && n.object_px >= kMoves_px) || n.camera_px >= kMoves_px;
    return moves && frame_ms > 0 && budget_ms > 0 && frame_ms > budget_ms;
}

Plan plan(const Needs& measured, const Situation& s, const Declared& declared) {
    Plan p;
    p.needs_ = measured;
    for (std::size_t i = 0; i < kNeeds.size(); ++i)
        if (declared.needs[i]) p.needs_.*kNeeds[i].value = *declared.needs[i];
    const Needs& n = p.needs_;
    const auto decide = [&](Effect e, Decision d) {
        const auto i = static_cast<std::size_t>(e);
        const EffectEntry& entry = kEffectEntries[i];
        const bool available = has(entry.methods, p.method_);
        // The bins' masks are the only way in which bins are drawn: no declaration turns them off.
        const bool fixed = e == Effect::level_mask && p.method_ != "inset_outset";
        if (declared.effects[i] && !fixed) d = {*declared.effects[i], "declared by " + declared.origin};
        if (!available) d = {false, p.method_ + " has none"};
        p.decisions_[i] = std::move(d);
    };

    // Which method draws comes first: the others depend on what it has.
    Decision foveation = pays(n, s);
    const bool choose = s.method == "auto";
    if (!choose) foveation = {s.method != "full", "asked for: method " + s.method + "; " + foveation.reason};
    if (const auto& forced = declared.effects[static_cast<std::size_t>(Effect::foveation)]; forced && choose)
        foveation = {*forced, "declared by " + declared.origin};
    const bool measured_it = n.full_ms > 0;
    p.method_ = !choose ? s.method : !foveation.on ? "full" : measured_it ? "scaled_bins" : "auto";
    p.decisions_[static_cast<std::size_t>(Effect::foveation)] = foveation;
    if (p.method_ == "auto") p.method_ = "scaled_bins";   // what the others ask about; put back below

    decide(Effect::level_mask, {true, "the densities of " + p.method_ + " are drawn one by one"});
    decide(Effect::hidden_area, n.lens_radius > 0 ? Decision{true, text("nothing is seen beyond %.2f NDC", n.lens_radius)}
                                                  : Decision{false, "no lens is declared: everything is seen"});
    decide(Effect::blend, any_of({{n.text_share, {kTextShare, "print is"}}, {n.thin_share, {kThinShare, "thin geometry is"}}, {n.glossy_share, {kGlossyShare, "small highlights are"}}}));
    decide(Effect::contrast, any_of({{n.text_share, {kTextShare, "print is"}}, {n.thin_share, {kThinShare, "thin geometry is"}}}));
    decide(Effect::msaa, above(n.thin_share, kThinShare, "thin geometry is"));
    Decision finer = any_of({{n.glossy_share, {kGlossyShare, "small highlights are"}}, {n.text_share, {kTextShare, "print is"}}, {n.thin_share, {kThinShare, "thin geometry is"}}});
    const double motion = std::max(n.camera_px, n.moving_share > 0 ? n.object_px : 0);
    if (finer.on && motion < kCrawls_px) finer = {false, finer.reason + text(", but the picture moves by %.2f px a frame only", motion)};
    decide(Effect::finer_periphery, std::move(finer));

    if (declared.lens) p.lens_ = *declared.lens;
    decide(Effect::lens_distortion, p.lens_.distorts() ? Decision{true, text("a lens is declared: k1 %.3f, k2 %.3f, k3 %.3f", p.lens_.k1, p.lens_.k2, p.lens_.k3)}
                                                       : Decision{false, "no lens is declared"});
    if (!p.lens_.distorts() && p.decisions_[static_cast<std::size_t>(Effect::lens_distortion)].on)
        p.decisions_[static_cast<std::size_t>(Effect::lens_distortion)] = {false, "asked for, but no lens is declared ([lens])"};
    Decision smooth = any_of({{n.glossy_share, {kFlickerShare, "small highlights are"}}, {n.text_share, {kFlickerShare, "print is"}}, {n.thin_share, {kFlickerShare, "thin geometry is"}}});
    if (smooth.on && (motion < kCrawls_px || motion > kSmears_px))
        smooth = {false, smooth.reason + text(", but the picture moves by %.2f px a frame (%.0f to %.0f can be smoothed)", motion, kCrawls_px, kSmears_px)};
    decide(Effect::temporal_smoothing, std::move(smooth));

    const double frame_ms = foveation.on && n.foveated_ms > 0 ? n.foveated_ms : n.full_ms;
    const bool extrapolate = extrapolation_called_for(n, frame_ms, s.budget_ms);
    decide(Effect::extrapolation, {extrapolate, s.budget_ms > 0 ? text("a frame takes %.1f ms of a budget of %.1f ms; objects move %.1f px, the camera %.1f px a frame", frame_ms,
                                                                       s.budget_ms, n.moving_share > 0 ? n.object_px : 0.0, n.camera_px)
                                                                : std::string("no frame budget is set")});
    decide(Effect::fragment_counter, {s.count_fragments, s.count_fragments ? "asked for" : "not asked for"});
    if (choose && foveation.on && !measured_it) p.method_ = "auto";
    return p;
}

void Plan::apply(foveation::MethodSettings& s) const noexcept {
    auto& io = s.inset_outset;
    io.masks = on(Effect::level_mask);
    io.hidden_radius = on(Effect::hidden_area) ? needs_.lens_radius : 0;
    io.blend_px = on(Effect::blend) ? kBlend_px : 0;
    io.contrast = on(Effect::contrast) ? kContrast : 0;
    io.samples = on(Effect::msaa) ? kSamples : 0;
    s.shading_rate.lens_radius = on(Effect::hidden_area) ? needs_.lens_radius : 1;
    if (!on(Effect::hidden_area)) s.shading_rate.flags = static_cast<std::uint8_t>(s.shading_rate.flags & ~density::kRateOcclusion);
    s.plan.reading = on(Effect::finer_periphery) ? density::Reading::area : density::Reading::linear;
    s.count_fragments = on(Effect::fragment_counter);
}

}  // namespace fovea::effects
