// A foveation method: takes recorded draws and the latched focal points, and leaves finished pictures in the app's
// framebuffers.
//
//   prepare (sizes changed)      submit, every frame, after the latch:
//     allocate its targets         plan -> patch -> issue the recorded draws per level or view -> resolve
//
// Every method is fed by the same focus and reports what it shaded. Choose one by name with create_method().
// Threads: the context's.
// Errors: create and prepare say what the driver refused; submit cannot fail: a method whose targets could not be had
// draws in full instead, and says so in FrameCost::fell_back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"
#include "render/density/plan.hpp"
#include "render/density/shading_rate.hpp"
#include "render/gl/command_list.hpp"

namespace fovea::foveation {

// Where one view is wanted: a rectangle of a framebuffer that has colour, depth and 8 bits of stencil. Two views may
// share a framebuffer (double-wide); the layers of a texture array are a framebuffer, a view and a set of focal points each.
// scaled_bins, its variants and full draw into several colour attachments and multisampled framebuffers too; the other
// methods leave several attachments to full. Any format that can be drawn to; of packed depth, what is outside the fovea is
// undefined after a frame unless resolve_depth is set.
struct ViewTarget {
    gl::Name framebuffer = 0;
    int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
    bool operator==(const ViewTarget&) const = default;
};

// The latched focal points of one view, in the NDC of that view.
struct ViewFocus {
    std::array<density::FocalPoint, density::kMaxFocalPoints> points{};
    std::size_t count = 0;
    [[nodiscard]] std::span<const density::FocalPoint> all() const noexcept { return std::span(points).first(count); }
};

struct FrameCost {
    std::uint64_t pixels_shaded = 0;   // texels in the method's masks, guard rings included; overdraw is not in it
    std::uint64_t pixels_full = 0;     // the views' pixels
    std::uint32_t submissions = 0;     // how often the list of draws was issued
    std::uint32_t draws = 0;           // draws issued, all submissions
    // How it was drawn: "full", "level masks", "rectangle lists", "late level 0"; empty: the only way the method has. And why
    // so. Strings that live for ever.
    const char* executor = "";
    const char* why = "";
    bool fell_back = false;            // drawn in full because a target could not be had, or the frame could not be foveated
    const char* note = "";             // why it fell back; a string that lives for ever
    gl::ViewDrawing drawing = gl::ViewDrawing::repeated;   // how several views were drawn
    int samples = 0;                   // a pixel, of the method's own images: what was asked for, or what the driver has
};

// A method that chooses has settled on another executor.
struct ExecutorSwitch {
    const char* from = "";
    const char* to = "";
    Duration from_cost{0}, to_cost{0};   // of a frame: the median of the last ones, and the trial that decided
};

struct NativeCalls;

// How bins outside the fovea are filled from their level.
enum class Resolver : std::uint8_t { automatic, gpu, processor };
// How fragments outside a level's bins are rejected.
enum class Mask : std::uint8_t { automatic, stencil, depth };

// How scaled_bins draws its levels: one submission each under a mask, or one for each of a few rectangles. Same picture.
enum class BinExecutor : std::uint8_t { masks, rectangles };

// Where a shading-rate map is made.
enum class RateMaker : std::uint8_t { automatic, gpu, processor };

// Arm's inset and outset views. Pixels of the finished picture.
struct InsetOutsetSettings {
    double ratio = 0.5;          // of the outset's pixels per axis, (0, 1]; the inset's too unless inset_px is set
    int inset_px = 0;            // edge of the inset; 0: ratio times the picture's longer edge
    double blend_px = 50;        // width of the smoothstep between the two, inward from the inset's circle; >= 0
    double contrast = 0;         // how much of the contrast lost by enlarging is put back, 0 (off) to 4
    double hidden_radius = 0;    // NDC: nothing outside is seen through the lens, and it is not shaded; 0: all is seen
    int samples = 0;             // MSAA 0, 2, 4, 8 of all four views: at least, if the driver has so many; FrameCost says how many
    // How the views are drawn: by one draw for all of them where the list has programs for it (Method::views_at_once()).
    // Nothing: multiview2 where the driver has it, else repeated; what cannot be had is replaced by the next of
    // multiview2, instanced, repeated.
    std::optional<gl::ViewDrawing> drawing = std::nullopt;
    bool masks = true;           // circular masks in both
};

// Varjo's dynamic viewports.
struct DynamicViewportSettings {
    double context_scale = 0.4;      // pixels per axis of the view of everything, (0, 1]
    double focus_extent = 0.4;       // part of the view, per axis, that the sharp view shows, (0, 1]
    bool separate_targets = false;   // a target for each view, for engines that always draw into a whole one
};

struct MethodSettings {
    // Bins, levels, reading and minimum density; the size comes from the targets. scaled_bins.
    density::PlanSettings plan;
    // Of the own targets of inset_outset and dynamic_viewports; scaled_bins matches the app's attachments by itself.
    gl::ColorFormat format = gl::ColorFormat::rgba8;
    gl::Filter filter = gl::Filter::linear;            // of the resolve; cubic keeps edges crisper and costs more
    bool resolve_depth = false;     // the depth of bins outside the fovea is put into the app's depth too, by the nearest texel
    int resolve_threads = 0;        // of the processor's resolve: 0 as many as processors (at most 4), 1 only the caller
    Resolver resolver = Resolver::automatic;   // automatic: what the start-up probe found to be cheaper on this driver
    Mask mask = Mask::automatic;               // automatic: stencil, unless only depth rejects early on this driver
    BinExecutor executor = BinExecutor::masks;         // scaled_bins; auto chooses by what the frames cost
    double texels_per_rectangle = 600;                 // rectangles: shade so many texels more if that saves one, 0 to 1e9
    double late_allowance = 0.15;   // auto_late: how much more a frame may cost whose fovea is drawn after the latch, (0, 10]
    InsetOutsetSettings inset_outset;
    DynamicViewportSettings dynamic_viewports;
    density::RateSettings shading_rate;
    RateMaker rate_maker = RateMaker::automatic;   // automatic: what the start-up probe found to be cheaper on this driver
    bool emulate = false;                 // never by the driver's own extensions
    const NativeCalls* native = nullptr;  // those extensions' calls; null: of the driver. Must outlive create_method() only
    bool count_fragments = false;   // debug: let counted_fragments() return what was really shaded, overdraw included
};

class Method {
public:
    virtual ~Method() = default;
    [[nodiscard]] virtual std::string_view name() const noexcept = 0;
    // True if the region of full density is bit-identical to a full render.
    [[nodiscard]] virtual bool exact_fovea() const noexcept = 0;
    // Cheap when the targets are those of the last call.
    [[nodiscard]] virtual Result<void> prepare(std::span<const ViewTarget> targets) = 0;
    // A method that draws the periphery before the gaze is latched, so that little is left to do after it. For such a
    // method: submit_early() with the newest focus known, wait for the GPU, latch, submit(). Without submit_early(),
    // submit() does both. The cost of both is in what submit() returns.
    [[nodiscard]] virtual bool late_fovea() const noexcept { return false; }
    virtual void submit_early(const gl::CommandList&, std::span<const ViewTarget>, std::span<const ViewFocus>) noexcept {}
    // After prepare(): which programs a list's draws need for this method to draw several views at once
    // (gl::Draw::views_program). repeated: none. A list without them is drawn view by view.
    [[nodiscard]] virtual gl::ViewsAtOnce views_at_once() const noexcept { return {}; }
    // True if a lost gaze should reach the method as a focus without points, rather than as the static focal point.
    [[nodiscard]] virtual bool wants_gaze_status() const noexcept { return false; }
    // How long the last frame took, submit to GPU done: methods that choose between executors learn from it.
    virtual void observe(Duration) noexcept {}
    // The last switch, once; nothing if there was none since the last call.
    [[nodiscard]] virtual std::optional<ExecutorSwitch> take_switch() noexcept { return std::nullopt; }
    // What draws at present: the method's own name, or that of the one it has chosen.
    [[nodiscard]] virtual std::string_view executor() const noexcept { return name(); }
    // The extension by which the driver itself foveates; empty: emulated, by passes of this library.
    [[nodiscard]] virtual std::string_view native_extension() const noexcept { return {}; }
    // targets: those prepared; focus: one per target. noexcept, no allocation. Flushes nothing.
    virtual FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                             std::span<const ViewFocus> focus) noexcept = 0;
    // What the last submit planned for a view; null for methods without bins.
    [[nodiscard]] virtual const density::Plan* plan(std::size_t view) const noexcept = 0;
    // The region at full resolution that the last submit left in a view: an ellipse in NDC, around its first focal point.
    struct Region {
        double x_ndc = 0, y_ndc = 0, half_width_ndc = 4, half_height_ndc = 4;   // beyond every corner: the whole view
    };
    [[nodiscard]] virtual Region full_region(std::size_t) const noexcept { return {}; }
    // Pixels per axis outside that region, against full, of a method without bins; (0, 1].
    [[nodiscard]] virtual double outside_scale() const noexcept { return 1; }
    // Fragments of the last submit, by the GPU's own count; waits for it. 0 unless count_fragments was set.
    [[nodiscard]] virtual std::uint64_t counted_fragments() = 0;
};

// The driver's own where it has the extensions and `emulate` is not set, else by passes of this library.
[[nodiscard]] Result<std::unique_ptr<Method>> create_scaled_bins(const MethodSettings& settings);
[[nodiscard]] Result<std::unique_ptr<Method>> create_shading_rate(const MethodSettings& settings);

// One row of the table of methods.
struct MethodEntry {
    const char* name;
    const char* summary;
    Result<std::unique_ptr<Method>> (*create)(const MethodSettings& settings);
};
[[nodiscard]] std::span<const MethodEntry> methods() noexcept;
// Whether there is one of this name; the error lists those that there are.
[[nodiscard]] Result<void> check_method(std::string_view name);

// Errors: an unknown name lists the known ones; shaders that do not compile; settings that cannot be.
[[nodiscard]] Result<std::unique_ptr<Method>> create_method(std::string_view name, const MethodSettings& settings);

}  // namespace fovea::foveation
