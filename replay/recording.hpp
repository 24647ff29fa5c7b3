// A gaze recording in memory, whatever file it came from.
//
// Times: `exposed` starts wherever the file's clock starts; nothing here is on this machine's clock.
// Threads: plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::replay {

// A per-sample label of the recording's own (hand-made or by a vendor's parser). For judging, never for predicting.
enum class Label : std::uint8_t { none = 0, fixation = 1, saccade = 2, post_saccadic = 3, pursuit = 4, blink = 5 };
[[nodiscard]] const char* to_string(Label label) noexcept;

struct RecordedSample {
    GazeSample sample;
    Label label = Label::none;
};

struct RecordingInfo {
    std::string format;          // the importer that read it, e.g. "fovea_csv"
    std::string device;          // e.g. "SR Research EyeLink 1000"
    std::string source;          // where the data come from; licence
    double nominal_rate_hz = 0;  // 0: unknown
    bool has_labels = false;
    bool has_head_pose = false;
};

struct Recording {
    RecordingInfo info;
    std::vector<RecordedSample> samples;  // in file order; ids 1, 2, 3 ...
};

// Reads a recording, recognising the format from the content. Errors name file, line and column, and the way out.
[[nodiscard]] Result<Recording> load_recording(const std::filesystem::path& path);

}  // namespace fovea::replay
