// What a start-up probe found out about the driver: which mask rejects fragments before they are shaded, and which resolve
// is cheapest. Drivers do not say, and some say the opposite of what they do.
//
// Source: measured on the current context by drawing (about 30 ms), once per driver: remembered in the process, and on disk
// where the program has named a folder (traits_file.hpp). A finding that a little noise could turn is not put on disk.
// Threads: the context's; the memory is shared and locked.
#pragma once

#include <filesystem>
#include <string>

namespace fovea::foveation {

struct DriverTraits {
    bool early_stencil = true;       // a failing stencil test saves most of the fragment's cost
    bool early_depth = true;
    bool depth_mask = false;         // masks should be depths: the stencil is not early, the depth test is
    bool processor_resolve = false;  // reading back, enlarging and uploading beats drawing textured rectangles
    bool gpu_rate_map = false;       // a compute shader and reading its map back beat filling a shading-rate map on the processor
    double rate_map_ratio = 0;       // the shader's way against the processor's; 0: there is none
    double stencil_cost = 0, depth_cost = 0;   // of a wholly rejected picture against a shaded one
    double resolve_ratio = 0;                  // processor resolve against the GPU's; 0: not comparable
    std::string origin;   // "measured", "remembered in FILE", and what was wrong with the file
};

[[nodiscard]] const DriverTraits& driver_traits();

// Where findings are kept between runs; empty, the default: nowhere. For main(), before the first driver_traits().
void keep_driver_traits_in(std::filesystem::path folder);
// Where programs keep them: $FOVEA_PROBE_CACHE (a folder; off: nowhere), else $XDG_CACHE_HOME/fovea, else $HOME/.cache/fovea;
// relative paths do not count. Empty: nowhere.
[[nodiscard]] std::filesystem::path traits_folder();
// What driver_traits() does the first time: reads the finding of the current context's driver in the folder, else measures it and puts
// it there.
[[nodiscard]] DriverTraits find_driver_traits(const std::filesystem::path& folder);

}  // namespace fovea::foveation
