// The visible table of recording formats. A new format is one file here, one row in importer_table.cpp, one test.
//
// An importer turns a file's units and frames into ours: directions in HeadFrame, int64 nanoseconds, millimetres.
// What the file says is invalid stays in the recording as an invalid sample; nothing is dropped or repaired.
// Errors: name the file, the line and the column (or byte), and the way out. No importer throws.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "replay/recording.hpp"

namespace fovea::replay {

struct ImportInput {
    std::filesystem::path path;  // for messages, and for files beside it
    std::string_view content;    // the whole file, unpacked if it was gzip; empty for importers with opens_file
};

struct Importer {
    const char* name;
    const char* one_line;
    // Looks at the first bytes (up to kPrefixSize, unpacked) and says whether they are of this format.
    bool (*recognise)(std::string_view prefix);
    Result<Recording> (*read)(const ImportInput& input);
    bool opens_file;  // reads `path` by itself (a database)
};

inline constexpr std::size_t kPrefixSize = 64 * 1024;

// In the order in which they are tried.
[[nodiscard]] const std::vector<Importer>& importers();

// One per format; each lives in the .cpp of its name (the session's in session_reader.cpp).
[[nodiscard]] bool recognise_session(std::string_view prefix);
[[nodiscard]] Result<Recording> read_session(const ImportInput& input);
[[nodiscard]] bool recognise_fovea_csv(std::string_view prefix);
[[nodiscard]] Result<Recording> read_fovea_csv(const ImportInput& input);
[[nodiscard]] bool recognise_numpy(std::string_view prefix);
[[nodiscard]] Result<Recording> read_numpy(const ImportInput& input);
[[nodiscard]] bool recognise_vive_sranipal(std::string_view prefix);
[[nodiscard]] Result<Recording> read_vive_sranipal(const ImportInput& input);

[[nodiscard]] bool recognise_eyelink_asc(std::string_view prefix);
[[nodiscard]] Result<Recording> read_eyelink_asc(const ImportInput& input);
[[nodiscard]] bool recognise_pupil_core(std::string_view prefix);      // pupil_labs.cpp
[[nodiscard]] Result<Recording> read_pupil_core(const ImportInput& input);
[[nodiscard]] bool recognise_pupil_cloud(std::string_view prefix);
[[nodiscard]] Result<Recording> read_pupil_cloud(const ImportInput& input);
[[nodiscard]] bool recognise_tobii_glasses2(std::string_view prefix);  // tobii_glasses.cpp
[[nodiscard]] Result<Recording> read_tobii_glasses2(const ImportInput& input);
[[nodiscard]] bool recognise_tobii_glasses3(std::string_view prefix);
[[nodiscard]] Result<Recording> read_tobii_glasses3(const ImportInput& input);
[[nodiscard]] bool recognise_tobii_tx300(std::string_view prefix);
[[nodiscard]] Result<Recording> read_tobii_tx300(const ImportInput& input);
[[nodiscard]] bool recognise_tobii_pro_lab(std::string_view prefix);
[[nodiscard]] Result<Recording> read_tobii_pro_lab(const ImportInput& input);
[[nodiscard]] bool recognise_jov2023(std::string_view prefix);         // unity_headsets.cpp
[[nodiscard]] Result<Recording> read_jov2023(const ImportInput& input);
[[nodiscard]] bool recognise_pico_neo3(std::string_view prefix);
[[nodiscard]] Result<Recording> read_pico_neo3(const ImportInput& input);
[[nodiscard]] bool recognise_etdqualitizer(std::string_view prefix);   // research_tables.cpp
[[nodiscard]] Result<Recording> read_etdqualitizer(const ImportInput& input);
[[nodiscard]] bool recognise_oemc_hmr(std::string_view prefix);
[[nodiscard]] Result<Recording> read_oemc_hmr(const ImportInput& input);
[[nodiscard]] bool recognise_xdf(std::string_view prefix);
[[nodiscard]] Result<Recording> read_xdf(const ImportInput& input);

// A whole file that belongs to the recording (one that lies beside it), for importers.
[[nodiscard]] Result<std::string> read_recording_file(const std::filesystem::path& path);

}  // namespace fovea::replay
