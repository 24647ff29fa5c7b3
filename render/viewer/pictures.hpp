// The pictures that a run leaves behind: a frame as the eyes got it, and the same frame with its levels drawn in.
//
// Errors: those of write_png, and a directory that cannot be made.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/frames.hpp"
#include "render/density/plan.hpp"
#include "render/gl/objects.hpp"

namespace fovea::viewer {

struct SnapshotView {
    std::vector<std::uint8_t> rgba;           // bottom row first
    std::vector<std::uint8_t> through_lens;   // the same, warped for the panel behind a lens; empty: there is none
    std::vector<std::uint8_t> level;          // of each bin, row 0 at the bottom; empty: all level 0
    int columns = 0, rows = 0, bin_px = 0;
    double focal_x_ndc = 0, focal_y_ndc = 0;
    std::optional<NdcPoint> actual;                  // where the eye was measured to be at the photon; nothing: not known
    double radius95_x_ndc = 0, radius95_y_ndc = 0;   // where the eye is with 95 % probability
};

struct Snapshot {
    std::uint64_t frame = 0;                  // 0: none taken
    int width_px = 0, height_px = 0;          // of each view
    std::vector<SnapshotView> views;
    double shaded = 1;                        // pixels shaded against full
    std::string title;                        // upper case letters, digits and .,:/%+-() are drawn
};

// The numbers and the title; views and their size are still to be filled in.
[[nodiscard]] Snapshot snapshot_of(std::uint64_t frame, std::string_view method, bool live, double shaded);
// Pixels and levels (plan: null if the method has none). Waits for the GPU.
[[nodiscard]] SnapshotView read_view(const gl::RenderTarget& target, const density::Plan* plan);

// Writes frame_extrapolated.png: one eye's extrapolated picture beside the same moment really rendered.
[[nodiscard]] Result<void> write_comparison(const SnapshotView& extrapolated, const SnapshotView& rendered, int width_px, int height_px, const std::filesystem::path& directory);
// Of the colours (alpha left out), dB; 99 where they are equal.
[[nodiscard]] double psnr_db(const SnapshotView& a, const SnapshotView& b) noexcept;

// Writes frame.png and frame_levels.png into the directory, and frame_lens.png where there is a lens.
[[nodiscard]] Result<void> write_pictures(const Snapshot& snapshot, const std::filesystem::path& directory);

}  // namespace fovea::viewer
