// What the start-up probe found out, kept on disk between runs: a file for each driver, in the user's cache folder.
//
//   fovea driver traits 1                a name derived from the key; the key itself is in the file too
//   driver llvmpipe (LLVM 15.0.6, 256 bits), OpenGL ES 3.2 Mesa 22.3.6, fovea 0.1.0, 2 processors
//   stencil_cost 0.024                   numbers only: what follows from them is decided anew by every version
//   ...
//   sum 8b1a9953c4611296                 of all bytes before it (FNV-1a): half a file, or one that was edited, is none
//
// A file that is another driver's, another user's, not a regular file, too long or damaged is not believed: read() says so,
// and the probe runs as if there were none. Files are written beside and renamed: a reader sees a whole one.
// Threads: any. Errors: in words; nothing here may stop a program.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "render/foveation/driver_traits.hpp"

namespace fovea::foveation {

struct TraitsKey {
    std::string renderer, gl_version, fovea_version;
    unsigned processors = 0;
    [[nodiscard]] std::string text() const;   // one line
};

// Measured numbers, from which everything else in DriverTraits follows.
struct TraitsNumbers {
    double stencil_cost = 0, depth_cost = 0, resolve_ratio = 0, rate_map_ratio = 0;
    bool operator==(const TraitsNumbers&) const = default;
};

[[nodiscard]] std::filesystem::path traits_file(const std::filesystem::path& folder, const TraitsKey& key);

struct TraitsRead {
    std::optional<TraitsNumbers> numbers;
    std::string why_not;   // why a file that is there is not believed; empty if there is none
};
[[nodiscard]] TraitsRead read_traits(const std::filesystem::path& file, const TraitsKey& key);
// Makes the folder (for the user only). What went wrong, or nothing.
[[nodiscard]] std::string write_traits(const std::filesystem::path& file, const TraitsKey& key, const TraitsNumbers& numbers);

}  // namespace fovea::foveation
