// The effects planner: which effects a scene calls for, why, and the method settings that follow from it.
//
//   what the scene contains (contents.hpp, measured)  --+
//   what a frame costs on this driver (measure.hpp)   --+--> Needs --> plan() --> on/off and a reason per effect
//   what its author declares (declared.hpp)           --+                  |
//                                                                          +--> method(), apply(): MethodSettings
// An effect that is off costs nothing: its setting is off, so its method makes no target, program, pass or query for it.
// Every effect in the table exists in the code; thresholds with their reasons stand beside each rule in effects.cpp.
// Input: shares are of the pixels that the scene covers, [0, 1]; times are milliseconds for all views together.
// Threads: pure functions. plan() allocates (on load, or when the settings change); extrapolation_called_for() does not.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "render/effects/lens.hpp"
#include "render/foveation/method.hpp"

namespace fovea::effects {

enum class Effect : std::uint8_t {
    foveation,          // fewer pixels where the eye does not look: any method but `full`
    level_mask,         // stencil or depth keeps the parts of a level that are not used from being shaded
    hidden_area,        // what the lens hides is not shaded
    blend,              // the edge of the sharp picture is faded into the wide one
    contrast,           // contrast lost by enlarging is put back
    msaa,               // several samples a pixel
    finer_periphery,    // density read as area: more pixels outside the fovea
    lens_distortion,    // the picture is warped for the lens in front of the panel
    temporal_smoothing, // the periphery is mixed with the pictures before it
    extrapolation,      // frames between frames, where the budget is missed
    fragment_counter,   // debug: counts what was really shaded
};
inline constexpr std::size_t kEffects = 11;

// What a scene asks for. 0 where nothing is known or nothing is there.
struct Needs {
    double views = 2;
    double triangles = 0;           // in the scene
    double triangle_px = 0;         // median area of a visible triangle, pixels
    double thin_share = 0;          // surfaces narrower than kThin_px: wires, railings, grids
    double text_share = 0;          // print: surfaces whose texture is two-valued and finer than the coarse levels
    double glossy_share = 0;        // highlights smaller than a coarse level's texel
    double transparent_share = 0;   // blended or cut out
    double moving_share = 0;        // objects that move on their own
    double object_px = 0;           // how far those move, pixels per frame, median
    double camera_px = 0;           // how far the picture moves with the camera, pixels per frame, median
    double lens_radius = 0;         // NDC: the lens shows nothing beyond; 0: everything is seen
    double vertex_ms = 0;           // one submission of all geometry, nothing shaded
    double full_ms = 0;             // a frame in full
    double foveated_ms = 0;         // the same frame foveated
};

struct NeedEntry {
    const char* name;      // as in a declaration
    const char* unit;
    const char* summary;
    double Needs::* value;
    double most;           // legal: 0 to this
};
[[nodiscard]] std::span<const NeedEntry> need_entries() noexcept;

// Where and how the scene is to be drawn.
struct Situation {
    std::string method = "auto";   // as asked for; `auto` lets the planner choose
    int width_px = 1024, height_px = 1024;   // of one view
    double budget_ms = 0;          // of a frame; 0: none
    bool count_fragments = false;  // asked for
};

// What an author says himself: it replaces what was measured and what was decided.
struct Declared {
    std::string origin;   // "room.toml" or "glTF extras of room.glb"; empty: nothing is declared
    std::array<std::optional<bool>, kEffects> effects;
    std::array<std::optional<double>, 14> needs;   // as in need_entries()
    std::optional<Lens> lens;                      // in front of the panel; what a lens does cannot be measured
};

struct Decision {
    bool on = false;
    std::string reason;   // with the numbers
};

struct EffectEntry {
    Effect effect;
    const char* name;      // as in a declaration
    const char* summary;   // what it does
    const char* wanted;    // what calls for it
    const char* methods;   // methods that have it, separated by blanks; "*": all
};
[[nodiscard]] std::span<const EffectEntry, kEffects> effect_entries() noexcept;

class Plan {
public:
    [[nodiscard]] bool on(Effect e) const noexcept { return decisions_[static_cast<std::size_t>(e)].on; }
    [[nodiscard]] const Decision& decision(Effect e) const noexcept { return decisions_[static_cast<std::size_t>(e)]; }
    // What draws: the method asked for, or under `auto` what pays ("scaled_bins" or "full"; "auto" where nothing was
    // measured, so that the frames themselves decide).
    [[nodiscard]] const std::string& method() const noexcept { return method_; }
    // What was planned from, declarations included.
    [[nodiscard]] const Needs& needs() const noexcept { return needs_; }
    // Of the left eye; meaningful where Effect::lens_distortion is on.
    [[nodiscard]] const Lens& lens() const noexcept { return lens_; }
    // Sets what the effects decide and leaves the rest.
    void apply(foveation::MethodSettings& settings) const noexcept;

private:
    friend Plan plan(const Needs&, const Situation&, const Declared&);
    std::array<Decision, kEffects> decisions_;
    std::string method_;
    Needs needs_;
    Lens lens_;
};

[[nodiscard]] Plan plan(const Needs& measured, const Situation& situation, const Declared& declared = {});

// The rule behind Effect::extrapolation, for every frame: something moves, and the frame takes longer than its budget.
// frame_ms <= 0 or budget_ms <= 0: not known, so not called for. `declared`: what the scene's author says wins.
[[nodiscard]] bool extrapolation_called_for(const Needs& needs, double frame_ms, double budget_ms, std::optional<bool> declared = {}) noexcept;

inline constexpr double kThin_px = 3;         // narrower than this at full resolution is less than a texel of level 2
inline constexpr double kPays = 0.95;         // foveation must bring a frame below this part of its time in full
inline constexpr double kCrawls_px = 1;       // from this motion per frame on, what coarse levels lose is seen to crawl
inline constexpr double kSmears_px = 16;      // above this motion per frame the history is not found any more
inline constexpr double kMoves_px = 0.5;      // less motion per frame than this is not seen to repeat

}  // namespace fovea::effects
