// The pictures that a run leaves behind: a frame as the eyes got it, and the same frame with its levels drawn in.
//
// Errors: those of write_png, and a directory that cannot be made.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "render/density/plan.hpp"

namespace fovea::viewer {

struct SnapshotView {
    std::vector<std::uint8_t> rgba;           // bottom row first
    std::vector<std::uint8_t> level;          // of each bin, row 0 at the bottom; empty: all level 0
    int columns = 0, rows = 0, bin_px = 0;
    double focal_x_ndc = 0, focal_y_ndc = 0;
    double radius95_x_ndc = 0, radius95_y_ndc = 0;   // where the eye is with 95 % probability
};

struct Snapshot {
    std::uint64_t frame = 0;                  // 0: none taken
    int width_px = 0, height_px = 0;          // of each view
    std::vector<SnapshotView> views;
    double shaded = 1;                        // pixels shaded against full
    std::string title;                        // upper case letters, digits and .,:/%+-() are drawn
};

void copy_levels(const density::Plan& plan, SnapshotView& view);

// Writes frame.png and frame_levels.png into the directory.
[[nodiscard]] Result<void> write_pictures(const Snapshot& snapshot, const std::filesystem::path& directory);

}  // namespace fovea::viewer
