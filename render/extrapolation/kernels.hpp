// The inner loops of the engine, compiled once for any processor and once for AVX2; both give the same bits.
//
// They use the compiler's vector extensions with a fixed width of eight floats and no fused operations, so that the order
// of every sum is the same on both paths. A job is plain data; a function works on a range of its rows.
// Threads: pure but for the job's output rows.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/extrapolation/path_bend.hpp"

namespace fovea::render::extrapolation {

inline constexpr int kPatchPx = 8;    // edge of a patch of the search, pixels of its level
inline constexpr int kStridePx = 4;   // from one patch to the next
inline constexpr int kPadPx = 16;     // border of repeated pixels around every luma level

struct PatchMotion {
    float u = 0, v = 0;   // where the patch is in the other picture, relative; pixels of the level
    float cost = 0;       // squared differences left, after the mean is taken out
    float shift = 0;      // mean difference
    float xx = 0, xy = 0, yy = 0;   // how much the patch says about its motion: its gradients' products, mean taken out
    float claim_u = 0, claim_v = 0;  // while patches are balanced: xx, xy and yy times the motion that the patch itself found
};

// What to do with a patch.
enum PatchTask : std::uint8_t {
    kPatchStill = 0,    // it stands still
    kPatchKeep = 1,     // it says nothing: as the coarser level found, and as its neighbours
    kPatchSearch = 2,
    kPatchCoarse = 3,   // not worth a search: as the coarser level found
};

// Patch (i, j) covers the pixels 4i-4 to 4i+3, 4j-4 to 4j+3 of `from`: every pixel lies in four patches.
struct SearchJob {
    const float *from, *to;      // pixel (0, 0) of two planes with kPadPx pixels around them
    std::ptrdiff_t stride;
    int width, height;
    int columns, rows;           // of patches
    PatchMotion* patches;        // in: where to start; out: what was found
    const std::uint8_t* tasks;   // PatchTask
    int iterations, passes;
    float reach;                 // no component of a motion may exceed it
    float low_x, low_y, high_x, high_y;   // where a patch's first pixel may come to lie in `to`: kSearchLow to kSearchHigh beyond
                                          // `to`, or less if not all of it is filled
    int column0, column1, row0, row1;   // the patches that count, of all; the others are neither read nor written
};

inline constexpr int kSearchLow = 1 - kPadPx, kSearchHigh = kPadPx - kPatchPx - 2;   // the latter from width or height

// Patches exchange what they know: each moves to where its own evidence and its neighbours' motion balance. Where a patch
// sees only an edge, or nothing, its neighbours decide; where neighbours differ widely they do not belong together.
struct BalanceJob {
    const SearchJob* search;
    int rounds;
    float stiffness;             // evidence, as of `xx`, that equals one neighbour's word
};

// Motion per pixel of the level: the mean of its four patches, those that fit the pixel better counting more.
struct SpreadJob {
    const SearchJob* search;
    float *u, *v;                // width x height
    float* scratch;              // spread_scratch() floats for each run of `bands_per_scratch` bands
    int bands_per_scratch;       // a call's bands lie in one such run
    int first_band = 0;          // of all calls
    int column0 = 0, column1 = 1 << 30;   // strides of columns to fill; the others are left alone
};
// The caller's memory, not the stack's: the GLES layer runs in threads of programs that may have little of it.
[[nodiscard]] constexpr int spread_pitch(int columns) noexcept { return columns * kStridePx + 16; }
[[nodiscard]] constexpr int spread_scratch(int columns) noexcept { return 3 * kStridePx * spread_pitch(columns); }

// One edge-aware pass: every cell becomes the mean of its neighbours at `step`, weighted by likeness in `guide` and by trust.
struct SmoothJob {
    const float *u, *v, *trust;  // width x height
    const float* guide;          // plane with padding
    std::ptrdiff_t guide_stride;
    int width, height, step;
    int x0, x1;                  // columns to do
    float *u_out, *v_out;
};

// Known motion with depth, carried to the output's time. Where two cells land, the larger front stays; the first of equals.
// A displacement of kNowhere_px: there is none.
inline constexpr float kNowhere_px = 1e6f;
[[nodiscard]] constexpr int carry_pitch(int width) noexcept { return width + 24; }
[[nodiscard]] constexpr std::size_t carry_scratch(int width) noexcept { return 15 * static_cast<std::size_t>(carry_pitch(width)); }
struct CarryJob {
    const float *motion, *ahead;   // pairs per cell; one of them may be null: see KnownMotion
    const float* depth;
    float step;                    // of `motion`, where `ahead` is null
    const PathBend* bend;          // how it bends, if it does; null: not at all
    int width, height, cell_px;
    float reach_px;
    const void* pixels;            // of the nearer source, one per cell: four channels of 8 bits, or four floats; null: not told
    std::ptrdiff_t stride;         // bytes
    bool floats;
    float* scratch;                // carry_scratch(width) floats
    float* front;                  // in: -infinity; out: -depth of what lies there
    std::uint8_t* sources;         // in: kBoth per output cell; out: kFirstOnly where the front hid it in the farther source
    float *u, *v, *far_u, *far_v;  // out: where each output cell comes from, in the nearer and in the farther source
};

// One pixel row of displacement from two rows of cells: between the centres of cells it is interpolated where neighbours agree,
// and taken from the nearer cell where they do not, so that two surfaces keep an edge between them.
inline constexpr float kSurfaceStep_px = 3.0f;   // neighbours displaced further apart do not agree
inline constexpr int kExpandPad = 16;            // floats and numbers of room that `mixed_*`, dx and dy have at each end
struct ExpandRow {
    const float *upper_u, *upper_v, *lower_u, *lower_v;   // rows of cells, pixels
    float below;                 // 0 to 1: how far the pixel row lies from the upper row of cells to the lower one
    int cell_px;                 // 2, 4 or 8
    int cell0, cell1;            // cells that are read, at least those around x0 to x1 - 1
    int x0, x1;
    float *mixed_u, *mixed_v;    // scratch, one per cell
    std::int32_t *dx, *dy;       // out, as WarpRow; up to 8 * cell_px beyond x1, and cell_px before x0, are written over
};

// Two pictures of one output row become one. Where both say about the same they are averaged: each has resampling and
// aliasing of its own. Where they differ, the first stays.
inline constexpr std::int32_t kFirstOnly = 0, kBoth = 24, kSecondOnly = 48;   // of 48: the second's most weight
struct BlendRow {
    void* out;                   // in: from the first; out: from both
    const void* second;          // four channels of 8 bits, or four floats
    const std::int32_t* how;     // one of the three per pixel
    int count;
    // Adds up by how much the second is above the first where, of eight pixels, both count in all: for each eight kDifferenceLanes
    // numbers, pairs of the first and third channel's differences and then of the second's and of the sizes of all three.
    // Null, and always of floats: not asked.
    std::int16_t* differences = nullptr;
};
inline constexpr int kDifferenceLanes = 32;

// One row of the gather. dx, dy: where each output pixel comes from, relative, 1/256 pixel, at most kMaxEdgePx.
struct WarpRow {
    const std::uint8_t* source;  // four channels of 8 bits, or four floats
    std::ptrdiff_t source_stride;
    int width, height;
    int y, x0, x1;
    const std::int32_t *dx, *dy;
    void* out;                   // pixel x0 of the output row, same four channels
    const std::uint8_t* finite;  // floats only: one flag per pixel, rows of `width`; null: all are
};

// Which pixels of a row moved, and where they were in the farther source.
struct AskRow {
    const std::int32_t *dx, *dy;   // as WarpRow, in the nearer source
    float back;                    // times this: in the farther one
    int width, height, y, x0, x1;
    std::int32_t *far_dx, *far_dy; // out
    std::uint32_t* mask;           // out: bit 0: it moved; all bits: and its place in the farther source is inside of it
};
inline constexpr int kWeighPx = 8;   // edge of a block
struct BlockSums {
    float moved = 0, asked = 0;           // pixels
    float left = 0, still = 0;            // squared differences, levels of 255
    float left_shift[4] = {}, still_shift[4] = {};   // differences, per channel
};
// The same while rows are added: lane by lane, of at most kWeighPx rows.
struct BlockLanes {
    std::int32_t squares[2][kWeighPx] = {}, counts[2][kWeighPx] = {};
    std::int16_t shifts[4][2 * kWeighPx] = {};
};
// Adds a row of pixels to the blocks it crosses; what may not be asked does not count.
struct WeighRow {
    const std::uint8_t *out, *far, *near, *then;   // whole blocks of four channels of 8 bits
    const std::uint32_t* mask;
    int blocks;
    BlockLanes* lanes;
};

struct Kernels {
    const char* name;
    void (*search)(const SearchJob&, int row0, int row1);      // rows of patches; reads and writes only these
    void (*balance)(const BalanceJob&);
    void (*spread)(const SpreadJob&, int band0, int band1);    // bands of kStridePx rows
    void (*smooth)(const SmoothJob&, int row0, int row1);
    void (*halve)(const float* in, std::ptrdiff_t in_stride, float* out, std::ptrdiff_t out_stride, int out_width, int row0, int row1);
    // Of tiles side by side, `tile_bytes` wide (a multiple of 32) and `rows` high: 1 if both pictures are the same there, else 0.
    void (*same_tiles)(const std::uint8_t* a, std::ptrdiff_t a_stride, const std::uint8_t* b, std::ptrdiff_t b_stride, int rows, int tiles, int tile_bytes, std::uint8_t* same);
    // Sums of 2x2 or 4x4 pixels of RGBA8 as luma 0 to 255, alpha counting a quarter. Whole cells only.
    void (*luma_rgba8)(const std::uint8_t* rows, std::ptrdiff_t row_bytes, int cell_px, int cells, float* out);
    void (*warp_rgba8_linear)(const WarpRow&);
    void (*warp_rgba8_cubic)(const WarpRow&);
    void (*warp_float_linear)(const WarpRow&);
    void (*warp_float_cubic)(const WarpRow&);
    bool (*carry)(const CarryJob&);                            // true: something moves
    void (*expand)(const ExpandRow&);
    void (*fix)(const float* px, std::int32_t* fixed, int count);   // to 1/256 pixel, as WarpRow wants it
    void (*blend_rgba8)(const BlendRow&);
    void (*blend_float)(const BlendRow&);
    void (*ask)(const AskRow&);
    void (*weigh_rgba8)(const WeighRow&);
    void (*sum_blocks)(const BlockLanes* lanes, int blocks, BlockSums* sums);
};

// The widest that this processor runs, or the portable one.
[[nodiscard]] const Kernels& choose_kernels(bool vector_code) noexcept;

}  // namespace fovea::render::extrapolation
