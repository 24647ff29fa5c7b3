// A frame that was never rendered: where the two last frames say that the picture is going.
//
//   t1            t2            t2 + factor * (t2 - t1)
//   src1 -------- src2 ----+--> output          factor 0.5: half a frame time ahead
//        motion per cell   |
//        of src2, checked  +-- carried on, projected to the output's time, holes filled from behind, then one gather
//
// Source: GL_QCOM_frame_extrapolation; the search is an inverse compositional one over overlapping patches (Kroeger et
// al., "Fast optical flow using dense inverse search", 2016), everything else is measured by `fovea tradeoff extrapolation`.
// Input/Output: pictures of one size and format; motion in pixels of that size, from src1 to src2.
// Cost: `fovea tradeoff extrapolation`; a static pair costs one compare and one copy.
// Threads: one call at a time per Extrapolator, which runs its own workers. The result does not depend on their number.
// Errors: create() names the setting that cannot be; extrapolate() answers with an Outcome and writes nothing unless `ok`.
#pragma once

#include <memory>
#include <optional>

#include "protocol/error.hpp"
#include "render/extrapolation/image.hpp"

namespace fovea::render::extrapolation {

// How much time to spend on one frame; what each does is in tuning.cpp.
enum class Preset : std::uint8_t { draft, fast, balanced, best };
inline constexpr Preset kPresets[] = {Preset::draft, Preset::fast, Preset::balanced, Preset::best};
[[nodiscard]] const char* preset_name(Preset p) noexcept;
[[nodiscard]] std::optional<Preset> preset_from_name(const char* name) noexcept;

struct Settings {
    Preset preset = Preset::balanced;
    int threads = 1;          // 1 to 16, the calling thread included
    bool vector_code = true;  // false: the portable code path even where the processor has a wider one (same bits)
};

// What a renderer knows about motion: one entry per texel of a buffer that covers the picture.
struct KnownMotion {
    const float* motion_px = nullptr;  // x, y: where what src2 shows there has come from, as src2 position - src1 position;
                                       // may be null if ahead_px is given
    const float* depth = nullptr;      // optional; smaller is nearer, any monotonic scale. With it and motion_px, src1 is read
                                       // too: it shows every point a second time, and some that src2 does not
    int width = 0, height = 0;         // ceil(picture / k) for one k of 1, 2, 4, 8
    // Optional, and then used instead of motion_px times the factor to go ahead: where it will be at the output's time, as output
    // position - src2 position. A turning camera bends the path of every point; a renderer that knows the pose for the
    // output's photon knows where each goes.
    const float* ahead_px = nullptr;
};

// Where the person looks: full effort inside `full_radius_px`, the least beyond `coarse_radius_px`.
struct Gaze {
    float x_px = 0, y_px = 0;                            // in the picture's own rows and columns; any value
    float full_radius_px = 128, coarse_radius_px = 384;  // 0 <= full <= coarse
};

struct Hints {
    const KnownMotion* motion = nullptr;
    const Gaze* gaze = nullptr;
};

enum class Outcome : std::uint8_t {
    ok,
    factor_is_zero,       // GL: INVALID_VALUE
    formats_differ,       // GL: INVALID_OPERATION, as are the next two
    sizes_differ,
    unusable_picture,     // no pixels, or a size outside 1 to kMaxEdgePx
    unusable_motion,      // the known motion's size fits no k
    out_of_memory,
};
[[nodiscard]] const char* outcome_text(Outcome o) noexcept;

// What the last call did, for counters and tests.
struct Report {
    bool repeated = false;        // the nearer source was copied whole, see `reason`
    enum class Reason : std::uint8_t { none, static_pair, scene_cut, factor_without_meaning, at_a_source } reason = Reason::none;
    float static_fraction = 0;    // of the picture's tiles: src1 equals src2 bit for bit
    float unexplained_fraction = 0;  // of the textured picture: no motion found there explains src2 by src1
    float filled_fraction = 0;    // of the output: nothing moved there, filled from around it
    int levels = 0;               // of the search; 0 with known motion
    bool used_both = false;       // src1 was read as well, where known motion with depth says what it shows
};

// Factors. Any value but 0 is legal. NaN is answered with src2: the specification names no error for it, and OpenGL ES
// 3.2 (2.3.4.1) wants no interruption. +infinity repeats src2, -infinity src1. -1 is src1's own time, and returns it bit
// for bit. Below -0.5 the nearer source src1 is the one that is moved. A motion that the factor carries further than
// kMaxReach of the longer edge says nothing about the picture any more: what moves so far is repeated where it was.
inline constexpr float kMaxReach = 0.25f;
// Motion is searched up to this part of the longer edge, per frame.
inline constexpr float kSearchReach = 0.125f;

class Extrapolator {
public:
    [[nodiscard]] static Result<Extrapolator> create(const Settings& settings);
    Extrapolator(Extrapolator&&) noexcept;
    Extrapolator& operator=(Extrapolator&&) noexcept;
    ~Extrapolator();

    // Allocates for this size and format, so that extrapolate() does not. False: out of memory.
    bool prepare(int width_px, int height_px, Format format) noexcept;

    // `output` overlaps neither source. Allocates only when size or format differ from those prepared or used last.
    Outcome extrapolate(const ConstImage& src1, const ConstImage& src2, const Image& output, float factor,
                        const Hints& hints = {}) noexcept;

    [[nodiscard]] const Report& report() const noexcept;
    [[nodiscard]] const Settings& settings() const noexcept;
    // "avx2" or "portable".
    [[nodiscard]] const char* code_path() const noexcept;

private:
    struct State;
    explicit Extrapolator(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::render::extrapolation
