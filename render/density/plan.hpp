// Which resolution each bin of an image is rendered at: the density equation decimated to a few levels.
//
//   bins, row 0 at the bottom (as in GL)        levels: 0 full, 1 half, 2 quarter ...
//   2 2 2 2 2 2 2 2      rectangles(1) = {(2,1)-(6,2), (2,2)-(3,4), (5,2)-(6,4), ...}: as few as there can be
//   2 2 1 1 1 1 2 2      (minimum_rectangles.hpp); bounds(1) = (2,1)-(6,5)
//   2 2 1 0 0 1 2 2
//   2 2 1 0 0 1 2 2      A level is chosen by the *maximum* density over the bin, so that quality is never below the
//   2 2 1 1 1 1 2 2      equation's anywhere in it.
//   2 2 2 2 2 2 2 2
//
// Source: GL_QCOM_framebuffer_foveated ("allowed to decimate to a fixed number of supported quality levels, and to
// group pixels into larger regions, as long as at least the quality of the equation is provided").
// Cost: measured by `fovea_bench --benchmark_filter=Plan`.
// Threads: one at a time per Plan.
// Errors: create() names the setting that cannot be; update() cannot fail.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/error.hpp"
#include "render/density/density.hpp"
#include "render/density/minimum_rectangles.hpp"

namespace fovea::density {

// What a density of 1/2 means. `linear`: half as many pixels along each axis; `area`: half as many pixels. The
// extension says "ratio of the resolution". `area` satisfies both readings and costs more.
enum class Reading : std::uint8_t { linear, area };

// A level is rendered at 1/2^shift of the resolution along each axis.
struct LevelScale {
    std::uint8_t x_shift = 0, y_shift = 0;  // 0 to 3
    bool operator==(const LevelScale&) const = default;
};

inline constexpr int kMaxFocalPoints = 16;
inline constexpr int kMaxImagePx = 16384;

struct PlanSettings {
    int width_px = 1024, height_px = 1024;  // 1 to kMaxImagePx
    int bin_px = 0;   // edge of a bin, 4 to 1024; 0: a 64th of the longer edge, above 1024 px 16 or a 128th of it. Rounded up to whole texels of the coarsest level
    Reading reading = Reading::linear;
    double min_density = 0;                 // 0 to 1
    std::array<LevelScale, kMaxLevels> levels{{{0, 0}, {1, 1}, {2, 2}}};  // level 0 is {0, 0}; pixels fall from one to the next
    int level_count = 3;                    // 1 to kMaxLevels
    int guard_texels = 1;                   // width of the ring that the resolve's filter reads around a level's bins, 0 to 2
};

// Half-open, in pixels of the full-resolution image.
struct PixelRect {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    [[nodiscard]] bool empty() const noexcept { return x0 >= x1 || y0 >= y1; }
};

class Plan {
public:
    [[nodiscard]] static Result<Plan> create(const PlanSettings& settings);

    // Plans for these focal points (the first kMaxFocalPoints of them; if there are more, everything is full density).
    // False, and nothing done, when they equal the last ones. noexcept, no allocation.
    bool update(std::span<const FocalPoint> points) noexcept;

    // The same, where only level 0 is to be had everywhere: drawn[i] is the box of bins in which level i already is (what
    // was drawn before the gaze was known). A bin gets the coarsest level that is fine enough and there.
    bool update(std::span<const FocalPoint> points, std::span<const BinRect> drawn) noexcept;
    // No focal points: each bin gets the finest level whose box contains it, the last level where none does. boxes[0] is
    // not read (level 0 is nowhere). noexcept, no allocation.
    void assign(std::span<const BinRect> boxes) noexcept;

    // A level for every bin, from elsewhere (a shading-rate map); row 0 at the bottom. Levels beyond the last are the last.
    // False, and nothing done, when they are those of the plan. noexcept, no allocation.
    bool assign_levels(std::span<const std::uint8_t> levels) noexcept;

    [[nodiscard]] const PlanSettings& settings() const noexcept { return settings_; }
    [[nodiscard]] int columns() const noexcept { return columns_; }
    [[nodiscard]] int rows() const noexcept { return rows_; }
    [[nodiscard]] int bin_px() const noexcept { return settings_.bin_px; }
    [[nodiscard]] int level_at(int column, int row) const noexcept {
        return level_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
    }
    // Every bin of a level exactly once, in the fewest rectangles; ordered by y0, then x0. Valid until the next update().
    [[nodiscard]] std::span<const BinRect> rectangles(int level) const noexcept;
    [[nodiscard]] BinRect bounds(int level) const noexcept { return bounds_[static_cast<std::size_t>(level)]; }
    [[nodiscard]] bool uses(int level) const noexcept { return !bounds(level).empty(); }
    [[nodiscard]] PixelRect pixels(const BinRect& r) const noexcept;

    // Size of a level's image that covers the whole view: ceil(size / 2^shift).
    [[nodiscard]] int level_width_px(int level) const noexcept;
    [[nodiscard]] int level_height_px(int level) const noexcept;
    // Texels of a level's image in its bins, and in a ring `guard_texels` wide around them (inside the image). Level 0 has
    // no ring. Exact when the image is a whole number of the level's texels, else within one texel per row and column.
    [[nodiscard]] std::uint64_t texels(int level) const noexcept { return texels_[static_cast<std::size_t>(level)]; }
    [[nodiscard]] std::uint64_t guard_texels(int level) const noexcept { return guard_[static_cast<std::size_t>(level)]; }
    [[nodiscard]] std::uint64_t pixels_full() const noexcept {
        return static_cast<std::uint64_t>(settings_.width_px) * static_cast<std::uint64_t>(settings_.height_px);
    }
    // Counts the updates that changed something.
    [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

private:
    Plan() = default;
    void choose_levels() noexcept;
    void finish_levels() noexcept;
    void find_bounds(int level) noexcept;
    void count_texels(int level) noexcept;

    PlanSettings settings_;
    int columns_ = 0, rows_ = 0;
    std::array<double, kMaxLevels> threshold_{};   // a level is allowed from this denominator of the equation on
    std::array<FocalPoint, kMaxFocalPoints> points_{};
    std::size_t point_count_ = 0;
    bool too_many_points_ = false;
    std::array<BinRect, kMaxLevels> drawn_{};
    bool restricted_ = false;                      // to drawn_
    std::vector<std::uint8_t> level_;              // rows_ * columns_
    std::vector<double> column_terms_;             // kMaxFocalPoints * columns_
    std::vector<BinRect> rectangles_;              // by level
    std::array<std::size_t, kMaxLevels + 1> first_rectangle_{};
    MinimumRectangles minimum_;
    std::array<BinRect, kMaxLevels> bounds_{};
    std::array<std::uint64_t, kMaxLevels> texels_{}, guard_{};
    std::uint64_t generation_ = 0;
};

// The level tables of the three standard sets: n levels of halved axes (1, 1/2, 1/4, 1/8), n = 1 to 4, or, with
// `anisotropic`, with a half-step between them (x halves first), n = 1 to 7.
[[nodiscard]] std::array<LevelScale, kMaxLevels> standard_levels(bool anisotropic = false) noexcept;

}  // namespace fovea::density
