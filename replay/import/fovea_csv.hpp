// The project's own recording format: a CSV that says about itself what it is. Format: docs/recording_csv.md.
//
// Without rounding, what write_csv writes and load_recording reads is the same bit for bit: int64 times and doubles.
// Errors: no write permission, a directory that is missing, a full disk, a file that exists.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "replay/recording.hpp"

namespace fovea::replay {

struct CsvOptions {
    // Below 0: directions as unit vectors, exact. 0 to 9: as azimuth and elevation in degrees with so many decimals
    // (5 decimals are 0.04 seconds of arc), which is shorter and easier to read.
    int degree_decimals = -1;
    bool overwrite = false;
};

// Writes beside the target and renames at the end, so there is never half a file.
[[nodiscard]] Result<void> write_csv(const std::filesystem::path& path, const Recording& recording,
                                     const CsvOptions& options = {});
// The same text as a string.
[[nodiscard]] std::string to_csv(const Recording& recording, const CsvOptions& options = {});

}  // namespace fovea::replay
